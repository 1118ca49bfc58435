// A terrain, rays that see it, and where it may lie.
#pragma once

#include <array>
#include <cmath>
#include <cstdlib>

#include "api.h"

namespace terrain {

constexpr std::array<double, 3> kUtm{5e5, 5e6, 0};  // UTM metres
/// BALLOT_TERRAIN_RAYS asks for more, and for a finer terrain, of 180 000 triangles.
inline const std::size_t kRays = [] {
  const char* given = std::getenv("BALLOT_TERRAIN_RAYS");
  return given ? std::size_t(std::strtoull(given, nullptr, 10)) : std::size_t{4000};
}();
inline const std::uint32_t kSide = kRays > 4000 ? 300 : 100;

inline std::vector<double> moved(std::span<const float> vectors, const std::array<double, 3>& by) {
  std::vector<double> all(vectors.begin(), vectors.end());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] += by[i % 3];
  return all;
}

/// A terrain of 1000 metres, with coordinates in 64ths.
struct Terrain {
  Grid grid{kSide};
  Terrain() {
    for (std::size_t i = 0; i < grid.positions.size(); i += 3) {
      float* p = &grid.positions[i];
      p[0] = std::round(p[0] * 64000) / 64, p[1] = std::round(p[1] * 64000) / 64;
      p[2] = std::round(64 * (40 * std::sin(p[0] / 70) + 25 * std::cos(p[1] / 40))) / 64;
    }
  }
};

/// Rays that see the terrain, with origins in 64ths.
struct Sight {
  std::vector<float> origins, directions;
  Sight() {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> at(0, 1000), turn(-1, 1);
    for (std::size_t i = 0; i < kRays; ++i) {
      origins.insert(origins.end(), {std::round(at(random) * 64) / 64, std::round(at(random) * 64) / 64, 200});
      directions.insert(directions.end(), {turn(random), turn(random), -0.6f - turn(random) * 0.4f});
    }
  }
};

}  // namespace terrain
