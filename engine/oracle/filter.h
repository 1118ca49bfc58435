// Decisions about a ray and a triangle in double precision that are given only where they are proved; the bounds'
// derivation is in filter.cpp.
#pragma once

#include "engine/scene/scene.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// A ray that is not dead, in double precision.
struct FilterRay {
  explicit FilterRay(const Ray& ray);
  double o[3], d[3], inverse_d[3];  // inverse_d: 0 where d is 0
  double length;                    // |dx| + |dy| + |dz|
  double t_min, t_max;
};

enum class Sure { No, Yes, Unsure };

/// Holds the exact t of the ray's line and the triangle's plane; all of the numbers, if det may be 0.
struct Interval {
  double low, high;
};

struct FilterSight {
  FilterSight(const FilterRay& ray, const Triangle& triangle);
  Sure hits_line() const;  // the closed triangle, for some t
  Interval t_bounds() const;

 private:
  Sure decide(const double (&error)[3]) const;
  double error_by_products(int side) const;

  const FilterRay& ray_;
  const Triangle& triangle_;
  double p_[3][3];  // the vertices, from the origin
  double side_[3], side_error_;
};

}  // namespace ballot
