#include "engine/render/film/film.h"

#include "engine/render/data/camera.h"

namespace ballot {

Film make_film(std::uint32_t width, std::uint32_t height, const Window& crop, const Shard& shard, bool moments,
               bool stats) {
  Film film{.width = width, .height = height, .crop = crop, .shard = shard};
  constexpr std::uint32_t kTileRays = TILE_SIZE * TILE_SIZE;
  const std::uint32_t tiles_x = (width + TILE_SIZE - 1) / TILE_SIZE;
  const std::uint32_t begin = crop.y0 / TILE_SIZE * tiles_x, end = (crop.y1 + TILE_SIZE - 1) / TILE_SIZE * tiles_x;
  const bool whole_tiles =
      crop.x0 == 0 && crop.x1 == width && crop.y0 % TILE_SIZE == 0 && (crop.y1 % TILE_SIZE == 0 || crop.y1 == height);
  film.listed.reserve(std::size_t(crop.x1 - crop.x0) * (crop.y1 - crop.y0) / shard.count + kTileRays);
  const std::uint64_t skipped = begin > shard.index ? (begin - shard.index + shard.count - 1) / shard.count : 0;
  for (std::uint64_t tile = shard.index + skipped * shard.count; tile < end; tile += shard.count)
    for (std::uint32_t i = 0; i < kTileRays; ++i) {
      const glm::uvec2 at = pixel_of(std::uint32_t(tile) * kTileRays + i, width);
      const bool padding = stats && whole_tiles && (at.x >= width || at.y >= height);
      if (film.holds(at) || padding) film.listed.push_back(LISTED_PIXEL(at.x, at.y));
    }
  film.pixels.assign(film.listed.size(), FilmPixel{});
  if (moments) film.moments.assign(film.listed.size(), glm::vec3(0));
  if (stats) film.stats.assign(film.listed.size(), RayStats{});
  return film;
}

}  // namespace ballot
