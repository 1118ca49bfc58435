#include "engine/tree/formats/bvh8.h"

#include <array>

#include "engine/core/parallel.h"
#include "engine/tree/formats/collapse.h"
#include "shaders/shared/grid.h"

namespace ballot {
namespace {

constexpr std::uint32_t kSlots = BVH8_CHILDREN;

using Slots = std::array<const DeviceChild*, kSlots>;  // null: empty

/// A node of the collapsed tree: its box, and the number of the child in each slot, or kEmpty.
constexpr std::uint8_t kEmpty = 0xFF;
struct Placed {
  Bounds all;
  std::array<std::uint8_t, kSlots> child;

  Slots slots(std::span<const DeviceChild> children) const {
    Slots out{};
    for (std::uint32_t s = 0; s < kSlots; ++s)
      if (child[s] != kEmpty) out[s] = &children[child[s]];
    return out;
  }
};

/// Returns the placement of these children with the largest gain (bvh8.h).
Placed placed(std::span<const DeviceChild> children) {
  Placed node{children[0].box, {}};
  node.child.fill(kEmpty);
  Bounds& all = node.all;
  for (const DeviceChild& c : children) all = {glm::min(all.lo, c.box.lo), glm::max(all.hi, c.box.hi)};
  const glm::dvec3 middle = glm::dvec3(all.lo) + glm::dvec3(all.hi);  // twice, as are the gains
  std::array<std::array<double, kSlots>, kSlots> gain;                // of each child in each slot
  for (std::size_t i = 0; i < children.size(); ++i) {
    const glm::dvec3 from = glm::dvec3(children[i].box.lo) + glm::dvec3(children[i].box.hi) - middle;
    for (std::uint32_t slot = 0; slot < kSlots; ++slot)
      gain[i][slot] = (slot & 1 ? from.x : -from.x) + (slot & 2 ? from.y : -from.y) + (slot & 4 ? from.z : -from.z);
  }
  // most[taken]: the largest gain of the first popcount(taken) children in these slots; last: the slot of the last.
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  std::array<double, 1 << kSlots> most;
  std::array<std::uint8_t, 1 << kSlots> last{};
  most.fill(kNone);
  most[0] = 0;
  std::uint32_t best = 0;
  for (std::uint32_t taken = 0; taken + 1 < most.size(); ++taken) {
    const std::size_t count = std::size_t(std::popcount(taken));
    if (count >= children.size()) continue;
    for (std::uint32_t slot = 0; slot < kSlots; ++slot) {
      const std::uint32_t then = taken | 1u << slot;
      const double sum = most[taken] + gain[count][slot];
      if (then != taken && (sum > most[then] || most[then] == kNone)) most[then] = sum, last[then] = std::uint8_t(slot);
    }
  }
  for (std::uint32_t taken = 0; taken < most.size(); ++taken)
    if (std::size_t(std::popcount(taken)) == children.size() && (best == 0 || most[taken] > most[best])) best = taken;
  for (std::size_t i = children.size(); i-- > 0; best &= ~(1u << last[best])) node.child[last[best]] = std::uint8_t(i);
  return node;
}

/// Returns the boxes of the children, widened along each axis by GRID_MARGIN of the node's extent.
std::array<Bounds, kSlots> widened(const Slots& slots, const Bounds& all) {
  std::array<Bounds, kSlots> boxes{};
  for (int axis = 0; axis < 3; ++axis) {
    const Difference extent = difference(all.hi[axis], all.lo[axis]);
    for (std::size_t s = 0; s < kSlots; ++s)
      if (slots[s]) {
        boxes[s].lo[axis] = widened_below(slots[s]->box.lo[axis], extent);
        boxes[s].hi[axis] = widened_above(slots[s]->box.hi[axis], extent);
      }
  }
  return boxes;
}

class Bvh8Encoder {
 public:
  Bvh8Encoder(const CollapsedBvh& tree, Bvh8Tree& out) : tree_(tree), out_(out) {
    out_.texels.resize(tree.ends.size() * BVH8_NODE_TEXELS);
  }

