#include "engine/render/film/shading_passes.h"

#include <algorithm>
#include <bit>

#include "engine/core/stopwatch.h"
#include "engine/gpu/room.h"
#include "engine/render/data/camera.h"
#include "engine/render/data/parts.h"
#include "engine/render/data/run_pass.h"

namespace ballot {

namespace {

constexpr std::uint32_t kFewestLanes = 4;    // lanes per pixel, where several lanes share a pixel
constexpr std::uint32_t kSamples = 16;       // samples of a pixel in one part
constexpr std::uint32_t kPartsTogether = 4;  // parts in one submission

/// Adds the device's counters of one sample of these pixels to the film.
void add_counters(Film& film, std::size_t first, std::uint32_t pixels, const Buffer<RayStats>& stats) {
  std::vector<RayStats> part(pixels);
  stats.download(std::span(part));
  for (std::uint32_t i = 0; i < pixels; ++i)
    for (const CounterInfo& c : kCounters) film.stats[first + i].*c.field += part[i].*c.field;
}

}  // namespace

std::vector<KernelSource> kernels_of(const Shading& shading, const SceneFeatures& features, bool makes_rays) {
  std::vector<KernelSource> sources;
  for (const SceneFeatures& seen : by_camera(features)) sources.push_back(primary_source(true, seen));
  if (features.alpha) sources.push_back(alpha_source(features));
  for (const SceneFeatures& seen : by_camera(features))
    if (makes_rays || sources.back().file != "shade/samples.comp")
      sources.push_back(samples_source(shading.name, seen, makes_rays));
  return sources;
}

Renderer::Passes::Passes(Context& gpu, std::uint32_t chunk_rays, const std::string& shading_name, bool counts,
                         const SceneFeatures& seen, bool makes)
    : shading(shading_name),
      features(seen),
      chunk(chunk_rays),
      generation(gpu.shader_generation()),
      makes_rays(makes),
      film(gpu, chunk, Access::Storage, "film"),
      listed(gpu, chunk, Access::Storage, "listed pixels"),
      stats(counts ? std::make_unique<Buffer<RayStats>>(gpu, chunk, Access::Storage, "counters") : nullptr),
      shade(gpu, samples_source(shading, seen, makes)) {
  if (shade.wants(BIND_LISTED)) shade.bind(BIND_LISTED, listed);
  shade.bind(BIND_FILM, film);
}

void Renderer::Passes::make_room(Context& gpu, std::size_t count) {
  ballot::make_room(hits, gpu, count, "hits");
  shade.bind(BIND_HITS, *hits);
  if (shade.wants(BIND_RAYS)) make_ray_room(gpu, count);
}

void Renderer::Passes::make_ray_room(Context& gpu, std::size_t count) {
  ballot::make_room(rays, gpu, count, "rays");
  if (shade.wants(BIND_RAYS)) shade.bind(BIND_RAYS, *rays);
  if (!primary) primary = std::make_unique<Kernel>(gpu, primary_source(true, features));
  primary->bind(BIND_LISTED, listed);
  primary->bind(BIND_RAYS, *rays);
}

std::uint64_t Renderer::Passes::bytes() const {
  std::uint64_t sum = film.bytes() + listed.bytes();
  for (const RawBuffer* b : std::initializer_list<const RawBuffer*>{rays.get(), hits.get(), stats.get(), cameras.get()})
    if (b) sum += b->bytes();
  return sum;
}

/// Begins to make the traversal kernel of primary rays, while the passes beside it are made.
void Renderer::prepare_trace(const RenderOptions& options, const SceneFeatures& features, bool counts,
                             std::uint64_t rays) {
  Query query = options.query;
  query.rays = kPrimaryRays;
  rays = std::min(rays, std::uint64_t(std::min(options.most_rays, tracer_.chunk_rays())));
  CameraKind camera = CameraKind::None;
  if (tracer_.makes_rays() && !counts && !features.alpha && tracer_.can_record(query, std::uint32_t(rays)))
    camera = features.perspective ? CameraKind::Perspective : CameraKind::Orthographic;
  tracer_.prepare(query, counts, camera);
}

Renderer::Passes& Renderer::passes(const RenderOptions& options, const SceneFeatures& features, std::uint32_t chunk,
                                   std::uint32_t samples) {
  const bool counts = options.stats || find_shading(options.shading).heat;
  if (passes_ && passes_->shading == options.shading && passes_->features == features && passes_->chunk == chunk &&
      counts == (passes_->stats != nullptr) && passes_->makes_rays == tracer_.makes_rays() &&
      passes_->generation == gpu_.shader_generation())
    return *passes_;
  passes_.reset();
  held_ = 0;
  prepare_trace(options, features, counts, std::uint64_t{chunk} * samples);
  passes_ = std::make_unique<Passes>(gpu_, chunk, options.shading, counts, features, tracer_.makes_rays());
  scene_.bind(passes_->shade);
  gpu_.save_pipeline_cache();
  return *passes_;
}

/// Returns the largest part of a chunk for one dispatch. Counter values depend on which rays share a subgroup, so with
/// counters a part is one sample of every pixel.
Part Renderer::largest_part_of(const Chunk& chunk, const RenderOptions& options) const {
  if (passes_->stats) return {0, chunk.pixels, 0, 1};
  std::uint64_t most = std::min(std::max(options.most_rays, 1u), tracer_.chunk_rays());
  if (chunk.samples < kFewestLanes)  // shading then has more invocations than rays
    most = std::min(most, std::uint64_t(gpu_.info().max_group_count_x) * kPassGroup / kFewestLanes);
  return largest_part(chunk.pixels, chunk.samples, std::uint32_t(most), kSamples);
}

/// Returns true if the traversal kernel makes the camera rays wherever the trace can be recorded. No other pass may
/// read them: neither the instrumented kernel nor the passes of alpha.
bool Renderer::makes_rays() const { return passes_->makes_rays && !passes_->stats && !passes_->features.alpha; }

/// Traces the rays of cameras[i] into the buffer of hits.
void Renderer::trace_samples(const std::vector<PrimaryPush>& cameras, std::uint32_t i, const Query& query,
                             RenderTimes& times) {
  Passes& p = *passes_;
  const PrimaryPush& camera = cameras[i];
  const auto add_trace = [&times](double ms) { times.trace_ms += ms; };
  if (makes_rays() && tracer_.can_record(query, camera.count)) {
    const CameraKind kind = camera.orthographic ? CameraKind::Orthographic : CameraKind::Perspective;
    tracer_.record(CameraRays{*p.cameras, i, p.listed, kind}, *p.hits, camera.count, query, add_trace);
    return;
  }
  p.make_ray_room(gpu_, p.hits->size());
  run_pass(gpu_, *p.primary, camera.count, &camera, sizeof camera, times.generate_ms);
  if (p.stats)
    add_trace(tracer_.trace_counted(*p.rays, *p.hits, camera.count, query, *p.stats).device_ms);
  else
    tracer_.record(*p.rays, *p.hits, camera.count, query, add_trace);
  waves_.pass_through(*p.rays, *p.hits, camera.count, query, p.features, times.passes);
}

void Renderer::shade_samples(Film& film, const Chunk& chunk, const PrimaryPush& camera, const RenderOptions& options,
                             RenderTimes& times, const Progress& progress) {
  Passes& p = *passes_;
  const PassScope scope(gpu_);
  if (!take(film)) {
    const Stopwatch watch(times.film_s);
    p.listed.upload(std::span(film.listed).subspan(chunk.first, chunk.pixels));
    if (film.samples > 0) p.film.upload(std::span(film.pixels).subspan(chunk.first, chunk.pixels));
  }
  Query query = options.query;
  query.rays = kPrimaryRays;
  const PixelCone cone = pixel_cone(camera);
  const Part largest = largest_part_of(chunk, options);
  p.make_room(gpu_, largest.rays());
  const std::vector<PrimaryPush> cameras = cameras_of(camera, chunk.pixels, chunk.samples, largest, film.samples);
  if (makes_rays()) {
    ballot::make_room(p.cameras, gpu_, cameras.size(), "cameras");
    p.cameras->upload(cameras);
  }
  std::uint64_t done = 0;
  for (std::uint32_t i = 0; i < cameras.size(); ++i) {
    trace_samples(cameras, i, query, times);
    const std::uint32_t together = cameras[i].together, pixels = cameras[i].count / together;
    const std::uint32_t lanes = p.makes_rays ? std::clamp(std::bit_floor(together), kFewestLanes, kPassGroup) : 1;
    const SamplesPush push{cameras[i], cone.width, cone.spread, pixels, std::uint32_t(std::countr_zero(lanes))};
    run_pass(gpu_, p.shade, pixels * lanes, &push, sizeof push, times.shade_ms);
    if (p.stats) add_counters(film, chunk.first, chunk.pixels, *p.stats);
    if ((i + 1) % kPartsTogether == 0) gpu_.flush();
    done += cameras[i].count;
    if (progress) progress(double(done) / (double(chunk.pixels) * chunk.samples));
  }
  gpu_.finish();
}

}  // namespace ballot
