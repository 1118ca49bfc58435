// The order in which rays are traced: rays that stand in rows, as those of a camera or a turning scanner do, are traced
// in tiles of 8 x 8, because the lanes of a subgroup go one way the farther the closer their rays are.
#pragma once

#include <algorithm>
#include <cstddef>

namespace ballot::api {

class RayArray;

/// An order of the rays of an array: their own, or by tiles of rows. Results do not depend on it.
class RowOrder {
 public:
  RowOrder() = default;

  /// Looks for rows in an array, at a few hundred rays of it and a first row. Rays stand in rows if a step to the next
  /// ray is short but at the end of each row, and rows lie side by side.
  static RowOrder find(const RayArray& rays);
  /// The order of `count` rays in rows of `width`.
  RowOrder(std::size_t count, std::size_t width);

  /// Length of a row; 0: the rays keep their order.
  std::size_t width() const { return width_; }
  /// The rays that are taken in tiles: those of whole bands of rows.
  std::size_t tiled() const { return tiled_; }

  /// Calls work(i, place, n) for each run of rays that stand side by side in the array: `n` rays from `place` on, which
  /// are traced as number first + i and those after it. The runs cover `count` rays from number `first` on.
  template <class Work>
  void for_runs(std::size_t first, std::size_t count, const Work& work) const {
    for_parts(first, count, work, [&](const Tiles& tiles, std::size_t i) {
      for (std::size_t tile = 0; tile < tiles.count; ++tile)
        for (std::size_t run = 0; run < kSide * kSide / kRun; ++run)
          work(i + tile * kSide * kSide + run * kRun,
               tiles.place + (run / 4 * 2 + run % 2) * width_ + tile * kSide + run / 2 % 2 * kRun, kRun);
    });
  }
  /// The same, but the rays of neighbouring tiles come row by row: writing them walks forwards through the array.
  template <class Work>
  void for_rows(std::size_t first, std::size_t count, const Work& work) const {
    for_parts(first, count, work, [&](const Tiles& tiles, std::size_t i) {
      for (std::size_t y = 0; y < kSide; ++y)
        for (std::size_t x = 0; x < kSide * tiles.count; x += kRun)
          work(i + x / kSide * kSide * kSide + (y / 2 * 2 + x / kRun % 2) * 8 + y % 2 * kRun,
               tiles.place + y * width_ + x, kRun);
    });
  }

 private:
  struct Run {
    std::size_t place, count;
  };
  struct Tiles {
    std::size_t place, count;
  };
  // A tile has two blocks side by side, four below each other. A block, of eight lanes, is 4 x 2 rays.
  static constexpr std::size_t kSide = 8;  // of a tile
  static constexpr std::size_t kRun = 4;   // rays of a block's row

  /// Calls over_tiles(tiles, i) for whole tiles and work(i, place, n) for runs of what is beside them.
  template <class Work, class OverTiles>
  void for_parts(std::size_t first, std::size_t count, const Work& work, const OverTiles& over_tiles) const {
    for (std::size_t i = 0; i < count;) {
      if (const Tiles tiles = tiles_at(first + i, count - i); tiles.count) {
        over_tiles(tiles, i);
        i += kSide * kSide * tiles.count;
        continue;
      }
      const Run run = run_at(first + i);
      const std::size_t n = std::min(run.count, count - i);
      work(i, run.place, n);
      i += n;
    }
  }
  /// Returns the whole tiles, side by side, that begin with the ray traced as number `at` and have `most` rays at most.
  Tiles tiles_at(std::size_t at, std::size_t most) const;
  /// Returns the run that the ray is in which is traced as number `at`, from that ray on.
  Run run_at(std::size_t at) const;

  std::size_t width_ = 0;
  std::size_t tiled_ = 0;
};

}  // namespace ballot::api
