// Lights that are no triangles: points, spots, suns, and the sky.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace ballot {

/// KHR_lights_punctual.
struct Light {
  enum class Kind : std::uint32_t { Point = 0, Spot = 1, Directional = 2 };
  std::string name = {};
  Kind kind = Kind::Point;
  glm::vec3 position{0};          // world, scene units; not of a directional light
  glm::vec3 direction{0, 0, -1};  // unit, where it shines to; not of a point light
  glm::vec3 intensity{1};         // colour times intensity: radiant intensity; irradiance of a directional light
  float range = 0;                // scene units; 0: without end
  float inner_angle = 0, outer_angle = 0.7853981634f;  // of a spot's cone to its axis, radians
};

/// What rays that leave the scene see.
struct Sky {
  enum class Kind : std::uint32_t { None = 0, Constant = 1, Gradient = 2, Map = 3 };
  Kind kind = Kind::None;
  glm::vec3 zenith{1}, horizon{1}, ground{1};  // radiance above, at and below the horizon; a constant sky's is zenith
  std::string map_name = {};                   // its file
  std::uint32_t width = 0, height = 0;         // of the map: longitude by latitude, the middle looks to -z, +y on top
  std::vector<glm::vec3> map = {};             // radiance, row by row from the top

  /// Radiance from a unit direction: what shaders/lib/shade/sky.glsl computes, for tests and tables.
  glm::vec3 radiance(const glm::vec3& direction) const;
};

/// A sky from a word: "none"; "R,G,B", constant; "gradient" or "gradient:R,G,B:R,G,B:R,G,B" (zenith, horizon, ground);
/// or the path of an EXR that is twice as wide as high, longitude by latitude, with R, G, B. Values are radiance, finite and
/// not below 0. Throws Error(Arguments) for another word, Error(Work) for a picture that cannot be used.
Sky make_sky(const std::string& word);

}  // namespace ballot
