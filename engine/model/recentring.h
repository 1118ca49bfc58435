// Questions in double, asked of a scene whose float32 numbers are counted from an origin. No Vulkan.
#pragma once

#include <algorithm>
#include <glm/vec3.hpp>
#include <limits>

#include "engine/core/geometry.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// A ray in the world, in double.
struct RayInDouble {
  glm::dvec3 origin{0};
  double t_min = 0;
  glm::dvec3 dir{0};
  double t_max = std::numeric_limits<double>::infinity();
};

static_assert(sizeof(RayInDouble) == 64);  // as kernels read it: shaders/lib/numeric/in_double.glsl

inline RayInDouble in_double(const Ray& r) {
  return {glm::dvec3(r.origin), double(r.t_min), glm::dvec3(r.dir), double(r.t_max)};
}
/// Rounds a ray to float32. An infinite t_max is no bound.
inline Ray rounded(const RayInDouble& r) {
  return {glm::vec3(r.origin), float(r.t_min), glm::vec3(r.dir),
          std::min(float(r.t_max), std::numeric_limits<float>::max())};
}

/// Makes float32 questions about an origin of questions in the world.
class Recentring {
 public:
  /// `box` holds the scene, about `origin`.
  Recentring(const glm::dvec3& origin, const Bounds& box);

  const glm::dvec3& origin() const { return origin_; }
  /// Has rays stay where they start, for questions that are asked in double.
  void stay() { stays_ = true; }
  /// Returns a ray about the origin, in double. No bound becomes the largest float.
  RayInDouble about(const RayInDouble& given) const;
  /// Returns true if a ray that starts there loses digits of the scene's size as float32: if it is farther from the box
  /// than two of its diagonals. What float32 cannot hold is not far: it is no ray.
  bool is_far(const glm::dvec3& at) const { return !is_near(at) && is_held(at); }
  /// Returns true if no ray that starts in a box is far.
  bool holds(const glm::dvec3& lo, const glm::dvec3& hi) const { return is_near(lo) && is_near(hi); }
  /// Returns a ray about the origin, rounded. One that starts far is moved along itself before, in double, to where it
  /// enters the box, and writes to `moved` by how much its t is less: else 0. Its place there is off by at most 2^-51
  /// of the distance, and by what rounding takes: 2^-24 of the box's size along an axis. If it misses the box it is
  /// dead.
  Ray ray(const RayInDouble& given, double& moved) const;
  /// Returns a point about the origin, rounded.
  glm::vec3 point(const glm::dvec3& at) const { return glm::vec3(at - origin_); }

 private:
  bool is_near(const glm::dvec3& at) const {
    const glm::dvec3 p = at - origin_;
    return p.x >= near_lo_.x && p.x <= near_hi_.x && p.y >= near_lo_.y && p.y <= near_hi_.y && p.z >= near_lo_.z &&
           p.z <= near_hi_.z;
  }
  static bool is_held(const glm::dvec3& v);

  glm::dvec3 origin_, lo_, hi_, near_lo_, near_hi_;
  double diagonal_;
  bool stays_ = false;
};

/// Returns the origin that float32 numbers within a box of the world are best counted from: zero unless that costs
/// more than 2^-24 of the box's longest side, else its middle with few digits, so that differences from it are exact
/// where doubles allow.
glm::dvec3 origin_for(const glm::dvec3& lo, const glm::dvec3& hi);

}  // namespace ballot
