// Vertices of a file in double, as they come, for float32 about an origin. Internal to engine/files.
#pragma once

#include <glm/common.hpp>
#include <limits>
#include <utility>
#include <vector>

#include "engine/model/recentring.h"

namespace ballot {

/// Rounds vertices to float32 about zero, and about an origin in the end if that keeps digits (origin_for()). What
/// float32 loses is kept beside them as long as they may lie far from zero.
class FileVertices {
 public:
  /// Adds a vertex of finite numbers.
  void add(const glm::dvec3& v) {
    const glm::vec3& rounded = all_.emplace_back(v);
    if (!keeps_) return;
    rests_.emplace_back(v - glm::dvec3(rounded));
    any_rest_ = any_rest_ || rests_.back() != glm::vec3(0);
    lo_ = glm::min(lo_, v), hi_ = glm::max(hi_, v);
    const glm::dvec3 sides = hi_ - lo_, far = glm::max(glm::abs(lo_), glm::abs(hi_));
    // Where this fails it fails for all boxes around, and so does the rule of origin_for().
    keeps_ = glm::max(far.x, glm::max(far.y, far.z)) > glm::max(sides.x, glm::max(sides.y, sides.z));
    if (!keeps_) std::vector<glm::vec3>().swap(rests_);
  }
  void reserve(std::size_t count) { all_.reserve(count); }
  /// Counts all vertices from an origin, which it returns. Call it once, behind the last one.
  glm::dvec3 settle() {
    const glm::dvec3 origin = keeps_ && any_rest_ ? origin_for(lo_, hi_) : glm::dvec3(0);
    if (origin != glm::dvec3(0))
      for (std::size_t i = 0; i < all_.size(); ++i)
        all_[i] = glm::vec3((glm::dvec3(all_[i]) - origin) + glm::dvec3(rests_[i]));
    std::vector<glm::vec3>().swap(rests_);
    return origin;
  }

  std::size_t size() const { return all_.size(); }
  const glm::vec3& operator[](std::size_t i) const { return all_[i]; }
  std::vector<glm::vec3> take() { return std::move(all_); }

 private:
  std::vector<glm::vec3> all_, rests_;
  glm::dvec3 lo_{std::numeric_limits<double>::infinity()}, hi_{-std::numeric_limits<double>::infinity()};
  bool keeps_ = true, any_rest_ = false;
};

}  // namespace ballot
