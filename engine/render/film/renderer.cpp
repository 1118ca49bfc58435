#include "engine/render/film/renderer.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "engine/core/error.h"
#include "engine/core/stopwatch.h"
#include "engine/gpu/room.h"
#include "engine/render/data/camera.h"
#include "engine/render/film/shading_passes.h"

namespace ballot {

namespace {

std::uint32_t last_depth_of(const Integrator& integrator, const RenderOptions& options) {
  return options.bounces < 0 ? integrator.last_depth : std::uint32_t(options.bounces);
}

}  // namespace

void RenderTimes::add(const RenderTimes& part) {
  generate_ms += part.generate_ms;
  trace_ms += part.trace_ms;
  shade_ms += part.shade_ms;
  device_ms += part.device_ms;
  seconds += part.seconds;
  film_s += part.film_s;
  rays += part.rays;
  passes.add(part.passes);
  heat_top = std::max(heat_top, part.heat_top);
}

Renderer::Renderer(Context& gpu, Tracer& tracer, SceneData& scene)
    : gpu_(gpu), tracer_(tracer), scene_(scene), waves_(gpu, tracer, scene) {}

Renderer::~Renderer() = default;

Film Renderer::start(const RenderOptions& options) const {
  check_options(options);
  const bool waves = find_integrator(options.shading) != nullptr;
  const bool stats = !waves && (options.stats || find_shading(options.shading).heat);
  return make_film(options.width, options.height, options.window(), options.shard, waves && options.wants("variance"),
                   stats);
}

Sky::Kind Renderer::sky_kind(const RenderOptions& options) const {
  const Sky::Kind kind = scene_.scene().sky.kind;
  return options.every_feature && kind == Sky::Kind::None ? Sky::Kind::Gradient : kind;
}

/// Returns the number of paths of a picture that are in flight at once.
std::uint32_t Renderer::most_paths(const Integrator& integrator, const SceneFeatures& features,
                                   const RenderOptions& options, std::uint64_t pixels) const {
  const std::uint32_t room =
      waves_.capacity(integrator, features, last_depth_of(integrator, options), pixels * options.spp);
  return std::min(std::max(options.most_rays, 1u), room);
}

void Renderer::wave_samples(Film& film, const Chunk& chunk, const PrimaryPush& camera, const SceneFeatures& features,
                            const RenderOptions& options, RenderTimes& times, const Progress& progress) {
  const Integrator& integrator = *find_integrator(options.shading);
  if (!take(film)) {
    const Stopwatch watch(times.film_s);
    make_room(listed_, gpu_, chunk.pixels, "listed pixels");
    make_room(film_, gpu_, chunk.pixels, "film");
    listed_->upload(std::span(film.listed).subspan(chunk.first, chunk.pixels));
    const bool begun = film.samples > 0;  // else the first sample overwrites the buffer
    if (begun) film_->upload(std::span(film.pixels).subspan(chunk.first, chunk.pixels));
    if (film.moments.empty()) moments_.reset();
    if (!film.moments.empty()) make_room(moments_, gpu_, chunk.pixels, "moments");
    if (moments_ && begun) moments_->upload(std::span(film.moments).subspan(chunk.first, chunk.pixels));
  }
  const Bounds& b = scene_.scene().bounds;
  PrimaryPush seeded = camera;
  seeded.seed = options.seed;
  const WaveSettings settings{
      .integrator = &integrator,
      .camera = seeded,
      .most_paths = most_paths(integrator, features, options, film.listed.size()),
      .last_depth = last_depth_of(integrator, options),
      .ao_radius = std::max(options.ao_radius * glm::distance(b.lo, b.hi), 1e-30f),
      .clamp = options.clamp,
      .query = options.query,
      .features = features,
      .sky = sky_kind(options),
  };
  waves_.add_samples(settings, *listed_, chunk.pixels, film.samples, chunk.samples, *film_, moments_.get(),
                     times.passes, progress);
}

bool Renderer::holds(const Film& film) const { return film.on_device != 0 && film.on_device == held_; }

/// Returns holds(film), and marks the buffers as holding no film until the current step has ended.
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
  if (!holds(film)) fail(Failure::Work, "the film's sums are no longer on the device: another film was rendered since");
  const Stopwatch watch(times.seconds);
  download(film, held_by_waves_, 0, film.listed.size(), times);
  film.on_device = 0;
}

void Renderer::advance(Film& film, const View& view, const RenderOptions& options, std::uint32_t samples,
                       RenderTimes& times, const Progress& progress, Sums sums) {
  check_options(options);
  const Stopwatch watch(times.seconds);
  samples = std::min(samples, options.spp - std::min(options.spp, film.samples));
  const Integrator* integrator = find_integrator(options.shading);
  const std::size_t total = film.listed.size();
  if (samples == 0 || total == 0) {
    film.samples += samples;
    return;
  }
  PrimaryPush camera = camera_push(view, film.width, film.height);
  camera.sample_count = options.spp;
  SceneFeatures features = options.every_feature ? SceneFeatures::every() : through(scene_.features(), view);
  features.tree.top_depth = scene_.features().tree.top_depth;
  features.tree.shapes = scene_.features().tree.shapes;
  features.stored = scene_.features().stored;
  const std::uint32_t chunk = std::uint32_t(std::min<std::size_t>(total, tracer_.chunk_rays()));
  if (!integrator) passes(options, features, chunk, samples);
  if (film.on_device != 0 && (!holds(film) || chunk < total || held_by_waves_ != (integrator != nullptr)))
    fail(Failure::Work, "the film's sums are no longer on the device: another film was rendered since");
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

std::uint64_t Renderer::bytes_for(const View& view, const RenderOptions& options) const {
  const Window w = options.window();
  const std::uint64_t pixels = std::uint64_t(w.x1 - w.x0) * (w.y1 - w.y0) / options.shard.count;
  const std::uint64_t chunk = std::min<std::uint64_t>(pixels, tracer_.chunk_rays());
  const std::uint64_t film = chunk * (sizeof(FilmPixel) + sizeof(std::uint32_t));
  if (const Integrator* integrator = find_integrator(options.shading))
    return film + (options.wants("variance") ? chunk * sizeof(glm::vec3) : 0) +
           waves_.bytes_for(*integrator, through(scene_.features(), view), last_depth_of(*integrator, options),
                            pixels * options.spp);
  const bool stats = options.stats || find_shading(options.shading).heat;
  const std::uint64_t rays = std::min<std::uint64_t>(pixels * options.spp, tracer_.chunk_rays());
  return film + (stats ? chunk * sizeof(RayStats) : 0) + rays * (sizeof(Ray) + sizeof(Hit));
}

std::uint64_t Renderer::bytes() const {
  std::uint64_t sum = waves_.bytes() + (passes_ ? passes_->bytes() : 0);
  for (const RawBuffer* b : std::initializer_list<const RawBuffer*>{listed_.get(), film_.get(), moments_.get()})
    if (b) sum += b->bytes();
  return sum;
}

}  // namespace ballot
