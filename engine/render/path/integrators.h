// Every integrator there is: pictures of more than what the eye's own rays hit. A new one is a line here and its code in
// shaders/path/scatter.comp.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "engine/render/data/scene_data.h"

namespace ballot {

struct Integrator {
  std::string_view name;
  int value;                   // BALLOT_INTEGRATOR
  std::uint32_t last_depth;    // unless RenderOptions::bounces says otherwise
  std::string_view next_kind;  // of the rays that it starts, in the words of kRayKinds: for a choice of the method
  std::string_view summary;
};

inline constexpr Integrator kIntegrators[] = {
    {"ao", INTEGRATOR_AO, 0, "", "ambient occlusion: how open a surface is, one short ray a sample (--ao-radius)"},
    {"whitted", INTEGRATOR_WHITTED, 8, "secondary",
     "light from a point of the lights, and mirrors and glass by all their reflections and refractions (Whitted 1980)"},
    {"path", INTEGRATOR_PATH, 16, "diffuse",
     "path tracing: all light that materials scatter, with a ray to the lights at every hit (Kajiya 1986)"},
};

/// Null if none is called so.
const Integrator* find_integrator(std::string_view name);

/// What the passes of an integrator want of a scene: which kernels, and which queues they fill.
struct WavePlan {
  bool shadow = false;  // rays to lights, or of ambient occlusion
  bool next = false;    // rays of further waves
  bool second = false;  // refracted rays beside the mirrored ones: paths part, and put off some rays
  bool alpha = false;   // hits that let rays through
};
WavePlan plan_of(const Integrator& integrator, const SceneFeatures& features);

/// Kernels of an integrator's passes, in their order, but for those of the traversal: what `features` lack is in none of them. A
/// scene with both kinds of cameras has those that make the eye's rays for each. `makes_rays`: as Tracer::makes_rays() says.
std::vector<KernelSource> kernels_of(const Integrator& integrator, const SceneFeatures& features, Sky::Kind sky,
                                     bool makes_rays);

KernelSource indirect_source();
/// With makes_rays the eye's rays need not be read, by a camera of the kinds that the features name; not of a scene with alpha, where
/// other passes read them too.
KernelSource scatter_source(const Integrator& integrator, const SceneFeatures& features, Sky::Kind sky,
                            bool makes_rays);
KernelSource connect_source();
KernelSource film_source(bool moments);
KernelSource alpha_source(const SceneFeatures& features);

}  // namespace ballot
