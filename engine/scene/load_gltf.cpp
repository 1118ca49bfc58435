// Loads glTF 2.0: the nodes of the default scene, depth first, become flat triangles.
#include <algorithm>
#include <map>
#include <set>

#include "engine/core/memory.h"
#include "engine/scene/gltf_convert.h"
#include "engine/scene/gltf_instances.h"
#include "engine/scene/gltf_mesh.h"
#include "engine/scene/gltf_texture.h"
#include "engine/scene/loaders.h"

namespace ballot {
namespace {

struct PlacedNode {
  std::size_t node;
  glm::dmat4 world_from_node;
};

std::size_t checked_node(const GltfFile& file, int node, const std::string& place) {
  const std::size_t count = file.model.nodes.size();
  if (node < 0 || static_cast<std::size_t>(node) >= count)
    fail_in(file.path, "{} names node {}, but the file has {}", place, node, count);
  return static_cast<std::size_t>(node);
}

/// Returns the parent of every node (-1: none). Throws on a second parent, which could make the scene of a small file
/// exponentially large.
std::vector<int> parents_of(const GltfFile& file) {
  const auto& nodes = file.model.nodes;
  std::vector<int> parents(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (const int child_index : nodes[i].children) {
      const std::size_t child = checked_node(file, child_index, label("node", i, nodes[i].name));
      if (parents[child] != -1)
        fail_in(file.path, "{} is a child of node {} and of node {}; glTF nodes must form trees",
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
  fail_in(file.path, "{} is in a cycle of child nodes or below one; glTF nodes must form trees",
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
    fail_in(file.path, "its default scene is {}, but the file has {}", chosen, scenes.size());
  const auto index = static_cast<std::size_t>(std::max(chosen, 0));
  const std::string place = label("scene", index, scenes[index].name);
  std::set<std::size_t> seen;
  for (const int node : scenes[index].nodes) {
    roots.push_back(checked_node(file, node, place));
    if (!seen.insert(roots.back()).second) fail_in(file.path, "{} names node {} twice; expected once", place, node);
  }
  return roots;
}

/// Returns the nodes of the default scene with their transforms, depth first in file order. There is no recursion,
/// because files may be deeply nested.
std::vector<PlacedNode> placed_nodes(const GltfFile& file) {
  const std::vector<int> parents = parents_of(file);
  check_cycles(file, parents);
  std::vector<PlacedNode> placed, open;
  const auto push_reversed = [&](const auto& nodes, const glm::dmat4& world_from_parent) {
    for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) {
      const auto index = static_cast<std::size_t>(*node);
      open.push_back({index, world_from_parent * node_matrix(file, index)});
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

using OpenMeshes = std::map<std::size_t, std::vector<OpenPrimitive>>;

/// Opens each mesh that the scene uses, once.
OpenMeshes open_meshes(GltfFile& file, const std::vector<PlacedNode>& placed) {
  OpenMeshes meshes;
  for (const PlacedNode& p : placed) {
    const tinygltf::Node& node = file.model.nodes[p.node];
    if (node.mesh == -1) continue;
    if (node.mesh < 0 || static_cast<std::size_t>(node.mesh) >= file.model.meshes.size())
      fail_in(file.path, "{} names mesh {}, but the file has {}", label("node", p.node, node.name), node.mesh,
              file.model.meshes.size());
    const auto mesh = static_cast<std::size_t>(node.mesh);
    const auto [entry, fresh] = meshes.try_emplace(mesh);
    if (!fresh) continue;
    for (std::size_t i = 0; i < file.model.meshes[mesh].primitives.size(); ++i)
      if (auto primitive = open_primitive(file, mesh, i)) entry->second.push_back(std::move(*primitive));
  }
  return meshes;
}

const std::vector<OpenPrimitive>* mesh_of(const GltfFile& file, const OpenMeshes& meshes, const PlacedNode& placed) {
  const int mesh = file.model.nodes[placed.node].mesh;
  return mesh == -1 ? nullptr : &meshes.at(static_cast<std::size_t>(mesh));
}

/// The instances of nodes that have some, by the node.
using OpenInstances = std::map<std::size_t, NodeInstances>;

OpenInstances instances_of(const GltfFile& file, const std::vector<PlacedNode>& placed) {
  OpenInstances all;
  for (const PlacedNode& p : placed)
    if (auto instances = open_instances(file, p.node)) all.emplace(p.node, std::move(*instances));
  return all;
}

/// Appends a mesh for a node: once, or for each of its instances.
void append_mesh(const GltfFile& file, const std::vector<OpenPrimitive>& mesh, const PlacedNode& p,
                 const OpenInstances& instances, const Carried& carried, Scene& scene) {
  const auto append = [&](const glm::dmat4& world_from_mesh) {
    for (const OpenPrimitive& primitive : mesh) append_primitive(file, primitive, world_from_mesh, carried, scene);
  };
  const auto found = instances.find(p.node);
  if (found == instances.end()) return append(p.world_from_node);
  if (std::ranges::all_of(mesh, [](const OpenPrimitive& o) { return o.triangle_count == 0; })) return;
  for (std::size_t i = 0; i < found->second.size(); ++i) append(p.world_from_node * found->second.matrix(i));
}

void read_triangles(const GltfFile& file, const OpenMeshes& meshes, const std::vector<PlacedNode>& placed,
                    Scene& scene) {
  std::size_t count = 0;
  Carried carried;
  const OpenInstances instances = instances_of(file, placed);
  for (const PlacedNode& p : placed) {
    const auto* mesh = mesh_of(file, meshes, p);
    if (!mesh) continue;
    const auto many = instances.find(p.node);
    for (const OpenPrimitive& primitive : *mesh) {
      count += primitive.triangle_count * (many == instances.end() ? 1 : many->second.size());
      carried.normals |= primitive.normals && primitive.triangle_count > 0;
      if (primitive.material < scene.materials.size() && primitive.triangle_count > 0)
        for (const TextureUse* use : scene.materials[primitive.material].uses())
          if (*use) carried.uvs[use->set] = true;
      if (count > kMaxTriangles)
        fail_in(file.path, "its nodes place more than {} triangles; use a smaller scene", kMaxTriangles);
    }
  }
  const std::size_t sets = static_cast<std::size_t>(std::ranges::count(carried.uvs, true));
  need_memory(count * (sizeof(Triangle) + sizeof(std::uint32_t) + (carried.normals ? sizeof(Triangle) : 0) +
                       sets * 3 * sizeof(glm::vec2)),
              fmt::format("{}: the scene of {} triangles", file.path.string(), count));
  scene.triangles.reserve(count);
  scene.material_of.reserve(count);
  if (carried.normals) scene.normals.reserve(count);
  for (std::size_t set = 0; set < kUvSets; ++set)
    if (carried.uvs[set]) scene.uvs[set].reserve(count);
  for (const PlacedNode& p : placed)
    if (const auto* mesh = mesh_of(file, meshes, p)) append_mesh(file, *mesh, p, instances, carried, scene);
}

/// Reads all materials, but textures only for those that some triangle uses.
void read_materials(const GltfFile& file, const OpenMeshes& meshes, Scene& scene) {
  std::set<std::size_t> used;
  for (const auto& [mesh, primitives] : meshes)
    for (const OpenPrimitive& p : primitives)
      if (p.triangle_count > 0) used.insert(p.material);
  GltfTextures textures(file, scene);
  for (std::size_t i = 0; i < file.model.materials.size(); ++i)
    scene.materials.push_back(convert_material(file, i, used.contains(i) ? &textures : nullptr, scene.notes));
  if (used.contains(scene.materials.size())) scene.materials.push_back({.name = "default"});
}

void read_lights(const GltfFile& file, const std::vector<PlacedNode>& placed, Scene& scene) {
  for (const PlacedNode& p : placed)
    if (has_light(file.model.nodes[p.node])) scene.lights.push_back(convert_light(file, p.node, p.world_from_node));
}

void read_views(const GltfFile& file, const std::vector<PlacedNode>& placed, Scene& scene) {
  std::set<std::string> names;
  std::map<std::string, std::size_t>
      next;  // the number to try next for a name, so that many equal names cost no search
  for (const PlacedNode& p : placed) {
    if (file.model.nodes[p.node].camera == -1) continue;
    View view = convert_camera(file, p.node, p.world_from_node, scene.views.size());
    const std::string given = view.name;
    std::size_t& n = next.try_emplace(given, 2).first->second;
    while (!names.insert(view.name).second) view.name = fmt::format("{}_{}", given, n++);
    if (view.name != given)
      scene.notes.push_back(fmt::format("A second view named '{}' was renamed to '{}'.", given, view.name));
    scene.views.push_back(std::move(view));
  }
}

void note_ignored(const tinygltf::Model& model, Scene& scene) {
  if (!model.animations.empty() || !model.skins.empty())
    scene.notes.emplace_back("The file's animations and skins were ignored; the nodes keep their own transforms.");
}

}  // namespace

Scene load_gltf(const std::filesystem::path& path, const LoadOptions& options) {
  GltfFile file = read_gltf(path, options);
  const std::vector<PlacedNode> placed = placed_nodes(file);
  const OpenMeshes meshes = open_meshes(file, placed);
  Scene scene;
  scene.notes = std::move(file.notes);
  read_materials(file, meshes, scene);
  read_triangles(file, meshes, placed, scene);
  read_lights(file, placed, scene);
  read_views(file, placed, scene);
  note_ignored(file.model, scene);
  return scene;
}

}  // namespace ballot
