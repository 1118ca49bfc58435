// Edits of a scene in double, and those of scenes with origins.
#include "engine/api/edits.h"
#include "engine/api/mesh_heights.h"

namespace ballot::api {

void check_numbers(const SceneEdits& edits, std::span<const std::uint32_t> instances) {
  for (const std::uint32_t number : instances) edits.check_placement(number);
  std::vector<std::uint32_t> sorted(instances.begin(), instances.end());
  std::ranges::sort(sorted);
  const auto twice = std::ranges::adjacent_find(sorted);
  if (twice != sorted.end()) refuse(fmt::format("instance {}: it is named twice in one call; expected once", *twice));
}

void check_vertex_count(const MeshState& mesh, std::size_t count, std::uint32_t number) {
  if (count != mesh.vertices)
    refuse(fmt::format("mesh {}: {} vertices, but the mesh was made with {}; replace the mesh by another", number,
                       count, mesh.vertices));
}

PendingEdits::Vertices vertices_about(const MeshState& mesh, const float* positions, const double* in_double,
                                      std::size_t count, std::size_t stride, std::uint32_t number) {
  RoundedVertices read =
      round_vertices(positions, in_double, count, stride, mesh.origin, fmt::format("mesh {}", number));
  PendingEdits::Vertices moving{nullptr, sizeof(glm::vec3), count};
  moving.own = std::move(read.vertices.gathered);
  if (!moving.own.empty()) moving.positions = &moving.own.data()->x;
  moving.rounding = read.moved, moving.in_double = std::move(read.in_double);
  return moving;
}

bool has_origins(const SceneState& scene) {
  const auto has = [](const auto& mesh) { return mesh.second.origin != glm::dvec3(0); };
  return scene.world->scene_facts().origin != glm::dvec3(0) || std::ranges::any_of(scene.meshes, has) ||
         (scene.pending && std::ranges::any_of(scene.pending->meshes, has));
}

void set_transforms_about(SceneState& scene, const std::uint32_t* instances, std::size_t count,
                          const std::function<MatrixInDouble(std::size_t)>& matrix) {
  PendingEdits& edits = *scene.pending;
  const std::map<std::uint32_t, std::uint32_t> meshes = edits.edits.meshes_of_placements();
  const auto at = [&](std::size_t i, std::uint32_t mesh) {
    return about(matrix(i), mesh_of(scene, mesh).origin, scene.world->scene_facts().origin);
  };
  if (instances) {
    check_numbers(edits.edits, {instances, count});
    for (std::size_t i = 0; i < count; ++i) edits.edits.set_transform(instances[i], at(i, meshes.at(instances[i])));
    return;
  }
  std::vector<Transform> all;
  for (const auto& [number, mesh] : meshes)
    if (all.size() < count) all.push_back(at(all.size(), mesh));
  all.resize(count);  // if there are too many, which is refused
  edits.edits.set_transforms(all);
  edits.transforms = std::move(all);  // whose memory stays
}

}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_scene_set_vertices_double(BallotScene* scene, uint32_t mesh, const double* positions, size_t count,
                                              size_t stride) {
  return move_mesh(scene, mesh, "moving vertices", [&](const MeshState& m) {
    if (count) need(positions, "ballot_scene_set_vertices_double", "positions");
    refuse_heights(m, mesh);
    check_vertex_count(m, count, mesh);
    return vertices_about(m, nullptr, positions, count, stride, mesh);
  });
}

BallotStatus ballot_scene_set_transforms_double(BallotScene* scene, const uint32_t* instances, const double* transforms,
                                                size_t count, size_t stride) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (count) need(transforms, "ballot_scene_set_transforms_double", "transforms");
    const std::size_t bytes = stride_of(stride, sizeof(MatrixInDouble), count, "transforms: stride");
    const DeviceUse use(*state->device);
    edits_of(*state, "moving instances", instances != nullptr);
    set_transforms_about(*state, instances, count, [&](std::size_t i) { return matrix_at(transforms, bytes, i); });
  });
}
