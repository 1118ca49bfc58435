#include "engine/files/gltf_nodes.h"

#include <algorithm>
#include <set>

#include "engine/files/gltf_convert.h"
#include "engine/files/loaders.h"

namespace ballot {
namespace {

/// Returns the parent of every node (-1: none). Throws on a second parent, which could make the scene of a small file
/// exponentially large.
std::vector<int> find_parents(const GltfFile& file) {
  const auto& nodes = file.model.nodes;
  std::vector<int> parents(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (const int child_index : nodes[i].children) {
      const std::size_t child = checked_node(file, child_index, label("node", i, nodes[i].name));
      if (parents[child] != -1)
        refuse("{} is a child of node {} and of node {}; glTF nodes must form trees",
               label("node", child, nodes[child].name), parents[child], i);
      parents[child] = static_cast<int>(i);
    }
  return parents;
}

/// Throws if the nodes form a cycle. Every node has at most one parent, so the nodes that cannot be reached from a node
/// without a parent are exactly those on and below a cycle.
void check_cycles(const GltfFile& file, const std::vector<int>& parents) {
  const auto& nodes = file.model.nodes;
  std::vector<std::size_t> reached;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (parents[i] == -1) reached.push_back(i);
  for (std::size_t i = 0; i < reached.size(); ++i)
    for (const int child : nodes[reached[i]].children) reached.push_back(static_cast<std::size_t>(child));
  if (reached.size() == nodes.size()) return;
  std::ranges::sort(reached);
  std::size_t lost = 0;
  while (lost < reached.size() && reached[lost] == lost) ++lost;
  refuse("{} is in a cycle of child nodes or below one; glTF nodes must form trees",
         label("node", lost, nodes[lost].name));
}

std::vector<std::size_t> root_nodes(const GltfFile& file, const std::vector<int>& parents) {
  const auto& scenes = file.model.scenes;
  const int chosen = file.model.defaultScene;
  std::vector<std::size_t> roots;
  if (scenes.empty()) {
    for (std::size_t i = 0; i < parents.size(); ++i)
      if (parents[i] == -1) roots.push_back(i);
    return roots;
  }
  if (chosen < -1 || chosen >= static_cast<int>(scenes.size()))
    refuse("its default scene is {}, but the file has {}", chosen, scenes.size());
  const auto index = static_cast<std::size_t>(std::max(chosen, 0));
  const std::string place = label("scene", index, scenes[index].name);
  std::set<std::size_t> seen;
  for (const int node : scenes[index].nodes) {
    roots.push_back(checked_node(file, node, place));
    if (!seen.insert(roots.back()).second) refuse("{} names node {} twice; expected once", place, node);
  }
  return roots;
}

}  // namespace

std::size_t checked_node(const GltfFile& file, int node, const std::string& place) {
  const std::size_t count = file.model.nodes.size();
  if (node < 0 || static_cast<std::size_t>(node) >= count)
    refuse("{} names node {}, but the file has {}", place, node, count);
  return static_cast<std::size_t>(node);
}

std::vector<int> parents_of(const GltfFile& file) {
  std::vector<int> parents = find_parents(file);
  check_cycles(file, parents);
  return parents;
}

// There is no recursion, because files may be deeply nested.
std::vector<PlacedNode> placed_nodes(const GltfFile& file, const std::vector<int>& parents) {
  std::vector<PlacedNode> placed, open;
  const auto push_reversed = [&](const auto& nodes, const glm::dmat4& world_from_parent) {
    for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) {
      const auto index = static_cast<std::size_t>(*node);
      open.push_back({index, world_from_parent * matrix_of(node_transform(file, index))});
    }
  };
  push_reversed(root_nodes(file, parents), glm::dmat4{1});
  while (!open.empty()) {
    placed.push_back(open.back());
    open.pop_back();
    push_reversed(file.model.nodes[placed.back().node].children, placed.back().world_from_node);
  }
  return placed;
}

}  // namespace ballot
