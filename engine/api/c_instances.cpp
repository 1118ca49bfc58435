// Scenes of instances in the C interface: made, moved, described.
#include <cstring>
#include <limits>

#include "engine/api/arrays.h"
#include "engine/api/meshes.h"

namespace ballot::api {
namespace {

constexpr std::size_t kTransformBytes = sizeof(Transform);
constexpr std::size_t kMostInstances = std::numeric_limits<std::uint32_t>::max() - 2;  // each has a triangle at least

/// Returns matrix number i of a caller's array.
Transform transform_at(const float* transforms, std::size_t stride, std::size_t i) {
  Transform t;
  std::memcpy(&t, reinterpret_cast<const char*>(transforms) + i * stride, sizeof t);
  return t;
}

std::vector<Placement> read_instances(const BallotInstances& given) {
  if (given.count && !given.transforms)
    refuse(fmt::format("instances: transforms is NULL, but count is {}", given.count));
  if (given.count > kMostInstances)
    refuse(fmt::format("instances: count is {}; at most {} are possible", given.count, kMostInstances));
  const std::size_t stride =
      stride_of(given.transform_stride, kTransformBytes, given.count, "instances: transform_stride");
  std::vector<Placement> all(given.count);
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = {given.meshes ? given.meshes[i] : 0, transform_at(given.transforms, stride, i)};
  return all;
}

/// Returns the number of instances. Throws Refused if the scene is flat.
std::size_t instances_of(const SceneState& scene, const char* call) {
  const Scene& facts = scene.engine->scene_facts();
  if (!facts.instanced()) refuse(fmt::format("{}: the scene has no instances; make one of meshes and instances", call));
  return facts.instances.placements.size();
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
    auto state = std::make_shared<SceneState>();
    state->device = d;
    if (o.update) state->update = ballot::find_named(ballot::kUpdateModes, o.update, "update mode").id;
    std::vector<ballot::Placement> placements = read_instances(read_struct(instances, "BallotInstances"));
    ballot::Scene made = read_meshes(meshes, count, state->meshes);
    made.instances.placements = std::move(placements);
    made.instances.placed = true;
    ballot::finish_scene(made);
    const DeviceUse use(*d);
    Watch watch(o, *d, "scene");
    const Watched watched(watch);
    state->open(std::move(made), ballot::IdSource::Mesh, engine_options(*d, o, "balanced", false),
                build_progress(watch));
    *scene = scenes().add(std::move(state));
  });
}

BallotStatus ballot_scene_update_instances(BallotScene* scene, const float* transforms, size_t count, size_t stride) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (count) need(transforms, "ballot_scene_update_instances", "transforms");
    const std::size_t bytes = stride_of(stride, kTransformBytes, count, "instances: stride");
    const DeviceUse use(*state->device);
    const std::size_t size = instances_of(*state, "update of instances");
    refuse_animated(*state, "update of instances");
    if (count != size) refuse(fmt::format("instances: {} transforms, but the scene has {} instances", count, size));
    // Matrices one behind the other are taken where they lie.
    std::vector<ballot::Transform> gathered(bytes == kTransformBytes ? 0 : count);
    for (std::size_t i = 0; i < gathered.size(); ++i) gathered[i] = transform_at(transforms, bytes, i);
    std::span<const ballot::Transform> all = gathered;
    if (bytes == kTransformBytes) all = {reinterpret_cast<const ballot::Transform*>(transforms), count};
    state->engine->set_transforms(all);
  });
}

BallotStatus ballot_scene_instance(BallotScene* scene, size_t instance, BallotInstanceInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_instance", "info");
    const DeviceHold hold(*state->device);
    const std::size_t size = instances_of(*state, "instance");
    if (instance >= size) refuse(fmt::format("instance {}: the scene has {}", instance, size));
    const ballot::SceneInstances& all = state->engine->scene().instances;
    const ballot::Placement& p = all.placements[instance];
    BallotInstanceInfo i = BALLOT_INIT(BallotInstanceInfo);
    write_name(i.name, all.placement_name(instance));
    i.id = all.placement_labels[instance].node;
    i.mesh = p.mesh;
    i.first = state->places->first_of(instance);
    i.triangles = state->meshes[p.mesh].triangles;
    std::memcpy(i.transform, &p.transform, sizeof i.transform);
    if (i.triangles) {
      const ballot::Bounds bounds = moved(bounds_of(*state, p.mesh), p.transform);
      for (int axis = 0; axis < 3; ++axis) i.lo[axis] = bounds.lo[axis], i.hi[axis] = bounds.hi[axis];
    }
    write_struct(info, i, "BallotInstanceInfo");
  });
}
