// The nearest points are a corner and the other triangle, or two inner points of edges; or an edge passes through the
// other triangle (Ericson. Real-Time Collision Detection, 2005, section 5.1.10). A product of two vectors has small
// relative errors in each component (difference_of_products()), so that the line along which two edges, or a corner and
// a plane, are apart is known however thin the triangle and however small the angle. What is not known then is where
// along the edges the nearest points are; the distance does not depend on that, as it grows with the square there.
#include "engine/core/triangle_distance.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "engine/core/exact_area.h"

namespace ballot {

namespace {

glm::dvec3 cross_of(const glm::dvec3& a, const glm::dvec3& b) {
  return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
          difference_of_products(a.x, b.y, a.y, b.x)};
}

/// A triangle whose corners are relative to some point, with its edges and its normal.
struct Face {
  explicit Face(const TriangleInDouble& triangle, const glm::dvec3& from)
      : corner{triangle[0] - from, triangle[1] - from, triangle[2] - from},
        edge{triangle[1] - triangle[0], triangle[2] - triangle[1], triangle[0] - triangle[2]},
        normal(cross_of(edge[0], edge[1])),
        normal2(glm::dot(normal, normal)) {}

  /// Returns true if a point near the plane is within all edges.
  bool holds(const glm::dvec3& point) const {
    for (std::size_t i = 0; i < 3; ++i)
      if (glm::dot(cross_of(normal, edge[i]), point - corner[i]) < 0) return false;
    return normal2 > 0;
  }
  double height(const glm::dvec3& point) const { return glm::dot(normal, point - corner[0]); }

  TriangleInDouble corner;
  std::array<glm::dvec3, 3> edge;
  glm::dvec3 normal;
  double normal2;
};

/// The nearest points that were found so far.
class Nearest {
 public:
  void take(double distance, const glm::dvec3& a, const glm::dvec3& b) {
    if (distance < gap_.distance) gap_ = {distance, a, b};
  }
  const TriangleGap& gap() const { return gap_; }

 private:
  TriangleGap gap_{std::numeric_limits<double>::infinity()};
};

/// Takes the nearest point of an edge and of the inside for a corner of the other triangle. `take` is given both.
template <class Take>
void meet_corner(const Face& face, const glm::dvec3& point, const Take& take) {
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 from = point - face.corner[i];
    const double along = glm::dot(from, face.edge[i]), length2 = glm::dot(face.edge[i], face.edge[i]);
    const double share = length2 > 0 ? std::fmin(std::fmax(along / length2, 0.0), 1.0) : 0.0;
    const glm::dvec3 foot = face.corner[i] + share * face.edge[i];
    take(glm::length(point - foot), foot, point);
  }
  if (!face.holds(point)) return;
  const double height = face.height(point);
  take(std::abs(height) / std::sqrt(face.normal2), point - face.normal * (height / face.normal2), point);
}

/// Takes inner points of two edges that are not parallel.
void meet_edges(const glm::dvec3& p, const glm::dvec3& u, const glm::dvec3& q, const glm::dvec3& v, Nearest& nearest) {
  const glm::dvec3 n = cross_of(u, v), w = q - p;
  const double n2 = glm::dot(n, n);
  if (n2 == 0) return;
  const double s = glm::dot(cross_of(w, v), n) / n2, t = glm::dot(cross_of(w, u), n) / n2;
  if (!(s >= 0 && s <= 1 && t >= 0 && t <= 1)) return;
  nearest.take(std::abs(glm::dot(w, n)) / std::sqrt(n2), p + s * u, q + t * v);
}

/// Takes the point where an edge passes through a face.
void meet_through(const Face& face, const glm::dvec3& p, const glm::dvec3& u, Nearest& nearest) {
  const double from = face.height(p), to = face.height(p + u);
  if (!(from <= 0 && to >= 0) && !(from >= 0 && to <= 0)) return;
  if (from == to) return;  // in the plane: edges and corners know
  const glm::dvec3 at = p + u * (from / (from - to));
  if (face.holds(at)) nearest.take(0, at, at);
}

}  // namespace

TriangleGap triangle_distance(const TriangleInDouble& a, const TriangleInDouble& b) {
  const glm::dvec3 from = a[0];
  const Face first(a, from), second(b, from);
  Nearest nearest;
  for (std::size_t i = 0; i < 3; ++i) {
    meet_corner(first, second.corner[i], [&](double distance, const glm::dvec3& foot, const glm::dvec3& point) {
      nearest.take(distance, foot, point);
    });
    meet_corner(second, first.corner[i], [&](double distance, const glm::dvec3& foot, const glm::dvec3& point) {
      nearest.take(distance, point, foot);
    });
    for (std::size_t k = 0; k < 3; ++k)
      meet_edges(first.corner[i], first.edge[i], second.corner[k], second.edge[k], nearest);
    meet_through(second, first.corner[i], first.edge[i], nearest);
    meet_through(first, second.corner[i], second.edge[i], nearest);
  }
  TriangleGap gap = nearest.gap();
  gap.a += from, gap.b += from;
  return gap;
}

}  // namespace ballot
