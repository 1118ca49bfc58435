// Repair: walks again that the driver cut short, in pieces of the tree that are small enough.
//
// Mesa 22.3's lavapipe gives all loops of an invocation 65 535 iterations together and then silently stops looping. The
// kernels notice this and mark the walk (shaders/lib/frame/cut_loops.glsl). What a walk finds does not depend on the
// order of the leaves: it is the smallest (t, prim) of the hits, the nearest point, a number or a list of crossings. So
// the tree can be cut into subtrees. A dispatch walks each of them, and the answers are merged.
#pragma once

#include <algorithm>
#include <bit>
#include <functional>
#include <span>
#include <vector>

#include "engine/answer/dispatch.h"
#include "engine/answer/query.h"
#include "engine/core/error.h"
#include "engine/model/recentring.h"

namespace ballot {

/// Returns the query that traces such rays: one invocation per ray, over the binary tree.
Query repair_query(Query query);

inline bool is_unfinished(std::uint32_t answer) { return answer == UNFINISHED; }
inline bool is_unfinished(float answer) { return is_unfinished(std::bit_cast<std::uint32_t>(answer)); }
template <class Record>
requires requires(const Record& r) { r.prim; }
bool is_unfinished(const Record& r) { return is_unfinished(r.prim); }

/// Repeats the walks whose answer is_unfinished(), in pieces of the tree of at most `limit` steps, then in ever smaller
/// ones, until none is left. Throws Error(Work) if one is cut short even in single leaves. What it is told of a kind of
/// walk:
///   Answer, none()          what a walk returns, and what it returns if it finds nothing
///   name(), kQueries        for messages: "kernel x", "rays"
///   choose(numbers)         these walks are repeated from now on
///   pieces(limit)           pieces that together hold the tree
///   ask(piece, found)       repeats the chosen walks in a piece
///   add(k, all, found)      adds what the k-th chosen walk has found in one more piece
template <class Walks>
void repair(Walks& walks, std::span<typename Walks::Answer> answers, std::uint64_t limit, const Context& gpu,
            TraceTimes& times) {
  std::vector<std::uint32_t> open;
  for (std::uint32_t i = 0; i < answers.size(); ++i)
    if (is_unfinished(answers[i])) open.push_back(i);
  times.retraced += open.size();
  for (;; limit = std::min<std::uint64_t>(limit / 8, 8192)) {
    if (open.empty()) return;
    walks.choose(open);
    std::vector<typename Walks::Answer> all(open.size(), walks.none()), found(open.size());
    std::vector<bool> cut(open.size());
    for (const auto& piece : walks.pieces(limit)) {
      walks.ask(piece, std::span(found));
      for (std::size_t k = 0; k < open.size(); ++k) {
        cut[k] = cut[k] || is_unfinished(found[k]);
        if (!cut[k]) walks.add(k, all[k], found[k]);
      }
    }
    std::vector<std::uint32_t> still;
    for (std::size_t k = 0; k < open.size(); ++k)
      if (cut[k])
        still.push_back(open[k]);
      else
        answers[open[k]] = std::move(all[k]);
    open = std::move(still);
    if (limit == 0 && !open.empty())
      fail(Failure::Work, "{}: {} {} could not be finished on {}: its driver stops loops after a few iterations",
           walks.name(), open.size(), Walks::kQueries, gpu.info().name);
  }
}
constexpr std::uint64_t kWholeTree = ~0ull, kFirstPieces = 8192;  // limits to begin with

/// Finishes rays that the driver cut short.
class Repair {
 public:
  /// Keeps references to all arguments. `job` is the job of repair_query().
  Repair(Context& gpu, DeviceTree& tree, Dispatcher& dispatcher, const Job& job)
      : gpu_(gpu), tree_(tree), dispatcher_(dispatcher), job_(job) {}

  /// Traces every ray of [0, count) whose hit is UNFINISHED. Throws Error(Work) if a ray stays unfinished.
  void run(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, TraceTimes& times);
  void run(const Buffer<RayInDouble>& rays, Buffer<Hit>& hits, std::uint32_t count, TraceTimes& times);

 private:
  template <class Given>
  class Walks;
  template <class Given>
  void finish(const Buffer<Given>& rays, Buffer<Hit>& hits, std::uint32_t count, TraceTimes& times);

  Context& gpu_;
  DeviceTree& tree_;
  Dispatcher& dispatcher_;
  const Job& job_;
};

/// Returns the roots of subtrees that together hold every leaf once. A subtree takes at most `limit` steps, unless it
/// is a single leaf. An inner node is one step, a leaf is one step, and each of its triangles is one more.
std::vector<std::uint32_t> pieces_of(const PairTree& bvh, std::uint64_t limit);

/// Returns the pair tree of a mesh by its number.
using MeshPairs = std::function<const PairTree&(std::size_t)>;

/// The same for a forest with these pair trees of its meshes: pieces that together hold every leaf of every instance
/// once. A piece of several instances holds them whole.
std::vector<TreePiece> pieces_of(const TopTree& top, const Forest& forest, const MeshPairs& pairs, std::uint64_t limit);

/// The same for a tree or a forest whose pairs are read in this way.
std::vector<TreePiece> pieces_of(DeviceTree& tree, const TreeAccess& access, std::uint64_t limit);

}  // namespace ballot
