// The sign of the volume of four points, det [b - a, c - a, d - a], is decided in double precision if it is above a
// bound of its rounding error. With u = 2^-53 and m the largest component of the three vectors, each component is
// off by u m, a component of the cross product of two of them by 8 u m^2 (engine/oracle/filter.cpp), and the sum of
// its products with the third vector by (8 + 2 + 2 + 2) u m^2 times the sum of that vector's components. 32 u m^2
// times that sum are taken. Below it integers decide.
#include "engine/oracle/self_crossings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <mutex>
#include <optional>

#include "engine/bvh/bvh.h"
#include "engine/core/parallel.h"
#include "engine/oracle/dyadic.h"
#include "engine/oracle/walker.h"

namespace ballot {
namespace {

constexpr std::size_t kCrossingChunk = 512;
constexpr std::size_t kMostPairs = 10;

int exact_side(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d) {
  std::array<std::array<Dyadic, 3>, 3> v;
  const glm::vec3* ends[3] = {&b, &c, &d};
  for (std::size_t i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) v[i][std::size_t(k)] = Dyadic((*ends[i])[k]) - Dyadic(a[k]);
  Dyadic sum;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    sum = sum + v[2][k] * (v[0][l] * v[1][m] - v[0][m] * v[1][l]);
  }
  return sum.sign();
}

/// Returns the sign of the volume of four points: 0 if they lie in a plane.
int side_of(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d) {
  const glm::dvec3 from(a), x = glm::dvec3(b) - from, y = glm::dvec3(c) - from, z = glm::dvec3(d) - from;
  const glm::dvec3 size = glm::max(glm::max(glm::abs(x), glm::abs(y)), glm::abs(z)), parts = glm::abs(z);
  const double m = std::max({size.x, size.y, size.z}), volume = glm::dot(glm::cross(x, y), z);
  const double error = 0x1p-48 * m * m * (parts.x + parts.y + parts.z);
  return volume > error ? 1 : volume < -error ? -1 : exact_side(a, b, c, d);
}

bool edge_passes(const glm::vec3& p, const glm::vec3& q, const Triangle& t) {
  const int at_p = side_of(t[0], t[1], t[2], p);
  if (at_p == 0 || at_p + side_of(t[0], t[1], t[2], q) != 0) return false;
  const int first = side_of(p, q, t[0], t[1]);
  return first != 0 && side_of(p, q, t[1], t[2]) == first && side_of(p, q, t[2], t[0]) == first;
}

struct Box {
  explicit Box(const Triangle& t)
      : lo(glm::min(t[0], glm::min(t[1], t[2]))), hi(glm::max(t[0], glm::max(t[1], t[2]))) {}
  bool meets(const glm::vec3& other_lo, const glm::vec3& other_hi) const {
    return glm::all(glm::lessThanEqual(lo, other_hi)) && glm::all(glm::lessThanEqual(other_lo, hi));
  }
  glm::vec3 lo, hi;
  double t_min = 0;
};

std::optional<double> enter(const Box& box, const Bounds& node, double) {
  return box.meets(node.lo, node.hi) ? std::optional(0.0) : std::nullopt;
}

}  // namespace

bool pass_through(const Triangle& a, const Triangle& b) {
  for (std::size_t i = 0; i < 3; ++i)
    if (edge_passes(a[i], a[(i + 1) % 3], b) || edge_passes(b[i], b[(i + 1) % 3], a)) return true;
  return false;
}

SelfCrossings self_crossings(std::span<const Triangle> triangles, const Progress& progress) {
  const Bvh bvh = build_bvh(triangles, {.builder = BuilderId::Balanced});
  const PairTree tree = encode_pairs(bvh, triangles, NodeLayout::Interleaved);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  std::mutex mutex;
  std::size_t done = 0;
  for_chunks(triangles.size(), kCrossingChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> mine;
    Walker walker(tree);
    for (std::size_t i = begin; i < end; ++i) {
      const Box box(triangles[i]);
      walker.walk(box, 0.0, [&](std::uint32_t texel) {
        const std::uint32_t prim = decode_prim(tree, texel);
        if (prim <= i) return true;
        const Box other(triangles[prim]);
        if (box.meets(other.lo, other.hi) && pass_through(triangles[i], triangles[prim]))
          mine.emplace_back(std::uint32_t(i), prim);
        return true;
      });
    }
    const std::lock_guard lock(mutex);
    pairs.insert(pairs.end(), mine.begin(), mine.end());
    done += end - begin;
    if (progress) progress(double(done) / double(triangles.size()));
  });
  SelfCrossings found;
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  for (const auto& [a, b] : pairs) found.prims.push_back(a), found.prims.push_back(b);
  std::ranges::sort(found.prims);
  found.prims.erase(std::unique(found.prims.begin(), found.prims.end()), found.prims.end());
  found.first.assign(pairs.begin(), pairs.begin() + std::ptrdiff_t(std::min(kMostPairs, pairs.size())));
  return found;
}

}  // namespace ballot
