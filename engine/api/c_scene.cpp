// Scenes of the C interface: made of meshes in memory, loaded, moved, described.
#include "engine/api/arrays.h"
#include "engine/api/meshes.h"
#include "engine/core/parallel.h"

namespace ballot::api {
namespace {

void check_same_vertices(const MeshState& mesh, std::size_t count, const std::string& where) {
  if (count != mesh.vertices)
    refuse(fmt::format("{}: {} vertices, but the mesh was made with {}; make a new scene for another mesh", where,
                       count, mesh.vertices));
}

/// Moves the vertices of a mesh on the device, which checks them.
void move_there(SceneState& state, const MeshState& m, const float* positions, std::size_t stride,
                const std::string& where) {
  const bool dense = stride == sizeof(glm::vec3);
  std::vector<glm::vec3> gathered(dense ? 0 : m.vertices);
  const char* from = reinterpret_cast<const char*>(positions);
  ballot::for_chunks(gathered.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) std::memcpy(&gathered[i], from + i * stride, sizeof(glm::vec3));
  });
  const std::span<const glm::vec3> all{dense ? reinterpret_cast<const glm::vec3*>(positions) : gathered.data(),
                                       m.vertices};
  if (!state.engine->set_vertices({m.first, m.triangles, m.indices, all}, state.update))
    check_vertices(positions, stride, m.vertices, where);
}

/// Moves the vertices of a mesh in a scene without instances, whose triangles are in one tree.
void move_flat(SceneState& state, const MeshState& m, const float* positions, std::size_t stride) {
  const std::span<const ballot::Triangle> old = state.engine->scene().triangles;
  std::vector<ballot::Triangle>& moved = state.spare;
  moved.resize(old.size());
  const std::size_t behind = m.first + m.triangles;
  ballot::copy_parallel(old.first(m.first), std::span(moved).first(m.first));
  ballot::copy_parallel(old.subspan(behind), std::span(moved).subspan(behind));
  gather(m, positions, stride, moved.data() + m.first);
  moved = state.engine->move(std::move(moved), state.update);
}

MeshState& mesh_at(SceneState& state, std::size_t mesh, const char* call) {
  if (mesh >= state.meshes.size())
    refuse(fmt::format("{}: mesh {}, but the scene has {}", call, mesh, state.meshes.size()));
  return state.meshes[mesh];
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_scene_create(BallotDevice* device, const BallotMesh* meshes, size_t count,
                                 const BallotSceneOptions* options, BallotScene** scene) {
  return guarded_use(device, [&](const std::shared_ptr<DeviceState>& d) {
    need(scene, "ballot_scene_create", "scene");
    if (count) need(meshes, "ballot_scene_create", "meshes");
    check_mesh_count(meshes, count);
    const BallotSceneOptions o = read_struct(options, "BallotSceneOptions");
    auto state = std::make_shared<SceneState>();
    state->device = d;
    if (o.update) state->update = ballot::find_named(ballot::kUpdateModes, o.update, "update mode").id;
    ballot::Scene made = read_meshes(meshes, count, state->meshes);
    ballot::finish_scene(made);
    const DeviceUse use(*d);
    Watch watch(o, *d, "scene");
    const Watched watched(watch);
    state->open(std::move(made), ballot::IdSource::Mesh, engine_options(*d, o, "auto", o.cache != 0),
                build_progress(watch));
    *scene = scenes().add(std::move(state));
  });
}

BallotStatus ballot_scene_load(BallotDevice* device, const char* path, const BallotSceneOptions* options,
                               BallotScene** scene) {
  return guarded_use(device, [&](const std::shared_ptr<DeviceState>& d) {
    need(scene, "ballot_scene_load", "scene");
    need(path, "ballot_scene_load", "path");
    const BallotSceneOptions o = read_struct(options, "BallotSceneOptions");
    auto state = std::make_shared<SceneState>();
    state->device = d;
    if (o.update) state->update = ballot::find_named(ballot::kUpdateModes, o.update, "update mode").id;
    ballot::LoadOptions load{.allow_outside = o.allow_outside != 0};
    if (o.instances) load.instances = ballot::find_named(ballot::kInstancePolicies, o.instances, "instances").id;
    const auto ids =
        ballot::find_named(ballot::kIdSources, o.ids ? o.ids : ballot::kDefaultIdSource, "source of ids").id;
    ballot::Scene loaded = ballot::load_scene(path, load);
    for (std::size_t m = 0; m < loaded.instances.meshes(); ++m) {
      const std::size_t triangles = loaded.instances.triangles_of(m);
      state->meshes.push_back({loaded.instances.first[m], triangles, 3 * triangles, {}});
    }
    const DeviceUse use(*d);
    Watch watch(o, *d, "scene");
    const Watched watched(watch);
    watch(0);
    state->open(std::move(loaded), ids, engine_options(*d, o, "best", !options || o.cache), build_progress(watch));
    *scene = scenes().add(std::move(state));
  });
}

BallotStatus ballot_scene_update(BallotScene* scene, size_t mesh, const float* positions, size_t count, size_t stride) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (count) need(positions, "ballot_scene_update", "positions");
    const DeviceUse use(*state->device);
    refuse_animated(*state, "update of vertices");
    ballot::Engine& engine = *state->engine;
    MeshState& m = mesh_at(*state, mesh, "update of vertices");
    const std::string where = fmt::format("update of vertices: mesh {}", mesh);
    check_same_vertices(m, count, where);
    const std::size_t bytes = vertex_stride(stride, count, where + ": stride");
    if (engine.takes_vertices()) {
      move_there(*state, m, positions, bytes, where);
    } else if (check_vertices(positions, bytes, count, where); engine.forest()) {
      std::vector<ballot::Triangle> moved(m.triangles);
      gather(m, positions, bytes, moved.data());
      engine.move_mesh(mesh, std::move(moved), state->update);
    } else {
      move_flat(*state, m, positions, bytes);
    }
    m.bounds.reset();
    state->refits = engine.last_update().refitted ? state->refits + 1 : 0;
  });
}