  void encode() {
    std::vector<Placed> nodes(tree_.ends.size());
    for_each_node([&](std::size_t from) { nodes[from] = placed(tree_.children_of(from)); });
    const std::vector<Numbers> numbers = numbered(nodes);
    for_each_node([&](std::size_t from) {
      const Numbers& n = numbers[from];
      write(nodes[from].slots(tree_.children_of(from)), nodes[from].all, n.first_child, n.list,
            &out_.texels[std::size_t(n.to) * BVH8_NODE_TEXELS]);
    });
  }

 private:
  struct Numbers {
    std::uint32_t to;           // the node's number here
    std::uint32_t first_child;  // that of its first inner child
    std::uint32_t list;         // the texel where its leaves begin
  };

  template <class Work>
  void for_each_node(const Work& work) const {
    for_chunks(tree_.ends.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t from = begin; from < end; ++from) work(from);
    });
  }

  /// Numbers the nodes and lists their leaves, parents first.
  std::vector<Numbers> numbered(std::span<const Placed> nodes) {
    std::vector<Numbers> numbers(nodes.size());
    std::vector<std::uint32_t> open{0};  // nodes of the collapsed tree
    std::uint32_t next = 1;
    while (!open.empty()) {
      const std::uint32_t from = open.back();
      open.pop_back();
      const Slots slots = nodes[from].slots(tree_.children_of(from));
      numbers[from].list = list_leaves(slots);
      numbers[from].first_child = next;  // the inner children of a node lie one behind the other
      const std::size_t first = open.size();
      for (const DeviceChild* c : slots)
        if (c && !is_leaf(c->ref)) numbers[c->ref].to = next++, open.push_back(c->ref);
      std::reverse(open.begin() + std::ptrdiff_t(first), open.end());
    }
    return numbers;
  }

  /// Appends the leaves of a node. Returns the texel where they begin.
  std::uint32_t list_leaves(const Slots& slots) {
    const auto first = std::uint32_t(out_.texels.size());
    std::uint32_t n = 0;
    for (const DeviceChild* c : slots) {
      if (!c || !is_leaf(c->ref)) continue;
      if (n % 4 == 0) out_.texels.emplace_back(END_OF_TREE);
      out_.texels.back()[int(n++ % 4)] = c->ref;
    }
    return first;
  }

  static void write(const Slots& slots, const Bounds& all, std::uint32_t first_child, std::uint32_t list,
                    glm::uvec4* node) {
    const std::array<Bounds, kSlots> boxes = widened(slots, all);
    Bounds whole = all;
    std::uint32_t inner = 0, leaves = 0;
    for (std::uint32_t s = 0; s < kSlots; ++s) {
      if (!slots[s]) continue;
      whole = {glm::min(whole.lo, boxes[s].lo), glm::max(whole.hi, boxes[s].hi)};
      (is_leaf(slots[s]->ref) ? leaves : inner) |= 1u << s;
    }
    for (int axis = 0; axis < 3; ++axis) {
      const float from = whole.lo[axis], step = grid_step(from, whole.hi[axis]);
      node[0][axis] = std::bit_cast<std::uint32_t>(from);
      node[1][axis] = std::bit_cast<std::uint32_t>(step);
      for (std::uint32_t s = 0; s < kSlots; ++s) {
        const std::uint32_t lower = slots[s] ? grid_below(from, step, boxes[s].lo[axis]) : GRID_STEPS;
        const std::uint32_t upper = slots[s] ? grid_above(from, step, boxes[s].hi[axis]) : 0;
        node[2 + axis][int(s / 4)] |= lower << 8 * (s % 4);
        node[2 + axis][int(2 + s / 4)] |= upper << 8 * (s % 4);
      }
    }
    node[0].w = first_child << 8 | inner;
    node[1].w = list << 8 | leaves;
  }

  const CollapsedBvh& tree_;
  Bvh8Tree& out_;
};

}  // namespace

Bvh8Tree encode_bvh8(const PairTree& binary) {
  Bvh8Tree out;
  const CollapsedBvh tree = collapse(binary, BVH8_CHILDREN, kBvh8MostNodes);
  if (tree.ends.empty()) return out;
  out.nodes = std::uint32_t(tree.ends.size());
  out.depth = tree.depth;
  out.children = std::uint32_t(tree.children.size());
  Bvh8Encoder(tree, out).encode();
  return out;
}

}  // namespace ballot
