// Loads glTF 2.0: the nodes of the default scene, depth first, become triangles in the world, or instances of meshes.
#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "engine/files/gltf_convert.h"
#include "engine/files/gltf_moving.h"
#include "engine/files/gltf_nodes.h"
#include "engine/files/gltf_texture.h"
#include "engine/files/gltf_triangles.h"
#include "engine/files/loaders.h"
#include "engine/model/pose.h"

namespace ballot {
namespace {

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
  std::map<std::string, std::size_t> next;  // number to try next for a name, so that many equal names cost no search
  for (const PlacedNode& p : placed) {
    if (file.model.nodes[p.node].camera == -1) continue;
    View view = convert_camera(file, p.node, p.world_from_node, scene.views.size());
    const std::string given = view.name;
    std::size_t& n = next.try_emplace(given, 2).first->second;
    while (!names.insert(view.name).second) view.name = fmt::format("{}_{}", given, n++);
    if (view.name != given)
      scene.notes.push_back(fmt::format("Another view named '{}' was renamed to '{}'.", given, view.name));
    scene.views.push_back(std::move(view));
  }
}

/// Reads what moves, and poses the scene at rest: skins and morph targets may move vertices away from where the nodes
/// place them.
void read_motion(GltfFile& file, Animation animation, const std::vector<bool>& moves, const MovingPlaces& where,
                 const std::vector<PlacedNode>& placed, Scene& scene) {
  scene.turned = read_moving(file, where.primitives, animation);
  animation.placements = where.instances;
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
      refuse("at rest, {}", e.what());
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
  MovingPlaces where;
  std::optional<Animation> animation;
  std::vector<bool> moves, turns;
  if (may_move(file)) {
    animation = read_animation(file, parents);
    moves = moving_nodes(*animation);
    turns = turning_nodes(*animation);
  }
  scene.notes = std::move(file.notes);
  file.notes.clear();
  read_materials(file, meshes, scene);
  read_triangles({file, meshes, placed, moves, turns}, scene, animation ? &where : nullptr);
  read_lights(file, placed, scene);
  read_views(file, placed, scene);
  if (animation) read_motion(file, std::move(*animation), moves, where, placed, scene);
  std::ranges::move(file.notes, std::back_inserter(scene.notes));
  return scene;
}

}  // namespace ballot
