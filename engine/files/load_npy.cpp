// Loads NumPy arrays of triangles: an .npy of shape (n, 3, 3) or (n, 9), x y z of three vertices, float32 or float64;
// or an .npz with such an array, or with vertices and the indices of triangles. Rows of other widths are shapes.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "engine/core/memory.h"
#include "engine/files/loaders.h"
#include "engine/files/npy_heights.h"
#include "engine/files/npy_shapes.h"
#include "engine/files/zip_file.h"
#include "engine/model/recentring.h"

namespace ballot {
namespace {

/// Counts rows of points in double from an origin and rounds them. Returns the origin (origin_for()).
template <std::size_t Width, class Rounded>
glm::dvec3 round_rows(std::span<const std::array<double, Width>> rows, Rounded& to) {
  glm::dvec3 lo(std::numeric_limits<double>::infinity()), hi = -lo;
  for (const auto& row : rows)
    for (std::size_t i = 0; i < Width; ++i)
      if (const int axis = int(i % 3); std::isfinite(row[i]))
        lo[axis] = std::min(lo[axis], row[i]), hi[axis] = std::max(hi[axis], row[i]);
  const bool any = lo.x <= hi.x && lo.y <= hi.y && lo.z <= hi.z;
  const glm::dvec3 origin = any ? origin_for(lo, hi) : glm::dvec3(0);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    auto* floats = reinterpret_cast<float*>(&to[r]);
    for (std::size_t i = 0; i < Width; ++i) floats[i] = float(rows[r][i] - origin[int(i % 3)]);
  }
  return origin;
}

/// Reads rows of points; float64 is rounded about the origin that is returned.
template <class Row, class Allocator>
glm::dvec3 read_floats(NpyFile& file, const Rows& rows, std::vector<Row, Allocator>& to) {
  static_assert(sizeof(Row) % sizeof(float) == 0);
  constexpr std::size_t kWidth = sizeof(Row) / sizeof(float);
  file.expect_items(rows.count, kWidth * rows.bytes, rows.bytes);
  const bool wide = rows.bytes == sizeof(double);
  need_memory_for(rows.count * sizeof(Row) * (wide ? 3 : 1), fmt::format("{} rows", rows.count));
  to.resize(rows.count);
  if (!wide) {
    file.read(to.data(), to.size() * sizeof(Row));
    return glm::dvec3(0);
  }
  std::vector<std::array<double, kWidth>> values(rows.count);
  file.read(values.data(), values.size() * sizeof values[0]);
  return round_rows<kWidth>(values, to);
}

Scene soup_of(NpyFile& file, const LoadOptions& options) {
  if (options.shapes && options.shapes->raster) return heights_of(file, options);
  const Rows rows = rows_of(file);
  const bool triangles = rows.width == 9 && !options.shapes;
  if (!rows.are_floats() || rows.width == 0 || (rows.width == 3 && options.radius == 0 && !options.shapes))
    refuse("{}; expected triangles: float32 or float64 of shape (n, 3, 3); or shapes: {}", file.found(), npy_shapes());
  if (!triangles) return shapes_of(file, options);
  if (rows.count > kMaxTriangles)
    refuse("has {} triangles; expected at most {}; use a smaller scene", rows.count, kMaxTriangles);
  Scene scene;
  scene.origin = read_floats(file, rows, scene.triangles);
  complete_mesh(scene);
  return scene;
}

/// Joins vertices with the indices of triangles.
Scene indexed_of(NpyFile& vertices, NpyFile& faces) {
  const Rows points = rows_of(vertices), corners = rows_of(faces);
  if (points.width != 3 || !points.are_floats())
    refuse("its vertices: {}; expected float32 or float64 of shape (n, 3)", vertices.found());
  if (corners.width != 3 || !corners.are_integers())
    refuse("its triangles: {}; expected whole numbers of shape (n, 3)", faces.found());
  if (corners.count > kMaxTriangles)
    refuse("has {} triangles; expected at most {}; use a smaller scene", corners.count, kMaxTriangles);
  std::vector<glm::vec3> positions;
  const glm::dvec3 origin = read_floats(vertices, points, positions);
  faces.expect_items(corners.count, 3 * corners.bytes, corners.bytes);
  need_memory_for(corners.count * sizeof(Triangle), fmt::format("{} triangles", corners.count));
  Scene scene;
  scene.origin = origin;
  scene.triangles.resize(corners.count);
  for (std::size_t t = 0; t < scene.triangles.size(); ++t)
    for (glm::vec3& vertex : scene.triangles[t]) {
      std::uint64_t index = 0;
      faces.read(&index, corners.bytes);
      const std::size_t unused = 64 - 8 * corners.bytes;  // bits of the word
      const std::int64_t signed_index = std::int64_t(index << unused) >> unused;
      if (corners.kind == 'i' && signed_index < 0)
        refuse("triangle {} names vertex {}, but there are {}", t, signed_index, positions.size());
      if (index >= positions.size())
        refuse("triangle {} names vertex {}, but there are {}", t, index, positions.size());
      vertex = positions[index];
    }
  complete_mesh(scene);
  return scene;
}

}  // namespace

Scene load_npy(const std::filesystem::path& path, const LoadOptions& options) {
  NpyFile file(path);
  return soup_of(file, options);
}

Scene load_npz(const std::filesystem::path& path, const LoadOptions& options) {
  const ZipFile zip(path);
  const std::vector<std::string> names = zip.names();
  const auto open = [&](const std::string& name) { return NpyFile(path / name, zip.read(name)); };
  const auto has = [&](const char* name) { return std::ranges::find(names, name) != names.end(); };
  const std::string faces = has("faces.npy") ? "faces.npy" : "triangles.npy";
  if (has("vertices.npy") && has(faces.c_str())) {
    NpyFile points = open("vertices.npy"), corners = open(faces);
    return indexed_of(points, corners);
  }
  if (!has("triangles.npy") && names.size() != 1)
    refuse("has the arrays {}; expected 'triangles', or 'vertices' and 'faces'",
           names.empty() ? "(none)" : fmt::format("{}", fmt::join(names, ", ")));
  NpyFile triangles = open(has("triangles.npy") ? "triangles.npy" : names[0]);
  return soup_of(triangles, options);
}

}  // namespace ballot
