// The filter of the exact oracle: decides in double precision what a proved error bound allows it to decide. filter.cpp
// derives the bounds.
#pragma once

#include "engine/core/geometry.h"
#include "engine/model/recentring.h"

namespace ballot {

/// A ray that is not dead, in double precision.
struct FilterRay {
  explicit FilterRay(const RayInDouble& ray);
  explicit FilterRay(const Ray& ray) : FilterRay(in_double(ray)) {}
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
  /// Returns whether the line crosses the triangle, if it does or does not by more than the error bound. Ties, which
  /// some rule has to break, are Unsure.
  Sure crosses_line() const;
  Interval t_bounds() const;
  /// Returns the sign of det, or 0 if the error bound does not allow for one.
  int side_of_plane() const;
  /// Finds the weights of vertices 1 and 2. Returns false if their error may exceed `error`. The line must hit the
  /// triangle.
  bool weights(double& u, double& v, double error) const;

 private:
  Sure decide(const double (&error)[3]) const;
  Sure decide_strictly(const double (&error)[3]) const;
  double error_by_products(int side) const;

  const FilterRay& ray_;
  const Triangle& triangle_;
  double p_[3][3];  // the vertices minus the ray's origin
  double side_[3], side_error_;
};

}  // namespace ballot
