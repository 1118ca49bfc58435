#include "engine/render/film/film.h"

#include "engine/core/parallel.h"
#include "engine/render/data/camera.h"

namespace ballot {

namespace {

/// The pixels of a tile are listed from `first` on.
struct ListedTile {
  std::uint32_t tile;
  std::size_t first;
};

/// Returns how many pixels of a tile lie in the crop window.
std::uint32_t pixels_in(const Film& film, std::uint32_t tile) {
  const glm::uvec2 lo = pixel_of(tile * kTileRays, film.width);
  const auto shared = [](std::uint32_t begin, std::uint32_t from, std::uint32_t to) {
    const std::uint32_t first = std::max(begin, from), end = std::min(begin + TILE_SIZE, to);
    return first < end ? end - first : 0;
  };
  return shared(lo.x, film.crop.x0, film.crop.x1) * shared(lo.y, film.crop.y0, film.crop.y1);
}

/// Lists the pixels of the film's tiles. padded: those beyond the picture too.
void list_pixels(Film& film, bool padded) {
  const std::uint32_t tiles_x = (film.width + TILE_SIZE - 1) / TILE_SIZE;
  const std::uint32_t begin = film.crop.y0 / TILE_SIZE * tiles_x;
  const std::uint32_t end = (film.crop.y1 + TILE_SIZE - 1) / TILE_SIZE * tiles_x;
  const auto [index, count] = film.shard;
  const std::uint64_t skipped = begin > index ? (begin - index + count - 1) / count : 0;
  std::vector<ListedTile> tiles;
  std::size_t pixels = 0;
  for (std::uint64_t tile = index + skipped * count; tile < end; tile += count) {
    tiles.push_back({std::uint32_t(tile), pixels});
    pixels += padded ? kTileRays : pixels_in(film, std::uint32_t(tile));
  }
  film.listed.resize(pixels);
  for_chunks(tiles.size(), 16, [&](std::size_t from, std::size_t to) {
    for (std::size_t t = from; t < to; ++t) {
      std::uint32_t* next = film.listed.data() + tiles[t].first;
      for (std::uint32_t i = 0; i < kTileRays; ++i) {
        const glm::uvec2 at = pixel_of(tiles[t].tile * kTileRays + i, film.width);
        if (padded || film.holds(at)) *next++ = LISTED_PIXEL(at.x, at.y);
      }
    }
  });
}

}  // namespace

Film make_film(std::uint32_t width, std::uint32_t height, const Window& crop, const Shard& shard, bool moments,
               bool stats) {
  Film film{.width = width, .height = height, .crop = crop, .shard = shard};
  const bool whole_tiles =
      crop.x0 == 0 && crop.x1 == width && crop.y0 % TILE_SIZE == 0 && (crop.y1 % TILE_SIZE == 0 || crop.y1 == height);
  list_pixels(film, stats && whole_tiles);
  film.pixels.resize(film.listed.size());
  for_chunks(film.pixels.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    std::fill(film.pixels.data() + begin, film.pixels.data() + end, FilmPixel{});
  });
  if (moments) film.moments.assign(film.listed.size(), glm::vec3(0));
  if (stats) film.stats.assign(film.listed.size(), RayStats{});
  return film;
}

}  // namespace ballot
