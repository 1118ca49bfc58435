#include "engine/api/meshes.h"

#include <cmath>
#include <cstring>
#include <limits>

#include "engine/api/mesh_attributes.h"
#include "engine/api/mesh_heights.h"
#include "engine/api/mesh_shapes.h"
#include "engine/api/origins.h"
#include "engine/core/parallel.h"

namespace ballot::api {

namespace {

constexpr std::size_t kMostTriangles = std::numeric_limits<std::int32_t>::max();

template <class Index>
std::vector<std::uint32_t> read_indices(const BallotMesh& m, const std::string& where) {
  const std::span given(static_cast<const Index*>(m.indices), m.index_count);
  check_indices(given, m.vertex_count, where);
  return {given.begin(), given.end()};
}

/// What a mesh is made of: checked, but for what lies on the device.
struct MeshSource {
  MeshState state;
  std::optional<DenseVertices> positions;  // of the host
  std::optional<DeviceVertices> there;     // instead of these
  std::vector<std::array<glm::vec3, 3>> normals;
  std::vector<ballot::Shape> shapes = {};  // whose positions are the corners of what stands in for them
  std::vector<std::uint32_t> cells = {};   // the corners of triangles that heights tell

  std::span<const std::uint32_t> corners() const {
    if (!shapes.empty()) return {};
    return state.heights ? cells : state.indices;
  }
};

/// Reads the indices of a mesh, or copies them on the device.
void take_indices(const BallotMesh& m, const MeshBuffers& from, const SceneState& scene, const std::string& where,
                  MeshState& to) {
  if (from.indices) {
    const auto& given = array_of<std::uint32_t>(*from.indices, scene, m.index_count, where.c_str(), "indices");
    Buffer<std::uint32_t> own(*scene.device->gpu, m.index_count, Access::Storage, "corners of triangles that move");
    own.copy_from(given, 0, 0, m.index_count);
    to.indices_there = std::make_shared<const Buffer<std::uint32_t>>(std::move(own));
  } else if (m.indices && m.index_type == BALLOT_INDEX_U16) {
    to.indices = read_indices<std::uint16_t>(m, where);
  } else if (m.indices && m.index_type == BALLOT_INDEX_U32) {
    to.indices = read_indices<std::uint32_t>(m, where);
  } else if (m.indices) {
    refuse(
        fmt::format("{}: index_type is {}; expected BALLOT_INDEX_U16 or BALLOT_INDEX_U32", where, int(m.index_type)));
  }
}

MeshSource read_vertices(const BallotMesh& m, const MeshBuffers& from, const SceneState& scene,
                         const glm::dvec3& origin, const std::string& where) {
  const ShapeInfo& info = shapes_of(m, where);
  check_mesh(m, where);
  MeshSource mesh;
  mesh.state = {(m.indices || m.index_buffer ? m.index_count : m.vertex_count) / info.vertices, m.vertex_count};
  mesh.state.kind = info.kind;
  mesh.state.origin = origin;
  take_indices(m, from, scene, where, mesh.state);
  if (info.raster) {
    mesh.state.heights = read_heights(m, where);
    mesh.state.triangles = mesh.state.heights->triangles();
    mesh.cells = corners_of(*mesh.state.heights);
    DenseVertices& to = mesh.positions.emplace();
    to.gathered = positions_of(*mesh.state.heights, origin, mesh.state.rounding);
    to.all = to.gathered;
    check_vertices(to.all, where);
  } else if (from.vertices) {
    array_of<glm::vec3>(*from.vertices, scene, m.vertex_count, where.c_str(), "vertices");
    mesh.there = {.buffer = {from.vertices, &from.vertices->raw()}, .count = m.vertex_count};
    check_there(*mesh.there, *scene.device->gpu, where);
  } else {
    RoundedVertices read =
        round_vertices(m.positions, m.positions_double, m.vertex_count, m.position_stride, origin, where);
    mesh.state.rounding = read.moved, mesh.state.in_double = std::move(read.in_double);
    check_vertices(mesh.positions.emplace(std::move(read.vertices)).all, where);
  }
  if (!m.normals) return mesh;
  const std::size_t normal_stride = vertex_stride(m.normal_stride, m.vertex_count, where + ": normal_stride");
  const DenseVertices normals(m.normals, normal_stride, m.vertex_count);
  check_vertices(normals.all, where + ", normals");
  if (info.kind != ShapeKind::Triangles) {
    mesh.state.normals.assign(normals.all.begin(), normals.all.end());
    return mesh;
  }
  const MeshIndices corners = indices_of(mesh.state);
  if (from.indices) check_indices(corners.all, m.vertex_count, where);
  mesh.normals.resize(mesh.state.triangles);
  expand(corners.all, normals.all, mesh.normals);
  return mesh;
}

MeshSource read_source(const BallotMesh& m, const MeshBuffers& from, const SceneState& scene, const glm::dvec3& origin,
                       const std::string& where) {
  MeshSource mesh = read_vertices(m, from, scene, origin, where);
  mesh.state.attributes = read_attributes(m, from.attributes, mesh.state, scene, where);
  if (mesh.state.kind == ShapeKind::Triangles) return mesh;
  mesh.state.radii = read_radii(m, where);
  mesh.shapes = shapes_at(mesh.state, mesh.positions->all, where);
  std::vector<glm::vec3> corners;
  for (const Triangle& t : stand_ins(mesh.state.kind, mesh.shapes)) corners.insert(corners.end(), t.begin(), t.end());
  mesh.positions->gathered = std::move(corners);
  mesh.positions->all = mesh.positions->gathered;
  return mesh;
}

/// Has the device make the triangles of meshes, one behind the other, and tells their states the bounds. Throws
/// Error(Arguments), which begins with the mesh's name, if it finds a vertex or an index that cannot be.
TrianglesThere make_there(const SceneState& scene, std::span<MeshSource> meshes, std::span<const std::string> names) {
  std::vector<MovedVertices> all;
  std::size_t count = 0;
  for (const MeshSource& mesh : meshes) {
    MovedVertices& m = all.emplace_back();
    m.first = count, m.triangles = mesh.state.triangles;
    m.corners = mesh.corners(), m.corners_there = mesh.state.indices_there;
    if (mesh.positions) m.positions = mesh.positions->all;
    m.there = mesh.there;
    count += m.triangles;
  }
  IndexedTriangles made(*scene.device->gpu, count);
  made.record(all, made.triangles());
  const std::vector<IndexedTriangles::Found> found = made.found();
  std::vector<MeshExtents> extents;
  for (std::size_t i = 0; i < all.size(); ++i) {
    check_found(all[i], found[i], names[i], scene.device->gpu->info());
    extents.push_back(found[i].extents);
    meshes[i].state.bounds = found[i].extents.bounds;
  }
  return {std::move(made.triangles()), std::move(extents)};
}

/// Gives a scene the normals of those of its meshes that have some.
void gather_normals(std::span<const MeshSource> meshes, const SceneInstances& all, Scene& to) {
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    if (meshes[i].normals.empty()) continue;
    to.normals.resize(to.triangles.size());
    std::ranges::copy(meshes[i].normals, to.normals.begin() + std::ptrdiff_t(all.first[i]));
  }
}

/// Gives a scene the shapes of those of its meshes that have some.
void gather_shapes(std::span<const MeshSource> meshes, const SceneInstances& all, Scene& to) {
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    if (meshes[i].shapes.empty()) continue;
    to.shapes.resize(to.triangles.size());
    std::ranges::copy(meshes[i].shapes, to.shapes.begin() + std::ptrdiff_t(all.first[i]));
  }
}

