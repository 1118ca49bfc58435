// Loads glTF 2.0: the nodes of the default scene, depth first, become flat triangles.
#include <algorithm>
#include <map>
#include <set>

#include "engine/core/memory.h"
#include "engine/scene/gltf_convert.h"
#include "engine/scene/gltf_instances.h"
#include "engine/scene/gltf_mesh.h"
#include "engine/scene/gltf_moving.h"
#include "engine/scene/gltf_nodes.h"
#include "engine/scene/gltf_texture.h"
#include "engine/scene/loaders.h"
#include "engine/scene/pose.h"

namespace ballot {
namespace {

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

/// Appends a mesh for a node: once, or for each of its instances. `where`, if set, gets the place of each primitive.
void append_mesh(const GltfFile& file, const std::vector<OpenPrimitive>& mesh, const PlacedNode& p,
                 const OpenInstances& instances, const Carried& carried, Scene& scene,
                 std::vector<PlacedPrimitive>* where) {
  const auto found = instances.find(p.node);
  const bool instanced = found != instances.end();
  const auto append = [&](const glm::dmat4& node_from_mesh) {
    const glm::dmat4 world = instanced ? p.world_from_node * node_from_mesh : p.world_from_node;
    for (const OpenPrimitive& primitive : mesh) {
      if (where && primitive.triangle_count > 0)
        where->push_back({&primitive, p.node, node_from_mesh, instanced, scene.triangles.size()});
      append_primitive(file, primitive, world, carried, scene);
    }
  };
  if (!instanced) return append(glm::dmat4{1});
  if (std::ranges::all_of(mesh, [](const OpenPrimitive& o) { return o.triangle_count == 0; })) return;
  for (std::size_t i = 0; i < found->second.size(); ++i) append(found->second.matrix(i));
}

void read_triangles(const GltfFile& file, const OpenMeshes& meshes, const std::vector<PlacedNode>& placed, Scene& scene,
                    std::vector<PlacedPrimitive>* where) {
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
      carried.colors |= primitive.colors && primitive.triangle_count > 0;
      if (primitive.material < scene.materials.size() && primitive.triangle_count > 0)
        for (const TextureUse* use : scene.materials[primitive.material].uses())
          if (*use) carried.uvs[use->set] = true;
      if (count > kMaxTriangles)
        fail_in(file.path, "its nodes place more than {} triangles; use a smaller scene", kMaxTriangles);
    }
  }
  const std::size_t sets = static_cast<std::size_t>(std::ranges::count(carried.uvs, true));
  need_memory(count * (sizeof(Triangle) + sizeof(std::uint32_t) + (carried.normals ? sizeof(Triangle) : 0) +
                       (carried.colors ? 3 * sizeof(glm::vec4) : 0) + sets * 3 * sizeof(glm::vec2)),
              fmt::format("{}: the scene of {} triangles", file.path.string(), count));
  scene.triangles.reserve(count);
  scene.material_of.reserve(count);
  if (carried.normals) scene.normals.reserve(count);
  if (carried.colors) scene.colors.reserve(count);
  for (std::size_t set = 0; set < kUvSets; ++set)
    if (carried.uvs[set]) scene.uvs[set].reserve(count);
  for (const PlacedNode& p : placed)
    if (const auto* mesh = mesh_of(file, meshes, p)) append_mesh(file, *mesh, p, instances, carried, scene, where);
}

/// Reads all materials, but textures only for those that some triangle uses.
void read_materials(const GltfFile& file, const OpenMeshes& meshes, Scene& scene) {
  std::set<std::size_t> used;
  for (const auto& [mesh, primitives] : meshes)
    for (const OpenPrimitive& p : primitives)
      if (p.triangle_count > 0) used.insert(p.material);
  GltfTextures textures(file, scene);
  note_unmodelled(file, used, scene.notes);
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

/// Reads what moves, and puts the scene at rest, where skins and morph targets may lie elsewhere than their nodes say.
void read_motion(GltfFile& file, const std::vector<int>& parents, const std::vector<PlacedPrimitive>& where,
                 const std::vector<PlacedNode>& placed, Scene& scene) {
  Animation animation = read_animation(file, parents);
  read_moving(file, where, animation);
  const std::vector<bool> moves = moving_nodes(animation);
  const auto node_of = [&](const PlacedNode& p) { return moves[p.node] ? static_cast<int>(p.node) : -1; };
  std::size_t light = 0, view = 0;  // they are in the order of their nodes
  for (const PlacedNode& p : placed) {
    if (has_light(file.model.nodes[p.node])) scene.lights[light++].node = node_of(p);
    if (file.model.nodes[p.node].camera != -1) scene.views[view++].node = node_of(p);
  }
  scene.animation = std::make_shared<const Animation>(std::move(animation));
  if (scene.animation->posed_vertices > 0) {
    try {
      set_pose(scene, nullptr, 0);
    } catch (const Error& e) {
      fail_in(file.path, "at rest, {}", e.what());
    }
  }
  if (scene.animation->clips.empty()) scene.animation.reset();
}

}  // namespace

Scene load_gltf(const std::filesystem::path& path, const LoadOptions& options) {
  GltfFile file = read_gltf(path, options);
  const std::vector<int> parents = parents_of(file);
  const std::vector<PlacedNode> placed = placed_nodes(file, parents);
  const OpenMeshes meshes = open_meshes(file, placed);
  Scene scene;
  std::vector<PlacedPrimitive> where;
  const bool moves = may_move(file);
  scene.notes = std::move(file.notes);
  file.notes.clear();
  read_materials(file, meshes, scene);
  read_triangles(file, meshes, placed, scene, moves ? &where : nullptr);
  read_lights(file, placed, scene);
  read_views(file, placed, scene);
  if (moves) read_motion(file, parents, where, placed, scene);
  std::ranges::move(file.notes, std::back_inserter(scene.notes));
  return scene;
}

}  // namespace ballot
