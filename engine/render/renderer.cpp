#include "engine/render/renderer.h"

#include <chrono>

#include "engine/core/error.h"
#include "engine/render/camera.h"
#include "engine/render/ray_kinds.h"
#include "engine/trace/counters.h"

namespace ballot {

namespace {

constexpr std::uint32_t kGroup = 64;  // of shaders/rays/primary.comp and shaders/shade/shade.comp

Image image_of(const std::vector<FilmPixel>& film, const RenderOptions& options) {
  Image image;
  image.width = options.width;
  image.height = options.height;
  const float scale = 1.0f / float(options.spp);
  const auto add = [&](const char* name, Pixel type, auto value) {
    Channel channel{name, type, {}, {}};
    for (const FilmPixel& p : film)
      if constexpr (std::is_same_v<decltype(value(p)), std::uint32_t>)
        channel.uints.push_back(value(p));
      else
        channel.floats.push_back(value(p));
    image.channels.push_back(std::move(channel));
  };
  add("R", Pixel::Half, [&](const FilmPixel& p) { return p.color.r * scale; });
  add("G", Pixel::Half, [&](const FilmPixel& p) { return p.color.g * scale; });
  add("B", Pixel::Half, [&](const FilmPixel& p) { return p.color.b * scale; });
  add("A", Pixel::Half, [&](const FilmPixel& p) { return p.alpha * scale; });
  add("Z", Pixel::Float, [](const FilmPixel& p) { return p.z; });
  add("N.X", Pixel::Float, [](const FilmPixel& p) { return p.normal.x; });
  add("N.Y", Pixel::Float, [](const FilmPixel& p) { return p.normal.y; });
  add("N.Z", Pixel::Float, [](const FilmPixel& p) { return p.normal.z; });
  add("prim", Pixel::Uint, [](const FilmPixel& p) { return p.prim; });
  return image;
}

void set(FilmPixel& pixel, const FilmPixel& value) { pixel = value; }
void set(RayStats& sum, const RayStats& value) {
  for (const CounterInfo& c : kCounters) sum.*c.field += value.*c.field;
}

/// From the order of rays (shaders/lib/film.glsl) to rows of pixels: pixels are replaced, counts added.
template <class T>
void scatter(std::span<const T> part, const PrimaryPush& camera, std::vector<T>& pixels) {
  for (std::uint32_t i = 0; i < part.size(); ++i) {
    const glm::uvec2 at = pixel_of(camera.first + i, camera.width);
    if (at.x < camera.width && at.y < camera.height) set(pixels[std::size_t(at.y) * camera.width + at.x], part[i]);
  }
}

}  // namespace

const Shading& find_shading(std::string_view name) {
  std::string names;
  for (const Shading& s : kShadings) {
    if (s.name == name) return s;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", s.name);
  }
  fail(Failure::Arguments, "no shading is called '{}'; there are: {}", name, names);
}

void check_options(const RenderOptions& o) {
  if (o.width < 1 || o.height < 1 || o.width > 16384 || o.height > 16384)
    fail(Failure::Arguments, "--size: {}x{} is not between 1x1 and 16384x16384", o.width, o.height);
  if (o.spp < 1 || o.spp > 65536) fail(Failure::Arguments, "--spp: {} is not between 1 and 65536", o.spp);
  find_shading(o.shading);
  find_heat(o.heat);
}

/// Kernels and buffers of pictures that share shading and chunk size.
struct Renderer::Passes {
  std::string shading;
  std::uint32_t chunk;
  std::uint64_t generation;  // of the shaders
  Buffer<Ray> rays;
  Buffer<Hit> hits;
  Buffer<FilmPixel> film;
  std::unique_ptr<Buffer<RayStats>> stats;  // only where counters are asked for
  Kernel primary, shade;

