#include "engine/tree/device/double_corners.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/gpu/context.h"

namespace ballot {

namespace {

constexpr std::size_t kTexelsOfTriangle = 5, kTrianglesAtOnce = 1 << 14;
static_assert(sizeof(CornersInDouble) <= kTexelsOfTriangle * sizeof(glm::uvec4));

double largest_coordinate(std::span<const CornersInDouble> corners) {
  double most = 0;
  for (const CornersInDouble& triangle : corners)
    for (const glm::dvec3& v : triangle) most = std::max({most, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return most;
}

}  // namespace

DoubleCorners::DoubleCorners(std::vector<CornersInDouble> corners, std::vector<std::size_t> first, float top_room)
    : corners_(std::move(corners)), first_(std::move(first)), top_room_(top_room) {
  room_ = float(kRoundedToSingle * largest_coordinate(corners_));
}

const Buffer<glm::uvec4>& DoubleCorners::texels(Context& gpu) {
  if (texels_) return *texels_;
  const std::size_t count = first_.size() + kTexelsOfTriangle * corners_.size();
  if (count > gpu.info().max_texels)
    fail(Failure::Work, "numeric mode double: {} triangles need {} texels, but {} has buffers of {}", corners_.size(),
         count, gpu.info().name, gpu.info().max_texels);
  std::vector<glm::uvec4> texels(count);
  for (std::size_t i = 0; i < first_.size(); ++i)
    texels[i].x = std::uint32_t(first_.size() + kTexelsOfTriangle * first_[i]);
  for_chunks(corners_.size(), kTrianglesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      std::memcpy(&texels[first_.size() + kTexelsOfTriangle * i], &corners_[i], sizeof corners_[i]);
  });
  texels_.emplace(gpu, count, Access::Texel | Access::Storage, "triangles in double");
  texels_->upload(texels);
  return *texels_;
}

}  // namespace ballot
