#include "engine/tree/host/topology.h"

#include <algorithm>
#include <optional>

#include "engine/tree/host/build.h"
#include "engine/tree/host/moved_corners.h"
#include "engine/tree/host/weld.h"

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

/// Adds the edges of an instance, as long as there is room.
void name_moved(std::vector<FaultyEdge>& named, std::span<const FaultyEdge> of_mesh, const Transform& transform,
                std::uint32_t first, std::size_t most) {
  for (const FaultyEdge& edge : of_mesh)
    if (named.size() < most)
      named.push_back(
          {moved_corner(transform, edge.from), moved_corner(transform, edge.to), edge.triangles, first + edge.prim});
}

void finish(std::vector<FaultyEdge>& named, std::size_t most) {
  std::ranges::stable_sort(named, {}, &FaultyEdge::prim);
  if (named.size() > most) named.resize(most);
}

}  // namespace

/// Returns the edges of all triangles with area, those that are the same next to each other. Adds the triangles without
/// area that have three different vertices to `flat`.
static std::vector<HalfEdge> half_edges(std::span<const Triangle> triangles, std::uint64_t& flat) {
  std::vector<HalfEdge> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t prim = 0; prim < triangles.size(); ++prim) {
    const VertexKey keys[3] = {key_of(triangles[prim][0]), key_of(triangles[prim][1]), key_of(triangles[prim][2])};
    if (keys[0] == keys[1] || keys[1] == keys[2] || keys[2] == keys[0]) continue;
    if (is_degenerate(triangles[prim])) {
      ++flat;
      continue;
    }
    for (std::size_t i = 0; i < 3; ++i) edges.push_back(HalfEdge::of(keys[i], keys[(i + 1) % 3], prim, i));
  }
  sort_on_all_cores(edges);
  return edges;
}

std::vector<std::array<glm::vec3, 2>> open_edges(std::span<const Triangle> triangles) {
  std::vector<std::array<glm::vec3, 2>> open;
  std::uint64_t flat = 0;
  const std::vector<HalfEdge> edges = half_edges(triangles, flat);
  for_equal(edges, [&](std::size_t begin, std::size_t end) {
    if ((end - begin) % 2) open.push_back({vertex_of(edges[begin].from), vertex_of(edges[begin].to)});
  });
  return open;
}

Topology topology_of(std::span<const Triangle> triangles, std::size_t most) {
  Topology t;
  t.triangles = triangles.size();
  const std::vector<HalfEdge> edges = half_edges(triangles, t.flat);
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

Topology topology_of(const Forest& forest, std::size_t most) {
  std::vector<std::optional<Topology>> of_mesh(forest.meshes().size());
  Topology all;
  for (std::size_t i = 0; i < forest.size(); ++i) {
    std::optional<Topology>& mesh = of_mesh[forest.mesh_of(i)];
    const MeshTree& of = forest.meshes()[forest.mesh_of(i)];  // shapes have no edges
    if (!mesh) mesh = topology_of(of.kind == ShapeKind::Triangles ? of.triangles : std::span<const Triangle>(), most);
    all.triangles += mesh->triangles, all.flat += mesh->flat, all.edges += mesh->edges, all.open += mesh->open;
    all.boundary += mesh->boundary, all.nonmanifold += mesh->nonmanifold, all.flipped += mesh->flipped;
    const auto add = [&](std::vector<FaultyEdge>& named, const std::vector<FaultyEdge>& edges) {
      name_moved(named, edges, forest.transforms()[i], forest.first_of(i), most);
    };
    add(all.first_boundary, mesh->first_boundary);
    add(all.first_nonmanifold, mesh->first_nonmanifold);
    add(all.first_flipped, mesh->first_flipped);
  }
  return all;
}

}  // namespace ballot
