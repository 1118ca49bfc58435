#include "engine/bvh/topology.h"

#include <algorithm>
#include <bit>
#include <compare>

#include "engine/bvh/build.h"
#include "engine/core/parallel.h"

namespace ballot {

namespace {

/// The bits of a vertex, with -0 as 0.
using Key = std::array<std::uint32_t, 3>;
Key key_of(const glm::vec3& v) {
  return {std::bit_cast<std::uint32_t>(v.x + 0.0f), std::bit_cast<std::uint32_t>(v.y + 0.0f),
          std::bit_cast<std::uint32_t>(v.z + 0.0f)};
}
glm::vec3 vertex_of(const Key& k) {
  return {std::bit_cast<float>(k[0]), std::bit_cast<float>(k[1]), std::bit_cast<float>(k[2])};
}

/// An edge of one triangle, from its smaller end; `back`: the triangle runs along it the other way.
struct HalfEdge {
  Key from, to;
  std::uint32_t prim;
  bool back;
  bool same_edge(const HalfEdge& other) const { return from == other.from && to == other.to; }
  friend bool operator<(const HalfEdge& a, const HalfEdge& b) {
    if (a.from != b.from) return a.from < b.from;
    if (a.to != b.to) return a.to < b.to;
    return a.prim < b.prim;
  }
};

/// Keeps the edges of the smallest prims.
void name(std::vector<FaultyEdge>& named, std::span<const HalfEdge> edge, std::size_t most) {
  const HalfEdge& first = edge.front();
  named.push_back({vertex_of(first.from), vertex_of(first.to), std::uint32_t(edge.size()), first.prim});
  if (most > named.size() || named.size() - most < 1024) return;
  std::ranges::stable_sort(named, {}, &FaultyEdge::prim);
  named.resize(most);
}

void finish(std::vector<FaultyEdge>& named, std::size_t most) {
  std::ranges::stable_sort(named, {}, &FaultyEdge::prim);
  if (named.size() > most) named.resize(most);
}

/// Sorts by parts, several at a time, which are then merged.
void sort_all(std::vector<HalfEdge>& edges) {
  const std::size_t part = std::max<std::size_t>(1 << 14, (edges.size() + core_count() - 1) / core_count());
  for_chunks(edges.size(), part, [&](std::size_t begin, std::size_t end) {
    std::sort(edges.begin() + std::ptrdiff_t(begin), edges.begin() + std::ptrdiff_t(end));
  });
  for (std::size_t end = part; end < edges.size(); end += part)
    std::inplace_merge(edges.begin(), edges.begin() + std::ptrdiff_t(end),
                       edges.begin() + std::ptrdiff_t(std::min(end + part, edges.size())));
}

}  // namespace

Topology topology_of(std::span<const Triangle> triangles, std::size_t most) {
  Topology t;
  t.triangles = triangles.size();
  std::vector<HalfEdge> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t prim = 0; prim < triangles.size(); ++prim) {
    const Key keys[3] = {key_of(triangles[prim][0]), key_of(triangles[prim][1]), key_of(triangles[prim][2])};
    if (keys[0] == keys[1] || keys[1] == keys[2] || keys[2] == keys[0]) continue;
    if (is_degenerate(triangles[prim])) {
      ++t.flat;
      continue;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Key &a = keys[i], &b = keys[(i + 1) % 3];
      edges.push_back(b < a ? HalfEdge{b, a, prim, true} : HalfEdge{a, b, prim, false});
    }
  }
  sort_all(edges);
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].same_edge(edges[begin])) ++end;
    const std::span<const HalfEdge> edge(edges.data() + begin, end - begin);
    ++t.edges;
    t.open += edge.size() % 2;
    if (edge.size() == 1) ++t.boundary, name(t.first_boundary, edge, most);
    if (edge.size() > 2) ++t.nonmanifold, name(t.first_nonmanifold, edge, most);
    if (edge.size() == 2 && edge[0].back == edge[1].back) ++t.flipped, name(t.first_flipped, edge, most);
  }
  for (auto* named : {&t.first_boundary, &t.first_nonmanifold, &t.first_flipped}) finish(*named, most);
  return t;
}

}  // namespace ballot
