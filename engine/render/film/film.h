// A film: the sums over the samples of the requested pixels of a picture.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "engine/answer/counters.h"
#include "engine/core/unset.h"
#include "shaders/shared/render.h"

namespace ballot {

/// The pixels [x0, x1) x [y0, y1) of a picture.
struct Window {
  std::uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool operator==(const Window&) const = default;
};

/// Every `count`-th tile of a picture, from tile `index` on. A tile has TILE_SIZE^2 pixels; tiles count row by row.
struct Shard {
  std::uint32_t index = 0, count = 1;  // index < count
  bool operator==(const Shard&) const = default;
};

/// The sums of a picture while it is rendered, one record per pixel of `listed`.
struct Film {
  std::uint32_t width = 0, height = 0;  // pixels of the whole picture
  Window crop;                          // the requested part of the picture
  Shard shard;                          // the requested tiles of that part
  std::uint32_t samples = 0;            // samples that every pixel has so far
  /// The pixels of the film as LISTED_PIXEL words, in the order of their rays (shaders/shared/render.h).
  UnsetVector<std::uint32_t> listed = {};
  UnsetVector<FilmPixel> pixels = {};   // sums, one record per listed pixel
  std::vector<glm::vec3> moments = {};  // sums of squared differences from the mean; empty unless variance is requested
  std::vector<RayStats> stats = {};     // sums of counters; empty unless counters are requested
  /// The id of the sums if a Renderer still holds them on the device; `pixels` and `moments` are then out of date.
  /// 0: the sums are here.
  std::uint64_t on_device = 0;

  /// Returns true if the pixel (x, y) lies in the crop window.
  bool holds(glm::uvec2 pixel) const {
    return pixel.x >= crop.x0 && pixel.x < crop.x1 && pixel.y >= crop.y0 && pixel.y < crop.y1;
  }
};

/// Returns a film for the pixels of a crop window and shard, with `samples` 0 and all sums zero. `moments` and `stats`
/// say which optional sums the film has. With `stats`, rows of whole tiles also list the dead rays of tiles that
/// extend beyond the picture: counter values depend on which rays share a subgroup.
Film make_film(std::uint32_t width, std::uint32_t height, const Window& crop, const Shard& shard, bool moments,
               bool stats);

}  // namespace ballot