  Passes(Context& gpu, std::uint32_t chunk_rays, const std::string& shading_name, bool counts,
         const SceneFeatures& scene)
      : shading(shading_name),
        chunk(chunk_rays),
        generation(gpu.shader_generation()),
        rays(gpu, chunk, Access::Storage, "rays"),
        hits(gpu, chunk, Access::Storage, "hits"),
        film(gpu, chunk, Access::Storage, "film"),
        stats(counts ? std::make_unique<Buffer<RayStats>>(gpu, chunk, Access::Storage, "counters") : nullptr),
        primary(gpu, primary_source(false)),
        shade(gpu, shading_source(shading, scene)) {
    primary.bind(BIND_RAYS, rays);
    shade.bind(BIND_RAYS, rays);
    shade.bind(BIND_HITS, hits);
    shade.bind(BIND_FILM, film);
  }
};

Renderer::Renderer(Context& gpu, Tracer& tracer, SceneData& scene) : gpu_(gpu), tracer_(tracer), scene_(scene) {}

Renderer::~Renderer() = default;

Renderer::Passes& Renderer::passes(const RenderOptions& options, std::uint32_t chunk) {
  const bool counts = options.stats || find_shading(options.shading).heat;
  if (passes_ && passes_->shading == options.shading && passes_->chunk == chunk &&
      counts == (passes_->stats != nullptr) && passes_->generation == gpu_.shader_generation())
    return *passes_;
  passes_.reset();
  passes_ = std::make_unique<Passes>(gpu_, chunk, options.shading, counts, features_of(scene_.scene()));
  scene_.bind(passes_->shade);
  gpu_.save_pipeline_cache();
  return *passes_;
}

double Renderer::trace(Passes& passes, std::uint32_t count, const Query& query) {
  if (!passes.stats) return tracer_.trace(passes.rays, passes.hits, count, query).device_ms;
  return tracer_.trace_counted(passes.rays, passes.hits, count, query, *passes.stats).device_ms;
}

void Renderer::trace_sample(Passes& passes, const PrimaryPush& camera, std::uint32_t count, const Query& query,
                            RenderTimes& times) {
  const std::uint32_t groups = (count + kGroup - 1) / kGroup;
  gpu_.submit(passes.primary.name(), [&](VkCommandBuffer cmd) {
    passes.primary.dispatch(cmd, groups, camera);
    memory_barrier(cmd);
  });
  times.generate_ms += gpu_.last_ms();
  times.trace_ms += trace(passes, count, query);
  const ShadePush push{camera.width, camera.height, camera.first, count, camera.sample_index};
  gpu_.submit(passes.shade.name(), [&](VkCommandBuffer cmd) {
    passes.shade.dispatch(cmd, groups, push);
    memory_barrier(cmd);
  });
  times.shade_ms += gpu_.last_ms();
}

Image Renderer::render(const View& view, const RenderOptions& options, RenderTimes* times, const Progress& progress) {
  check_options(options);
  const auto start = std::chrono::steady_clock::now();
  const std::uint32_t total = padded_rays(options.width, options.height);
  const std::uint32_t chunk = std::min(total, tracer_.chunk_rays() / (TILE_SIZE * TILE_SIZE) * (TILE_SIZE * TILE_SIZE));
  Passes& passes = this->passes(options, chunk);
  PrimaryPush camera = camera_push(view, options.width, options.height);
  camera.sample_count = options.spp;
  RenderTimes sum;
  Query query = options.query;
  query.rays = kPrimaryRays;
  std::vector<FilmPixel> film(std::size_t(options.width) * options.height), part(chunk);
  std::vector<RayStats> stats(passes.stats ? film.size() : 0), stats_part(passes.stats ? chunk : 0);
  for (camera.first = 0; camera.first < total; camera.first += chunk) {
    const std::uint32_t count = std::min(chunk, total - camera.first);
    for (camera.sample_index = 0; camera.sample_index < options.spp; ++camera.sample_index) {
      trace_sample(passes, camera, count, query, sum);
      if (passes.stats) {
        passes.stats->download(std::span(stats_part).first(count));
        scatter(std::span<const RayStats>(stats_part).first(count), camera, stats);
      }
      const double chunk_done = double(camera.sample_index + 1) / options.spp * count;
      if (progress) progress((camera.first + chunk_done) / total);
    }
    passes.film.download(std::span(part).first(count));
    scatter(std::span<const FilmPixel>(part).first(count), camera, film);
  }
  Image image = image_of(film, options);
  if (passes.stats) add_stats(image, stats, options.spp);
  if (find_shading(options.shading).heat)
    sum.heat_top = paint_heat(image, find_heat(options.heat), tracer_.variant(query).how.subgroup);
  sum.rays = std::uint64_t(options.width) * options.height * options.spp;
  sum.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (times) *times = sum;
  return image;
}

}  // namespace ballot
