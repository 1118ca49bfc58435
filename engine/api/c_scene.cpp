// Scenes of the C interface: made of meshes in memory, loaded, moved, described.
#include <cmath>
#include <limits>

#include "engine/api/state.h"
#include "engine/core/parallel.h"

namespace ballot::api {
namespace {

constexpr std::size_t kMostTriangles = std::numeric_limits<std::int32_t>::max();
constexpr float kLargestCoordinate = 1e12f;  // as the tree's builder has it (engine/bvh/bvh.h)
constexpr std::size_t kVertexBytes = 3 * sizeof(float);

[[noreturn]] void refuse(const std::string& text) { throw Refused(BALLOT_ERROR_ARGUMENT, text); }

std::size_t stride_of(std::size_t given, const std::string& where) {
  if (given == 0) return kVertexBytes;
  if (given < kVertexBytes || given % sizeof(float))
    refuse(fmt::format("{} is {} bytes; expected a multiple of 4, at least {}, or 0 for {}", where, given, kVertexBytes,
                       kVertexBytes));
  return given;
}

glm::vec3 vertex(const float* positions, std::size_t stride, std::size_t i) {
  const float* p = reinterpret_cast<const float*>(reinterpret_cast<const char*>(positions) + i * stride);
  return {p[0], p[1], p[2]};
}

bool in_range(float x) { return std::abs(x) <= kLargestCoordinate; }  // false for NaN

void check_vertices(const float* positions, std::size_t stride, std::size_t count, const std::string& where) {
  for_chunks(count, 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const glm::vec3 v = vertex(positions, stride, i);
      if (!in_range(v.x) || !in_range(v.y) || !in_range(v.z))
        refuse(fmt::format("{}: vertex {} is ({}, {}, {}); expected finite numbers within +-1e12; scale the scene",
                           where, i, v.x, v.y, v.z));
    }
  });
}

template <class Index>
std::vector<std::uint32_t> read_indices(const BallotMesh& m, const std::string& where) {
  std::vector<std::uint32_t> indices(m.index_count);
  const Index* from = static_cast<const Index*>(m.indices);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    indices[i] = from[i];
    if (indices[i] >= m.vertex_count)
      refuse(fmt::format("{}: index {} is {}, but there are {} vertices", where, i, indices[i], m.vertex_count));
  }
  return indices;
}

/// Checks a mesh and returns its part of the scene.
MeshState read_mesh(const BallotMesh& m, std::size_t first, const std::string& where) {
  if (!m.positions || m.vertex_count == 0) refuse(fmt::format("{}: it has no vertices; leave empty meshes out", where));
  const std::size_t corners = m.indices ? m.index_count : m.vertex_count;
  if (corners == 0 || corners % 3)
    refuse(fmt::format("{}: {} {}; expected a multiple of 3, at least 3", where, corners,
                       m.indices ? "indices" : "vertices without indices"));
  if (first + corners / 3 > kMostTriangles)
    refuse(fmt::format("{}: the scene has {} triangles with it; at most {} are possible", where, first + corners / 3,
                       kMostTriangles));
  if (!m.indices && m.index_count)
    refuse(fmt::format("{}: index_count is {}, but indices is NULL", where, m.index_count));
  MeshState mesh{m.id, first, corners / 3, m.vertex_count, {}};
  if (m.indices && m.index_type == BALLOT_INDEX_U16)
    mesh.indices = read_indices<std::uint16_t>(m, where);
  else if (m.indices && m.index_type == BALLOT_INDEX_U32)
    mesh.indices = read_indices<std::uint32_t>(m, where);
  else if (m.indices)
    refuse(
        fmt::format("{}: index_type is {}; expected BALLOT_INDEX_U16 or BALLOT_INDEX_U32", where, int(m.index_type)));
  return mesh;
}

/// Writes three vectors for each triangle of a mesh.
void gather(const MeshState& mesh, const float* from, std::size_t stride, std::array<glm::vec3, 3>* to) {
  for_chunks(mesh.triangles, 1 << 15, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t corner = 3 * t + k;
        to[t][k] = vertex(from, stride, mesh.indices.empty() ? corner : mesh.indices[corner]);
      }
  });
}

