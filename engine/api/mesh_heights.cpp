#include "engine/api/mesh_heights.h"

#include <cstring>

#include "engine/api/edits.h"

namespace ballot::api {
namespace {

/// Returns the grid of a mesh without its heights.
HeightField grid_of(const BallotMesh& m) {
  return {m.columns, {m.spacing[0], m.spacing[1]}, {m.corner[0], m.corner[1]}, {}};
}

std::shared_ptr<const HeightField> read(HeightField field, const float* from, std::size_t count, std::size_t stride,
                                        const std::string& where) {
  const std::size_t step = stride_of(stride, sizeof(float), count, where + ": position_stride");
  field.heights.resize(count);
  const char* bytes = reinterpret_cast<const char*>(from);
  if (step == sizeof(float))
    std::memcpy(field.heights.data(), bytes, count * sizeof(float));
  else
    for (std::size_t i = 0; i < count; ++i) std::memcpy(&field.heights[i], bytes + i * step, sizeof(float));
  check_heights(field, where);
  return std::make_shared<const HeightField>(std::move(field));
}

}  // namespace

void check_raster(const BallotMesh& m, const std::string& where) {
  if (m.positions || m.positions_double || m.indices || m.index_count)
    refuse(fmt::format("{}: positions or indices are set beside heights, which tell both; expected NULL", where));
  check_grid(grid_of(m), m.vertex_count, where);
  check_triangle_count(2 * (m.vertex_count / m.columns - 1) * (m.columns - 1), where);
}

std::shared_ptr<const HeightField> read_heights(const BallotMesh& m, const std::string& where) {
  check_raster(m, where);
  return read(grid_of(m), m.heights, m.vertex_count, m.position_stride, where);
}

PendingEdits::Vertices moved_heights(const MeshState& mesh, const float* heights, std::size_t count, std::size_t stride,
                                     std::uint32_t number) {
  const std::string where = fmt::format("mesh {}", number);
  if (!mesh.heights) refuse(fmt::format("{}: it is not of heights; expected vertices, or a mesh of heights", where));
  check_vertex_count(mesh, count, number);
  const HeightField& before = *mesh.heights;
  PendingEdits::Vertices moving{nullptr, sizeof(glm::vec3), count};
  moving.heights = read({before.columns, before.spacing, before.corner, {}}, heights, count, stride, where);
  moving.own = positions_of(*moving.heights, mesh.origin, moving.rounding);
  moving.positions = &moving.own.data()->x;
  return moving;
}

void refuse_heights(const MeshState& mesh, std::uint32_t number) {
  if (mesh.heights) refuse(fmt::format("mesh {}: it is of heights; expected ballot_scene_set_heights()", number));
}

}  // namespace ballot::api