/// Gives the triangles of meshes without normals their own, where other meshes have some. Shapes keep none.
void fill_normals(Scene& scene) {
  if (scene.normals.empty()) return;
  scene.normals.resize(scene.triangles.size());
  for (std::size_t m = 0; m < scene.instances.meshes(); ++m) {
    if (scene.instances.mesh_labels[m].kind != ShapeKind::Triangles) continue;
    for (std::size_t i = scene.instances.first[m]; i < scene.instances.first[m + 1]; ++i)
      for (glm::vec3& n : scene.normals[i])
        if (n == glm::vec3(0)) n = geometric_normal(scene.triangles[i]);
  }
}

/// Checks that attributes of one name have as many components in all meshes.
void check_together(std::span<const MeshSource> meshes) {
  std::map<std::string_view, std::pair<std::uint32_t, std::size_t>> seen;  // components, and in which mesh
  for (std::size_t i = 0; i < meshes.size(); ++i)
    for (const MeshAttribute& a : meshes[i].state.attributes) {
      const auto& [components, first] = seen.try_emplace(a.name, a.components, i).first->second;
      if (components != a.components)
        refuse(fmt::format("mesh {}, attribute '{}': it has {} components, but {} in mesh {}; expected as many", i,
                           a.name, a.components, components, first));
    }
}

