// Ray reordering on devices that are the CPU. Kernels would take seven times as long there: lavapipe reads and writes
// lane by lane.
#include <cmath>
#include <glm/common.hpp>

#include "engine/answer/reorder.h"
#include "engine/core/key_sort.h"
#include "engine/core/stopwatch.h"

namespace ballot {

namespace {

constexpr std::size_t kCopied = 1 << 13;  // rays

/// Spread the bits of x, so that two bits, or one, are free behind each.
std::uint32_t spread_by_2(std::uint32_t x) {
  x = (x | x << 8) & 0x300Fu;
  x = (x | x << 4) & 0x30C3u;
  return (x | x << 2) & 0x9249u;
}
std::uint32_t spread_by_1(std::uint32_t x) {
  x = (x | x << 2) & 0x33u;
  return (x | x << 1) & 0x55u;
}

/// Returns the number of the cell of x in [0, 1]. Numbers beyond are moved to the ends, NaN to the first.
std::uint32_t cell_of(float x, std::uint32_t cells) {
  return x > 0 ? std::uint32_t(std::min(x * float(cells), float(cells - 1))) : 0;
}

/// Makes the keys of shaders/reorder/keys.comp.
class RayKeys {
 public:
  explicit RayKeys(const Bounds& b) : scene_(b) {
    for (int k = 0; k < 3; ++k) inverse_[k] = b.hi[k] > b.lo[k] ? 1 / (b.hi[k] - b.lo[k]) : 0;
  }

  std::uint32_t operator()(const Ray& r) const {
    if (!(r.t_max > r.t_min)) return (1u << REORDER_KEY_BITS) - 1;
    const glm::vec3 inv = 1.0f / r.dir, near = glm::min((scene_.lo - r.origin) * inv, (scene_.hi - r.origin) * inv);
    const float begin = std::max(r.t_min, std::max(near.x, std::max(near.y, near.z)));
    const glm::vec3 unit = (r.origin + begin * r.dir - scene_.lo) * inverse_;
    const std::uint32_t origin = spread_by_2(cell_of(unit.x, 64)) | spread_by_2(cell_of(unit.y, 32)) << 2 |
                                 spread_by_2(cell_of(unit.z, 32)) << 1;
    return origin << 8 | direction(r.dir);
  }

 private:
  static std::uint32_t direction(const glm::vec3& dir) {
    const glm::vec3 n = dir / (std::abs(dir.x) + std::abs(dir.y) + std::abs(dir.z));
    glm::vec2 at(n.x, n.y);
    if (n.z < 0) at = {std::copysign(1 - std::abs(n.y), n.x), std::copysign(1 - std::abs(n.x), n.y)};
    return spread_by_1(cell_of(0.5f * at.x + 0.5f, 16)) << 1 | spread_by_1(cell_of(0.5f * at.y + 0.5f, 16));
  }

  Bounds scene_;
  glm::vec3 inverse_{0};
};

/// Calls work(), and then done() with the milliseconds that it took.
template <class Work>
void timed(const Context::Done& done, const Work& work) {
  const Timer timer;
  work();
  done(timer.ms());
}

template <class T>
const T* read_of(const Buffer<T>& buffer) {
  return reinterpret_cast<const T*>(buffer.mapped());
}

/// Copies records to the places of their rays.
template <class T>
void scatter(const Buffer<T>& from, const std::vector<std::uint32_t>& order, std::uint32_t first, Buffer<T>& to) {
  const T* records = read_of(from);
  T* places = reinterpret_cast<T*>(to.mapped()) + first;
  for_chunks(order.size(), kCopied, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) places[order[i]] = records[i];
  });
}

}  // namespace

void Reorder::sort_on_host(const GivenRays& given, const Bounds& scene, const Context::Done& done) {
  gpu_.finish();
  timed(done, [&] {
    const Ray* rays = read_of(given.rays) + given.range.begin;
    Ray* sorted = reinterpret_cast<Ray*>(rays_->mapped());
    const std::size_t count = given.range.end - given.range.begin;
    const RayKeys key_of(scene);
    order_by(
        count, [&](std::size_t i) { return key_of(rays[i]); }, REORDER_KEY_BITS, host_order_);
    for_chunks(count, kCopied, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) sorted[i] = rays[host_order_[i]];
    });
  });
  push_.first = given.range.begin;
}

void Reorder::put_back_on_host(Buffer<Hit>& hits, const Context::Done& done, Buffer<RayStats>* stats) {
  gpu_.finish();
  timed(done, [&] {
    scatter(*hits_, host_order_, push_.first, hits);
    if (stats) scatter(*stats_, host_order_, push_.first, *stats);
  });
}

}  // namespace ballot
