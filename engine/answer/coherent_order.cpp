#include "engine/answer/coherent_order.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>

#include "engine/core/key_sort.h"

namespace ballot {

namespace {

constexpr int kPointKeyBits = 30, kRayKeyBits = 18, kOctantBits = 3;

/// Spreads the lower ten bits of x, so that two bits are free behind each.
std::uint32_t spread(std::uint32_t x) {
  x = (x | x << 16) & 0x030000FFu;
  x = (x | x << 8) & 0x0300F00Fu;
  x = (x | x << 4) & 0x030C30C3u;
  return (x | x << 2) & 0x09249249u;
}

/// Returns the Morton code of a point of the unit cube, with `bits` bits an axis. Points beyond it are moved to its
/// sides; NaN is zero.
std::uint32_t morton_code(const glm::vec3& unit, int bits) {
  const float cells = float(1 << bits);
  const auto cell = [&](float x) { return std::uint32_t(int(std::max(0.0f, std::min(x * cells, cells - 1)))); };
  return spread(cell(unit.x)) << 2 | spread(cell(unit.y)) << 1 | spread(cell(unit.z));
}

/// Scales points of the bounds, and of `room` times their sides around them, to the unit cube.
struct Frame {
  Frame(const Bounds& b, float room) {
    const glm::vec3 sides = b.hi - b.lo;
    lo = b.lo - room * sides;
    for (int k = 0; k < 3; ++k) inverse[k] = sides[k] > 0 ? 1 / ((1 + 2 * room) * sides[k]) : 0;
  }
  glm::vec3 unit(const glm::vec3& p) const { return (p - lo) * inverse; }
  glm::vec3 lo, inverse{0};
};

}  // namespace

void order_points(std::span<const ProbePoint> points, const Bounds& bounds, std::vector<std::uint32_t>& order) {
  const Frame frame(bounds, 0.25f);
  order_by(
      points.size(), [&](std::size_t i) { return morton_code(frame.unit(points[i].at), 10); }, kPointKeyBits, order);
}

void order_boxes(std::span<const ProbeBox> boxes, const Bounds& bounds, std::vector<std::uint32_t>& order) {
  const Frame frame(bounds, 0.25f);
  const auto key = [&](std::size_t i) {
    return morton_code(frame.unit(0.5f * boxes[i].lo + 0.5f * boxes[i].hi), kPointKeyBits / 3);
  };
  order_by(boxes.size(), key, kPointKeyBits, order);
}

bool order_rays(std::span<const Ray> rays, const Bounds& bounds, std::vector<std::uint32_t>& order) {
  const Frame frame(bounds, 0);
  const auto key = [&](std::size_t i) {
    // Signs and sizes of random directions are random, so this has no branches.
    const glm::vec3& d = rays[i].dir;
    const float x = std::fabs(d.x), y = std::fabs(d.y), z = std::fabs(d.z), half = 0.5f * std::max(x, std::max(y, z));
    const std::uint32_t octant = std::uint32_t(std::signbit(d.x)) << 2 | std::uint32_t(std::signbit(d.y)) << 1 |
                                 std::uint32_t(std::signbit(d.z));
    const std::uint32_t to = std::uint32_t(x > half) << 2 | std::uint32_t(y > half) << 1 | std::uint32_t(z > half);
    return octant << 15 | to << 12 | morton_code(frame.unit(rays[i].origin), 4);
  };
  // Rays of a camera or from one place are alike.
  const std::size_t sample = std::min<std::size_t>(rays.size(), 4096);
  std::size_t alike = 0;
  for (std::size_t i = 1; i < sample; ++i) alike += key(i) == key(i - 1);
  if (2 * alike >= sample) return false;
  // Some eight rays a key: finer keys take longer to sort than they save.
  const int bits = std::clamp(int(std::bit_width(rays.size())) - 3, kOctantBits, kRayKeyBits);
  order_by(
      rays.size(), [&](std::size_t i) { return key(i) >> (kRayKeyBits - bits); }, bits, order);
  return true;
}

}  // namespace ballot
