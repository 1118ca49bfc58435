// Nodes are handled in batches, those with the largest surface first. The moves of a batch are searched for in parallel
// on a tree that stands still, and then made one after the other.
#include "engine/tree/host/reinsert.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <glm/common.hpp>

#include "engine/core/interruption.h"
#include "engine/core/parallel.h"
#include "engine/tree/host/build.h"

namespace ballot {
namespace {

constexpr std::uint32_t kNowhere = 0xFFFFFFFFu;
constexpr int kMostPasses = 8;
constexpr double kLeastSaving = 0.01;  // of the inner nodes' cost, for another pass
// The part of all nodes in a batch. Moves of a batch may be in each other's way: then one of them waits for the next
// pass.
constexpr std::size_t kBatches = 64, kLeastBatch = 64;
constexpr std::size_t kSearchChunk = 32;
// The most nodes that a search looks at. It needs at most 512 in models of up to 330 000 triangles; where thousands of
// triangles overlap each other it would look at them all.
constexpr std::size_t kMostVisits = 1024;
// The tree may become twice as deep as a balanced one, and by this much deeper: every ray has a stack of that size.
constexpr std::uint32_t kSpareHeight = 8;

float area_of(const Bounds& b) { return float(half_area(b.lo, b.hi)); }
Bounds united(const Bounds& a, const Bounds& b) { return {glm::min(a.lo, b.lo), glm::max(a.hi, b.hi)}; }

// A place for a subtree: it and node `at` become siblings, and the surfaces of inner nodes shrink by `saving`.
struct Place {
  std::uint32_t at = kNowhere;
  float saving = 0;
};

class Reinserter {
 public:
  explicit Reinserter(Bvh&& bvh) : bvh_(std::move(bvh)), links_(bvh_.nodes.size()), seen_(bvh_.nodes.size()) {
    for (std::uint32_t i = 0; i < links_.size(); ++i) {
      if (i == 1) continue;
      links_[i].area = area_of(box(i));
      if (is_leaf(i)) continue;
      for (const std::uint32_t side : {0u, 1u}) {
        links_[i].child[side] = bvh_.nodes[i].first + side;
        links_[links_[i].child[side]].parent = i;
      }
      inner_area_ += links_[i].area;
    }
    for (std::size_t i = links_.size(); i-- > 2;) raise(links_[i].parent, links_[i].height);  // children come last
    const auto balanced = std::uint32_t(std::bit_width(bvh_.stats.leaves));
    most_height_ = std::max(bvh_.stats.depth, 2 * balanced + kSpareHeight);
  }

  Bvh run(const BuildSettings& settings) {
    for (int pass = 0; pass < kMostPasses; ++pass) {
      const double before = inner_area_;
      move_all();
      if (inner_area_ > before * (1 - kLeastSaving)) break;
    }
    return ordered(settings);
  }

 private:
  struct Link {
    std::uint32_t parent = kNowhere;
    std::uint32_t child[2] = {kNowhere, kNowhere};
    float area = 0;
    std::uint32_t height = 0;  // inner nodes on the longest path from here down
  };

  bool is_leaf(std::uint32_t i) const { return bvh_.nodes[i].count > 0; }
  Bounds box(std::uint32_t i) const { return {bvh_.nodes[i].lo, bvh_.nodes[i].hi}; }
  std::uint32_t sibling(std::uint32_t i) const {
    const Link& parent = links_[links_[i].parent];
    return parent.child[parent.child[0] == i ? 1 : 0];
  }

  // One pass over all nodes but the root and its children.
  void move_all() {
    std::vector<std::uint32_t> order;
    order.reserve(links_.size());
    for (std::uint32_t i = 2; i < links_.size(); ++i)
      if (links_[i].parent != 0) order.push_back(i);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return links_[a].area != links_[b].area ? links_[a].area > links_[b].area : a < b;
    });
    const std::size_t batch = std::max(kLeastBatch, order.size() / kBatches + 1);
    for (std::size_t begin = 0; begin < order.size(); begin += batch)
      move_batch(std::span(order).subspan(begin, std::min(batch, order.size() - begin)));
  }

  void move_batch(std::span<const std::uint32_t> nodes) {
    check_interruption();
    struct Move {
      std::uint32_t node;
      Place to;
    };
    std::vector<Move> moves(nodes.size());
    for_chunks(nodes.size(), kSearchChunk, [&](std::size_t begin, std::size_t end) {
      std::vector<Place> todo;
      for (std::size_t i = begin; i < end; ++i) moves[i] = {nodes[i], find_place(nodes[i], todo)};
    });
    std::erase_if(moves, [](const Move& m) { return m.to.at == kNowhere; });
    std::stable_sort(moves.begin(), moves.end(),
                     [](const Move& a, const Move& b) { return a.to.saving > b.to.saving; });
    ++batch_;
    for (const Move& m : moves)
      if (claims(m.node, m.to.at)) move(m.node, m.to.at);
  }

