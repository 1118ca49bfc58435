#include "engine/files/npy_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/memory.h"
#include "engine/files/npy_file.h"

namespace ballot {
namespace {

void write_array(const std::filesystem::path& path, const std::string& start, const void* data, std::size_t bytes) {
  write_atomically(path, [&](OutputFile& out) {
    out.write(start.data(), start.size());
    out.write(data, bytes);
  });
}

void write_column(const std::filesystem::path& path, std::string_view descr, std::uint64_t count, const void* data,
                  std::size_t bytes) {
  write_array(path, npy_start(descr, fmt::format("({},)", count)), data, bytes);
}

/// Rounds to float; what is finite stays finite.
float rounded(double value) {
  constexpr double limit = std::numeric_limits<float>::max();
  return float(std::isfinite(value) ? std::clamp(value, -limit, limit) : value);
}

}  // namespace

glm::vec3 PointsOfFile::about(const glm::dvec3& origin, std::size_t i) const {
  if (in_double.empty() && origin == glm::dvec3(0)) return single[i];
  const glm::dvec3 p = about_in_double(origin, i);
  return {rounded(p.x), rounded(p.y), rounded(p.z)};
}

PointsOfFile read_points(const std::filesystem::path& path) {
  NpyFile file(path);
  const NpyHeader& header = file.header();
  const bool wide = header.descr == "'<f8'";
  if (!wide && header.descr != "'<f4'")
    file.stop(file.found() +
              "; expected points, float32 '<f4' or float64 '<f8' of shape (n, 3); convert with "
              "numpy.ascontiguousarray(a, '<f4')");
  const auto& shape = *header.shape;
  if (shape.size() != 2 || shape[1] != 3) file.stop(file.found() + "; expected points of shape (n, 3): x y z");
  const std::size_t number = wide ? sizeof(double) : sizeof(float);
  file.expect_items(shape[0], 3 * number, number);
  if (shape[0] > std::numeric_limits<std::uint32_t>::max())
    file.stop(file.found() + "; expected less than 2^32 points; split the file");
  need_memory(shape[0] * 3 * number, fmt::format("{}: {} points", path.string(), shape[0]));
  PointsOfFile points;
  if (wide) {
    points.in_double.resize(shape[0]);
    file.read(points.in_double.data(), points.in_double.size() * sizeof(glm::dvec3));
  } else {
    points.single.resize(shape[0]);
    file.read(points.single.data(), points.single.size() * sizeof(glm::vec3));
  }
  return points;
}

std::vector<std::uint32_t> read_masks(const std::filesystem::path& path) {
  NpyFile file(path);
  const auto& shape = *file.header().shape;
  if (file.header().descr != "'<u4'" || shape.size() != 1)
    file.stop(file.found() + "; expected masks, uint32 '<u4' of shape (n,); convert with numpy.asarray(a, '<u4')");
  file.expect_items(shape[0], sizeof(std::uint32_t), sizeof(std::uint32_t));
  need_memory(shape[0] * sizeof(std::uint32_t), fmt::format("{}: {} masks", path.string(), shape[0]));
  std::vector<std::uint32_t> masks(shape[0]);
  file.read(masks.data(), masks.size() * sizeof(std::uint32_t));
  return masks;
}

void write_numbers(const std::filesystem::path& path, std::span<const float> numbers) {
  write_column(path, "'<f4'", numbers.size(), numbers.data(), numbers.size_bytes());
}
void write_numbers(const std::filesystem::path& path, std::span<const double> numbers) {
  write_column(path, "'<f8'", numbers.size(), numbers.data(), numbers.size_bytes());
}
void write_numbers(const std::filesystem::path& path, std::span<const std::uint32_t> numbers) {
  write_column(path, "'<u4'", numbers.size(), numbers.data(), numbers.size_bytes());
}
void write_volume(const std::filesystem::path& path, std::span<const float> numbers, std::uint32_t side) {
  const std::string shape = fmt::format("({}, {}, {})", side, side, side);
  write_array(path, path.extension() == ".raw" ? std::string() : npy_start("'<f4'", shape), numbers.data(),
              numbers.size_bytes());
}
void write_flags(const std::filesystem::path& path, std::span<const std::uint8_t> flags) {
  write_column(path, "'|b1'", flags.size(), flags.data(), flags.size_bytes());
}

std::string crossings_start(std::uint64_t count) {
  return npy_start("[('ray', '<u4'), ('t', '<f4'), ('prim', '<u4'), ('u', '<f4'), ('v', '<f4')]",
                   fmt::format("({:<20},)", count));
}

}  // namespace ballot
