// Scenes of the C interface: made of meshes in memory, loaded, moved, described.
#include <cstring>

#include "engine/api/arrays.h"
#include "engine/api/in_double.h"
#include "engine/api/meshes.h"
#include "engine/api/origins.h"
#include "engine/model/instances.h"

namespace ballot::api {
namespace {

/// Returns the options of a scene that is made or loaded, in a state of its device.
std::shared_ptr<SceneState> new_state(const std::shared_ptr<DeviceState>& device, const BallotSceneOptions& o) {
  auto state = std::make_shared<SceneState>();
  state->device = device;
  if (o.updates) state->update = find_named(kUpdateModes, o.updates.text, "update mode").id;
  state->ids = find_named(kIdSources, o.ids ? std::string_view(o.ids.text) : kDefaultIdSource, "source of ids").id;
  return state;
}

Layout layout_of(const BallotSceneOptions& o) {
  return find_named(kLayouts, o.layout ? std::string_view(o.layout.text) : kDefaultLayout, "layout").id;
}

/// Places the meshes of a scene and finishes it. Bounds of what does not stay in place are found on the host.
void finish(GivenScene& made, std::vector<Placement> placements, bool placed, Layout layout) {
  if (!std::ranges::all_of(placements, is_identity, &Placement::transform)) bring_triangles(made);
  SceneInstances& all = made.scene.instances;
  all.placements = std::move(placements);
  all.placed = placed;
  all.layout = layout;
  std::vector<Bounds> bounds;
  if (made.there && !made.there->on_host)
    for (const MeshExtents& mesh : made.there->meshes) bounds.push_back(mesh.bounds);
  finish_scene(made.scene, bounds);
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_scene_create(BallotDevice* device, const BallotMesh* meshes, size_t count,
                                 const BallotInstances* instances, const BallotSceneOptions* options,
                                 BallotScene** scene) {
  return guarded_use(device, [&](const std::shared_ptr<DeviceState>& d) {
    need(scene, "ballot_scene_create", "scene");
    if (count) need(meshes, "ballot_scene_create", "meshes");
    check_mesh_count(meshes, count);
    const BallotSceneOptions o = read_struct(options, "BallotSceneOptions");
    const auto state = new_state(d, o);
    if (state->ids != ballot::IdSource::Mesh)
      refuse(fmt::format("ids is '{}': meshes in memory have ids of their own (BallotMesh::id); expected NULL",
                         o.ids.text));
    GivenInstances placed;
    if (instances) placed = read_instances(read_struct(instances, "BallotInstances"));
    std::vector<MeshBuffers> from;
    for (std::size_t i = 0; i < count; ++i) from.emplace_back(mesh_struct(meshes, i), fmt::format("mesh {}", i));
    Watch watch(o, *d, "scene");
    const Watched watched(watch);
    std::optional<DeviceUse> use;
    if (std::ranges::any_of(from, &MeshBuffers::needs_device)) use.emplace(*d);
    const Origins origins = find_origins(meshes, count, instances ? &placed : nullptr, o.origin);
    GivenScene made = read_meshes(meshes, from, origins, *state);
    for (std::size_t i = 0; i < placed.placements.size(); ++i)
      if (ballot::Placement& p = placed.placements[i]; p.mesh < count)
        p.transform = about(placed.matrices[i], origins.meshes[p.mesh], origins.scene);
    finish(made, std::move(placed.placements), instances != nullptr, layout_of(o));
    if (!use) use.emplace(*d);
    ballot::DeviceSceneOptions how = scene_options(*d, o, "auto", o.cache != 0);
    how.triangles = std::move(made.there);
    how.build.keeps_flat =
        std::ranges::any_of(state->meshes, [](auto& mesh) { return rounds_flat(mesh.second, mesh.second.in_double); });
    state->open(std::move(made.scene), how, build_progress(watch));
    *scene = scenes().add(state);
  });
}

BallotStatus ballot_scene_load(BallotDevice* device, const char* path, const BallotSceneOptions* options,
                               BallotScene** scene) {
  return guarded_use(device, [&](const std::shared_ptr<DeviceState>& d) {
    need(scene, "ballot_scene_load", "scene");
    need(path, "ballot_scene_load", "path");
    const BallotSceneOptions o = read_struct(options, "BallotSceneOptions");
    const auto state = new_state(d, o);
    if (std::ranges::any_of(o.origin, [](double x) { return x != 0; }))
      refuse(fmt::format("ballot_scene_load: origin is ({}, {}, {}); expected none: files find their own", o.origin[0],
                         o.origin[1], o.origin[2]));
    ballot::LoadOptions load{.allow_outside = o.allow_outside != 0, .layout = layout_of(o), .radius = o.radius};
    if (o.shapes) load.shapes = &ballot::find_named(ballot::kShapes, o.shapes.text, "kind of shapes");
    load.spacing = {o.spacing[0], o.spacing[1]};
    if (o.instances) load.instances = ballot::find_named(ballot::kInstancePolicies, o.instances.text, "instances").id;
    ballot::Scene loaded = ballot::load_scene(path, load);
    for (std::size_t m = 0; m < loaded.instances.meshes(); ++m)
      state->meshes.emplace(static_cast<std::uint32_t>(m), state_of_file(loaded, m));
    const DeviceUse use(*d);
    Watch watch(o, *d, "scene");
    const Watched watched(watch);
    watch(0);
    state->open(std::move(loaded), scene_options(*d, o, "best", !options || o.cache), build_progress(watch));
    *scene = scenes().add(state);
  });
}

BallotStatus ballot_scene_info(BallotScene* scene, BallotSceneInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_info", "info");
    const DeviceHold hold(*state->device);
    const ballot::DeviceScene& world = *state->world;
    const ballot::Forest* forest = world.forest();
    const ballot::BvhStats& s = world.bvh_stats();
    const bool stays = !forest && !world.scene_facts().animation;  // bounds are true without the triangles
    const ballot::Bounds& bounds = (stays ? world.scene_facts() : world.scene()).bounds;
    BallotSceneInfo i = BALLOT_INIT(BallotSceneInfo);
    i.triangles = world.scene_facts().triangles.size();
    i.degenerate = s.degenerate;
    i.meshes = world.scene_facts().instances.meshes();
    i.views = world.scene_facts().views.size();
    i.instances = world.scene_facts().instances.placements.size();
    i.instance_triangles = world.triangle_count();
    if (forest) i.trees = forest->meshes().size(), i.top_seconds = forest->top_facts().build_s;
    for (int axis = 0; axis < 3; ++axis) i.lo[axis] = bounds.lo[axis], i.hi[axis] = bounds.hi[axis];
    i.nodes = s.nodes, i.leaves = s.leaves, i.depth = s.depth;
    i.sah = s.sah;
    i.build_seconds = forest ? s.build_s : world.refit_policy().build_s();
    i.decay = forest ? 1 : world.refit_policy().decay();
    i.update_seconds = world.last_update().seconds;
    i.refits = state->refits;
    for (int axis = 0; axis < 3; ++axis) i.origin[axis] = world.scene_facts().origin[axis];
    write_struct(info, i, "BallotSceneInfo");
  });
}

BallotStatus ballot_scene_mesh(BallotScene* scene, size_t place, BallotMeshInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_mesh", "info");
    const DeviceHold hold(*state->device);
    const ballot::SceneInstances& all = state->world->scene_facts().instances;
    if (place >= all.meshes()) refuse(fmt::format("mesh at place {}: the scene has {}", place, all.meshes()));
    const ballot::Bounds bounds = bounds_of(*state, place);
    BallotMeshInfo i = BALLOT_INIT(BallotMeshInfo);
    write_name(i.name, all.mesh_name(place));
    i.id = all.mesh_labels[place].id;
    i.mesh = all.mesh_labels[place].number;
    i.first = all.first[place], i.triangles = all.triangles_of(place);
    const MeshState& mesh = state->meshes.at(i.mesh);
    i.attributes = static_cast<std::uint32_t>(mesh.attributes.size());
    i.rounding = mesh.rounding;
    write_name(i.shapes, std::string(mesh.heights ? ballot::kHeights : ballot::info_of(mesh.kind).name));
    if (mesh.heights) {
      const ballot::HeightField& field = *mesh.heights;
      i.columns = field.columns;
      for (int axis = 0; axis < 2; ++axis) i.spacing[axis] = field.spacing[axis], i.corner[axis] = field.corner[axis];
    }
    for (int axis = 0; axis < 3; ++axis) i.origin[axis] = mesh.origin[axis];
    for (int axis = 0; axis < 3; ++axis) i.lo[axis] = bounds.lo[axis], i.hi[axis] = bounds.hi[axis];
    write_struct(info, i, "BallotMeshInfo");
  });
}

