#include "engine/trace/auto/coherence.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

namespace ballot {

namespace {

constexpr std::size_t kRun = 64;  // neighbours that packets would hold together
constexpr double kCoherent = 0.9, kMixed = 0.4;
constexpr double kShort = 0.1;  // of the scene's diagonal

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

std::string ray_class_of(std::span<const Ray> rays, const Bounds& scene) {
  std::size_t runs = 0, agreeing = 0;
  for (std::size_t first = 0; first < rays.size(); first += kRun, ++runs)
    agreeing += agrees(rays.subspan(first, std::min(kRun, rays.size() - first)));
  std::vector<double> lengths;
  for (const Ray& r : rays)
    if (alive(r)) lengths.push_back(double(r.t_max) * glm::length(glm::dvec3(r.dir)));
  const double share = runs ? double(agreeing) / double(runs) : 1;
  bool is_short = false;
  if (!lengths.empty()) {
    const auto middle = lengths.begin() + std::ptrdiff_t(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    is_short = *middle < kShort * glm::length(glm::dvec3(scene.hi) - glm::dvec3(scene.lo));
  }
  return fmt::format("foreign: {}, {}",
                     share >= kCoherent ? "coherent"
                     : share >= kMixed  ? "mixed"
                                        : "incoherent",
                     is_short ? "short" : "long");
}

}  // namespace ballot
