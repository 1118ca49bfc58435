#include "engine/api/meshes.h"

#include <cmath>
#include <cstring>
#include <limits>

#include "engine/core/parallel.h"

namespace ballot::api {

namespace {

constexpr std::size_t kMostTriangles = std::numeric_limits<std::int32_t>::max();
constexpr std::size_t kMostInstances = std::numeric_limits<std::uint32_t>::max() - 2;  // each has a triangle at least
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

/// Gives the triangles of meshes without normals their own, where other meshes have some.
void fill_normals(Scene& scene) {
  if (scene.normals.empty()) return;
  scene.normals.resize(scene.triangles.size());
  for (std::size_t i = 0; i < scene.triangles.size(); ++i)
    for (glm::vec3& n : scene.normals[i])
      if (n == glm::vec3(0)) n = geometric_normal(scene.triangles[i]);
}

}  // namespace

DenseVertices::DenseVertices(const float* from, std::size_t stride, std::size_t count) {
  if (stride == sizeof(glm::vec3)) {
    all = {reinterpret_cast<const glm::vec3*>(from), count};
    return;
  }
  gathered.resize(count);
  const char* bytes = reinterpret_cast<const char*>(from);
  for_chunks(count, 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) std::memcpy(&gathered[i], bytes + i * stride, sizeof(glm::vec3));
  });
  all = gathered;
}

void check_mesh_count(const BallotMesh* meshes, std::size_t count) {
  if (count > kMostTriangles)  // each has one at least
    refuse(fmt::format("meshes: their number is {}; at most {} are possible", count, kMostTriangles));
  if (count) mesh_struct(meshes, 0);  // whose size tells where the others are
}

void check_triangle_count(std::size_t triangles, const std::string& where) {
  if (triangles > kMostTriangles)
    refuse(fmt::format("{}: the scene has {} triangles with it; at most {} are possible", where, triangles,
                       kMostTriangles));
}

namespace {

/// Returns the row of the shapes that a mesh is made of. Throws Refused unless it has what they need.
const ShapeInfo& shapes_of(const BallotMesh& m, const std::string& where) {
  const ShapeInfo& info = find_named(kShapes, m.shapes ? m.shapes.text : kShapes[0].name, "kind of shapes");
  if (!m.positions || m.vertex_count == 0)
    refuse(fmt::format("{}: positions is NULL or vertex_count is 0; leave empty meshes out", where));
  const std::size_t corners = m.indices ? m.index_count : m.vertex_count;
  if (corners == 0 || corners % info.vertices)
    refuse(fmt::format("{}: {} {}; expected a multiple of {}, at least {}", where, corners,
                       m.indices ? "indices" : "vertices without indices", info.vertices, info.vertices));
  check_triangle_count(corners / info.vertices, where);
  if (!m.indices && m.index_count)
    refuse(fmt::format("{}: index_count is {}, but indices is NULL", where, m.index_count));
  if (info.radii != (m.radii != nullptr))
    refuse(fmt::format("{}: radii is {}NULL, but {} have {}", where, m.radii ? "not " : "", info.name,
                       info.radii ? "some" : "none"));
  if (info.kind != ShapeKind::Triangles && info.normals != (m.normals != nullptr))
    refuse(fmt::format("{}: normals is {}NULL, but {} have {}", where, m.normals ? "not " : "", info.name,
                       info.normals ? "some" : "none"));
  return info;
}

std::vector<std::uint32_t> read_corners(const BallotMesh& m, const std::string& where) {
  if (!m.indices) return {};
  if (m.index_type == BALLOT_INDEX_U16) return read_indices<std::uint16_t>(m, where);
  if (m.index_type == BALLOT_INDEX_U32) return read_indices<std::uint32_t>(m, where);
  refuse(fmt::format("{}: index_type is {}; expected BALLOT_INDEX_U16 or BALLOT_INDEX_U32", where, int(m.index_type)));
}

std::vector<float> read_radii(const BallotMesh& m, const std::string& where) {
  std::vector<float> radii(m.radii ? m.vertex_count : 0);
  const std::size_t stride = stride_of(m.radius_stride, sizeof(float), radii.size(), where + ": radius_stride");
  const char* from = reinterpret_cast<const char*>(m.radii);
  for (std::size_t i = 0; i < radii.size(); ++i) std::memcpy(&radii[i], from + i * stride, sizeof(float));
  return radii;
}

}  // namespace

std::vector<ballot::Shape> shapes_at(const MeshState& mesh, std::span<const glm::vec3> positions,
                                     const std::string& where) {
  return make_shapes(mesh.kind, mesh.indices, {positions, mesh.radii, mesh.normals}, where);
}

