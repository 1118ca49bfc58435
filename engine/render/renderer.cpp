#include "engine/render/renderer.h"

#include <algorithm>
#include <chrono>
#include <glm/geometric.hpp>

#include "engine/core/error.h"
#include "engine/render/camera.h"
#include "engine/render/ray_kinds.h"
#include "engine/render/room.h"

namespace ballot {

namespace {

constexpr std::uint32_t kGroup = 64;           // of shaders/rays/primary.comp and shaders/shade/shade.comp
constexpr std::uint32_t kSamplesTogether = 4;  // of a chunk, in one submission

std::uint32_t last_depth_of(const Integrator& integrator, const RenderOptions& options) {
  return options.bounces < 0 ? integrator.last_depth : std::uint32_t(options.bounces);
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

/// Kernels and buffers of pictures that share shading and chunk size.
struct Renderer::Passes {
  std::string shading;
  SceneFeatures features;
  std::uint32_t chunk;
  std::uint64_t generation;  // of the shaders
  Buffer<Ray> rays;
  Buffer<Hit> hits;
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
        rays(gpu, chunk, Access::Storage, "rays"),
        hits(gpu, chunk, Access::Storage, "hits"),
        film(gpu, chunk, Access::Storage, "film"),
        numbers(gpu, chunk, Access::Storage, "ray numbers"),
        stats(counts ? std::make_unique<Buffer<RayStats>>(gpu, chunk, Access::Storage, "counters") : nullptr),
        primary(gpu, primary_source(true, seen)),
        shade(gpu, shading_source(shading, seen)) {
    primary.bind(BIND_RAYS, rays);
    primary.bind(BIND_NUMBERS, numbers);
    shade.bind(BIND_RAYS, rays);
    shade.bind(BIND_HITS, hits);
    shade.bind(BIND_FILM, film);
  }
  std::uint64_t bytes() const {
    return rays.bytes() + hits.bytes() + film.bytes() + numbers.bytes() + (stats ? stats->bytes() : 0);
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

void Renderer::shade_samples(Film& film, std::size_t first, std::uint32_t count, PrimaryPush camera,
                             std::uint32_t samples, const RenderOptions& options, RenderTimes& times) {
  Passes& p = *passes_;
  const std::uint32_t groups = (count + kGroup - 1) / kGroup;
  const PassScope scope(gpu_);
  const auto run = [&](Kernel& kernel, const auto& push, double& ms) {
    gpu_.pass(
        kernel.name(), [&](VkCommandBuffer cmd) { kernel.dispatch(cmd, groups, push); },
        [&ms](double spent) { ms += spent; });
  };
  if (!take(film)) {
    const Stopwatch watch(times.film_s);
    p.numbers.upload(std::span(film.numbers).subspan(first, count));
    if (film.samples > 0) p.film.upload(std::span(film.pixels).subspan(first, count));
  }
  std::vector<RayStats> part(p.stats ? count : 0);
  Query query = options.query;
  query.rays = kPrimaryRays;
  const PixelCone cone = pixel_cone(camera);
  for (std::uint32_t s = 0; s < samples; ++s) {
    camera.sample_index = film.samples + s;
    run(p.primary, camera, times.generate_ms);
    if (p.stats)
      times.trace_ms += tracer_.trace_counted(p.rays, p.hits, count, query, *p.stats).device_ms;
    else
      tracer_.record(p.rays, p.hits, count, query, [&times](double ms) { times.trace_ms += ms; });
    waves_.pass_through(p.rays, p.hits, count, query, p.features, times.passes);
    // A film of one column of tiles: every index is a pixel of it.
    run(p.shade, ShadePush{TILE_SIZE, ~0u, 0, count, camera.sample_index, cone.width, cone.spread}, times.shade_ms);
    if (s % kSamplesTogether == kSamplesTogether - 1) gpu_.flush();
    if (!p.stats) continue;
    p.stats->download(std::span(part));
    for (std::uint32_t i = 0; i < count; ++i)
      for (const CounterInfo& c : kCounters) film.stats[first + i].*c.field += part[i].*c.field;
  }
  gpu_.finish();
}

Sky::Kind Renderer::sky_kind(const RenderOptions& options) const {
  const Sky::Kind kind = scene_.scene().sky.kind;
  return options.every_feature && kind == Sky::Kind::None ? Sky::Kind::Gradient : kind;
}

std::uint32_t Renderer::most_paths(const Integrator& integrator, const SceneFeatures& features,
                                   const RenderOptions& options) const {
  return std::min(std::max(options.most_paths, 1u),
                  waves_.capacity(integrator, features, last_depth_of(integrator, options)));
}

void Renderer::wave_samples(Film& film, std::size_t first, std::uint32_t count, const PrimaryPush& camera,
                            const SceneFeatures& features, std::uint32_t samples, const RenderOptions& options,
                            RenderTimes& times) {
  const Integrator& integrator = *find_integrator(options.shading);
  if (!take(film)) {
    const Stopwatch watch(times.film_s);
    make_room(numbers_, gpu_, count, "ray numbers");
    make_room(film_, gpu_, count, "film");
    numbers_->upload(std::span(film.numbers).subspan(first, count));
    const bool begun = film.samples > 0;  // else the first sample writes it
    if (begun) film_->upload(std::span(film.pixels).subspan(first, count));
    if (film.moments.empty()) moments_.reset();
    if (!film.moments.empty()) make_room(moments_, gpu_, count, "moments");
    if (moments_ && begun) moments_->upload(std::span(film.moments).subspan(first, count));
  }
  const Bounds& b = scene_.scene().bounds;
  const WaveSettings settings{
      .integrator = &integrator,
      .camera = camera,
      .most_paths = most_paths(integrator, features, options),
      .last_depth = last_depth_of(integrator, options),
      .ao_radius = std::max(options.ao_radius * glm::distance(b.lo, b.hi), 1e-30f),
      .seed = options.seed,
      .query = options.query,
      .features = features,
      .sky = sky_kind(options),
  };
  waves_.add_samples(settings, *numbers_, count, film.samples, samples, *film_, moments_.get(), times.passes);
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
  const std::uint32_t chunk = std::uint32_t(
      std::min<std::size_t>(total, integrator ? most_paths(*integrator, features, options) : tracer_.chunk_rays()));
  if (!integrator) passes(options, features, chunk);
  if (film.on_device != 0 && (!holds(film) || chunk < total || held_by_waves_ != (integrator != nullptr)))
    fail(Failure::Work, "the film's sums are no longer on the device: another was rendered since");
  const bool stay = sums == Sums::OnDevice && chunk == total;
  for (std::size_t first = 0; first < total; first += chunk) {
    const std::uint32_t count = std::uint32_t(std::min<std::size_t>(chunk, total - first));
    if (integrator)
      wave_samples(film, first, count, camera, features, samples, options, times);
    else
      shade_samples(film, first, count, camera, samples, options, times);
    if (!stay) download(film, integrator != nullptr, first, count, times);
    if (progress) progress((film.samples + samples * double(first + count) / double(total)) / options.spp);
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
