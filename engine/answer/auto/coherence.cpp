#include "engine/answer/auto/coherence.h"

#include <algorithm>
#include <cmath>

namespace ballot {

namespace {

constexpr std::size_t kRun = 64;  // neighbours that packets would hold together
constexpr double kCoherent = 0.9, kMixed = 0.4;

bool alive(const Ray& r) {
  float sum = r.t_min + r.t_max;
  for (int a = 0; a < 3; ++a) sum += r.origin[a] + r.dir[a];
  return std::isfinite(sum) && r.t_max > r.t_min;
}

unsigned octant(const Ray& r) {
  return unsigned(std::signbit(r.dir.x)) | unsigned(std::signbit(r.dir.y)) << 1 | unsigned(std::signbit(r.dir.z)) << 2;
}

/// Returns true if all live rays of a run point into one octant.
bool agrees(std::span<const Ray> run) {
  unsigned seen = 0;
  for (const Ray& r : run)
    if (alive(r)) seen |= 1u << octant(r);
  return (seen & (seen - 1)) == 0;
}

}  // namespace

std::string_view ray_class_of(std::span<const Ray> rays) {
  std::size_t runs = 0, agreeing = 0;
  for (std::size_t first = 0; first < rays.size(); first += kRun, ++runs)
    agreeing += agrees(rays.subspan(first, std::min(kRun, rays.size() - first)));
  const double share = runs ? double(agreeing) / double(runs) : 1;
  return share >= kCoherent ? "coherent" : share >= kMixed ? "mixed" : "incoherent";
}

}  // namespace ballot
