// Scenes of the C interface: made of meshes in memory, loaded, moved, described.
#include "engine/api/arrays.h"
#include "engine/api/meshes.h"

namespace ballot::api {
namespace {

void add_normals(const BallotMesh& m, const MeshState& mesh, ballot::Scene& scene, const std::string& where) {
  if (!m.normals) return;
  const std::size_t stride = vertex_stride(m.normal_stride, m.vertex_count, where + ": normal_stride");
  check_vertices(m.normals, stride, m.vertex_count, where + ", normals");
  scene.normals.resize(scene.triangles.size());
  gather(mesh, m.normals, stride, scene.normals.data() + mesh.first);
}

/// Gives the triangles of meshes without normals their own, where other meshes have some.
void fill_normals(ballot::Scene& scene) {
  if (scene.normals.empty()) return;
  scene.normals.resize(scene.triangles.size());
  for (std::size_t i = 0; i < scene.triangles.size(); ++i)
    for (glm::vec3& n : scene.normals[i])
      if (n == glm::vec3(0)) n = geometric_normal(scene.triangles[i]);
}

void check_same_vertices(const MeshState& mesh, std::size_t count, const std::string& where) {
  if (count != mesh.vertices)
    refuse(fmt::format("{}: {} vertices, but the mesh was made with {}; make a new scene for another mesh", where,
                       count, mesh.vertices));
}

/// Returns what the building of a tree tells its progress.
Progress build_progress(Watch& watch) {
  if (!watch) return {};
  return [&watch](double done) { watch(done); };
}

const MeshState& mesh_at(const SceneState& state, std::size_t mesh, const char* call) {
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
    ballot::Scene made;
    made.name = "scene";
    for (std::size_t i = 0; i < count; ++i) {
      const std::string where = fmt::format("mesh {}", i);
      const BallotMesh m = mesh_struct(meshes, i);
      const MeshState& mesh = state->meshes.emplace_back(read_mesh(m, made.triangles.size(), where));
      const std::size_t position_stride = vertex_stride(m.position_stride, m.vertex_count, where + ": position_stride");
      check_vertices(m.positions, position_stride, m.vertex_count, where);
      made.triangles.resize(mesh.first + mesh.triangles);
      gather(mesh, m.positions, position_stride, made.triangles.data() + mesh.first);
      add_normals(m, mesh, made, where);
    }
    fill_normals(made);
    ballot::finish_scene(made);
    const DeviceUse use(*d);
    Watch watch(o, *d, "scene");
    const Watched watched(watch);
    state->engine = std::make_unique<ballot::Engine>(std::move(made), engine_options(*d, o, "auto", o.cache != 0),
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
    state->from_file = true;
    if (o.update) state->update = ballot::find_named(ballot::kUpdateModes, o.update, "update mode").id;
    ballot::LoadOptions load{.allow_outside = o.allow_outside != 0};
    if (o.instances) load.instances = ballot::find_named(ballot::kInstancePolicies, o.instances, "instances").id;
    ballot::Scene loaded = ballot::load_scene(path, load);
    const std::uint64_t triangles = ballot::triangle_count(loaded);
    state->meshes.push_back({0, 0, triangles, 3 * triangles, {}});
    const DeviceUse use(*d);
    Watch watch(o, *d, "scene");
    const Watched watched(watch);
    watch(0);
    state->engine = std::make_unique<ballot::Engine>(
        std::move(loaded), engine_options(*d, o, "best", !options || o.cache), build_progress(watch));
    *scene = scenes().add(std::move(state));
  });
}

BallotStatus ballot_scene_update(BallotScene* scene, size_t mesh, const float* positions, size_t count, size_t stride) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    if (count) need(positions, "ballot_scene_update", "positions");
    const DeviceUse use(*state->device);
    if (state->from_file)
      refuse("update of vertices: the scene was loaded from a file; make one of meshes to move their vertices");
    ballot::Engine& engine = engine_of(*state, "update of vertices");
    const MeshState& m = mesh_at(*state, mesh, "update of vertices");
    const std::string where = fmt::format("update of vertices: mesh {}", mesh);
    check_same_vertices(m, count, where);
    const std::size_t bytes = vertex_stride(stride, count, where + ": stride");
    check_vertices(positions, bytes, count, where);
    const std::span<const ballot::Triangle> old = engine.scene().triangles;
    std::vector<ballot::Triangle>& moved = state->spare;
    moved.resize(old.size());
    const std::size_t behind = m.first + m.triangles;
    ballot::copy_parallel(old.first(m.first), std::span(moved).first(m.first));
    ballot::copy_parallel(old.subspan(behind), std::span(moved).subspan(behind));
    gather(m, positions, bytes, moved.data() + m.first);
    moved = engine.move(std::move(moved), state->update);
    state->refits = engine.last_update().refitted ? state->refits + 1 : 0;
  });
}

BallotStatus ballot_scene_info(BallotScene* scene, BallotSceneInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_info", "info");
    const DeviceHold hold(*state->device);
    const ballot::Forest* forest = state->instanced ? &state->instanced->forest : nullptr;
    const ballot::BvhStats& s = forest ? forest->summary().stats : state->engine->bvh_stats();
    const ballot::Bounds& bounds = forest ? forest->top_facts().bounds : state->engine->scene_facts().bounds;
    BallotSceneInfo i = BALLOT_INIT(BallotSceneInfo);
    i.triangles = forest ? s.triangles : state->engine->triangle_count();
    i.degenerate = s.degenerate;
    i.meshes = state->meshes.size();
    if (forest) {
      i.instances = forest->size();
      i.instance_triangles = forest->triangle_count();
      i.top_seconds = forest->top_facts().build_s;
    } else {
      i.views = state->engine->scene_facts().views.size();
      if (const ballot::Forest* kept = state->engine->forest()) {
        i.instances = kept->size();
        i.instance_triangles = kept->triangle_count();
        i.top_seconds = kept->top_facts().build_s;
      }
    }
    for (int axis = 0; axis < 3; ++axis) i.lo[axis] = bounds.lo[axis], i.hi[axis] = bounds.hi[axis];
    i.nodes = s.nodes, i.leaves = s.leaves, i.depth = s.depth;
    i.sah = s.sah;
    i.build_seconds = forest ? s.build_s : state->engine->refit_policy().build_s();
    i.decay = forest ? 1 : state->engine->refit_policy().decay();
    i.update_seconds = forest ? 0 : state->engine->last_update().seconds;
    i.refits = state->refits;
    write_struct(info, i, "BallotSceneInfo");
  });
}

BallotStatus ballot_scene_mesh(BallotScene* scene, size_t mesh, BallotMeshInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_mesh", "info");
    const MeshState& m = mesh_at(*state, mesh, "facts about a mesh");
    write_struct(info, BallotMeshInfo{sizeof(BallotMeshInfo), m.id, m.first, m.triangles}, "BallotMeshInfo");
  });
}

BallotStatus ballot_scene_triangles(BallotScene* scene, float* triangles) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(triangles, "ballot_scene_triangles", "triangles");
    const DeviceHold hold(*state->device);
    const auto copy = [&](const std::vector<ballot::Triangle>& all) {
      if (!all.empty()) std::memcpy(triangles, all.data(), all.size() * sizeof(ballot::Triangle));
      triangles += 9 * all.size();
    };
    if (!state->instanced) return copy(ballot::world_triangles(state->engine->scene()));
    for (const ballot::MeshTree& mesh : state->instanced->forest.meshes()) copy(mesh.triangles);
  });
}
