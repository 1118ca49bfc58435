#include "engine/bvh/topology.h"

#include <algorithm>

#include "engine/bvh/build.h"
#include "engine/bvh/weld.h"

namespace ballot {

namespace {

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

}  // namespace

Topology topology_of(std::span<const Triangle> triangles, std::size_t most) {
  Topology t;
  t.triangles = triangles.size();
  std::vector<HalfEdge> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t prim = 0; prim < triangles.size(); ++prim) {
    const VertexKey keys[3] = {key_of(triangles[prim][0]), key_of(triangles[prim][1]), key_of(triangles[prim][2])};
    if (keys[0] == keys[1] || keys[1] == keys[2] || keys[2] == keys[0]) continue;
    if (is_degenerate(triangles[prim])) {
      ++t.flat;
      continue;
    }
    for (std::size_t i = 0; i < 3; ++i) edges.push_back(HalfEdge::of(keys[i], keys[(i + 1) % 3], prim, i));
  }
  sort_on_all_cores(edges);
  for_equal(edges, [&](std::size_t begin, std::size_t end) {
    const std::span<const HalfEdge> edge(edges.data() + begin, end - begin);
    ++t.edges;
    t.open += edge.size() % 2;
    if (edge.size() == 1) ++t.boundary, name(t.first_boundary, edge, most);
    if (edge.size() > 2) ++t.nonmanifold, name(t.first_nonmanifold, edge, most);
    if (edge.size() == 2 && edge[0].back == edge[1].back) ++t.flipped, name(t.first_flipped, edge, most);
  });
  for (auto* named : {&t.first_boundary, &t.first_nonmanifold, &t.first_flipped}) finish(*named, most);
  return t;
}

}  // namespace ballot
