// Height fields: rasters of heights over a regular grid, whose cells are two triangles each. No Vulkan.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace ballot {

/// A raster of heights, row by row. Cell (r, c) lies between rows r and r + 1 and columns c and c + 1. Its triangles
/// are numbers 2 i and 2 i + 1, where i counts the cells row by row: of the samples (r, c), (r, c + 1), (r + 1, c + 1),
/// and (r, c), (r + 1, c + 1), (r + 1, c). Both turn counterclockwise, seen from above.
struct HeightField {
  std::size_t columns = 0;
  glm::dvec2 spacing{1};            // from a sample to the next of its row, and from a row to the next
  glm::dvec2 corner{0};             // x and y of the first sample
  std::vector<float> heights = {};  // NaN: there is none, so the triangles of the sample are no surface

  std::size_t rows() const { return heights.size() / columns; }
  std::size_t triangles() const { return 2 * (rows() - 1) * (columns - 1); }
  bool has(std::size_t sample) const { return !std::isnan(heights[sample]); }
  /// Returns where a sample lies, at height 0 if it has none.
  glm::dvec3 at(std::size_t sample) const {
    return {corner.x + double(sample % columns) * spacing.x, corner.y + double(sample / columns) * spacing.y,
            has(sample) ? heights[sample] : 0.0};
  }
};

/// Throws Error(Arguments), which begins with `where`, unless `samples` are two full rows of two columns at least, and
/// the numbers of the grid are finite, its spacing above 0.
void check_grid(const HeightField& grid, std::size_t samples, const std::string& where);
/// Throws Error(Arguments), which begins with `where` and names the sample, for a height beyond +-1e12.
void check_heights(const HeightField& field, const std::string& where);

/// A box of the samples that have heights; lo above hi if none has.
struct HeightBox {
  glm::dvec3 lo, hi;
};
HeightBox box_of(const HeightField& field);

/// Returns where the samples lie, counted from an origin and rounded. Writes how far that has moved one at most.
std::vector<glm::vec3> positions_of(const HeightField& field, const glm::dvec3& origin, double& moved);

/// Returns the samples at the corners of the triangles, three each. Where one has no height it is three times the first
/// sample that has one.
std::vector<std::uint32_t> corners_of(const HeightField& field);

/// Returns true if the same samples of two rasters of one size have heights.
bool have_same_holes(const HeightField& a, const HeightField& b);

}  // namespace ballot