void add_normals(const BallotMesh& m, const MeshState& mesh, ballot::Scene& scene, const std::string& where) {
  if (!m.normals) return;
  const std::size_t stride = stride_of(m.normal_stride, where + ": normal_stride");
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

ballot::EngineOptions engine_options(const DeviceState& device, const BallotSceneOptions& o, const char* builder,
                                     bool cache) {
  ballot::EngineOptions options;
  options.context = device.gpu;
  options.use_cache = cache;
  options.build.builder = ballot::find_builder(o.builder ? o.builder : builder).id;
  if (o.max_leaf) options.build.max_leaf = o.max_leaf;
  if (o.split_budget != 0) options.build.split_budget = std::max(o.split_budget, 0.0f);
  return options;
}

void check_same_vertices(const MeshState& mesh, std::size_t count, const std::string& where) {
  if (count != mesh.vertices)
    refuse(fmt::format("{}: {} vertices, but the mesh was made with {}; make a new scene for another mesh", where,
                       count, mesh.vertices));
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
    const BallotSceneOptions o = read_struct(options, "BallotSceneOptions");
    auto state = std::make_shared<SceneState>();
    state->device = d;
    ballot::Scene made;
    made.name = "scene";
    const std::size_t stride = count ? meshes[0].size : 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string where = fmt::format("mesh {}", i);
      const BallotMesh m = read_struct(
          reinterpret_cast<const BallotMesh*>(reinterpret_cast<const char*>(meshes) + i * stride), "BallotMesh");
      const MeshState& mesh = state->meshes.emplace_back(read_mesh(m, made.triangles.size(), where));
      const std::size_t position_stride = stride_of(m.position_stride, where + ": position_stride");
      check_vertices(m.positions, position_stride, m.vertex_count, where);
      made.triangles.resize(mesh.first + mesh.triangles);
      gather(mesh, m.positions, position_stride, made.triangles.data() + mesh.first);
      add_normals(m, mesh, made, where);
    }
    fill_normals(made);
    ballot::finish_scene(made);
    const DeviceUse use(*d);
    const char* quickest = d->gpu->info().is_cpu() ? "balanced" : "device";
    state->engine = std::make_unique<ballot::Engine>(std::move(made), engine_options(*d, o, quickest, o.cache != 0));
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
    ballot::Scene loaded = ballot::load_scene(path);
    state->meshes.push_back({0, 0, loaded.triangles.size(), 3 * loaded.triangles.size(), {}});
    const DeviceUse use(*d);
    state->engine =
        std::make_unique<ballot::Engine>(std::move(loaded), engine_options(*d, o, "best", !options || o.cache));
    *scene = scenes().add(std::move(state));
  });
}

BallotStatus ballot_scene_update(BallotScene* scene, size_t mesh, const float* positions, size_t count, size_t stride) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(positions, "ballot_scene_update", "positions");
    const DeviceUse use(*state->device);
    if (state->from_file)
      refuse("ballot_scene_update: the scene was loaded from a file; make one of meshes to move their vertices");
    const MeshState& m = mesh_at(*state, mesh, "ballot_scene_update");
    const std::string where = fmt::format("ballot_scene_update: mesh {}", mesh);
    check_same_vertices(m, count, where);
    const std::size_t bytes = stride_of(stride, where + ": stride");
    check_vertices(positions, bytes, count, where);
    std::vector<ballot::Triangle> triangles = state->engine->scene().triangles;
    gather(m, positions, bytes, triangles.data() + m.first);
    state->engine->move(std::move(triangles));
  });
}

BallotStatus ballot_scene_info(BallotScene* scene, BallotSceneInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_info", "info");
    const std::lock_guard lock(state->device->mutex);
    const ballot::BvhStats& s = state->engine->bvh().stats;
    const ballot::Scene& of = state->engine->scene();
    BallotSceneInfo i = BALLOT_INIT(BallotSceneInfo);
    i.triangles = of.triangles.size();
    i.degenerate = s.degenerate;
    i.meshes = state->meshes.size();
    i.views = of.views.size();
    for (int axis = 0; axis < 3; ++axis) i.lo[axis] = of.bounds.lo[axis], i.hi[axis] = of.bounds.hi[axis];
    i.nodes = s.nodes, i.leaves = s.leaves, i.depth = s.depth;
    i.sah = s.sah;
    i.build_seconds = s.build_s;
    write_struct(info, i, "BallotSceneInfo");
  });
}

BallotStatus ballot_scene_mesh(BallotScene* scene, size_t mesh, BallotMeshInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_mesh", "info");
    const MeshState& m = mesh_at(*state, mesh, "ballot_scene_mesh");
    write_struct(info, BallotMeshInfo{sizeof(BallotMeshInfo), m.id, m.first, m.triangles}, "BallotMeshInfo");
  });
}

BallotStatus ballot_scene_triangles(BallotScene* scene, float* triangles) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(triangles, "ballot_scene_triangles", "triangles");
    const std::lock_guard lock(state->device->mutex);
    const auto& all = state->engine->scene().triangles;
    if (!all.empty()) std::memcpy(triangles, all.data(), all.size() * sizeof(ballot::Triangle));
  });
}
