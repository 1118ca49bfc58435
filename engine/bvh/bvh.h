// The bounding volume hierarchy in its reference form: built by Embree, flattened, checked, cached. No Vulkan.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/scene.h"
#include "shaders/shared/layout.h"

namespace ballot {

struct BuildSettings {
  std::uint32_t max_leaf = MAX_LEAF_TRIANGLES;  // 1..6
  float split_budget = 0.5f;       // spatial splits may add at most this share of references; 0 builds without splits
  float traversal_cost = 1.2f;     // SAH cost of a node step, in the same unit as:
  float intersection_cost = 1.0f;  // SAH cost of one triangle
  bool operator==(const BuildSettings&) const = default;
};

struct BvhStats {
  std::uint32_t triangles = 0;   // of the scene, degenerate ones included
  std::uint32_t degenerate = 0;  // zero area: left out of the tree
  std::uint32_t references = 0;  // after spatial splits (the paper's "split triangles")
  std::uint32_t nodes = 0;       // nodes in use: inner and leaves, without the unused node 1
  std::uint32_t leaves = 0;
  std::uint32_t depth = 0;         // inner nodes on the longest path from the root: bounds every depth-first stack
  std::uint32_t largest_leaf = 0;  // triangles
  double sah = 0;           // expected cost of a random ray that meets the root box, with the costs of the settings
  std::uint64_t bytes = 0;  // nodes and references in reference form
  double build_s = 0;       // wall time of the build; of the load when it came from the cache
  bool from_cache = false;
};

/// Node 0 is the root, node 1 is unused, siblings are neighbours. An empty scene has no nodes at all.
struct Bvh {
  std::vector<BvhNode> nodes;
  std::vector<std::uint32_t> references;  // prim of each reference, in leaf order
  Bounds bounds;                          // of the root; zero if empty
  BvhStats stats;
};

/// What boxes on the device are measured from: along axes whose zero is 16 of the scene's longest sides away or more, the middle
/// of the scene, where differences are exact (Pat H. Sterbenz. Floating-Point Computation. 1974); along others 0. So boxes of a scene
/// in a country's coordinates keep the precision of a scene near zero.
glm::vec3 box_origin(const Bounds& scene);

/// What kernels are made for.
inline TreeFacts facts_of(const Bvh& bvh) {
  return {bvh.stats.depth, bvh.stats.largest_leaf, box_origin(bvh.bounds) != glm::vec3(0)};
}

/// progress(done) with done in [0, 1], from the building thread or others, one at a time.
using Progress = std::function<void(double)>;

/// Builds with rtcBuildBVH, RTC_BUILD_QUALITY_HIGH. Spatial splits clip the triangle, outward rounded, so that the
/// boxes of all references of a triangle cover it.
/// Throws Error(Work) if a vertex is not finite, memory runs out or Embree fails; Error(Arguments) on bad settings.
Bvh build_bvh(std::span<const Triangle> triangles, const BuildSettings& settings = {}, const Progress& progress = {});

/// As build_bvh, through a cache on disk keyed by the triangles' bytes, the settings and the layout version. A file
/// that is truncated or does not match is ignored and replaced; files are written to a temporary name and renamed, so
/// readers and concurrent writers never see half of one. A cache that cannot be written is not an error.
Bvh build_bvh_cached(std::span<const Triangle> triangles, const BuildSettings& settings,
                     const std::filesystem::path& cache_folder, const Progress& progress = {});

/// Names every broken invariant ("node 12: box of child 31 exceeds its parent's on x", ...); empty if the tree is
/// sound. At most `limit` lines.
std::vector<std::string> check_bvh(const Bvh& bvh, std::span<const Triangle> triangles,
                                   const BuildSettings& settings = {}, std::size_t limit = 20);

}  // namespace ballot
