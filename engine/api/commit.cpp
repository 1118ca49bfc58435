// Edits of a scene become true.
#include "engine/api/edits.h"
#include "engine/api/in_double.h"
#include "engine/api/mesh_attributes.h"
#include "engine/api/mesh_shapes.h"
#include "engine/api/meshes.h"
#include "engine/model/instances.h"

namespace ballot::api {
namespace {

/// Takes vertices that move into edits that change the structure.
void take_vertices(SceneState& scene, PendingEdits& edits) {
  for (const auto& [number, v] : edits.vertices) {
    const std::string where = fmt::format("mesh {}", number);
    const auto fresh = edits.meshes.find(number);
    MeshState& mesh = fresh != edits.meshes.end() ? fresh->second : scene.meshes.at(number);
    edits.there.erase(number);
    if (v.there && mesh.kind == ShapeKind::Triangles) {
      edits.edits.move_mesh(number, {.elsewhere = mesh.triangles});
      edits.there.emplace(number, move_there(mesh, *v.there, scene, where));
      continue;
    }
    const std::vector<glm::vec3> read = v.there ? read_vertices(*v.there) : std::vector<glm::vec3>();
    const DenseVertices dense(v.there ? &read.data()->x : v.positions, v.there ? sizeof(glm::vec3) : v.stride, v.count);
    check_vertices(dense.all, where);
    MeshGeometry moved;
    if (mesh.kind != ShapeKind::Triangles) {
      moved.shapes = shapes_at(mesh, dense.all, where);
      moved.triangles = stand_ins(mesh.kind, moved.shapes);
    } else {
      moved.triangles.resize(mesh.triangles);
      expand(v.heights ? corners_of(*v.heights) : indices_of(mesh).all, dense.all, moved.triangles);
    }
    edits.edits.move_mesh(number, std::move(moved));
  }
}

/// Has the host have the triangles of meshes that the device has made: flat normals are made of them.
void bring_made(PendingEdits& edits) {
  for (const auto& [number, there] : edits.there) {
    MeshGeometry mesh;
    bring_triangles(mesh, *there);
    edits.edits.move_mesh(number, std::move(mesh));
  }
  edits.there.clear();
}

/// Gives meshes that move, and lie in one tree with others of several trees, their own. Shapes move as another mesh
/// would take their place.
void separate_moved(const SceneState& scene, PendingEdits& edits) {
  if (!scene.world->forest() || edits.vertices.empty()) return;
  const TreeLayout layout = tree_layout(scene.world->scene_facts());
  for (const auto& [number, v] : edits.vertices)
    if (const auto mesh = edits.edits.mesh_index(number);
        mesh && (layout.shares(*mesh) || scene.meshes.at(number).kind != ShapeKind::Triangles)) {
      scene.world->placed_scene();
      edits.edits.separate_mesh(number);
    }
}

/// Has the structure change if other samples of heights are missing than before.
void touch_holes(const SceneState& scene, PendingEdits& edits) {
  for (const auto& [number, v] : edits.vertices)
    if (v.heights && edits.edits.mesh_index(number) && !have_same_holes(*v.heights, *scene.meshes.at(number).heights)) {
      scene.world->placed_scene();
      edits.edits.touch_mesh(number);
    }
}

/// Returns the masks that an array on the device sets; none: there is no such array.
std::vector<std::uint32_t> read_masks(const PendingEdits& edits) {
  if (!edits.masks_there) return {};
  std::vector<std::uint32_t> masks(edits.edits.placement_count());
  const std::size_t records = edits.masks_there->bytes() / sizeof masks[0];
  if (records < masks.size())
    refuse(
        fmt::format("setting masks: the buffer of masks has {} records, but the edits make {} instances; expected "
                    "one for each",
                    records, masks.size()));
  edits.masks_there->download(0, masks.data(), masks.size() * sizeof masks[0]);
  return masks;
}

/// Tells meshes that their vertices have moved.
void end_vertices(SceneState& scene, const PendingEdits& edits) {
  for (const auto& [number, v] : edits.vertices) {
    MeshState& mesh = scene.meshes.at(number);
    mesh.bounds.reset();
    mesh.rounding = v.rounding, mesh.in_double = v.in_double;
    if (v.heights) mesh.heights = v.heights;
  }
}

/// Commits edits that move meshes and instances. `masks`: of all instances; none: they stay.
void commit_moves(SceneState& scene, PendingEdits& edits, std::span<const std::uint32_t> masks) {
  const SceneInstances& all = scene.world->scene_facts().instances;
  std::vector<DenseVertices> dense;
  std::vector<MeshIndices> indices;
  std::vector<MovedVertices> moved;
  dense.reserve(edits.vertices.size()), indices.reserve(edits.vertices.size());
  for (const auto& [number, v] : edits.vertices) {
    const std::size_t mesh = *edits.edits.mesh_index(number);
    MovedVertices& m = moved.emplace_back();
    m = {all.first[mesh], all.triangles_of(mesh), {}, {}, mesh, number, v.there};
    MeshState& state = scene.meshes.at(number);
    if (state.indices_there && scene.world->reads_vertices_there(mesh))
      m.corners_there = state.indices_there;
    else
      m.corners = indices.emplace_back(indices_of(state)).all;
    if (!v.there) m.positions = dense.emplace_back(v.positions, v.stride, v.count).all;
  }
  const bool there = edits.transforms_there && edits.edits.transforms().empty();
  SceneChange change{.vertices = moved,
                     .transforms = there ? MovedTransforms(edits.transforms_there) : edits.edits.transforms(),
                     .masks = masks};
  scene.world->commit(change, scene.update);
  end_vertices(scene, edits);
}

/// Commits edits that change the structure.
void commit_structure(SceneState& scene, PendingEdits& edits) {
  scene.world->placed_scene();
  take_vertices(scene, edits);
  const bool has_normals = edits.edits.has_normals();
  if (has_normals) scene.world->scene(), bring_made(edits);
  SceneChange change{.structure = edits.edits.structure(scene.world->meshes_there()), .there = std::move(edits.there)};
  check_triangle_count(change.structure->instances.first.back(), "commit");
  scene.world->commit(change, scene.update);
  const Scene& now = scene.world->scene_facts();
  scene.places.emplace(now, scene.ids);
  scene.there.reset();
  std::map<std::uint32_t, MeshState> meshes;
  for (const MeshLabel& label : now.instances.mesh_labels) {
    auto fresh = edits.meshes.extract(label.number);
    meshes.insert(fresh ? std::move(fresh) : scene.meshes.extract(label.number));
  }
  scene.meshes = std::move(meshes);
  end_vertices(scene, edits);
}

/// Returns true if the edits are of attributes alone.
bool are_attributes(const PendingEdits& edits) {
  return !edits.attributes.empty() && edits.meshes.empty() && edits.vertices.empty() && !edits.transforms_there &&
         !edits.masks_there && !edits.edits.changes_instances();
}

/// Makes edits of meshes and instances true.
void commit_scene(SceneState& scene, PendingEdits& edits) {
  separate_moved(scene, edits);
  touch_holes(scene, edits);
  const std::vector<std::uint32_t> masks = read_masks(edits);
  if (!masks.empty() && edits.edits.hides_or_shows(masks)) {
    scene.world->placed_scene();
    edits.edits.set_masks(masks);
  }
  std::vector<ballot::Transform> read;
  if (edits.transforms_there && (edits.edits.changes_instances() || !scene.world->reads_transforms_there())) {
    read = read_transforms(*edits.transforms_there, edits.edits.placement_count());
    edits.edits.set_transforms(read);
  }
  if (edits.edits.changes_structure())
    commit_structure(scene, edits);
  else
    commit_moves(scene, edits, masks);
  scene.refits = scene.world->last_update().refitted ? scene.refits + 1 : 0;
}

/// Has trees keep triangles that float32 rounds flat, if there are some in a mesh that edits bring or move.
void keep_flat_triangles(SceneState& scene, PendingEdits& edits) {
  const auto flat = [&](auto& edited) { return rounds_flat(edited.second, edited.second.in_double); };
  const auto moved_flat = [&](const auto& moved) {
    const auto mesh = scene.meshes.find(moved.first);
    return mesh != scene.meshes.end() && rounds_flat(mesh->second, moved.second.in_double);
  };
  if (std::ranges::any_of(edits.meshes, flat) || std::ranges::any_of(edits.vertices, moved_flat))
    scene.world->keep_flat();
}

}  // namespace

void commit(SceneState& scene, PendingEdits& edits) {
  forget_doubles(scene);
  keep_flat_triangles(scene, edits);
  if (!are_attributes(edits)) commit_scene(scene, edits);
  take_attributes(scene, edits);
}

}  // namespace ballot::api