BallotStatus ballot_scene_find_meshes(BallotScene* scene, const char* name, uint32_t* meshes, size_t room,
                                      size_t* count) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(name, "ballot_scene_find_meshes", "name");
    if (room) need(meshes, "ballot_scene_find_meshes", "meshes");
    need(count, "ballot_scene_find_meshes", "count");
    const DeviceHold hold(*state->device);
    const ballot::SceneInstances& all = state->world->scene_facts().instances;
    std::size_t found = 0;
    for (std::size_t m = 0; m < all.meshes(); ++m) {
      if (all.mesh_name(m) != name) continue;
      if (found < room) meshes[found] = all.mesh_labels[m].number;
      ++found;
    }
    *count = found;
  });
}

BallotStatus ballot_scene_instance(BallotScene* scene, size_t place, BallotInstanceInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_instance", "info");
    const DeviceHold hold(*state->device);
    const ballot::SceneInstances& all = state->world->scene().instances;
    if (place >= all.placements.size())
      refuse(fmt::format("instance at place {}: the scene has {}", place, all.placements.size()));
    const ballot::Placement& p = all.placements[place];
    BallotInstanceInfo i = BALLOT_INIT(BallotInstanceInfo);
    write_name(i.name, all.placement_name(place));
    i.id = all.placement_labels[place].node;
    i.instance = all.placement_labels[place].number;
    i.mask = p.mask;
    i.group = p.group;
    i.mesh = all.mesh_labels[p.mesh].number;
    i.first = state->places->first_of(place);
    i.triangles = all.triangles_of(p.mesh);
    std::memcpy(i.transform, &p.transform, sizeof i.transform);
    if (i.triangles) {
      const ballot::Bounds bounds = moved(bounds_of(*state, p.mesh), p.transform);
      for (int axis = 0; axis < 3; ++axis) i.lo[axis] = bounds.lo[axis], i.hi[axis] = bounds.hi[axis];
    }
    write_struct(info, i, "BallotInstanceInfo");
  });
}