BallotStatus ballot_scene_info(BallotScene* scene, BallotSceneInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_info", "info");
    const DeviceHold hold(*state->device);
    const ballot::Engine& engine = *state->engine;
    const ballot::Forest* forest = engine.forest();
    const ballot::BvhStats& s = engine.bvh_stats();
    const ballot::Bounds& bounds = engine.scene().bounds;
    BallotSceneInfo i = BALLOT_INIT(BallotSceneInfo);
    i.triangles = engine.scene_facts().triangles.size();
    i.degenerate = s.degenerate;
    i.meshes = state->meshes.size();
    i.views = engine.scene_facts().views.size();
    if (forest) {
      i.instances = engine.scene_facts().instances.placements.size();
      i.instance_triangles = engine.triangle_count();
      i.top_seconds = forest->top_facts().build_s;
    }
    for (int axis = 0; axis < 3; ++axis) i.lo[axis] = bounds.lo[axis], i.hi[axis] = bounds.hi[axis];
    i.nodes = s.nodes, i.leaves = s.leaves, i.depth = s.depth;
    i.sah = s.sah;
    i.build_seconds = forest ? s.build_s : engine.refit_policy().build_s();
    i.decay = forest ? 1 : engine.refit_policy().decay();
    i.update_seconds = engine.last_update().seconds;
    i.refits = state->refits;
    write_struct(info, i, "BallotSceneInfo");
  });
}

BallotStatus ballot_scene_mesh(BallotScene* scene, size_t mesh, BallotMeshInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_mesh", "info");
    const DeviceHold hold(*state->device);
    const MeshState& m = mesh_at(*state, mesh, "facts about a mesh");
    const ballot::SceneInstances& all = state->engine->scene_facts().instances;
    const ballot::Bounds bounds = bounds_of(*state, mesh);
    BallotMeshInfo i = BALLOT_INIT(BallotMeshInfo);
    write_name(i.name, all.mesh_name(mesh));
    i.id = all.mesh_labels[mesh].id;
    i.first = m.first, i.triangles = m.triangles;
    for (int axis = 0; axis < 3; ++axis) i.lo[axis] = bounds.lo[axis], i.hi[axis] = bounds.hi[axis];
    write_struct(info, i, "BallotMeshInfo");
  });
}

BallotStatus ballot_scene_triangles(BallotScene* scene, float* triangles) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(triangles, "ballot_scene_triangles", "triangles");
    const DeviceHold hold(*state->device);
    const std::span<const ballot::Triangle> all = state->engine->scene().triangles;
    if (!all.empty()) std::memcpy(triangles, all.data(), all.size_bytes());
  });
}
