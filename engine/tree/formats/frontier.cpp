#include "engine/tree/formats/frontier.h"

#include <limits>
#include <queue>
#include <set>

#include "engine/tree/formats/pair_decode.h"
#include "engine/tree/host/build.h"

namespace ballot {
namespace {

using Texel = glm::uvec4;

/// Returns the child references of the inner nodes above the frontier.
std::set<std::uint32_t> nodes_to_open(const PairTree& binary, std::uint32_t nodes) {
  std::set<std::uint32_t> opened;
  std::priority_queue<std::pair<double, std::uint32_t>> inner;  // inner nodes of the frontier, by surface area
  const auto add = [&](const DeviceChild& c) {
    if (!is_leaf(c.ref)) inner.emplace(half_area(c.box.lo, c.box.hi), c.ref);
  };
  add({binary.root_box, binary.root});
  for (std::uint32_t n = 1; n < nodes && !inner.empty(); ++n) {
    const std::uint32_t largest = inner.top().second;
    inner.pop();
    opened.insert(largest);
    const DevicePair pair = decode_pair(binary, largest);
    add(pair.left);
    add(pair.right);
  }
  return opened;
}

/// True if rays of this octant mostly meet the right box first. The axis along which the centres are farthest apart
/// decides.
bool right_first(const DevicePair& pair, std::uint32_t octant) {
  const glm::vec3 d = (pair.right.box.lo + pair.right.box.hi) - (pair.left.box.lo + pair.left.box.hi);
  const glm::vec3 a = glm::abs(d);
  const int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
  return (d[axis] < 0) != ((octant >> axis & 1) != 0);
}

/// Returns the nodes of the frontier, front to back for rays of this octant.
std::vector<DeviceChild> in_order(const PairTree& binary, const std::set<std::uint32_t>& opened, std::uint32_t octant) {
  std::vector<DeviceChild> stack{{binary.root_box, binary.root}}, line;
  while (!stack.empty()) {
    const DeviceChild c = stack.back();
    stack.pop_back();
    if (is_leaf(c.ref) || !opened.contains(c.ref)) {
      line.push_back(c);
      continue;
    }
    const DevicePair pair = decode_pair(binary, c.ref);
    const bool right = right_first(pair, octant);
    stack.push_back(right ? pair.left : pair.right);
    stack.push_back(right ? pair.right : pair.left);
  }
  return line;
}

}  // namespace

std::vector<Texel> encode_frontier(const PairTree& binary, std::uint32_t nodes) {
  const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x); };
  constexpr float far = std::numeric_limits<float>::max();
  const DeviceChild none{{glm::vec3(far), glm::vec3(-far)}, END_OF_TREE};
  const bool empty = binary.root == END_OF_TREE;
  const std::set<std::uint32_t> opened = empty ? std::set<std::uint32_t>() : nodes_to_open(binary, nodes);
  std::vector<Texel> out;
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    std::vector<DeviceChild> line = empty ? std::vector<DeviceChild>() : in_order(binary, opened, octant);
    line.resize(nodes, none);
    for (const DeviceChild& c : line) {
      out.push_back({bits(c.box.lo.x), bits(c.box.lo.y), bits(c.box.lo.z), c.ref});
      out.push_back({bits(c.box.hi.x), bits(c.box.hi.y), bits(c.box.hi.z), 0});
    }
  }
  return out;
}

}  // namespace ballot
