// Scenes of instances in the C interface: made, moved, described.
#include <cstring>

#include "engine/api/meshes.h"
#include "engine/tree/build/device_build.h"

namespace ballot::api {
namespace {

constexpr std::size_t kTransformBytes = sizeof(Transform);

/// Returns matrix number i of a caller's array.
Transform transform_at(const float* transforms, std::size_t stride, std::size_t i) {
  Transform t;
  std::memcpy(&t, reinterpret_cast<const char*>(transforms) + i * stride, sizeof t);
  return t;
}

std::size_t transform_stride(std::size_t given, const char* where) {
  if (given == 0) return kTransformBytes;
  if (given < kTransformBytes || given % sizeof(float))
    refuse(fmt::format("{} is {} bytes; expected a multiple of 4, at least {}, or 0 for {}", where, given,
                       kTransformBytes, kTransformBytes));
  return given;
}

std::vector<Placement> read_instances(const BallotInstances& given) {
  if (given.count && !given.transforms)
    refuse(fmt::format("instances: transforms is NULL, but count is {}", given.count));
  const std::size_t stride = transform_stride(given.transform_stride, "instances: transform_stride");
  std::vector<Placement> all(given.count);
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = {given.meshes ? given.meshes[i] : 0, transform_at(given.transforms, stride, i)};
  return all;
}

/// Returns the builder of the trees of meshes.
Forest::BuildMesh builder_of_meshes(Context& gpu, const BuildSettings& settings) {
  if (!builder_of(settings.builder).on_device)
    return [=](std::span<const Triangle> triangles) { return build_bvh(triangles, settings); };
  return [&gpu, settings](std::span<const Triangle> triangles) { return DeviceBuild(gpu, triangles, settings).bvh(); };
}

InstanceScene& instances_of(const SceneState& scene, const char* call) {
  if (!scene.instanced)
    refuse(fmt::format("{}: the scene has no instances; make it with ballot_scene_create_instances()", call));
  return *scene.instanced;
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_scene_create_instances(BallotDevice* device, const BallotMesh* meshes, size_t count,
                                           const BallotInstances* instances, const BallotSceneOptions* options,
                                           BallotScene** scene) {
  return guarded_use(device, [&](const std::shared_ptr<DeviceState>& d) {
    need(scene, "ballot_scene_create_instances", "scene");
    need(instances, "ballot_scene_create_instances", "instances");
    if (count) need(meshes, "ballot_scene_create_instances", "meshes");
    const BallotSceneOptions o = read_struct(options, "BallotSceneOptions");
    const std::vector<ballot::Placement> placements = read_instances(read_struct(instances, "BallotInstances"));
    auto state = std::make_shared<SceneState>();
    state->device = d;
    std::vector<std::vector<ballot::Triangle>> triangles;
    std::size_t first = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string where = fmt::format("mesh {}", i);
      const BallotMesh m = mesh_struct(meshes, i);
      const MeshState& mesh = state->meshes.emplace_back(read_mesh(m, first, where));
      first += mesh.triangles;
      const std::size_t stride = stride_of(m.position_stride, where + ": position_stride");
      check_vertices(m.positions, stride, m.vertex_count, where);
      gather(mesh, m.positions, stride, triangles.emplace_back(mesh.triangles).data());
    }
    const DeviceUse use(*d);
    const ballot::BuildSettings settings = engine_options(*d, o, "balanced", false).build;
    state->instanced = std::make_unique<InstanceScene>(*d->gpu, std::move(triangles), placements,
                                                       builder_of_meshes(*d->gpu, settings));
    *scene = scenes().add(std::move(state));
  });
}

BallotStatus ballot_scene_update_instances(BallotScene* scene, const float* transforms, size_t count, size_t stride) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (count) need(transforms, "ballot_scene_update_instances", "transforms");
    const std::size_t bytes = transform_stride(stride, "ballot_scene_update_instances: stride");
    // Matrices one behind the other are taken where they lie.
    std::vector<ballot::Transform> gathered(bytes == kTransformBytes ? 0 : count);
    for (std::size_t i = 0; i < gathered.size(); ++i) gathered[i] = transform_at(transforms, bytes, i);
    std::span<const ballot::Transform> all = gathered;
    if (bytes == kTransformBytes) all = {reinterpret_cast<const ballot::Transform*>(transforms), count};
    const DeviceUse use(*state->device);
    InstanceScene& of = instances_of(*state, "ballot_scene_update_instances");
    of.tracer.move_instances(all);
  });
}

BallotStatus ballot_scene_instance(BallotScene* scene, size_t instance, BallotInstanceInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_instance", "info");
    const std::lock_guard lock(state->device->mutex);
    const ballot::Forest& forest = instances_of(*state, "ballot_scene_instance").forest;
    if (instance >= forest.size())
      refuse(fmt::format("ballot_scene_instance: instance {}, but the scene has {}", instance, forest.size()));
    BallotInstanceInfo i = BALLOT_INIT(BallotInstanceInfo);
    i.mesh = forest.mesh_of(instance);
    i.first = forest.first_of(instance);
    i.triangles = forest.meshes()[i.mesh].triangles.size();
    std::memcpy(i.transform, &forest.transforms()[instance], sizeof i.transform);
    write_struct(info, i, "BallotInstanceInfo");
  });
}
