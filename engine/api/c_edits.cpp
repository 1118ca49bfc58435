// Edits of a scene in the C interface: gathered, committed, dropped.
#include <cstring>

#include "engine/api/arrays.h"
#include "engine/api/edits.h"
#include "engine/api/mesh_attributes.h"
#include "engine/api/mesh_shapes.h"
#include "engine/api/meshes.h"
#include "engine/model/instances.h"

namespace ballot::api {
namespace {

/// Vertices that an edit gives up. They go once the call has let go of the device: the last reference to an array on it
/// takes the device to destroy it.
using MovingVertices = std::map<std::uint32_t, PendingEdits::Vertices>::node_type;

/// Lets go of what edits have on the device of meshes while the device is held.
struct MeshesGo {
  explicit MeshesGo(std::unique_ptr<PendingEdits>& of) : edits(of) {}
  ~MeshesGo() {
    if (edits) edits->let_go();
  }
  MeshesGo(const MeshesGo&) = delete;
  MeshesGo& operator=(const MeshesGo&) = delete;
  std::unique_ptr<PendingEdits>& edits;
};

constexpr std::uint32_t kNoMesh = 0xFFFFFFFF;  // number of no mesh; as an id it stands for the number

/// Takes vertices that move into edits that change the structure.
void take_vertices(SceneState& scene, PendingEdits& edits) {
  for (const auto& [number, v] : edits.vertices) {
    const std::vector<glm::vec3> read = v.there ? read_vertices(*v.there) : std::vector<glm::vec3>();
    const DenseVertices dense(v.there ? &read.data()->x : v.positions, v.there ? sizeof(glm::vec3) : v.stride, v.count);
    check_vertices(dense.all, fmt::format("mesh {}", number));
    const auto fresh = edits.meshes.find(number);
    MeshState& mesh = fresh != edits.meshes.end() ? fresh->second : scene.meshes.at(number);
    if (mesh.kind != ShapeKind::Triangles) {
      std::vector<ballot::Shape> shapes = shapes_at(mesh, dense.all, fmt::format("mesh {}", number));
      std::vector<Triangle> boxes = stand_ins(mesh.kind, shapes);
      edits.edits.move_mesh(number, std::move(boxes), std::move(shapes));
      continue;
    }
    std::vector<Triangle> triangles(mesh.triangles);
    expand(indices_of(mesh), dense.all, triangles);
    edits.edits.move_mesh(number, std::move(triangles));
  }
}

/// Gives meshes that move, and lie in one tree with others of several trees, their own. Shapes move as another mesh
/// would take their place.
void separate_moved(const SceneState& scene, PendingEdits& edits) {
  if (!scene.world->forest() || edits.vertices.empty()) return;
  const TreeLayout layout = tree_layout(scene.world->scene_facts());
  for (const auto& [number, v] : edits.vertices)
    if (const auto mesh = edits.edits.mesh_index(number);
        mesh && (layout.shares(*mesh) || scene.meshes.at(number).kind != ShapeKind::Triangles)) {
      scene.world->scene();
      edits.edits.separate_mesh(number);
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

/// Commits edits that move meshes and instances. `masks`: of all instances; none: they stay.
void commit_moves(SceneState& scene, PendingEdits& edits, std::span<const std::uint32_t> masks) {
  const SceneInstances& all = scene.world->scene_facts().instances;
  std::vector<DenseVertices> dense;
  std::vector<MovedVertices> moved;
  dense.reserve(edits.vertices.size());
  for (const auto& [number, v] : edits.vertices) {
    const std::size_t mesh = *edits.edits.mesh_index(number);
    MovedVertices& m = moved.emplace_back();
    m = {all.first[mesh], all.triangles_of(mesh), {}, {}, mesh, number, v.there};
    MeshState& state = scene.meshes.at(number);
    if (state.indices_there && scene.world->reads_vertices_there(mesh))
      m.corners_there = state.indices_there;
    else
      m.corners = indices_of(state);
    if (!v.there) m.positions = dense.emplace_back(v.positions, v.stride, v.count).all;
  }
  const bool there = edits.transforms_there && edits.edits.transforms().empty();
  SceneChange change{.vertices = moved,
                     .transforms = there ? MovedTransforms(edits.transforms_there) : edits.edits.transforms(),
                     .masks = masks};
  scene.world->commit(change, scene.update);
  for (const auto& [number, v] : edits.vertices) scene.meshes.at(number).bounds.reset();
}

/// Commits edits that change the structure.
void commit_structure(SceneState& scene, PendingEdits& edits) {
  scene.world->scene();
  take_vertices(scene, edits);
  SceneChange change{.structure = edits.edits.structure()};
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
  for (const auto& [number, v] : edits.vertices) scene.meshes.at(number).bounds.reset();
}

/// Returns true if the edits are of attributes alone.
bool are_attributes(const PendingEdits& edits) {
  return !edits.attributes.empty() && edits.meshes.empty() && edits.vertices.empty() && !edits.transforms_there &&
         !edits.masks_there && !edits.edits.changes_instances();
}

/// Makes edits of meshes and instances true.
void commit_scene(SceneState& scene, PendingEdits& edits) {
  separate_moved(scene, edits);
  const std::vector<std::uint32_t> masks = read_masks(edits);
  if (!masks.empty() && edits.edits.hides_or_shows(masks)) {
    scene.world->scene();
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

/// Makes `edits` true, which were the scene's: they are gone, whatever follows.
void commit(SceneState& scene, PendingEdits& edits) {
  if (!are_attributes(edits)) commit_scene(scene, edits);
  take_attributes(scene, edits);
}

/// Throws Error(Arguments) unless there is an instance for each number, and each is named once.
void check_numbers(const SceneEdits& edits, std::span<const std::uint32_t> instances) {
  for (const std::uint32_t number : instances) edits.check_placement(number);
  std::vector<std::uint32_t> sorted(instances.begin(), instances.end());
  std::ranges::sort(sorted);
  const auto twice = std::ranges::adjacent_find(sorted);
  if (twice != sorted.end()) refuse(fmt::format("instance {}: it is named twice in one call; expected once", *twice));
}

BallotMesh mesh_given(const BallotMesh* mesh, const char* call) {
  need(mesh, call, "mesh");
  return read_struct(mesh, "BallotMesh");
}

}  // namespace

PendingEdits& edits_of(SceneState& scene, const char* call, bool needs_scene, bool beside) {
  refuse_animated(scene, call);
  if (!beside && scene.pending && scene.pending->transforms_there)
    refuse(fmt::format("{}: instances are to move by an array on the device; commit that before", call));
  const Scene& now = needs_scene ? scene.world->scene() : scene.world->scene_facts();
  if (!scene.pending) scene.pending = std::make_unique<PendingEdits>(now, scene.next);
  return *scene.pending;
}

const MeshState& mesh_of(const SceneState& scene, std::uint32_t mesh) {
  scene.pending->edits.mesh_index(mesh);
  const auto found = scene.pending->meshes.find(mesh);
  return found != scene.pending->meshes.end() ? found->second : scene.meshes.at(mesh);
}

}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_scene_add_mesh(BallotScene* scene, const BallotMesh* mesh, uint32_t* number) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(number, "ballot_scene_add_mesh", "number");
    const BallotMesh m = mesh_given(mesh, "ballot_scene_add_mesh");
    const MeshBuffers from(m, "mesh");
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "adding a mesh");
    GivenMesh given = read_mesh(m, from, *state, "mesh");
    check_components(*state, kNoMesh, given.state.attributes, "mesh");
    const bool by_number = m.id == kNoMesh;
    *number = edits.edits.add_mesh(std::move(given.geometry), by_number ? std::nullopt : std::optional(m.id),
                                   m.name ? std::optional<std::string>(m.name.text) : std::nullopt);
    edits.meshes.insert_or_assign(*number, std::move(given.state));
  });
}

