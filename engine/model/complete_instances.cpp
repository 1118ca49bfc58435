// What a scene gets of meshes, placements and names that its maker did not give.
#include <algorithm>
#include <span>
#include <utility>

#include "engine/core/error.h"
#include "engine/model/instances.h"

namespace ballot {
namespace {

/// Gives meshes without labels, or without names, theirs.
void label_meshes(SceneInstances& all, const std::string& scene) {
  const bool labelled = !all.mesh_labels.empty();
  if (labelled && !all.names.empty()) return;
  for (std::size_t m = 0; m < all.meshes() && !labelled; ++m)
    all.mesh_labels.push_back({.id = static_cast<std::uint32_t>(m)});
  for (std::size_t m = 0; m < all.mesh_labels.size(); ++m) {
    all.mesh_labels[m].name = static_cast<std::uint32_t>(all.names.size());
    all.names.push_back(all.mesh_labels.size() == 1 ? scene : fmt::format("mesh {}", m));
  }
}

/// Places each mesh once, in the world. Its label is the mesh's.
void place_in_world(SceneInstances& all) {
  for (std::size_t m = 0; m < all.meshes(); ++m) {
    all.placements.push_back({static_cast<std::uint32_t>(m), {}});
    all.placement_labels.push_back({all.mesh_labels[m].name, all.mesh_labels[m].id});
    all.mesh_labels[m].in_world = true;
  }
}

/// Gives placements without labels theirs.
void label_placements(SceneInstances& all) {
  if (!all.placement_labels.empty()) return;
  for (std::size_t p = 0; p < all.placements.size(); ++p)
    all.placement_labels.push_back({all.mesh_labels[all.placements[p].mesh].name, static_cast<std::uint32_t>(p)});
}

void check_count(const Scene& scene, const char* what, std::size_t count, std::size_t labels) {
  if (count != labels)
    fail(Failure::Arguments, "scene '{}' has {} {}, but {} labels of them; expected as many", scene.name, count, what,
         labels);
}

void check_names(const Scene& scene) {
  const SceneInstances& all = scene.instances;
  const auto unnamed = [&](const auto& label) { return label.name >= all.names.size(); };
  if (std::ranges::any_of(all.mesh_labels, unnamed) || std::ranges::any_of(all.placement_labels, unnamed))
    fail(Failure::Arguments, "scene '{}': a mesh or a placement has a name that is not among its {} names", scene.name,
         all.names.size());
}

/// Has meshes lie in the world, or not, as the layout asks for. Nobody meets a mesh of mask 0, and not everybody one of
/// a group, so none shares its tree.
void lay_out(SceneInstances& all) {
  std::vector<std::uint32_t> uses(all.meshes());
  for (const Placement& p : all.placements) ++uses[p.mesh];
  std::size_t next = 0;  // no mesh before it may follow
  for (const Placement& p : all.placements) {
    bool& in_world = all.mesh_labels[p.mesh].in_world;
    if (all.layout == Layout::Merge) in_world = uses[p.mesh] == 1 && is_identity(p.transform) && p.mesh >= next;
    if (all.layout == Layout::Separate || p.mask == 0 || p.group != kSharedGroup) in_world = false;
    if (all.mesh_labels[p.mesh].kind != ShapeKind::Triangles) in_world = false;
    if (in_world) next = p.mesh + std::size_t{1};
  }
}

/// Numbers meshes and placements in their order, unless they have numbers.
void number(SceneInstances& all) {
  if (std::exchange(all.numbered, true)) return;
  for (std::uint32_t number = 0; MeshLabel & label : all.mesh_labels) label.number = number++;
  for (std::uint32_t number = 0; PlacementLabel & label : all.placement_labels) label.number = number++;
}

/// Checks that each mesh in the world is placed once, with the identity, and that they are so in their order. Then the
/// triangles of a flat scene are numbered as they lie in its arrays.
void check_world(const Scene& scene) {
  const SceneInstances& all = scene.instances;
  std::vector<bool> placed(all.meshes());
  std::size_t next = 0;  // no mesh before it may follow
  for (const Placement& p : all.placements) {
    if (!all.mesh_labels[p.mesh].in_world) continue;
    if (p.mesh < next || !is_identity(p.transform))
      fail(Failure::Arguments,
           "scene '{}': mesh {} lies in the world, but is placed elsewhere, twice or out of order; expected once, with "
           "the identity, behind the meshes before it",
           scene.name, p.mesh);
    placed[p.mesh] = true;
    next = p.mesh + std::size_t{1};
  }
  for (std::size_t m = 0; m < all.meshes(); ++m)
    if (all.mesh_labels[m].in_world && !placed[m])
      fail(Failure::Arguments, "scene '{}': mesh {} lies in the world, but has no placement; expected one", scene.name,
           m);
}

void set_materials(Scene& scene) {
  SceneInstances& all = scene.instances;
  for (std::size_t m = 0; m < all.meshes(); ++m) {
    const std::size_t begin = all.first[m], count = all.triangles_of(m);
    const std::uint32_t material = count ? scene.material(begin) : kSeveralMaterials;
    const bool one =
        scene.material_of.empty() || std::ranges::all_of(std::span(scene.material_of).subspan(begin, count),
                                                         [&](std::uint32_t each) { return each == material; });
    all.mesh_labels[m].material = one ? material : kSeveralMaterials;
  }
}

}  // namespace

void complete_instances(Scene& scene) {
  SceneInstances& all = scene.instances;
  const bool whole = all.meshes() == 1 && all.mesh_labels.size() == 1 && all.mesh_labels[0].in_world;
  if (whole || (all.first.empty() && all.placements.empty())) all.first = {0, scene.triangles.size()};
  check_instances(scene);
  label_meshes(all, scene.name);
  check_count(scene, "meshes", all.meshes(), all.mesh_labels.size());
  if (all.placements.empty() && !all.placed) place_in_world(all);
  label_placements(all);
  check_count(scene, "placements", all.placements.size(), all.placement_labels.size());
  check_names(scene);
  number(all);
  lay_out(all);
  check_world(scene);
  all.kept = static_cast<std::size_t>(std::ranges::count(all.mesh_labels, false, &MeshLabel::in_world));
  set_materials(scene);
}

}  // namespace ballot
