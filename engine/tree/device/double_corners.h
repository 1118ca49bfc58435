// The vertices of a scene in double, for numeric mode "double".
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/tree/host/corners_in_double.h"

namespace ballot {

/// The triangles of a scene in double, of which its trees have the roundings. On the device they lie as
/// shaders/lib/numeric/sheared_double.glsl reads them: of each mesh of the trees a texel with its first triangle's
/// place, then five texels a triangle. Belongs to the thread of its Context.
class DoubleCorners {
 public:
  /// `corners`: of all triangles, in the order of Scene::triangles. `first`: of each mesh of the trees, the number of
  /// its first triangle. `top_room`: how far rounding moves a vertex in the world at most, where instances place it.
  DoubleCorners(std::vector<CornersInDouble> corners, std::vector<std::size_t> first, float top_room);

  std::span<const CornersInDouble> here() const { return corners_; }
  /// Returns a bound of how far rounding moves a vertex in its mesh's space, along an axis.
  float room() const { return room_; }
  float top_room() const { return top_room_; }
  /// Returns the array on the device, made on first use. Throws Error(Work) if the device has no room for it.
  const Buffer<glm::uvec4>& texels(Context& gpu);

 private:
  std::vector<CornersInDouble> corners_;
  std::vector<std::size_t> first_;
  float room_ = 0, top_room_;
  std::optional<Buffer<glm::uvec4>> texels_;
};

}  // namespace ballot