GivenMesh read_mesh(const BallotMesh& m, const std::string& where) {
  const ShapeInfo& info = shapes_of(m, where);
  const std::size_t corners = m.indices ? m.index_count : m.vertex_count;
  GivenMesh mesh{{corners / info.vertices, m.vertex_count, read_corners(m, where)}, {}};
  MeshGeometry& made = mesh.geometry;
  made.kind = info.kind;
  const std::size_t stride = vertex_stride(m.position_stride, m.vertex_count, where + ": position_stride");
  const DenseVertices positions(m.positions, stride, m.vertex_count);
  check_vertices(positions.all, where);
  std::optional<DenseVertices> normals;
  if (m.normals) {
    const std::size_t normal_stride = vertex_stride(m.normal_stride, m.vertex_count, where + ": normal_stride");
    check_vertices(normals.emplace(m.normals, normal_stride, m.vertex_count).all, where + ", normals");
  }
  if (info.kind != ShapeKind::Triangles) {
    mesh.state.kind = info.kind;
    mesh.state.radii = read_radii(m, where);
    if (normals) mesh.state.normals.assign(normals->all.begin(), normals->all.end());
    made.shapes = shapes_at(mesh.state, positions.all, where);
    made.triangles = stand_ins(info.kind, made.shapes);
    return mesh;
  }
  made.triangles.resize(mesh.state.triangles);
  expand(mesh.state.indices, positions.all, made.triangles);
  if (!normals) return mesh;
  made.normals.resize(mesh.state.triangles);
  expand(mesh.state.indices, normals->all, made.normals);
  return mesh;
}

Scene read_meshes(const BallotMesh* meshes, std::size_t count, std::map<std::uint32_t, MeshState>& states) {
  check_mesh_count(meshes, count);
  Scene made;
  made.name = "scene";
  SceneInstances& all = made.instances;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string where = fmt::format("mesh {}", i);
    const BallotMesh m = mesh_struct(meshes, i);
    GivenMesh mesh = read_mesh(m, where);
    const std::size_t first = made.triangles.size();
    check_triangle_count(first + mesh.state.triangles, where);
    all.first.push_back(first);
    all.mesh_labels.push_back({.id = m.id, .kind = mesh.geometry.kind});
    if (!mesh.geometry.shapes.empty()) made.shapes.resize(first);
    made.shapes.insert(made.shapes.end(), mesh.geometry.shapes.begin(), mesh.geometry.shapes.end());
    if (first == 0) {
      made.triangles = std::move(mesh.geometry.triangles);
      made.normals = std::move(mesh.geometry.normals);
    } else {
      made.triangles.insert(made.triangles.end(), mesh.geometry.triangles.begin(), mesh.geometry.triangles.end());
      if (!mesh.geometry.normals.empty()) made.normals.resize(first);
      made.normals.insert(made.normals.end(), mesh.geometry.normals.begin(), mesh.geometry.normals.end());
    }
    states.emplace_hint(states.end(), static_cast<std::uint32_t>(i), std::move(mesh.state));
  }
  fill_normals(made);
  if (!made.shapes.empty()) made.shapes.resize(made.triangles.size());
  all.first.push_back(made.triangles.size());
  return made;
}

std::vector<Placement> read_instances(const BallotInstances& given) {
  if (given.count && !given.transforms)
    refuse(fmt::format("instances: transforms is NULL, but count is {}", given.count));
  if (given.count > kMostInstances)
    refuse(fmt::format("instances: count is {}; at most {} are possible", given.count, kMostInstances));
  const std::size_t stride =
      stride_of(given.transform_stride, sizeof(Transform), given.count, "instances: transform_stride");
  std::vector<Placement> all(given.count);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (given.meshes) all[i].mesh = given.meshes[i];
    if (given.masks) all[i].mask = given.masks[i];
    std::memcpy(&all[i].transform, reinterpret_cast<const char*>(given.transforms) + i * stride, sizeof(Transform));
  }
  return all;
}

Bounds bounds_of(SceneState& scene, std::size_t mesh) {
  const std::uint32_t number = scene.world->scene_facts().instances.mesh_labels[mesh].number;
  std::optional<Bounds>& bounds = scene.meshes.at(number).bounds;
  if (!bounds) bounds = bounds_of_mesh(scene.world->scene(), mesh);
  return *bounds;
}

void refuse_animated(const SceneState& scene, const char* call) {
  const auto& animation = scene.world->scene_facts().animation;
  if (animation && !animation->clips.empty())
    refuse(fmt::format("{}: the scene's animations move it; set a time instead, or load a file without them", call));
}

BallotMesh mesh_struct(const BallotMesh* meshes, std::size_t i) {
  return read_struct(reinterpret_cast<const BallotMesh*>(reinterpret_cast<const char*>(meshes) + i * meshes[0].size),
                     "BallotMesh");
}

DeviceSceneOptions scene_options(const DeviceState& device, const BallotSceneOptions& o, const char* builder,
                                 bool cache) {
  DeviceSceneOptions options;
  options.context = device.gpu;
  options.use_cache = cache;
  options.build.builder = find_builder(o.builder ? o.builder.text : builder).id;
  if (!(o.expected_rays >= 0)) refuse(fmt::format("expected_rays is {}; expected at least 0", o.expected_rays));
  if (o.expected_rays > 0) options.expected_rays = o.expected_rays;
  if (o.max_leaf) options.build.max_leaf = o.max_leaf;
  if (o.split_budget != 0) options.build.split_budget = std::max(o.split_budget, 0.0f);
  return options;
}

}  // namespace ballot::api