/// Names the meshes of a scene if one of them has a name.
void name_meshes(const BallotMesh* meshes, SceneInstances& all) {
  const std::size_t count = all.meshes();
  bool any = false;
  for (std::size_t i = 0; i < count; ++i) {
    const BallotMesh m = mesh_struct(meshes, i);
    any = any || m.name.text;
    all.mesh_labels[i].name = static_cast<std::uint32_t>(i);
    all.names.push_back(m.name ? m.name.text : count == 1 ? std::string("scene") : fmt::format("mesh {}", i));
  }
  if (!any) all.names.clear();
}

}  // namespace

MeshBuffers::MeshBuffers(const BallotMesh& m, const std::string& where) {
  if (m.vertex_buffer) vertices = use(m.vertex_buffer);
  if (m.index_buffer) indices = use(m.index_buffer);
  check_attribute_count(m, where);
  for (std::size_t i = 0; i < m.attribute_count; ++i) {
    const BallotAttribute a = attribute_struct(m, i);
    attributes.push_back(a.buffer ? use(a.buffer) : nullptr);
  }
}

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

void check_mesh(const BallotMesh& m, const std::string& where) {
  const ShapeInfo& info = shapes_of(m, where);
  if (info.raster) return check_raster(m, where);
  const std::size_t each = info.vertices;
  const auto once = [&](bool here, bool there, const char* array, const char* buffer) {
    if (here && there) refuse(fmt::format("{}: both {} and {} are set; expected one of them", where, array, buffer));
  };
  once(m.positions, m.vertex_buffer, "positions", "vertex_buffer");
  once(m.positions, m.positions_double, "positions", "positions_double");
  once(m.positions_double, m.vertex_buffer, "positions_double", "vertex_buffer");
  once(m.indices, m.index_buffer, "indices", "index_buffer");
  if ((!m.positions && !m.positions_double && !m.vertex_buffer) || m.vertex_count == 0)
    refuse(fmt::format("{}: positions is NULL or vertex_count is 0; leave empty meshes out", where));
  const bool indexed = m.indices || m.index_buffer;
  const std::size_t corners = indexed ? m.index_count : m.vertex_count;
  if (corners == 0 || corners % each)
    refuse(fmt::format("{}: {} {}; expected a multiple of {}, at least {}", where, corners,
                       indexed ? "indices" : "vertices without indices", each, each));
  check_triangle_count(corners / each, where);
  if (!indexed && m.index_count)
    refuse(fmt::format("{}: index_count is {}, but indices is NULL", where, m.index_count));
  if (m.vertex_buffer && m.position_stride && m.position_stride != sizeof(glm::vec3))
    refuse(fmt::format("{}: position_stride is {}; expected 0 beside vertex_buffer", where, m.position_stride));
  if (m.index_buffer && m.index_type == BALLOT_INDEX_U16)
    refuse(fmt::format("{}: index_type is BALLOT_INDEX_U16; those of index_buffer have 32 bits", where));
}

void check_triangle_count(std::size_t triangles, const std::string& where) {
  if (triangles > kMostTriangles)
    refuse(fmt::format("{}: the scene has {} triangles with it; at most {} are possible", where, triangles,
                       kMostTriangles));
}

