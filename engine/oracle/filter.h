// The filter of the exact oracle: decides in double precision what a proved error bound allows it to decide. filter.cpp
// derives the bounds.
#pragma once

#include "engine/scene/scene.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// A ray that is not dead, in double precision.
struct FilterRay {
  explicit FilterRay(const Ray& ray);
  double o[3], d[3], inverse_d[3];  // inverse_d is 0 where d is 0
  double length;                    // |dx| + |dy| + |dz|
  double t_min, t_max;
};

/// A decision, or Unsure if the error bound does not allow for one.
enum class Sure { No, Yes, Unsure };

/// An interval that holds the exact t at which the ray's line meets the triangle's plane. It holds all numbers if det
/// may be 0.
struct Interval {
  double low, high;
};

/// A triangle as seen by a ray, with error bounds.
struct FilterSight {
  FilterSight(const FilterRay& ray, const Triangle& triangle);
  Sure hits_line() const;  // does the line hit the closed triangle, at any t?
  Interval t_bounds() const;

 private:
  Sure decide(const double (&error)[3]) const;
  double error_by_products(int side) const;

  const FilterRay& ray_;
  const Triangle& triangle_;
  double p_[3][3];  // the vertices minus the ray's origin
  double side_[3], side_error_;
};

}  // namespace ballot
