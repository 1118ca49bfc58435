#include "engine/formats/bvh8.h"

#include <array>

#include "engine/formats/collapse.h"
#include "shaders/shared/grid.h"

namespace ballot {
namespace {

constexpr std::uint32_t kSlots = BVH8_CHILDREN;

using Slots = std::array<const DeviceChild*, kSlots>;  // null: empty

/// Returns the children in their slots.
Slots placed(std::span<const DeviceChild> children, const Bounds& all) {
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
  Slots slots{};
  for (std::size_t i = children.size(); i-- > 0; best &= ~(1u << last[best])) slots[last[best]] = &children[i];
  return slots;
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
    struct Open {
      std::uint32_t from, to;  // a node of the collapsed tree, and its number here
    };
    std::vector<Open> open{{0, 0}};
    std::uint32_t next = 1;
    while (!open.empty()) {
      const auto [from, to] = open.back();
      open.pop_back();
      const std::span<const DeviceChild> children = tree_.children_of(from);
      Bounds all = children[0].box;
      for (const DeviceChild& c : children) all = {glm::min(all.lo, c.box.lo), glm::max(all.hi, c.box.hi)};
      const Slots slots = placed(children, all);
      const std::uint32_t list = list_leaves(slots);
      write(slots, all, next, list, &out_.texels[std::size_t(to) * BVH8_NODE_TEXELS]);
      const std::uint32_t first = next;  // the inner children of a node lie one behind the other
      for (const DeviceChild* c : slots)
        if (c && !is_leaf(c->ref)) open.push_back({c->ref, next++});
      std::reverse(open.end() - (next - first), open.end());
    }
  }

 private:
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
