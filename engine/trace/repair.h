// Repair: traces rays again whose traversal the driver cut short, in pieces of the tree that are small enough.
//
// Mesa 22.3's lavapipe gives all loops of an invocation 65 535 iterations together and then silently stops looping. The
// kernels notice this (shaders/lib/frame/main.glsl) and mark the ray. The hit of a ray is the smallest (t, prim) over
// all leaves, in whatever order they are visited. So the tree can be cut into subtrees. A dispatch traces each of them,
// and the hits are merged.
#pragma once

#include <span>
#include <vector>

#include "engine/trace/dispatch.h"
#include "engine/trace/query.h"

namespace ballot {

/// Returns the query that traces such rays: one invocation per ray, over the binary tree.
Query repair_query(Query query);

/// A piece of a forest: a reference in the top-level tree and, unless END_OF_TREE, where the walk of each mesh's tree
/// begins.
struct ForestPiece {
  std::uint32_t root, mesh_root = END_OF_TREE;
};

/// Finishes rays that the driver cut short.
class Repair {
 public:
  /// Keeps references to all arguments. `job` is the job of repair_query().
  Repair(Context& gpu, DeviceTree& tree, Dispatcher& dispatcher, const Job& job)
      : gpu_(gpu), tree_(tree), dispatcher_(dispatcher), job_(job) {}

  /// Traces every ray of [0, count) whose hit is UNFINISHED, in ever smaller pieces of the tree, until it is finished.
  /// Throws Error(Work) if a ray stays unfinished.
  void run(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, TraceTimes& times);

 private:
  std::vector<ForestPiece> pieces(std::uint64_t limit) const;
  void trace_pieces(std::span<const Ray> part, std::uint64_t limit, std::vector<Hit>& best, std::vector<bool>& cut,
                    TraceTimes& times);

  Context& gpu_;
  DeviceTree& tree_;
  Dispatcher& dispatcher_;
  const Job& job_;
};

/// Returns the roots of subtrees that together hold every leaf once. A subtree takes at most `limit` steps, unless it
/// is a single leaf. An inner node is one step, a leaf is one step, and each of its triangles is one more.
std::vector<std::uint32_t> pieces_of(const PairTree& bvh, std::uint64_t limit);

/// The same for a forest with these pair trees of its meshes: pieces that together hold every leaf of every instance
/// once. A piece of several instances holds them whole.
std::vector<ForestPiece> pieces_of(const TopTree& top, const Forest& forest, std::span<const PairTree> meshes,
                                   std::uint64_t limit);

}  // namespace ballot
