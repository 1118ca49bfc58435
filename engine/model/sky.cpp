// The radiance of a sky.
#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/gtc/constants.hpp>

#include "engine/model/light.h"

namespace ballot {

glm::vec3 Sky::radiance(const glm::vec3& d) const {
  if (kind == Kind::None) return glm::vec3(0);
  if (kind == Kind::Constant) return zenith;
  if (kind == Kind::Gradient) return d.y >= 0 ? glm::mix(horizon, zenith, std::sqrt(d.y)) : ground;
  const float u = 0.5f + std::atan2(d.x, -d.z) * glm::one_over_two_pi<float>();
  const float v = std::acos(std::clamp(d.y, -1.0f, 1.0f)) * glm::one_over_pi<float>();
  const auto x = std::min(std::uint32_t(u * float(width)), width - 1);
  const auto y = std::min(std::uint32_t(v * float(height)), height - 1);
  return map[std::size_t(y) * width + x];
}

}  // namespace ballot
