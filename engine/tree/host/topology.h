// The edges of a mesh: whether it is closed, manifold and consistently wound.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "engine/tree/host/forest.h"

namespace ballot {

/// An edge with a fault, as its two ends, the number of triangles at it and the first of them.
struct FaultyEdge {
  glm::vec3 from{0}, to{0};
  std::uint32_t triangles = 0, prim = 0;
};

/// What is known of the edges of a mesh. Vertices are the same if their coordinates are equal; 0 and -0 are. Triangles
/// without area have no edges here, as no query finds them: a gap that one closes stays open. `flat` counts those with
/// three different vertices, `triangles` all.
struct Topology {
  std::uint64_t triangles = 0, flat = 0, edges = 0;
  std::uint64_t open = 0;         // edges of an odd number of triangles; the inside test by parity needs 0
  std::uint64_t boundary = 0;     // edges of one triangle
  std::uint64_t nonmanifold = 0;  // edges of more than two triangles
  std::uint64_t flipped = 0;      // edges whose two triangles run along them in the same direction
  std::vector<FaultyEdge> first_boundary, first_nonmanifold, first_flipped;  // in the order of prim

  bool closed() const { return open == 0; }
  bool manifold() const { return nonmanifold == 0; }
  bool consistently_wound() const { return flipped == 0; }
};

/// Returns the ends of the edges of an odd number of triangles, Topology::open of them.
std::vector<std::array<glm::vec3, 2>> open_edges(std::span<const Triangle> triangles);

/// Finds the topology of triangles, on all cores, and names at most `most` faulty edges of each sort.
Topology topology_of(std::span<const Triangle> triangles, std::size_t most = 10);

/// Finds that of a forest: of the mesh of each instance by itself, as vertices of two instances are never the same.
/// Numbers are counted through the instances, and ends of edges lie where closest points have them (moved_corners.h).
Topology topology_of(const Forest& forest, std::size_t most = 10);

}  // namespace ballot