BallotStatus ballot_scene_replace_mesh(BallotScene* scene, uint32_t mesh, const BallotMesh* with) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const BallotMesh m = mesh_given(with, "ballot_scene_replace_mesh");
    const std::string where = fmt::format("mesh {}", mesh);
    const MeshBuffers from(m, where);
    MovingVertices gone;
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "replacing a mesh");
    edits.edits.mesh_index(mesh);
    GivenMesh given = read_mesh(m, from, *state, where);
    check_components(*state, mesh, given.state.attributes, where);
    edits.edits.replace_mesh(mesh, std::move(given.geometry));
    edits.meshes.insert_or_assign(mesh, std::move(given.state));
    edits.attributes.erase(mesh);
    gone = edits.vertices.extract(mesh);
  });
}

BallotStatus ballot_scene_remove_mesh(BallotScene* scene, uint32_t mesh) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    MovingVertices gone;
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "removing a mesh");
    edits.edits.remove_mesh(mesh);
    edits.meshes.erase(mesh);
    edits.attributes.erase(mesh);
    gone = edits.vertices.extract(mesh);
  });
}

BallotStatus ballot_scene_set_vertices(BallotScene* scene, uint32_t mesh, const float* positions, size_t count,
                                       size_t stride) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (count) need(positions, "ballot_scene_set_vertices", "positions");
    MovingVertices gone;
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "moving vertices", false, true);
    const MeshState& m = mesh_of(*state, mesh);
    if (count != m.vertices)
      refuse(fmt::format("mesh {}: {} vertices, but the mesh was made with {}; replace the mesh by another", mesh,
                         count, m.vertices));
    const std::size_t bytes = vertex_stride(stride, count, fmt::format("mesh {}: stride", mesh));
    gone = edits.vertices.extract(mesh);
    edits.vertices.emplace(mesh, PendingEdits::Vertices{positions, bytes, count});
  });
}

BallotStatus ballot_scene_set_vertex_buffer(BallotScene* scene, uint32_t mesh, BallotBuffer* vertices) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const auto from = use(vertices);
    MovingVertices gone;
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "moving vertices", false, true);
    const MeshState& m = mesh_of(*state, mesh);
    const std::string where = fmt::format("mesh {}", mesh);
    array_of<glm::vec3>(*from, *state, m.vertices, where.c_str(), "vertices");
    const ballot::DeviceVertices there{.buffer = {from, &from->raw()}, .count = m.vertices};
    check_there(there, *state->device->gpu, where);
    gone = edits.vertices.extract(mesh);
    edits.vertices.emplace(mesh, PendingEdits::Vertices{.count = m.vertices, .there = there});
  });
}

