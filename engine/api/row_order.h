// The order in which rays are traced: rays that stand in rows, as those of a camera or a turning scanner do, are traced
// in tiles of 8 x 8, because the lanes of a subgroup go one way the farther the closer their rays are.
#pragma once

#include <cstddef>
#include <span>

namespace ballot::api {

class RayArray;

/// An order of the rays of an array: their own, or by tiles of rows. Results do not depend on it.
class RowOrder {
 public:
  RowOrder() = default;

  /// Looks for rows in an array, at a few thousand rays of it. Rays stand in rows if a step to the next ray is short
  /// but at the end of each row, and rows lie side by side.
  static RowOrder find(const RayArray& rays);
  /// The order of `count` rays in rows of `width`.
  RowOrder(std::size_t count, std::size_t width);

  /// Length of a row; 0: the rays keep their order.
  std::size_t width() const { return width_; }

  /// Writes the places in the array of the rays that are traced as number `first` and those after it.
  void places(std::size_t first, std::span<std::size_t> places) const;

 private:
  std::size_t width_ = 0;
  std::size_t tiled_ = 0;  // rays of whole bands
};

}  // namespace ballot::api
