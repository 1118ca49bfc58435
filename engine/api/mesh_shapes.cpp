#include "engine/api/mesh_shapes.h"

#include <cstring>

#include "engine/core/registry.h"

namespace ballot::api {

const ShapeInfo& shapes_of(const BallotMesh& m, const std::string& where) {
  const ShapeInfo& info = find_named(kShapes, m.shapes ? m.shapes.text : kShapes[0].name, "kind of shapes");
  const auto as_wanted = [&](bool has, bool given, const char* what) {
    if (has != given)
      refuse(fmt::format("{}: {} is {}NULL, but {} have {}", where, what, given ? "not " : "", info.name,
                         has ? "some" : "none"));
  };
  as_wanted(info.radii, m.radii != nullptr, "radii");
  as_wanted(info.raster, m.heights != nullptr, "heights");
  if (&info == &kShapes[0]) return info;
  if (info.kind != ShapeKind::Triangles) as_wanted(info.normals, m.normals != nullptr, "normals");
  if (m.vertex_buffer || m.index_buffer)
    refuse(
        fmt::format("{}: its {} lie in an array on the device; expected the host's memory: meshes of triangles alone "
                    "are read there",
                    where, info.name));
  return info;
}

std::vector<float> read_radii(const BallotMesh& m, const std::string& where) {
  std::vector<float> radii(m.radii ? m.vertex_count : 0);
  const std::size_t stride = stride_of(m.radius_stride, sizeof(float), radii.size(), where + ": radius_stride");
  const char* from = reinterpret_cast<const char*>(m.radii);
  for (std::size_t i = 0; i < radii.size(); ++i) std::memcpy(&radii[i], from + i * stride, sizeof(float));
  return radii;
}

std::vector<ballot::Shape> shapes_at(const MeshState& mesh, std::span<const glm::vec3> positions,
                                     const std::string& where) {
  return make_shapes(mesh.kind, mesh.indices, {positions, mesh.radii, mesh.normals}, where);
}

MeshState state_of_file(const ballot::Scene& scene, std::size_t mesh) {
  MeshState state;
  const ShapeInfo& info = info_of(scene.instances.mesh_labels[mesh].kind);
  state.triangles = scene.instances.triangles_of(mesh), state.vertices = info.vertices * state.triangles;
  state.kind = info.kind;
  state.origin = scene.origin;
  if (scene.heights) {
    state.heights = scene.heights, state.vertices = scene.heights->heights.size();
    positions_of(*state.heights, state.origin, state.rounding);
  }
  if (info.kind == ShapeKind::Triangles) return state;
  for (const ballot::Shape& s : std::span(scene.shapes).subspan(scene.instances.first[mesh], state.triangles)) {
    if (info.radii) state.radii.push_back(s.a.w);
    if (info.radii && info.vertices == 2) state.radii.push_back(s.b.w);
    if (info.normals) state.normals.emplace_back(s.b);
  }
  return state;
}

}  // namespace ballot::api
