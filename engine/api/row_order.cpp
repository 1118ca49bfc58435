#include "engine/api/row_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "engine/api/sources.h"

namespace ballot::api {

namespace {

constexpr std::size_t kLeastWidth = 16;       // of rows that are worth it
constexpr std::size_t kMostWidth = 1u << 16;  // of rows that are looked for
constexpr std::size_t kRowsLookedAt = 16;
constexpr std::size_t kStepsLookedAt = 16;  // of a row
constexpr float kJump = 4;                  // a step at the end of a row is this many times the longest within it
constexpr float kFarthestRow = 16;          // rows that are more steps apart make tiles that are too long

/// Returns the distance of two rays, in origin and direction.
float step(const Ray& a, const Ray& b) {
  float sum = 0;
  for (int axis = 0; axis < 3; ++axis)
    sum += std::abs(a.origin[axis] - b.origin[axis]) + std::abs(a.dir[axis] - b.dir[axis]);
  return sum;
}

/// Returns false if the first rays are in no order: those that are eight steps apart are about as near to each other as
/// neighbours are. So random rays need no long search for the end of a row.
bool go_on(const RayArray& rays) {
  constexpr std::size_t kLookedAt = 64, kSteps = 8;
  std::array<Ray, kLookedAt> some;
  rays.read(0, some);
  float near = 0, far = 0;
  for (std::size_t i = 0; i + kSteps < kLookedAt; ++i)
    near += step(some[i], some[i + 1]), far += step(some[i], some[i + kSteps]);
  return !(far < 1.5f * near);
}

/// Returns the number of rays before the first long step, or 0.
std::size_t first_row(const RayArray& rays) {
  const std::size_t most = std::min(rays.count(), kMostWidth + 1);
  std::vector<Ray> some;
  float longest = 0;
  for (std::size_t i = 0; i + 1 < most; ++i) {
    if (i + 1 >= some.size()) {  // most rows are short
      some.resize(std::min(most, std::max<std::size_t>(2048, 4 * some.size())));
      rays.read(0, some);
    }
    const float s = step(some[i], some[i + 1]);
    if (i + 1 >= kLeastWidth && longest > 0 && s > kJump * longest) return i + 1;
    if (!(s < 1e30f)) return 0;
    longest = std::max(longest, s);
  }
  return 0;
}

/// Returns true if a row begins at ray `begin` and the next one at begin + width, side by side. Looks at a few of its
/// steps: a caller waits meanwhile.
bool is_row(const RayArray& rays, std::size_t begin, std::size_t width) {
  const auto pair = [&](std::size_t first) {
    std::array<Ray, 2> two;
    rays.read(begin + first, two);
    return two;
  };
  float longest = 0;
  for (std::size_t k = 0; k < kStepsLookedAt; ++k) {
    const auto two = pair(k * (width - 2) / (kStepsLookedAt - 1));
    longest = std::max(longest, step(two[0], two[1]));
  }
  const auto end = pair(width - 1);
  const float jump = step(end[0], end[1]), apart = step(pair(0)[0], end[1]);
  return longest > 0 && jump > kJump * longest && apart < kFarthestRow * longest;
}

}  // namespace

RowOrder::RowOrder(std::size_t count, std::size_t width)
    : width_(width), tiled_(width ? count / (kSide * width) * kSide * width : 0) {}

RowOrder RowOrder::find(const RayArray& rays) {
  if (rays.count() < kSide * kLeastWidth || !go_on(rays)) return {};
  const std::size_t width = first_row(rays);
  if (width == 0 || rays.count() < kSide * width) return {};
  const std::size_t rows = rays.count() / width - 1;  // whose next row is there too
  const std::size_t stride = std::max<std::size_t>(1, rows / kRowsLookedAt);
  for (std::size_t row = 0; row < rows; row += stride)
    if (!is_row(rays, row * width, width)) return {};
  return {rays.count(), width};
}

RowOrder::Tiles RowOrder::tiles_at(std::size_t at, std::size_t most) const {
  if (at >= tiled_) return {0, 0};
  const std::size_t whole = width_ / kSide * kSide, tile_rays = kSide * kSide;
  const std::size_t band = at / (kSide * width_) * (kSide * width_), in = at - band;
  if (in % tile_rays || in >= kSide * whole) return {0, 0};
  return {band + in / kSide, std::min(kSide * whole - in, most) / tile_rays};
}

RowOrder::Run RowOrder::run_at(std::size_t at) const {
  if (at >= tiled_) return {at, std::numeric_limits<std::size_t>::max()};
  const std::size_t whole = width_ / kSide * kSide, rest = width_ - whole, band_rays = kSide * width_;
  const std::size_t band = at / band_rays * band_rays, in = at - band;
  if (in >= kSide * whole) {  // columns beside the tiles
    const std::size_t k = in - kSide * whole, x = k % rest;
    return {band + k / rest * width_ + whole + x, rest - x};
  }
  const std::size_t tile = in / 64, block = in / 8 % 8, lane = in % 8;
  const std::size_t row = band + tile * kSide + block % 2 * 4 + (block / 2 * 2 + lane / 4) * width_;
  return {row + lane % 4, 4 - lane % 4};
}

}  // namespace ballot::api
