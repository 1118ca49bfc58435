// Rays whose traversal a driver cut short, traced again in pieces of the tree that are short enough.
//
// Mesa 22.3's lavapipe gives all loops of an invocation 65 535 iterations together and then silently stops looping. The
// kernels notice (shaders/lib/frame/main.glsl) and mark such rays. The answer is the smallest (t, prim) over all leaves
// whatever the order, so the tree can be cut into subtrees, each traced by a dispatch of its own, and the answers
// merged.
#pragma once

#include <span>
#include <vector>

#include "engine/trace/dispatch.h"
#include "engine/trace/query.h"

namespace ballot {

/// The query that traces such rays: one invocation a ray, over the binary tree.
Query repair_query(Query query);

class Repair {
 public:
  /// `job`: of repair_query().
  Repair(Context& gpu, DeviceTree& tree, Dispatcher& dispatcher, const Job& job)
      : gpu_(gpu), tree_(tree), dispatcher_(dispatcher), job_(job) {}

  /// Traces every ray of [0, count) whose hit is UNFINISHED until it is answered. Throws Error(Work) if a ray stays
  /// unfinished.
  void run(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, TraceTimes& times);

 private:
  void trace_pieces(std::span<const Ray> part, std::uint64_t limit, std::vector<Hit>& best, std::vector<bool>& cut,
                    TraceTimes& times);

  Context& gpu_;
  DeviceTree& tree_;
  Dispatcher& dispatcher_;
  const Job& job_;
};

/// Roots of subtrees of at most `limit` steps that together hold every leaf once. A step is an inner node or a
/// triangle, and one for each leaf.
std::vector<std::uint32_t> pieces_of(const PairTree& bvh, std::uint64_t limit);

}  // namespace ballot
