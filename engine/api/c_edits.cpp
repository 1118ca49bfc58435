// Edits of a scene in the C interface: gathered, committed, dropped.
#include <cstring>

#include "engine/api/arrays.h"
#include "engine/api/edits.h"
#include "engine/api/mesh_attributes.h"
#include "engine/api/mesh_heights.h"
#include "engine/api/mesh_shapes.h"
#include "engine/api/meshes.h"
#include "engine/api/origins.h"
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

BallotMesh mesh_given(const BallotMesh* mesh, const char* call) {
  need(mesh, call, "mesh");
  return read_struct(mesh, "BallotMesh");
}

}  // namespace

PendingEdits& edits_of(SceneState& scene, const char* call, bool needs_scene, bool beside) {
  refuse_animated(scene, call);
  if (!beside && scene.pending && scene.pending->transforms_there)
    refuse(fmt::format("{}: instances are to move by an array on the device; commit that before", call));
  const Scene& now = needs_scene ? scene.world->placed_scene() : scene.world->scene_facts();
  if (!scene.pending) scene.pending = std::make_unique<PendingEdits>(now, scene.next);
  return *scene.pending;
}

const MeshState& mesh_of(const SceneState& scene, std::uint32_t mesh) {
  scene.pending->edits.mesh_index(mesh);
  const auto found = scene.pending->meshes.find(mesh);
  return found != scene.pending->meshes.end() ? found->second : scene.meshes.at(mesh);
}

BallotStatus move_mesh(BallotScene* scene, std::uint32_t mesh, const char* doing,
                       const std::function<PendingEdits::Vertices(const MeshState&)>& make) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    MovingVertices gone;
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, doing, false, true);
    PendingEdits::Vertices moving = make(mesh_of(*state, mesh));
    gone = edits.vertices.extract(mesh);
    edits.vertices.emplace(mesh, std::move(moving));
  });
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
    GivenMesh given = read_mesh(m, from, *state, own_origin(m, "mesh"), "mesh");
    check_components(*state, kNoMesh, given.state.attributes, "mesh");
    const bool by_number = m.id == kNoMesh;
    *number = edits.edits.add_mesh(std::move(given.geometry), by_number ? std::nullopt : std::optional(m.id),
                                   m.name ? std::optional<std::string>(m.name.text) : std::nullopt);
    edits.meshes.insert_or_assign(*number, std::move(given.state));
    if (given.there) edits.there.insert_or_assign(*number, std::move(given.there));
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
    const glm::dvec3 origin = mesh_of(*state, mesh).origin;
    GivenMesh given = read_mesh(m, from, *state, origin, where);
    check_components(*state, mesh, given.state.attributes, where);
    edits.edits.replace_mesh(mesh, std::move(given.geometry));
    edits.meshes.insert_or_assign(mesh, std::move(given.state));
    edits.there.erase(mesh);
    if (given.there) edits.there.emplace(mesh, std::move(given.there));
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
    edits.there.erase(mesh);
    edits.attributes.erase(mesh);
    gone = edits.vertices.extract(mesh);
  });
}

BallotStatus ballot_scene_set_vertices(BallotScene* scene, uint32_t mesh, const float* positions, size_t count,
                                       size_t stride) {
  return move_mesh(scene, mesh, "moving vertices", [&](const MeshState& m) {
    if (count) need(positions, "ballot_scene_set_vertices", "positions");
    refuse_heights(m, mesh);
    check_vertex_count(m, count, mesh);
    if (m.origin != glm::dvec3(0)) return vertices_about(m, positions, nullptr, count, stride, mesh);
    return PendingEdits::Vertices{positions, vertex_stride(stride, count, fmt::format("mesh {}: stride", mesh)), count};
  });
}

BallotStatus ballot_scene_set_heights(BallotScene* scene, uint32_t mesh, const float* heights, size_t count,
                                      size_t stride) {
  return move_mesh(scene, mesh, "moving heights", [&](const MeshState& m) {
    if (count) need(heights, "ballot_scene_set_heights", "heights");
    return moved_heights(m, heights, count, stride, mesh);
  });
}

BallotStatus ballot_scene_set_vertex_buffer(BallotScene* scene, uint32_t mesh, BallotBuffer* vertices) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const auto from = use(vertices);
    MovingVertices gone;
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "moving vertices", false, true);
    const MeshState& m = mesh_of(*state, mesh);
    refuse_heights(m, mesh);
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
    GivenInstances read = read_instances(read_struct(instances, "BallotInstances"));
    std::vector<ballot::Placement>& given = read.placements;
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "adding instances");
    for (std::size_t i = 0; i < given.size(); ++i)
      given[i].transform =
          about(read.matrices[i], mesh_of(*state, given[i].mesh).origin, state->world->scene_facts().origin);
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
    if (has_origins(*state))
      return set_transforms_about(*state, instances, count,
                                  [&](std::size_t i) { return matrix_at(transforms, bytes, i); });
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
