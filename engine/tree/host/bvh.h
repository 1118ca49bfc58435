// The bounding volume hierarchy (BVH) in its reference form: building with Embree, checking and caching. Uses no
// Vulkan.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/geometry.h"
#include "engine/model/features.h"
#include "engine/tree/host/builders.h"
#include "shaders/shared/layout.h"

namespace ballot {

struct BuildSettings {
  std::uint32_t max_leaf = MAX_LEAF_TRIANGLES;  // 1..6
  float split_budget = 0.5f;       // spatial splits add at most this share of references, 0..16; 0: no splits
  float traversal_cost = 1.2f;     // SAH cost of one node, positive, in the same unit as:
  float intersection_cost = 1.0f;  // SAH cost of one triangle, positive
  BuilderId builder = BuilderId::Best;
  bool keeps_flat = false;  // triangles without area get into leaves: float32 rounds them flat, doubles do not
  bool operator==(const BuildSettings&) const = default;
};

struct BvhStats {
  std::uint32_t triangles = 0;   // in the scene, degenerate ones included
  std::uint32_t degenerate = 0;  // triangles without area, which the tree leaves out
  std::uint32_t references = 0;  // to triangles, after spatial splits (the paper's "split triangles")
  std::uint32_t nodes = 0;       // inner nodes and leaves, without the unused node 1
  std::uint32_t leaves = 0;
  std::uint32_t depth = 0;         // inner nodes on the longest path from the root; bounds every depth-first stack
  std::uint32_t largest_leaf = 0;  // references in the largest leaf
  double sah = 0;           // expected cost of a random ray that meets the root box, by the costs of the settings
  std::uint64_t bytes = 0;  // of nodes and references in the reference form
  double build_s = 0;       // wall time in seconds of the build, or of the load if the tree came from the cache
  bool from_cache = false;
  BuilderId builder = BuilderId::Best;  // the builder that made the tree
};

/// A binary tree in the reference form. Node 0 is the root and node 1 is unused. Siblings are neighbours in the array.
/// An empty scene has no nodes.
struct Bvh {
  std::vector<BvhNode> nodes;
  std::vector<std::uint32_t> references;  // prim of each reference, in leaf order
  Bounds bounds;                          // box of the root; zero if the tree is empty
  BvhStats stats;

  bool is_empty() const { return stats.nodes == 0 && nodes.empty(); }
};

/// Returns the point that boxes on the device are measured from. Along an axis where the scene lies 16 times its
/// longest side or more away from zero, this is the middle of the scene; along the others it is 0. That far from zero
/// the differences are exact (Pat H. Sterbenz. Floating-Point Computation. 1974). So the boxes of a scene in national
/// grid coordinates keep the precision of a scene near zero.
glm::vec3 box_origin(const Bounds& scene);

/// Returns the facts of a tree that kernels are compiled for.
inline TreeFacts facts_of(const Bvh& bvh) {
  return {bvh.stats.depth, bvh.stats.largest_leaf, box_origin(bvh.bounds) != glm::vec3(0)};
}

/// A callback progress(done) with done in [0, 1]. It may be called from any thread, but never from two at once.
using Progress = std::function<void(double)>;

/// Builds a tree on the CPU with the builder of the settings, which is one of Embree's rtcBuildBVH. A spatial split
/// clips the triangle and rounds the boxes of its parts outward, so the boxes of all references of a triangle cover it.
/// Throws Error(Work) if a coordinate of a vertex is not finite or beyond +-1e12, there are more than 2^31 triangles,
/// memory runs out or Embree fails. Throws Error(Arguments) if a setting is out of range or the builder runs on the
/// device.
Bvh build_bvh(std::span<const Triangle> triangles, const BuildSettings& settings = {}, const Progress& progress = {});

/// As build_bvh(), but through a cache on disk. Its key is made from the bytes of the triangles, the settings and the
/// layout version. A file that is truncated or does not match is ignored and replaced. A file is written under a
/// temporary name and then renamed, so neither readers nor concurrent writers see an incomplete one. A cache that
/// cannot be written is not an error.
Bvh build_bvh_cached(std::span<const Triangle> triangles, const BuildSettings& settings,
                     const std::filesystem::path& cache_folder, const Progress& progress = {});

/// Returns one line for each broken invariant ("node 12: box of child 31 exceeds its parent's on x", ...), at most
/// `limit` lines. Returns nothing if the tree is sound.
std::vector<std::string> check_bvh(const Bvh& bvh, std::span<const Triangle> triangles,
                                   const BuildSettings& settings = {}, std::size_t limit = 20);

}  // namespace ballot
