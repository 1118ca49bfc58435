// Loads arrays of heights: a raster.
#include "engine/files/npy_heights.h"

#include <algorithm>
#include <memory>

#include "engine/files/loaders.h"
#include "engine/files/npy_rows.h"
#include "engine/model/mesh_vertices.h"
#include "engine/model/recentring.h"

namespace ballot {
namespace {

std::vector<float> read_heights(NpyFile& file, const Rows& rows) {
  std::vector<float> heights(rows.count * rows.width);
  if (rows.bytes == sizeof(float)) {
    file.read(heights.data(), heights.size() * sizeof(float));
    return heights;
  }
  std::vector<double> row(rows.width);
  for (std::size_t r = 0; r < rows.count; ++r) {
    file.read(row.data(), row.size() * sizeof(double));
    std::ranges::transform(row, heights.begin() + std::ptrdiff_t(r * rows.width), [](double h) { return float(h); });
  }
  return heights;
}

}  // namespace

Scene heights_of(NpyFile& file, const LoadOptions& options) {
  const Rows rows = rows_of(file);
  if (!rows.are_floats() || file.header().shape->size() != 2)
    refuse("{}; expected heights: float32 or float64 of shape (rows, columns)", file.found());
  const std::size_t samples = rows.count * rows.width;
  if (samples > kMaxTriangles / 2)
    refuse("has {} heights; expected at most {}; use a smaller scene", samples, kMaxTriangles / 2);
  file.expect_items(rows.count, rows.width * rows.bytes, rows.bytes);
  need_memory_for(samples * (sizeof(float) + sizeof(glm::vec3) + 2 * (sizeof(Triangle) + 3 * sizeof(std::uint32_t))),
                  fmt::format("{} heights", samples));
  HeightField field{.columns = rows.width};
  if (options.spacing != glm::dvec2(0)) field.spacing = options.spacing;
  try {
    check_grid(field, samples, "heights");
    field.heights = read_heights(file, rows);
    check_heights(field, "heights");
  } catch (const Error& e) {
    if (e.kind() != Failure::Arguments) throw;
    throw Flaw(e.what());
  }
  Scene scene;
  const HeightBox box = box_of(field);
  if (box.lo.x <= box.hi.x) scene.origin = origin_for(box.lo, box.hi);
  double moved = 0;
  scene.triangles.resize(field.triangles());
  expand(corners_of(field), positions_of(field, scene.origin, moved), scene.triangles);
  scene.instances.first = {0, scene.triangles.size()};
  scene.instances.mesh_labels.push_back({.columns = field.columns});
  scene.heights = std::make_shared<const HeightField>(std::move(field));
  complete_mesh(scene);
  return scene;
}

}  // namespace ballot
