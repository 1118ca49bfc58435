// A picture while it grows: sums over the samples of the pixels that are asked for.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "engine/trace/counters.h"
#include "shaders/shared/render.h"

namespace ballot {

/// Pixels [x0, x1) x [y0, y1) of a picture.
struct Window {
  std::uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool operator==(const Window&) const = default;
};

/// Every `count`-th tile of TILE_SIZE^2 pixels, from number `index` on, row by row.
struct Shard {
  std::uint32_t index = 0, count = 1;  // index below count
  bool operator==(const Shard&) const = default;
};

struct Film {
  std::uint32_t width = 0, height = 0;  // of the whole picture
  Window crop;                          // what of it is asked for
  Shard shard;
  std::uint32_t samples = 0;  // that every pixel has so far
  std::vector<std::uint32_t> listed =
      {};                               // its pixels, LISTED_PIXEL, in the order of their rays: shaders/shared/render.h
  std::vector<FilmPixel> pixels = {};   // one each, sums
  std::vector<glm::vec3> moments = {};  // sums of squared differences to the mean; empty where nobody asks for variance
  std::vector<RayStats> stats = {};     // sums; empty where nobody asks for counters
  std::uint64_t on_device = 0;  // names the sums that a Renderer holds and that are not here yet; 0: they are here

  bool holds(glm::uvec2 pixel) const {
    return pixel.x >= crop.x0 && pixel.x < crop.x1 && pixel.y >= crop.y0 && pixel.y < crop.y1;
  }
};

/// Room for the pixels of a crop window and shard. `samples` is 0 and the sums are zero. With `stats`, whole pictures also have the
/// dead rays of tiles that reach beyond them: what counters say depends on which rays share a subgroup.
Film make_film(std::uint32_t width, std::uint32_t height, const Window& crop, const Shard& shard, bool moments,
               bool stats);

}  // namespace ballot
