#include "engine/tree/formats/wide8.h"

#include <limits>

#include "engine/tree/formats/collapse.h"

namespace ballot {
namespace {

void add_wide8_node(std::span<const DeviceChild> children, std::vector<glm::uvec4>& out) {
  const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x); };
  constexpr float far = std::numeric_limits<float>::max();
  const DeviceChild none{{glm::vec3(far), glm::vec3(-far)}, END_OF_TREE};
  for (std::size_t i = 0; i < WIDE8_CHILDREN; ++i) {
    const DeviceChild& c = i < children.size() ? children[i] : none;
    out.push_back({bits(c.box.lo.x), bits(c.box.lo.y), bits(c.box.lo.z), c.ref});
  }
  for (std::size_t i = 0; i < WIDE8_CHILDREN; ++i) {
    const DeviceChild& c = i < children.size() ? children[i] : none;
    out.push_back({bits(c.box.hi.x), bits(c.box.hi.y), bits(c.box.hi.z), 0});
  }
}

}  // namespace

Wide8Tree encode_wide8(const PairTree& binary) {
  const CollapsedBvh tree = collapse(binary, WIDE8_CHILDREN, WIDE8_MAX_NODES);
  Wide8Tree out;
  out.depth = tree.depth;
  out.children = std::uint32_t(tree.children.size());
  out.nodes.reserve(tree.ends.size() * WIDE8_NODE_TEXELS);
  for (std::size_t i = 0; i < tree.ends.size(); ++i) add_wide8_node(tree.children_of(i), out.nodes);
  return out;
}

}  // namespace ballot
