// The registry of ray kinds. A new kind is a line here and a file under shaders/rays/; the command line, the tests and
// the benchmark then list it without further change.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "engine/answer/variant.h"
#include "engine/model/features.h"
#include "engine/render/data/camera.h"
#include "engine/render/data/offset_policies.h"

namespace ballot {

/// A kind of rays: primary rays, or secondary rays that start at primary hits.
struct RayKind {
  std::string_view name;
  Want want;
  std::span<const std::string_view> generators;  // under shaders/rays/; all rays of the first precede the second's
  std::uint32_t rays_per_hit;                    // per hit and generator; 0: RayKindOptions::ao_rays
  std::string_view summary;

  bool from_camera() const;  // true: primary rays, one per pixel; false: rays that start at primary hits
};

inline constexpr std::string_view kPrimaryGenerator[] = {kPrimaryRays};
inline constexpr std::string_view kReflectGenerator[] = {"reflect"};
inline constexpr std::string_view kRefractGenerator[] = {"refract"};
inline constexpr std::string_view kSecondaryGenerators[] = {"reflect", "refract"};
inline constexpr std::string_view kShadowGenerator[] = {"shadow"};
inline constexpr std::string_view kAoGenerator[] = {"ao"};
inline constexpr std::string_view kDiffuseGenerator[] = {"diffuse"};

inline constexpr RayKind kRayKinds[] = {
    {kPrimaryRays, Want::Nearest, kPrimaryGenerator, 1, "from the camera, one per pixel, in tiles of Morton order"},
    {"reflect", Want::Nearest, kReflectGenerator, 1, "mirrored at every primary hit"},
    {"refract", Want::Nearest, kRefractGenerator, 1, "into every primary hit as into glass of index 1.5"},
    {"secondary", Want::Nearest, kSecondaryGenerators, 1, "all reflections, then all refractions (Vinkler, section 4)"},
    {"shadow", Want::Any, kShadowGenerator, 1, "from primary hits to a point light near the camera"},
    {"ao", Want::Any, kAoGenerator, 0, "ambient occlusion: cosine-distributed, short, several per primary hit"},
    {"diffuse", Want::Nearest, kDiffuseGenerator, 1, "cosine-distributed from primary hits, unsorted"},
};

inline bool RayKind::from_camera() const { return generators[0] == kPrimaryGenerator[0]; }

/// Returns the ray kind of this name. Throws Error(Arguments) that lists the known names.
const RayKind& find_ray_kind(std::string_view name);

/// Returns the kernel of a generator of secondary rays, for a scene with these features.
KernelSource generator_source(std::string_view generator, const OffsetPolicy& offset, const SceneFeatures& features);

/// The options of secondary rays.
struct RayKindOptions {
  std::uint32_t ao_rays = 8;           // per hit, 1 to 64
  float ao_radius = 0.05f;             // length of ao rays: share of the scene's diagonal, above 0
  std::string offset{kDefaultOffset};  // origin offset policy: a name of kOffsetPolicies
  float constant_offset = 1e-4f;       // of policy "constant": share of the scene's diagonal, above 0, at most 1
};

/// Throws Error(Arguments) for options out of their ranges.
void check_options(const RayKindOptions& options);

}  // namespace ballot