BallotStatus ballot_scene_add_instances(BallotScene* scene, const BallotInstances* instances, uint32_t* numbers) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(instances, "ballot_scene_add_instances", "instances");
    const std::vector<ballot::Placement> given = read_instances(read_struct(instances, "BallotInstances"));
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "adding instances");
    for (const ballot::Placement& p : given) edits.edits.mesh_index(p.mesh);
    for (std::size_t i = 0; i < given.size(); ++i) {
      const std::uint32_t number = edits.edits.add_placement(given[i]);
      if (numbers) numbers[i] = number;
    }
  });
}

BallotStatus ballot_scene_remove_instances(BallotScene* scene, const uint32_t* instances, size_t count) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (count) need(instances, "ballot_scene_remove_instances", "instances");
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "removing instances");
    const std::span<const std::uint32_t> all(instances, count);
    check_numbers(edits.edits, all);
    for (const std::uint32_t number : all) edits.edits.remove_placement(number);
  });
}

BallotStatus ballot_scene_set_transforms(BallotScene* scene, const uint32_t* instances, const float* transforms,
                                         size_t count, size_t stride) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (count) need(transforms, "ballot_scene_set_transforms", "transforms");
    const std::size_t bytes = stride_of(stride, sizeof(ballot::Transform), count, "transforms: stride");
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "moving instances", instances != nullptr);
    const auto at = [&](std::size_t i) {
      ballot::Transform t;
      std::memcpy(&t, reinterpret_cast<const char*>(transforms) + i * bytes, sizeof t);
      return t;
    };
    if (instances) {
      const std::span<const std::uint32_t> all(instances, count);
      check_numbers(edits.edits, all);
      for (std::size_t i = 0; i < count; ++i) edits.edits.set_transform(all[i], at(i));
      return;
    }
    std::span<const ballot::Transform> all{reinterpret_cast<const ballot::Transform*>(transforms), count};
    if (bytes == sizeof(ballot::Transform)) {
      edits.edits.set_transforms(all);
      return;
    }
    std::vector<ballot::Transform> gathered;
    for (std::size_t i = 0; i < count; ++i) gathered.push_back(at(i));
    edits.edits.set_transforms(gathered);
    edits.transforms = std::move(gathered);  // whose memory stays
  });
}

BallotStatus ballot_scene_set_transform_buffer(BallotScene* scene, BallotBuffer* transforms) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const auto from = use(transforms);
    std::shared_ptr<const ballot::RawBuffer> gone;  // as MovingVertices
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "moving instances", false, true);
    array_of<ballot::Transform>(*from, *state, edits.edits.placement_count(), "moving instances", "transforms");
    if (edits.edits.changes_instances())
      refuse(
          "moving instances by an array on the device: other edits of meshes or instances are to be made; commit "
          "those before");
    gone = std::exchange(edits.transforms_there, {from, &from->raw()});
  });
}

BallotStatus ballot_scene_set_masks(BallotScene* scene, const uint32_t* instances, const uint32_t* masks,
                                    size_t count) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (count) need(instances, "ballot_scene_set_masks", "instances");
    if (count) need(masks, "ballot_scene_set_masks", "masks");
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "setting masks");
    check_numbers(edits.edits, {instances, count});
    for (std::size_t i = 0; i < count; ++i) edits.edits.set_mask(instances[i], masks[i]);
  });
}

BallotStatus ballot_scene_set_groups(BallotScene* scene, const uint32_t* instances, const uint32_t* groups,
                                     size_t count) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (count) need(instances, "ballot_scene_set_groups", "instances");
    if (count) need(groups, "ballot_scene_set_groups", "groups");
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "setting groups");
    check_numbers(edits.edits, {instances, count});
    for (std::size_t i = 0; i < count; ++i) edits.edits.set_group(instances[i], groups[i]);
  });
}

BallotStatus ballot_scene_set_mask_buffer(BallotScene* scene, BallotBuffer* masks) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const auto from = use(masks);
    std::shared_ptr<const ballot::RawBuffer> gone;  // as MovingVertices
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "setting masks", false, true);
    array_of<std::uint32_t>(*from, *state, edits.edits.placement_count(), "setting masks", "masks");
    gone = std::exchange(edits.masks_there, {from, &from->raw()});
  });
}

BallotStatus ballot_scene_commit(BallotScene* scene) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    std::unique_ptr<PendingEdits> edits;
    const DeviceUse use(*state->device);
    edits.swap(state->pending);
    const MeshesGo go(edits);
    if (edits) commit(*state, *edits);
  });
}

BallotStatus ballot_scene_discard(BallotScene* scene) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    std::unique_ptr<PendingEdits> edits;
    const DeviceUse use(*state->device);
    edits.swap(state->pending);
    const MeshesGo go(edits);
  });
}
