#include "engine/render/film/film.h"

#include "engine/render/data/camera.h"

namespace ballot {

Film make_film(std::uint32_t width, std::uint32_t height, const Window& crop, const Shard& shard, bool moments,
               bool stats) {
  Film film{.width = width, .height = height, .crop = crop, .shard = shard};
  const bool whole = crop == Window{0, 0, width, height};
  constexpr std::uint32_t kTileRays = TILE_SIZE * TILE_SIZE;
  film.listed.reserve(std::size_t(crop.x1 - crop.x0) * (crop.y1 - crop.y0) / shard.count + kTileRays);
  for (std::uint32_t tile = shard.index; tile * kTileRays < padded_rays(width, height); tile += shard.count)
    for (std::uint32_t ray = tile * kTileRays; ray < (tile + 1) * kTileRays; ++ray) {
      const glm::uvec2 at = pixel_of(ray, width);
      const bool padding = stats && whole && (at.x >= width || at.y >= height);
      if (film.holds(at) || padding) film.listed.push_back(LISTED_PIXEL(at.x, at.y));
    }
  film.pixels.assign(film.listed.size(), FilmPixel{});
  if (moments) film.moments.assign(film.listed.size(), glm::vec3(0));
  if (stats) film.stats.assign(film.listed.size(), RayStats{});
  return film;
}

}  // namespace ballot