BallotStatus ballot_scene_indices(BallotScene* scene, uint32_t mesh, uint32_t* indices, size_t room, size_t* count) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (room) need(indices, "ballot_scene_indices", "indices");
    need(count, "ballot_scene_indices", "count");
    const DeviceHold hold(*state->device);
    const auto found = state->meshes.find(mesh);
    if (found == state->meshes.end()) refuse(fmt::format("mesh {}: the scene has none of this number", mesh));
    const MeshIndices all = indices_of(found->second);
    std::copy_n(all.all.begin(), std::min(room, all.all.size()), indices);
    *count = all.all.size();
  });
}

BallotStatus ballot_scene_heights(BallotScene* scene, uint32_t mesh, float* heights) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(heights, "ballot_scene_heights", "heights");
    const DeviceHold hold(*state->device);
    const auto found = state->meshes.find(mesh);
    if (found == state->meshes.end()) refuse(fmt::format("mesh {}: the scene has none of this number", mesh));
    const auto& field = found->second.heights;
    if (!field) refuse(fmt::format("mesh {}: it is not of heights; expected one that is", mesh));
    std::ranges::copy(field->heights, heights);
  });
}

BallotStatus ballot_scene_triangles(BallotScene* scene, float* triangles) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(triangles, "ballot_scene_triangles", "triangles");
    const DeviceHold hold(*state->device);
    const std::span<const ballot::Triangle> all = state->world->scene().triangles;
    if (!all.empty()) std::memcpy(triangles, all.data(), all.size_bytes());
  });
}
