#include "engine/render/renderer.h"

#include <algorithm>
#include <chrono>
#include <glm/geometric.hpp>

#include "engine/core/error.h"
#include "engine/render/camera.h"
#include "engine/render/parts.h"
#include "engine/render/ray_kinds.h"
#include "engine/render/room.h"

namespace ballot {

namespace {

constexpr std::uint32_t kGroup = 64;         // of shaders/rays/primary.comp and shaders/shade/shade.comp
constexpr std::uint32_t kPartsTogether = 4;  // in one submission

std::uint32_t last_depth_of(const Integrator& integrator, const RenderOptions& options) {
  return options.bounces < 0 ? integrator.last_depth : std::uint32_t(options.bounces);
}

/// Adds what the device counted of a sample of these pixels.
void add_counters(Film& film, std::size_t first, std::uint32_t pixels, const Buffer<RayStats>& stats) {
  std::vector<RayStats> part(pixels);
  stats.download(std::span(part));
  for (std::uint32_t i = 0; i < pixels; ++i)
    for (const CounterInfo& c : kCounters) film.stats[first + i].*c.field += part[i].*c.field;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Adds the seconds of a scope.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() { seconds_ += seconds_since(start_); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

std::vector<KernelSource> kernels_of(const Shading& shading, const SceneFeatures& features) {
  std::vector<KernelSource> sources;
  for (const SceneFeatures& seen : by_camera(features)) sources.push_back(primary_source(true, seen));
  if (features.alpha) sources.push_back(alpha_source(features));
  sources.push_back(shading_source(shading.name, features));
  return sources;
}

/// Pixels of a film that are rendered while the device holds them, and samples that each of them is to have more.
struct Renderer::Chunk {
  std::size_t first;
  std::uint32_t pixels, samples;
};

/// Kernels and buffers of pictures that share shading and chunk size.
struct Renderer::Passes {
  std::string shading;
  SceneFeatures features;
  std::uint32_t chunk;
  std::uint64_t generation;  // of the shaders
  std::unique_ptr<Buffer<Ray>> rays;
  std::unique_ptr<Buffer<Hit>> hits;
  Buffer<FilmPixel> film;
  Buffer<std::uint32_t> numbers;
  std::unique_ptr<Buffer<RayStats>> stats;  // only where counters are asked for
  Kernel primary, shade;

  Passes(Context& gpu, std::uint32_t chunk_rays, const std::string& shading_name, bool counts,
         const SceneFeatures& seen)
      : shading(shading_name),
        features(seen),
        chunk(chunk_rays),
        generation(gpu.shader_generation()),
        film(gpu, chunk, Access::Storage, "film"),
        numbers(gpu, chunk, Access::Storage, "ray numbers"),
        stats(counts ? std::make_unique<Buffer<RayStats>>(gpu, chunk, Access::Storage, "counters") : nullptr),
        primary(gpu, primary_source(true, seen)),
        shade(gpu, shading_source(shading, seen)) {
    primary.bind(BIND_NUMBERS, numbers);
    shade.bind(BIND_FILM, film);
  }
  void make_room(Context& gpu, std::size_t count) {
    ballot::make_room(rays, gpu, count, "rays");
    ballot::make_room(hits, gpu, count, "hits");
    primary.bind(BIND_RAYS, *rays);
    shade.bind(BIND_RAYS, *rays);
    shade.bind(BIND_HITS, *hits);
  }
  std::uint64_t bytes() const {
    return (rays ? rays->bytes() + hits->bytes() : 0) + film.bytes() + numbers.bytes() + (stats ? stats->bytes() : 0);
  }
};

Renderer::Renderer(Context& gpu, Tracer& tracer, SceneData& scene)
    : gpu_(gpu), tracer_(tracer), scene_(scene), waves_(gpu, tracer, scene) {}

Renderer::~Renderer() = default;

Renderer::Passes& Renderer::passes(const RenderOptions& options, const SceneFeatures& features, std::uint32_t chunk) {
  const bool counts = options.stats || find_shading(options.shading).heat;
  if (passes_ && passes_->shading == options.shading && passes_->features == features && passes_->chunk == chunk &&
      counts == (passes_->stats != nullptr) && passes_->generation == gpu_.shader_generation())
    return *passes_;
  passes_.reset();
  held_ = 0;
  passes_ = std::make_unique<Passes>(gpu_, chunk, options.shading, counts, features);
  scene_.bind(passes_->shade);
  gpu_.save_pipeline_cache();
  return *passes_;
}

Film Renderer::start(const RenderOptions& options) const {
  check_options(options);
  const bool waves = find_integrator(options.shading) != nullptr;
  const bool stats = !waves && (options.stats || find_shading(options.shading).heat);
  return make_film(options.width, options.height, options.window(), options.shard, waves && options.wants("variance"),
                   stats);
}

void Renderer::shade_samples(Film& film, const Chunk& chunk, PrimaryPush camera, const RenderOptions& options,
                             RenderTimes& times, const Progress& progress) {
  Passes& p = *passes_;
  const PassScope scope(gpu_);
  const auto run = [&](Kernel& kernel, std::uint32_t count, const auto& push, double& ms) {
    gpu_.pass(
        kernel.name(), [&](VkCommandBuffer cmd) { kernel.dispatch(cmd, (count + kGroup - 1) / kGroup, push); },
        [&ms](double spent) { ms += spent; });
  };
  if (!take(film)) {
    const Stopwatch watch(times.film_s);
    p.numbers.upload(std::span(film.numbers).subspan(chunk.first, chunk.pixels));
    if (film.samples > 0) p.film.upload(std::span(film.pixels).subspan(chunk.first, chunk.pixels));
  }
  Query query = options.query;
  query.rays = kPrimaryRays;
  const PixelCone cone = pixel_cone(camera);
  // What counters say depends on which rays share a subgroup: there a sample of every pixel goes by itself. On an H200 16 samples
  // together instead of 4 gain 1.02 to 1.09 in the traversal, but shading, whose lanes then read far from each other, takes 1.3
  // to 1.4 times as long.
  const std::uint32_t together = gpu_.info().is_cpu() ? 16 : 4;
  const Part largest = p.stats ? Part{0, chunk.pixels, 0, 1}
                               : largest_part(chunk.pixels, chunk.samples, most_rays(p.features, options), together);
  p.make_room(gpu_, largest.rays());
  std::uint64_t done = 0, parts = 0;
  for_parts(chunk.pixels, chunk.samples, largest, [&](const Part& part) {
    camera.first = part.pixel;
    camera.count = part.rays();
    camera.together = part.samples;
    camera.sample_index = film.samples + part.sample;
    run(p.primary, part.rays(), camera, times.generate_ms);
    if (p.stats)
      times.trace_ms += tracer_.trace_counted(*p.rays, *p.hits, part.rays(), query, *p.stats).device_ms;
    else
      tracer_.record(*p.rays, *p.hits, part.rays(), query, [&times](double ms) { times.trace_ms += ms; });
    waves_.pass_through(*p.rays, *p.hits, part.rays(), query, p.features, times.passes);
    // A film of one column of tiles: every index is a pixel of it.
    const ShadePush push{.width = TILE_SIZE,
                         .height = ~0u,
                         .first = 0,
                         .count = part.pixels,
                         .sample_index = camera.sample_index,
                         .together = part.samples,
                         .place = part.pixel,
                         .cone_width = cone.width,
                         .cone_spread = cone.spread};
    run(p.shade, part.pixels, push, times.shade_ms);
    if (p.stats) add_counters(film, chunk.first, chunk.pixels, *p.stats);
    if (++parts % kPartsTogether == 0) gpu_.flush();
    done += part.rays();
    if (progress) progress(double(done) / (double(chunk.pixels) * chunk.samples));
  });
  gpu_.finish();
}

Sky::Kind Renderer::sky_kind(const RenderOptions& options) const {
  const Sky::Kind kind = scene_.scene().sky.kind;
  return options.every_feature && kind == Sky::Kind::None ? Sky::Kind::Gradient : kind;
}

std::uint32_t Renderer::most_rays(const SceneFeatures& features, const RenderOptions& options) const {
  const Integrator* integrator = find_integrator(options.shading);
  const std::uint32_t room =
      integrator ? waves_.capacity(*integrator, features, last_depth_of(*integrator, options)) : tracer_.chunk_rays();
  return std::min(std::max(options.most_rays, 1u), room);
}

void Renderer::wave_samples(Film& film, const Chunk& chunk, const PrimaryPush& camera, const SceneFeatures& features,
                            const RenderOptions& options, RenderTimes& times, const Progress& progress) {
  const Integrator& integrator = *find_integrator(options.shading);
  if (!take(film)) {
    const Stopwatch watch(times.film_s);
    make_room(numbers_, gpu_, chunk.pixels, "ray numbers");
    make_room(film_, gpu_, chunk.pixels, "film");
    numbers_->upload(std::span(film.numbers).subspan(chunk.first, chunk.pixels));
    const bool begun = film.samples > 0;  // else the first sample writes it
    if (begun) film_->upload(std::span(film.pixels).subspan(chunk.first, chunk.pixels));
    if (film.moments.empty()) moments_.reset();
    if (!film.moments.empty()) make_room(moments_, gpu_, chunk.pixels, "moments");
    if (moments_ && begun) moments_->upload(std::span(film.moments).subspan(chunk.first, chunk.pixels));
  }
  const Bounds& b = scene_.scene().bounds;
  const WaveSettings settings{
      .integrator = &integrator,
      .camera = camera,
      .most_paths = most_rays(features, options),
      .last_depth = last_depth_of(integrator, options),
      .ao_radius = std::max(options.ao_radius * glm::distance(b.lo, b.hi), 1e-30f),
      .seed = options.seed,
      .query = options.query,
      .features = features,
      .sky = sky_kind(options),
  };
  waves_.add_samples(settings, *numbers_, chunk.pixels, film.samples, chunk.samples, *film_, moments_.get(),
                     times.passes, progress);
}

bool Renderer::holds(const Film& film) const { return film.on_device != 0 && film.on_device == held_; }

/// The same; and until the step has ended, nothing is held.
bool Renderer::take(const Film& film) {
  const bool held = holds(film);
  held_ = 0;
  return held;
}

void Renderer::download(Film& film, bool waves, std::size_t first, std::size_t count, RenderTimes& times) const {
  const Stopwatch watch(times.film_s);
  (waves ? *film_ : passes_->film).download(std::span(film.pixels).subspan(first, count));
  if (waves && moments_) moments_->download(std::span(film.moments).subspan(first, count));
}

void Renderer::collect(Film& film, RenderTimes& times) {
  if (film.on_device == 0) return;
  if (!holds(film)) fail(Failure::Work, "the film's sums are no longer on the device: another was rendered since");
  const auto start = std::chrono::steady_clock::now();
  download(film, held_by_waves_, 0, film.numbers.size(), times);
  film.on_device = 0;
  times.seconds += seconds_since(start);
}

void Renderer::advance(Film& film, const View& view, const RenderOptions& options, std::uint32_t samples,
                       RenderTimes& times, const Progress& progress, Sums sums) {
  check_options(options);
  const auto start = std::chrono::steady_clock::now();
  samples = std::min(samples, options.spp - std::min(options.spp, film.samples));
  const Integrator* integrator = find_integrator(options.shading);
  const std::size_t total = film.numbers.size();
  if (samples == 0 || total == 0) {
    film.samples += samples;
    return;
  }
  PrimaryPush camera = camera_push(view, film.width, film.height);
  camera.sample_count = options.spp;
  const SceneFeatures features = options.every_feature ? SceneFeatures::every() : through(scene_.features(), view);
  const std::uint32_t chunk = std::uint32_t(std::min<std::size_t>(total, tracer_.chunk_rays()));
  if (!integrator) passes(options, features, chunk);
  if (film.on_device != 0 && (!holds(film) || chunk < total || held_by_waves_ != (integrator != nullptr)))
    fail(Failure::Work, "the film's sums are no longer on the device: another was rendered since");
  const bool stay = sums == Sums::OnDevice && chunk == total;
  for (std::size_t first = 0; first < total; first += chunk) {
    const Chunk part{first, std::uint32_t(std::min<std::size_t>(chunk, total - first)), samples};
    const Progress partly = [&](double share) {
      const double pixels = (double(first) + share * part.pixels) / double(total);
      if (progress) progress((film.samples + samples * pixels) / options.spp);
    };
    if (integrator)
      wave_samples(film, part, camera, features, options, times, partly);
    else
      shade_samples(film, part, camera, options, times, partly);
    if (!stay) download(film, integrator != nullptr, first, part.pixels, times);
  }
  film.samples += samples;
  film.on_device = held_ = stay ? ++named_ : 0;
  held_by_waves_ = integrator != nullptr;
  add_totals(options, std::uint64_t(total) * samples, times);
  times.seconds += seconds_since(start);
}

void Renderer::add_totals(const RenderOptions& options, std::uint64_t samples, RenderTimes& times) const {
  times.device_ms = times.passes.ms("");
  if (!find_integrator(options.shading)) {
    times.rays += samples;
    times.device_ms += times.generate_ms + times.trace_ms + times.shade_ms;
    return;
  }
  times.generate_ms = times.passes.ms("begin");
  times.trace_ms = times.passes.ms("trace");
  times.shade_ms = times.device_ms - times.generate_ms - times.trace_ms;
  times.rays = 0;
  for (const PassTime& t : times.passes.all())
    if (t.name.starts_with("trace")) times.rays += t.rays;
}

std::uint64_t Renderer::bytes() const {
  std::uint64_t sum = waves_.bytes() + (passes_ ? passes_->bytes() : 0);
  for (const RawBuffer* b : std::initializer_list<const RawBuffer*>{numbers_.get(), film_.get(), moments_.get()})
    if (b) sum += b->bytes();
  return sum;
}

}  // namespace ballot
