// The oracle's arithmetic: tests one ray against triangles and boxes in double precision. Internal to engine/oracle.
//
// Woop, Benthin, Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013. The ray is sheared onto the z axis. The
// signs of the edge functions of the projected triangle decide. An edge function depends on its two vertices alone and
// only changes its sign with their order, so neighbours agree on a shared edge.
#pragma once

#include <optional>

#include "engine/oracle/oracle.h"

namespace ballot {

/// A ray prepared for the tests in double precision.
struct RayFrame {
  RayFrame(const RayInDouble& ray, const Bounds& bounds);
  RayFrame(const Ray& ray, const Bounds& bounds) : RayFrame(in_double(ray), bounds) {}
  double o[3], d[3], inverse_d[3];
  int kx, ky, kz;  // kz: the main axis, along which |d| is largest
  double sx, sy, sz;
  double t_min, t_max;
  double pad[3];                             // width that is added to boxes on each side, scene units
  Arithmetic arithmetic = Arithmetic::Woop;  // the triangle test whose rounding error is judged
};

/// A triangle sheared onto the ray. A side is twice the area that the ray's point spans with an edge.
struct Sight {
  Sight(const RayFrame& ray, const Triangle& triangle);
  double x[3], y[3];  // lateral position of the vertices, scene units
  double z[3];        // depth of the vertices, in multiples of the ray's direction, as t
  double side[3];     // edge function opposite to each vertex: U, V, W
  double det;         // their sum
  double reach;       // largest distance of a vertex from the origin along an axis, scene units

  double t() const { return (side[0] * z[0] + side[1] * z[1] + side[2] * z[2]) / det; }
  double weight(int vertex) const { return side[vertex] / det; }
};

/// Returns the hit of the triangle in double precision, edges included, or nothing.
std::optional<OracleHit> intersect(const RayFrame& ray, const Triangle& triangle, std::uint32_t prim);

/// Returns the nearest hit in a mesh, with the mesh's own numbers.
OracleHit nearest_in(const PlacedMesh& mesh);

/// Returns the t at which the ray enters the padded box, or nothing if it misses it in [ray.t_min, t_far].
std::optional<double> enter(const RayFrame& ray, const Bounds& box, double t_far);

}  // namespace ballot
