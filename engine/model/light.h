// Lights that are not triangles: point, spot and directional lights, and the sky.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace ballot {

/// A punctual light, as in the glTF extension KHR_lights_punctual.
struct Light {
  enum class Kind : std::uint32_t { Point = 0, Spot = 1, Directional = 2 };
  std::string name = {};
  Kind kind = Kind::Point;
  glm::vec3 position{0};          // world space, scene units; unused for a directional light
  glm::vec3 direction{0, 0, -1};  // unit vector, the direction in which it shines; unused for a point light
  glm::vec3 intensity{1};         // colour times intensity: radiant intensity; irradiance for a directional light
  float range = 0;                // scene units; 0: unlimited
  float inner_angle = 0, outer_angle = 0.7853981634f;  // of a spot's cone, measured from its axis, radians
  int node = -1;                                       // of Scene::animation, that moves the light; -1: none
};

/// The radiance that rays see when they leave the scene.
struct Sky {
  enum class Kind : std::uint32_t { None = 0, Constant = 1, Gradient = 2, Map = 3 };
  Kind kind = Kind::None;
  glm::vec3 zenith{1}, horizon{1}, ground{1};  // radiance straight up, at and below the horizon; constant sky: zenith
  std::string map_name = {};                   // file of the map
  std::uint32_t width = 0, height = 0;         // of the map: longitude by latitude, -z in the middle, +y on top
  std::vector<glm::vec3> map = {};             // radiance, row by row from the top

  /// Returns the radiance from a unit direction, as shaders/lib/shade/sky.glsl computes it. For tests.
  glm::vec3 radiance(const glm::vec3& direction) const;
};

}  // namespace ballot
