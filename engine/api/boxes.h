// Reads the boxes of a call from the caller's memory.
#pragma once

#include <span>

#include "engine/api/sources.h"

namespace ballot::api {

/// The boxes of a call.
class BoxArray {
 public:
  /// Throws Refused if the description is wrong.
  explicit BoxArray(const BallotBoxes& boxes);
  std::size_t count() const { return shape_.count; }
  /// Fills `boxes` from number `first` of the array on. Corners in double, or about an origin, are rounded outward. An
  /// infinite corner becomes the largest float, which is no bound either.
  void read(std::uint64_t first, std::span<ProbeBox> boxes) const;
  const FilterColumns& filters() const { return filters_; }
  /// Asks a scene: what is read then are boxes about its origin.
  void ask(const SceneState& scene) { origin_ = scene.world->scene_facts().origin; }

 private:
  Shape shape_;
  Lane low_, high_;
  FilterColumns filters_;
  glm::dvec3 origin_{0};  // of the scene that is asked
};

}  // namespace ballot::api
