// Turns films into pictures with named channels.
#include <algorithm>
#include <functional>

#include "engine/core/parallel.h"
#include "engine/render/data/camera.h"
#include "engine/render/film/renderer.h"

namespace ballot {

namespace {

/// Writes the pixels of a film to channels of an image of the crop window. All channels are filled in one pass, by all
/// cores: a picture has as many bytes as the film, and its memory has not been touched yet.
class Painter {
 public:
  Painter(const Film& film, Image& image) : film_(film), image_(image), places_(film.listed.size()) {
    for_chunks(places_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const glm::uvec2 at = listed_pixel(film.listed[i]);
        places_[i] = film.holds(at) ? std::size_t(at.y - film.crop.y0) * image.width + (at.x - film.crop.x0) : kNowhere;
      }
    });
  }

  /// Plans a channel that holds value(i) for every pixel i of the film. The other pixels of the window get `otherwise`
  /// in Uint channels and 0 in others. paint() calls `value`.
  template <class Value>
  void add(const char* name, Pixel type, Value value, std::uint32_t otherwise = 0) {
    const auto fill = [this, value](Channel& channel, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        if (places_[i] == kNowhere) continue;
        if constexpr (std::is_same_v<decltype(value(i)), std::uint32_t>)
          channel.uints[places_[i]] = value(i);
        else
          channel.floats[places_[i]] = value(i);
      }
    };
    plans_.push_back({Channel{name, type, {}, {}}, otherwise, fill});
  }

  /// Fills the planned channels and moves them to the image.
  void paint() {
    const std::size_t count = std::size_t(image_.width) * image_.height;
    for_chunks(plans_.size(), 1, [&](std::size_t c, std::size_t) {
      Channel& channel = plans_[c].channel;
      if (channel.type == Pixel::Uint)
        channel.uints.assign(count, plans_[c].otherwise);
      else
        channel.floats.assign(count, 0.0f);
    });
    for_chunks(places_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (Plan& plan : plans_) plan.fill(plan.channel, begin, end);
    });
    for (Plan& plan : plans_) image_.channels.push_back(std::move(plan.channel));
    plans_.clear();
  }

  std::vector<RayStats> stats() const {
    std::vector<RayStats> all(std::size_t(image_.width) * image_.height);
    for (std::size_t i = 0; i < places_.size(); ++i)
      if (places_[i] != kNowhere) all[places_[i]] = film_.stats[i];
    return all;
  }

 private:
  struct Plan {
    Channel channel;
    std::uint32_t otherwise;
    std::function<void(Channel&, std::size_t, std::size_t)> fill;
  };
  static constexpr std::size_t kNowhere = ~std::size_t{0}, kChunk = 1 << 14;
  const Film& film_;
  Image& image_;
  UnsetVector<std::size_t> places_;
  std::vector<Plan> plans_;
};

void add_variance(Painter& painter, const Film& film) {
  const double n = film.samples;
  const float scale = n > 1 ? float(1 / (n * (n - 1))) : 0.0f;
  painter.add("variance.R", Pixel::Float, [&film, scale](std::size_t i) { return film.moments[i].r * scale; });
  painter.add("variance.G", Pixel::Float, [&film, scale](std::size_t i) { return film.moments[i].g * scale; });
  painter.add("variance.B", Pixel::Float, [&film, scale](std::size_t i) { return film.moments[i].b * scale; });
}

/// Bytes of the channels of a picture, for each of its pixels.
std::uint64_t channel_bytes(const RenderOptions& options, bool waves, bool stats) {
  const bool heat = !waves && find_shading(options.shading).heat;
  std::uint64_t values = stats ? std::size(kHeatKinds) : 0;
  if (options.wants("color") || heat) values += 4;
  for (const auto& [aov, count] : {std::pair("depth", 1), {"normal", 3}, {"prim", 1}, {"samples", 1}})
    if (options.wants(aov)) values += std::uint64_t(count);
  if (waves && options.wants("variance")) values += 3;
  return values * sizeof(float);
}

}  // namespace

PictureBytes picture_bytes(const RenderOptions& options) {
  const bool waves = find_integrator(options.shading) != nullptr;
  const bool stats = !waves && (options.stats || find_shading(options.shading).heat);
  const std::uint64_t moments = waves && options.wants("variance") ? sizeof(glm::vec3) : 0;
  const std::uint64_t film = sizeof(std::uint32_t) + sizeof(FilmPixel) + moments;
  // A film whose device may be lost is kept twice, but one with counters.
  const std::uint64_t films = stats ? film + sizeof(RayStats) : options.spp > 1 ? 2 * film : film;
  const std::uint64_t image = channel_bytes(options, waves, stats);
  // Beside the channels: first the place of each pixel and its counters, then the colours as halves.
  const std::uint64_t painted = image + sizeof(std::size_t) + (stats ? sizeof(RayStats) : 0);
  const std::uint64_t checkpoint = stats ? 0 : sizeof(std::size_t) + film;
  return {films + std::max(painted, checkpoint), image};
}

Image Renderer::picture(const Film& film, const RenderOptions& options, RenderTimes& times) const {
  Image image;
  image.width = film.crop.x1 - film.crop.x0;
  image.height = film.crop.y1 - film.crop.y0;
  image.x = film.crop.x0;
  image.y = film.crop.y0;
  image.full_width = film.width;
  image.full_height = film.height;
  Painter painter(film, image);
  const auto& pixels = film.pixels;
  const float scale = 1.0f / float(std::max(film.samples, 1u));
  const bool heat = !find_integrator(options.shading) && find_shading(options.shading).heat;
  if (options.wants("color") || heat) {
    painter.add("R", Pixel::Half, [&](std::size_t i) { return pixels[i].color.r * scale; });
    painter.add("G", Pixel::Half, [&](std::size_t i) { return pixels[i].color.g * scale; });
    painter.add("B", Pixel::Half, [&](std::size_t i) { return pixels[i].color.b * scale; });
    painter.add("A", Pixel::Half, [&](std::size_t i) { return pixels[i].alpha * scale; });
  }
  if (options.wants("depth")) painter.add("Z", Pixel::Float, [&](std::size_t i) { return pixels[i].z; });
  if (options.wants("normal")) {
    painter.add("N.X", Pixel::Float, [&](std::size_t i) { return pixels[i].normal.x; });
    painter.add("N.Y", Pixel::Float, [&](std::size_t i) { return pixels[i].normal.y; });
    painter.add("N.Z", Pixel::Float, [&](std::size_t i) { return pixels[i].normal.z; });
  }
  if (options.wants("prim"))
    painter.add(
        "prim", Pixel::Uint, [&](std::size_t i) { return std::uint32_t(pixels[i].prim); }, NO_HIT);
  if (options.wants("samples"))
    painter.add("samples", Pixel::Uint, [&](std::size_t) { return std::uint32_t(film.samples); });
  if (options.wants("variance") && !film.moments.empty()) add_variance(painter, film);
  painter.paint();
  if (!film.stats.empty()) add_stats(image, painter.stats(), std::max(film.samples, 1u));
  if (!heat) return image;
  Query query = options.query;
  query.rays = kPrimaryRays;
  times.heat_top = paint_heat_of(image, find_heat(options.heat), tracer_.variant(query).config.subgroup);
  return image;
}

}  // namespace ballot