GivenMesh read_mesh(const BallotMesh& m, const MeshBuffers& from, const SceneState& scene, const glm::dvec3& origin,
                    const std::string& where) {
  MeshSource source = read_source(m, from, scene, origin, where);
  GivenMesh mesh{.state = {}, .geometry = {.normals = std::move(source.normals), .kind = source.state.kind}};
  mesh.geometry.columns = source.state.columns();
  if (from) {
    mesh.there = std::make_shared<TrianglesThere>(make_there(scene, std::span(&source, 1), std::span(&where, 1)));
    mesh.geometry.elsewhere = source.state.triangles;
    if (!mesh.geometry.normals.empty()) bring_triangles(mesh.geometry, *std::exchange(mesh.there, nullptr));
  } else {
    mesh.geometry.triangles.resize(source.state.triangles);
    expand(source.corners(), source.positions->all, mesh.geometry.triangles);
  }
  mesh.state = std::move(source.state);
  mesh.geometry.shapes = std::move(source.shapes);
  return mesh;
}

std::shared_ptr<TrianglesThere> move_there(MeshState& mesh, const DeviceVertices& vertices, const SceneState& scene,
                                           const std::string& where) {
  MeshSource source{.state = mesh, .positions = {}, .there = vertices, .normals = {}};
  auto made = std::make_shared<TrianglesThere>(make_there(scene, std::span(&source, 1), std::span(&where, 1)));
  mesh.bounds = source.state.bounds;
  return made;
}

void bring_triangles(MeshGeometry& mesh, const TrianglesThere& there) {
  mesh.triangles.resize(there.triangles.size());
  there.triangles.download(mesh.triangles);
  mesh.elsewhere = 0;
}

MeshIndices indices_of(MeshState& mesh) {
  if (mesh.heights) {
    MeshIndices indices{corners_of(*mesh.heights), {}};
    indices.all = indices.made;
    return indices;
  }
  if (mesh.indices.empty() && mesh.indices_there) {
    std::vector<std::uint32_t> read(mesh.indices_there->size());
    mesh.indices_there->download(read);
    mesh.indices = std::move(read);
  }
  return {{}, mesh.indices};
}

GivenScene read_meshes(const BallotMesh* meshes, std::span<const MeshBuffers> from, const Origins& origins,
                       SceneState& scene) {
  GivenScene given;
  given.scene.origin = origins.scene;
  given.scene.name = "scene";
  SceneInstances& all = given.scene.instances;
  std::vector<MeshSource> sources;
  std::vector<std::string> names;
  std::size_t count = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const std::string& where = names.emplace_back(fmt::format("mesh {}", i));
    const BallotMesh m = mesh_struct(meshes, i);
    sources.push_back(read_source(m, from[i], scene, origins.meshes[i], where));
    all.first.push_back(count);
    all.mesh_labels.push_back({.id = m.id, .kind = sources[i].state.kind, .columns = sources[i].state.columns()});
    count += sources[i].state.triangles;
    check_triangle_count(count, where);
  }
  all.first.push_back(count);
  check_together(sources);
  name_meshes(meshes, all);
  given.scene.triangles.resize(count);
  gather_normals(sources, all, given.scene);
  gather_shapes(sources, all, given.scene);
  if (std::ranges::any_of(from, &MeshBuffers::operator bool)) {
    given.there = std::make_shared<TrianglesThere>(make_there(scene, sources, names));
    if (!given.scene.normals.empty()) bring_triangles(given);
  } else {
    for (std::size_t i = 0; i < sources.size(); ++i)
      expand(sources[i].corners(), sources[i].positions->all,
             std::span(given.scene.triangles).subspan(all.first[i], sources[i].state.triangles));
  }
  fill_normals(given.scene);
  for (std::size_t i = 0; i < sources.size(); ++i)
    scene.meshes.emplace_hint(scene.meshes.end(), static_cast<std::uint32_t>(i), std::move(sources[i].state));
  return given;
}

void bring_triangles(GivenScene& given) {
  if (!given.there || given.there->on_host) return;
  given.there->triangles.download(given.scene.triangles);
  given.there->on_host = true;
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
