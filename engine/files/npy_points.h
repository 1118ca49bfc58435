// NumPy .npy files of points and of the answers to queries.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

namespace ballot {

/// Points as a file has them: one of the lists is empty.
struct PointsOfFile {
  std::vector<glm::vec3> single;
  std::vector<glm::dvec3> in_double;

  std::uint64_t count() const { return single.size() + in_double.size(); }
  /// Returns a point, counted from an origin and rounded. A finite value beyond float32 becomes the largest float32.
  glm::vec3 about(const glm::dvec3& origin, std::size_t i) const;
  /// The same, not rounded.
  glm::dvec3 about_in_double(const glm::dvec3& origin, std::size_t i) const {
    return (in_double.empty() ? glm::dvec3(single[i]) : in_double[i]) - origin;
  }
};
/// Reads points: float32 or float64 of shape (n, 3), little endian. "-" is standard input. Throws Error(Work) that
/// names the file, the dtype and shape found, and those expected.
PointsOfFile read_points(const std::filesystem::path& path);

/// Reads a mask for each item: uint32 of shape (n,), little endian. Throws Error(Work) as read_points() does.
std::vector<std::uint32_t> read_masks(const std::filesystem::path& path);

/// Write one number for each query, as an array of shape (n,), atomically: float32, float64, uint32, or bool of 0 and
/// 1. Throw Error(Work).
void write_numbers(const std::filesystem::path& path, std::span<const float> numbers);
void write_numbers(const std::filesystem::path& path, std::span<const double> numbers);
void write_numbers(const std::filesystem::path& path, std::span<const std::uint32_t> numbers);
/// Writes numbers as a cubic volume of side^3, x fastest, atomically: an array of shape (side, side, side), or float32
/// without a header if the name ends in .raw. Throws Error(Work).
void write_volume(const std::filesystem::path& path, std::span<const float> numbers, std::uint32_t side);
void write_flags(const std::filesystem::path& path, std::span<const std::uint8_t> flags);

/// Returns the first bytes of a file of crossings, a structured array [('ray', '<u4'), ('t', '<f4'), ('prim', '<u4'),
/// ('u', '<f4'), ('v', '<f4')] of shape (count,). They are as many whatever the count is, so that they can be written
/// again once it is known. The records follow, 20 bytes each.
std::string crossings_start(std::uint64_t count);

}  // namespace ballot
