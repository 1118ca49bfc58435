#include "engine/model/heights.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/parallel.h"

namespace ballot {
namespace {

constexpr std::size_t kSamples = 1 << 16;  // that a thread takes at a time
constexpr float kHighest = 1e12f;          // as far as any vertex may lie

}  // namespace

void check_grid(const HeightField& grid, std::size_t samples, const std::string& where) {
  const std::size_t columns = grid.columns;
  if (columns < 2 || samples % columns || samples / columns < 2)
    fail(Failure::Arguments, "{}: {} heights in {} columns; expected two full rows at least, of two columns at least",
         where, samples, columns);
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  if (!positive(grid.spacing.x) || !positive(grid.spacing.y))
    fail(Failure::Arguments, "{}: the spacing of heights is ({}, {}); expected finite numbers above 0", where,
         grid.spacing.x, grid.spacing.y);
  if (!std::isfinite(grid.corner.x) || !std::isfinite(grid.corner.y))
    fail(Failure::Arguments, "{}: the corner of heights is ({}, {}); expected finite numbers", where, grid.corner.x,
         grid.corner.y);
}

void check_heights(const HeightField& field, const std::string& where) {
  for_chunks(field.heights.size(), kSamples, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (std::abs(field.heights[i]) > kHighest)  // false for NaN
        fail(Failure::Arguments,
             "{}: the height in row {}, column {} is {}; expected a number within +-1e12, or NaN for none", where,
             i / field.columns, i % field.columns, field.heights[i]);
  });
}

HeightBox box_of(const HeightField& field) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto of = [&](std::size_t begin, std::size_t end) {
    HeightBox box{glm::dvec3(kInfinity), glm::dvec3(-kInfinity)};
    for (std::size_t i = begin; i < end; ++i)
      if (const glm::dvec3 p = field.at(i); field.has(i)) box = {glm::min(box.lo, p), glm::max(box.hi, p)};
    return box;
  };
  const auto join = [](const HeightBox& a, const HeightBox& b) {
    return HeightBox{glm::min(a.lo, b.lo), glm::max(a.hi, b.hi)};
  };
  return joined_chunks(field.heights.size(), kSamples, of(0, 0), of, join);
}

std::vector<glm::vec3> positions_of(const HeightField& field, const glm::dvec3& origin, double& moved) {
  std::vector<glm::vec3> positions(field.heights.size());
  const auto round = [&](std::size_t begin, std::size_t end) {
    double most = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const glm::dvec3 p = field.at(i) - origin;
      positions[i] = glm::vec3(p);
      if (field.has(i)) most = std::max(most, glm::length(glm::dvec3(positions[i]) - p));
    }
    return most;
  };
  const auto larger = [](double a, double b) { return std::max(a, b); };
  moved = joined_chunks(positions.size(), kSamples, 0.0, round, larger);
  return positions;
}

std::vector<std::uint32_t> corners_of(const HeightField& field) {
  const auto none = [](float height) { return std::isnan(height); };
  const auto found = std::ranges::find_if_not(field.heights, none);
  const auto first = std::uint32_t(found == field.heights.end() ? 0 : found - field.heights.begin());
  std::vector<std::uint32_t> corners(3 * field.triangles());
  const std::size_t columns = field.columns, cells = columns - 1;
  for_chunks(field.triangles() / 2, kSamples, [&](std::size_t begin, std::size_t end) {
    for (std::size_t cell = begin; cell < end; ++cell) {
      const std::size_t low = cell / cells * columns + cell % cells, high = low + columns;
      const std::size_t samples[2][3] = {{low, low + 1, high + 1}, {low, high + 1, high}};
      for (std::size_t k = 0; k < 2; ++k) {
        const auto& s = samples[k];
        const bool whole = field.has(s[0]) && field.has(s[1]) && field.has(s[2]);
        for (std::size_t i = 0; i < 3; ++i) corners[6 * cell + 3 * k + i] = whole ? std::uint32_t(s[i]) : first;
      }
    }
  });
  return corners;
}

bool have_same_holes(const HeightField& a, const HeightField& b) {
  return std::ranges::equal(a.heights, b.heights, [](float x, float y) { return std::isnan(x) == std::isnan(y); });
}

}  // namespace ballot
