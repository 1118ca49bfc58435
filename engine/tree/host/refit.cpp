#include "engine/tree/host/refit.h"

#include <atomic>
#include <glm/common.hpp>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/model/scene.h"
#include "engine/tree/host/build.h"

namespace ballot {

namespace {

// A fixed size, so that sums over chunks do not depend on the machine.
constexpr std::size_t kRefitChunk = 1 << 15;

std::size_t chunks_of(std::size_t count) { return (count + kRefitChunk - 1) / kRefitChunk; }

/// The share of a chunk of nodes in a refit.
struct ChunkShare {
  double cost = 0;                   // by the SAH, not divided by the area of the root
  std::vector<std::uint32_t> later;  // nodes with children that other chunks finish, the last first
};

/// Refits a tree. Nodes come in depth-first order: children lie behind their parents, mostly close. So each chunk is
/// gone through from its end. Nodes that wait for others are left, with a NaN as their mark, and finished by one
/// thread: they are about as many in each chunk as the tree is deep.
class Refit {
 public:
  Refit(Bvh& bvh, std::span<const Triangle> triangles, const BuildSettings& settings)
      : bvh_(bvh), triangles_(triangles), settings_(settings), parts_(chunks_of(bvh.nodes.size())) {}

  void run() {
    for_chunks(bvh_.nodes.size(), kRefitChunk, [&](std::size_t begin, std::size_t end) { refit_chunk(begin, end); });
    double cost = 0;
    for (std::size_t p = parts_.size(); p-- > 0;) {
      for (const std::uint32_t i : parts_[p].later) unite(bvh_.nodes[i], parts_[p]);
      cost += parts_[p].cost;
    }
    const BvhNode& root = bvh_.nodes[0];
    bvh_.bounds = {root.lo, root.hi};
    const double whole = half_area(root.lo, root.hi);
    bvh_.stats.sah = whole > 0 ? cost / whole : sah_cost(bvh_, settings_);
  }

 private:
  void refit_chunk(std::size_t begin, std::size_t end) {
    ChunkShare& part = parts_[begin / kRefitChunk];
    for (std::size_t i = end; i-- > begin;) {
      if (i == 1) continue;  // not used
      BvhNode& node = bvh_.nodes[i];
      if (node.count > 0) {
        refit_leaf(node, part);
      } else if (node.first + 1 < end && is_done(node.first) && is_done(node.first + 1)) {
        unite(node, part);
      } else {
        node.lo.x = std::numeric_limits<float>::quiet_NaN();
        part.later.push_back(std::uint32_t(i));
      }
    }
  }

  bool is_done(std::size_t node) const { return bvh_.nodes[node].lo.x == bvh_.nodes[node].lo.x; }

  void refit_leaf(BvhNode& leaf, ChunkShare& part) const {
    Bounds box = bounds_of(triangles_[bvh_.references[leaf.first]]);
    for (std::uint32_t k = 1; k < leaf.count; ++k) {
      const Bounds other = bounds_of(triangles_[bvh_.references[leaf.first + k]]);
      box = {glm::min(box.lo, other.lo), glm::max(box.hi, other.hi)};
    }
    leaf.lo = box.lo;
    leaf.hi = box.hi;
    part.cost += half_area(box.lo, box.hi) * double{settings_.intersection_cost} * leaf.count;
  }

  void unite(BvhNode& node, ChunkShare& part) const {
    const BvhNode &left = bvh_.nodes[node.first], &right = bvh_.nodes[node.first + 1];
    node.lo = glm::min(left.lo, right.lo);
    node.hi = glm::max(left.hi, right.hi);
    part.cost += half_area(node.lo, node.hi) * double{settings_.traversal_cost};
  }

  Bvh& bvh_;
  const std::span<const Triangle> triangles_;
  const BuildSettings& settings_;
  std::vector<ChunkShare> parts_;
};

bool is_in_range(const Triangle& t) {
  const glm::vec3 far = glm::max(glm::abs(t[0]), glm::max(glm::abs(t[1]), glm::abs(t[2])));
  const float sum = t[0].x + t[0].y + t[0].z + t[1].x + t[1].y + t[1].z + t[2].x + t[2].y + t[2].z;
  return sum == sum && far.x <= kLargestVertex && far.y <= kLargestVertex && far.z <= kLargestVertex;
}

}  // namespace

MovedTriangles check_moved(std::span<const Triangle> before, std::size_t degenerate, std::span<const Triangle> now,
                           std::string_view scene) {
  if (now.size() != before.size())
    fail(Failure::Arguments, "scene '{}' has {} triangles, but {} are to take their place; expected as many", scene,
         before.size(), now.size());
  if (now.empty()) return {};
  std::vector<Bounds> parts(chunks_of(now.size()));
  std::atomic<bool> valid{true}, same{true};
  for_chunks(now.size(), kRefitChunk, [&](std::size_t begin, std::size_t end) {
    Bounds box = bounds_of(now[begin]);
    bool fits = true, alike = true;
    for (std::size_t i = begin; i < end; ++i) {
      const Bounds own = bounds_of(now[i]);
      box = {glm::min(box.lo, own.lo), glm::max(box.hi, own.hi)};
      fits &= is_in_range(now[i]);
      alike &= is_degenerate(now[i]) == (degenerate > 0 && is_degenerate(before[i]));
    }
    parts[begin / kRefitChunk] = box;
    if (!fits) valid = false;
    if (!alike) same = false;
  });
  if (!valid) {  // one of the two names the triangle
    bounds_of_vertices(now, scene);
    check_triangles(now);
  }
  MovedTriangles moved{parts[0], same};
  for (const Bounds& part : parts)
    moved.bounds = {glm::min(moved.bounds.lo, part.lo), glm::max(moved.bounds.hi, part.hi)};
  return moved;
}

void refit_bvh(Bvh& bvh, std::span<const Triangle> triangles, const BuildSettings& settings) {
  if (!bvh.nodes.empty()) Refit(bvh, triangles, settings).run();
}

}  // namespace ballot
