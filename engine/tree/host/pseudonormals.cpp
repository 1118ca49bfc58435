#include "engine/tree/host/pseudonormals.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "engine/tree/host/build.h"
#include "engine/tree/host/weld.h"

namespace ballot {

namespace {

constexpr std::size_t kTrianglesOfAThread = 1 << 12;

/// A corner of one triangle.
struct WeldedCorner {
  VertexKey at;
  std::uint32_t prim;
  std::uint8_t number;
  bool is_same(const WeldedCorner& other) const { return at == other.at; }
  friend bool operator<(const WeldedCorner& a, const WeldedCorner& b) {
    return a.at != b.at ? a.at < b.at : a.prim < b.prim;
  }
};

glm::dvec3 edge_of(const Triangle& t, std::size_t i) { return glm::dvec3(t[(i + 1) % 3]) - glm::dvec3(t[i]); }

/// Returns the unit normal, by the right-hand rule, of a triangle that has an area.
glm::dvec3 face_normal(const Triangle& t) { return glm::normalize(exact_cross(t[0], t[1], t[2])); }

double angle_at(const Triangle& t, std::size_t i) {
  const glm::dvec3 ahead = edge_of(t, i), back = -edge_of(t, (i + 2) % 3);
  return std::atan2(glm::length(exact_cross(t[0], t[1], t[2])), glm::dot(ahead, back));
}

/// Sorts the corners or edges of all triangles, and gives those that are the same the sum of weight(entry) times the
/// normal of its triangle, at place `first` and on of each triangle.
template <class Entry, class Weight>
void add_up(std::vector<Entry>& entries, std::span<const glm::dvec3> normals, std::size_t first, const Weight& weight,
            std::vector<glm::vec3>& all) {
  sort_on_all_cores(entries);
  for_equal(entries, [&](std::size_t begin, std::size_t end) {
    glm::dvec3 sum(0);
    for (std::size_t i = begin; i < end; ++i) sum += weight(entries[i]) * normals[entries[i].prim];
    for (std::size_t i = begin; i < end; ++i)
      all[PSEUDONORMALS * std::size_t(entries[i].prim) + first + entries[i].number] = glm::vec3(sum);
  });
}

}  // namespace

std::vector<glm::vec3> pseudonormals_of(std::span<const Triangle> triangles) {
  std::vector<glm::dvec3> normals(triangles.size(), glm::dvec3(0));
  for_chunks(triangles.size(), kTrianglesOfAThread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (!is_degenerate(triangles[i])) normals[i] = face_normal(triangles[i]);
  });
  std::vector<glm::vec3> all(PSEUDONORMALS * triangles.size(), glm::vec3(0));
  std::vector<WeldedCorner> corners;
  corners.reserve(3 * triangles.size());
  for (std::uint32_t prim = 0; prim < triangles.size(); ++prim)
    for (std::size_t i = 0; i < 3 && !is_degenerate(triangles[prim]); ++i)
      corners.push_back({key_of(triangles[prim][i]), prim, std::uint8_t(i)});
  add_up(
      corners, normals, 0, [&](const WeldedCorner& c) { return angle_at(triangles[c.prim], c.number); }, all);
  corners = {};
  std::vector<HalfEdge> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t prim = 0; prim < triangles.size(); ++prim)
    for (std::size_t i = 0; i < 3 && !is_degenerate(triangles[prim]); ++i)
      edges.push_back(HalfEdge::of(key_of(triangles[prim][i]), key_of(triangles[prim][(i + 1) % 3]), prim, i));
  add_up(
      edges, normals, 3, [](const HalfEdge&) { return 1.0; }, all);
  return all;
}

}  // namespace ballot