  // Finds the best place for a node, or a good one after kMostVisits, by branch and bound. On the way up from its
  // parent, which vanishes when the node is taken out, every sibling's subtree is searched. `saving` of what is to do
  // counts all nodes above it: those that shrink when the node leaves, less those that grow when it comes in. Below it
  // the node itself is a lower bound for the new parent.
  Place find_place(std::uint32_t node, std::vector<Place>& todo) const {
    const Bounds own = box(node);
    const float own_area = links_[node].area;
    const std::uint32_t parent = links_[node].parent, beside = sibling(node);
    Place best{kNowhere, own_area * 1e-5f};  // less is lost in rounding
    Bounds left = box(beside);               // of the node `above` when `node` is out
    float saving = links_[parent].area;
    std::size_t visits = 0;
    todo.clear();
    for (std::uint32_t above = parent, side = beside;;) {
      todo.push_back({side, saving});
      while (!todo.empty()) {
        if (++visits > kMostVisits) return best;
        const Place p = todo.back();
        todo.pop_back();
        if (p.saving - own_area <= best.saving) continue;
        const float here = p.saving - area_of(united(box(p.at), own));
        if (here > best.saving && p.at != beside) best = {p.at, here};
        if (is_leaf(p.at)) continue;
        for (const std::uint32_t child : links_[p.at].child) todo.push_back({child, here + links_[p.at].area});
      }
      if (above != parent) {
        left = united(left, box(side));
        saving += links_[above].area - area_of(left);
      }
      if (above == 0) return best;
      side = sibling(above);
      above = links_[above].parent;
    }
  }

  void raise(std::uint32_t parent, std::uint32_t child_height) {
    links_[parent].height = std::max(links_[parent].height, child_height + 1);
  }

  // Returns true if no move of this batch has touched what the move would change, and the tree does not become too
  // deep. Claims it then.
  bool claims(std::uint32_t node, std::uint32_t at) {
    const std::uint32_t parent = links_[node].parent, above = links_[parent].parent;
    if (above == kNowhere || links_[at].parent == kNowhere || at == parent || at == sibling(node)) return false;
    const std::uint32_t all[] = {node, parent, sibling(node), above, at, links_[at].parent};
    for (const std::uint32_t i : all)
      if (seen_[i] == batch_) return false;
    std::uint32_t depth = 0;  // of the new parent
    for (std::uint32_t i = at; i != 0; i = links_[i].parent, ++depth)
      if (i == node) return false;  // `at` has moved into the subtree
    if (depth + 1 + std::max(links_[node].height, links_[at].height) > most_height_) return false;
    for (const std::uint32_t i : all) seen_[i] = batch_;
    return true;
  }

  // The parent moves with the node: it becomes the parent of `at`.
  void move(std::uint32_t node, std::uint32_t at) {
    const std::uint32_t parent = links_[node].parent, beside = sibling(node), above = links_[parent].parent;
    replace(above, parent, beside);
    replace(links_[at].parent, at, parent);
    links_[parent].child[0] = at;
    links_[parent].child[1] = node;
    links_[at].parent = parent;
    refit_from(parent);
    refit_from(above);
  }

  void replace(std::uint32_t parent, std::uint32_t from, std::uint32_t to) {
    links_[parent].child[links_[parent].child[0] == from ? 0 : 1] = to;
    links_[to].parent = parent;
  }

  void refit_from(std::uint32_t i) {
    for (; i != kNowhere; i = links_[i].parent) {
      const Bounds all = united(box(links_[i].child[0]), box(links_[i].child[1]));
      bvh_.nodes[i].lo = all.lo;
      bvh_.nodes[i].hi = all.hi;
      inner_area_ -= links_[i].area;
      links_[i].area = area_of(all);
      links_[i].height = 0;
      for (const std::uint32_t child : links_[i].child) raise(i, links_[child].height);
      inner_area_ += links_[i].area;
    }
  }

  // Returns the reference form: depth first, siblings side by side, references in the order of the leaves.
  Bvh ordered(const BuildSettings& settings) {
    struct Step {
      std::uint32_t from, to, depth;
    };
    Bvh out;
    out.bounds = bvh_.bounds;
    out.stats = bvh_.stats;
    out.stats.depth = 0;
    out.nodes.resize(bvh_.nodes.size());
    out.references.reserve(bvh_.references.size());
    std::uint32_t next = 2;
    std::vector<Step> todo{{0, 0, 0}};
    while (!todo.empty()) {
      const Step step = todo.back();
      todo.pop_back();
      const BvhNode& from = bvh_.nodes[step.from];
      BvhNode& node = out.nodes[step.to] = from;
      if (from.count > 0) {
        node.first = std::uint32_t(out.references.size());
        const auto first = bvh_.references.begin() + from.first;
        out.references.insert(out.references.end(), first, first + from.count);
        out.stats.depth = std::max(out.stats.depth, step.depth);
        continue;
      }
      node.first = next;
      for (const std::uint32_t side : {1u, 0u})
        todo.push_back({links_[step.from].child[side], next + side, step.depth + 1});
      next += 2;
    }
    out.stats.sah = sah_cost(out, settings);
    return out;
  }

  Bvh bvh_;                          // its inner nodes' `first` is of the tree as it came
  std::vector<Link> links_;          // by node
  std::vector<std::uint32_t> seen_;  // by node: the last batch that has changed it
  std::uint32_t batch_ = 0, most_height_ = 0;
  double inner_area_ = 0;
};

}  // namespace

Bvh reinsert_subtrees(Bvh bvh, const BuildSettings& settings) {
  if (bvh.is_empty() || bvh.stats.leaves < 4) return bvh;
  return Reinserter(std::move(bvh)).run(settings);
}

}  // namespace ballot
