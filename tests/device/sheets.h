// Meshes whose vertices move, for tests.
#pragma once

#include <cmath>

#include "engine/model/mesh_vertices.h"
#include "engine/scene/device_scene.h"
#include "tests/device/forests.h"

namespace ballot {

using Positions = std::vector<glm::vec3>;

/// A square of 2 * side * side triangles over [-1, 1], which share their vertices.
struct Sheet {
  std::uint32_t side;
  float height;  // of the middle of it
  std::vector<std::uint32_t> corners = {};

  Sheet(std::uint32_t wanted, float at) : side(wanted), height(at) {
    for (std::uint32_t y = 0; y < side; ++y)
      for (std::uint32_t x = 0; x < side; ++x) {
        const std::uint32_t a = y * (side + 1) + x, b = a + side + 1;
        corners.insert(corners.end(), {a, a + 1, b, b, a + 1, b + 1});
      }
  }
  Positions positions(float phase, float scale = 1) const {
    Positions all;
    for (std::uint32_t y = 0; y <= side; ++y)
      for (std::uint32_t x = 0; x <= side; ++x) {
        const glm::vec2 at = 2.f * glm::vec2(x, y) / float(side) - 1.f;
        all.push_back(scale * glm::vec3(at.x, height + 0.2f * std::sin(7 * at.x + phase) * std::cos(5 * at.y), at.y));
      }
    return all;
  }
  UnsetVector<Triangle> triangles(float phase) const {
    UnsetVector<Triangle> all(corners.size() / 3);
    expand(corners, positions(phase), all);
    return all;
  }
};

/// Whether each mesh lies in the world by itself, or as instances.
enum class Made { Flat, Instances };
inline Scene scene_of(const std::vector<Sheet>& sheets, Made made) {
  Scene scene;
  scene.name = "sheets";
  scene.instances.first = {0};
  for (const Sheet& s : sheets) {
    const UnsetVector<Triangle> triangles = s.triangles(0);
    scene.triangles.insert(scene.triangles.end(), triangles.begin(), triangles.end());
    scene.instances.first.push_back(scene.triangles.size());
  }
  if (made == Made::Instances) {
    scene.instances.placements = {{0, {}},
                                  {1, forests::moved({0.1f, 0, 0})},
                                  {2, {}},
                                  {0, forests::turned(0.3f, 0.1f, glm::vec3(0.5f), {0, -2, 0})}};
    scene.instances.placed = true;
  }
  finish_scene(scene);
  return scene;
}

}  // namespace ballot
