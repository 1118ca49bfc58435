// The registry of integrators: shadings that trace secondary rays. A new one is a row here and a file under
// shaders/integrators/; the command line, the tests and the measurements then list it without further change.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "engine/render/data/scene_data.h"

namespace ballot {

/// The rays that an integrator traces in a scene. They determine its kernels and the queues that these fill.
struct WavePlan {
  bool shadow = false;  // shadow rays or ao rays
  bool next = false;    // secondary rays that form further waves
  bool second = false;  // reflected and refracted rays at one hit: paths branch, and defer the refracted rays
  bool alpha = false;   // hits that rays pass through; plan_of() sets it, for every integrator
};

/// The scene features that the kernel of an integrator depends on.
enum class Sees {
  Shape,      // only the normals: neither materials nor lights nor sky
  Materials,  // all
};

/// A shading that traces secondary rays or ao rays.
struct Integrator {
  std::string_view name;  // the kernel that shades the hits of a wave is shaders/integrators/<name>.comp
  std::string_view summary;
  Sees sees = Sees::Materials;
  std::uint32_t samples = 1;     // per pixel that make a picture, where none are given
  float clamp = 0;               // RenderOptions::clamp that suits so few samples
  std::uint32_t last_depth = 0;  // last path depth, unless RenderOptions::bounces overrides it
  // The ray kinds (kRayKinds) of the shadow rays and of the secondary rays, by which method auto chooses.
  std::string_view shadow_kind = "shadow", next_kind = {};
  WavePlan (*plan)(const SceneFeatures& features);  // without alpha; agrees with STARTS_* of the kernel
};

/// True if light sampling of a scene with these features has something to aim at besides a plain sky.
constexpr bool has_lamps(const SceneFeatures& f) { return f.emits || f.lights || f.sky_map; }

inline constexpr Integrator kIntegrators[] = {
    {.name = "ao",
     .summary = "ambient occlusion: how open a surface is, one short ray per sample (--ao-radius)",
     .sees = Sees::Shape,
     .samples = 16,
     .shadow_kind = "ao",
     .plan = [](const SceneFeatures&) { return WavePlan{.shadow = true}; }},
    {.name = "whitted",
     .summary = "direct light from one sampled point of the lights, and all reflections and refractions of mirrors and "
                "glass (Whitted 1980)",
     .samples = 16,
     .last_depth = 8,
     .next_kind = "secondary",
     .plan =
         [](const SceneFeatures& f) {
           return WavePlan{.shadow = has_lamps(f) || f.sky, .next = f.glossy, .second = f.glossy && f.refracts};
         }},
    {.name = "path",
     .summary = "path tracing: all light that materials scatter, with a ray to the lights at every hit (Kajiya 1986)",
     .samples = 64,
     .clamp = 20,
     .last_depth = 16,
     .next_kind = "diffuse",
     .plan = [](const SceneFeatures& f) { return WavePlan{.shadow = has_lamps(f), .next = true}; }},
};

/// Returns the integrator of this name; null if there is none.
const Integrator* find_integrator(std::string_view name);

/// Returns the plan of an integrator for a scene with these features.
WavePlan plan_of(const Integrator& integrator, const SceneFeatures& features);

/// Returns the kernels of an integrator's passes in the order of the passes, without those of the traversal. The
/// kernels contain no code for what `features` lack. For a scene with both kinds of cameras, kernels that make camera
/// rays are listed once for each kind. `makes_rays` is Tracer::makes_rays().
std::vector<KernelSource> kernels_of(const Integrator& integrator, const SceneFeatures& features, Sky::Kind sky,
                                     bool makes_rays);

/// Returns the kernel that turns the counts of the queues into indirect arguments.
KernelSource indirect_source();
/// Returns the kernel that shades the hits of a wave and starts shadow rays and secondary rays. With makes_rays it can
/// make the camera rays again instead of reading them, for cameras of the kinds among the features. In a scene with
/// alpha it always reads them, because other passes read them too.
KernelSource scatter_source(const Integrator& integrator, const SceneFeatures& features, Sky::Kind sky,
                            bool makes_rays);
/// Returns the kernel that adds the radiance of unoccluded shadow rays to their paths.
KernelSource connect_source();
/// Returns the kernel that adds finished paths to the film, and with `moments` to the moments of the variance.
KernelSource film_source(bool moments);
/// Returns the kernel that continues the rays whose hits let them through.
KernelSource alpha_source(const SceneFeatures& features);

}  // namespace ballot
