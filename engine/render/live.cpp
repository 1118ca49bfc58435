#include "engine/render/live.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "engine/core/error.h"
#include "engine/render/batch.h"
#include "engine/render/camera.h"
#include "engine/render/room.h"
#include "engine/render/run_pass.h"

namespace ballot {

namespace {

constexpr std::uint32_t kTileRays = TILE_SIZE * TILE_SIZE;

KernelSource plain_source(const char* name) {
  return {.name = std::string("shade.") + name,
          .file = std::string("shade/") + name + ".comp",
          .defines = {},
          .constants = {}};
}

std::uint32_t word_of(HeatKind::Field field) {
  const RayStats s{};
  if (!field) return ~0u;
  return std::uint32_t(reinterpret_cast<const std::byte*>(&(s.*field)) - reinterpret_cast<const std::byte*>(&s)) / 4;
}

}  // namespace

std::vector<KernelSource> live_sources() {
  return {plain_source("visible"), plain_source("heat"), plain_source("display")};
}

LiveImage::LiveImage(Context& gpu, Tracer& tracer, SceneData& scene)
    : gpu_(gpu),
      tracer_(tracer),
      scene_(scene),
      totals_(gpu, 1, Access::Storage, "totals"),
      totals_seen_(gpu, 1, Access::Host, "totals seen") {}

LiveImage::~LiveImage() = default;

void LiveImage::check(const LiveOptions& o) const {
  check_options(
      RenderOptions{.width = o.width, .height = o.height, .spp = o.sample_count, .shading = o.shading, .heat = o.heat});
  find_ray_kind(o.rays);
  check_options(RayKindOptions{.ao_radius = o.ao_radius});
  tracer_.variant(o.query);
  if (o.other) tracer_.variant(*o.other);
}

void LiveImage::make_room(const LiveOptions& o, bool counts) {
  const std::uint32_t total = padded_rays(o.width, o.height);
  const std::uint32_t most = tracer_.chunk_rays() / kTileRays * kTileRays;
  const std::uint32_t wanted = std::min(total, most);
  const bool from_hits = !find_ray_kind(o.rays).from_camera();
  // A window's picture grows and shrinks all the time: buffers only grow.
  const std::size_t pixels = std::size_t(o.width) * o.height;
  if (!pixels_ || pixels_->size() < pixels || wanted > chunk_rays_)
    vk_check(vkDeviceWaitIdle(gpu_.device()), "waiting for the window");
  if (wanted > chunk_rays_) {
    film_.clear();
    other_film_.clear();
    starts_.reset();
    chunk_rays_ = wanted;
  }
  ballot::make_room(pixels_, gpu_, pixels, "pixels");
  ballot::make_room(rays_, gpu_, chunk_rays_, "rays");
  ballot::make_room(hits_, gpu_, chunk_rays_, "hits");
  if (from_hits) ballot::make_room(secondary_, gpu_, chunk_rays_, "rays from hits");
  if (from_hits) ballot::make_room(secondary_hits_, gpu_, chunk_rays_, "hits of rays from hits");
  if (counts) ballot::make_room(stats_, gpu_, chunk_rays_, "counters");
  const std::size_t chunks = (total + chunk_rays_ - 1) / chunk_rays_;
  while (film_.size() < chunks) film_.emplace_back(gpu_, chunk_rays_, Access::Storage, "film");
  while (o.other && other_film_.size() < chunks) other_film_.emplace_back(gpu_, chunk_rays_, Access::Storage, "film b");
}

Kernel& LiveImage::kernel(const KernelSource& source) {
  auto& kernel = kernels_[source.name];
  if (refresh(gpu_, kernel, source)) {
    scene_.bind(*kernel);
    gpu_.save_pipeline_cache();
  }
  return *kernel;
}

LiveTimes LiveImage::add_sample(const View& view, const LiveOptions& options) {
  check(options);
  const bool counts = find_shading(options.shading).heat;
  make_room(options, counts);
  const std::uint32_t total = padded_rays(options.width, options.height);
  PrimaryPush camera = camera_push(view, options.width, options.height);
  camera.sample_count = options.sample_count;
  camera.sample_index = options.sample_index;
  const RayKind& kind = find_ray_kind(options.rays);
  // Any-hit kinds are the ones that may aim at the light.
  if (kind.want == Want::Any && options.sample_index == 0) light_ = point_light(tracer_, scene_.scene(), view);
  LiveTimes times;
  const SceneFeatures features = through(scene_.features(), view);
  const PassScope scope(gpu_);
  gpu_.pass("totals", [&](VkCommandBuffer cmd) { vkCmdFillBuffer(cmd, totals_.handle(), 0, VK_WHOLE_SIZE, 0); });
  std::size_t chunk = 0;
  for (camera.first = 0; camera.first < total; camera.first += chunk_rays_) {
    camera.count = std::min(chunk_rays_, total - camera.first);
    sample_slice({chunk++, features, camera, camera.count}, options, times);
  }
  gpu_.pass("totals", [&](VkCommandBuffer cmd) {
    const VkBufferCopy all{0, 0, sizeof(DisplayTotals)};
    vkCmdCopyBuffer(cmd, totals_.handle(), totals_seen_.handle(), 1, &all);
  });
  DisplayTotals totals{};
  totals_seen_.download(std::span(&totals, 1));
  times.rays = std::uint64_t(totals.live) * kind.generators.size();
  times.different = totals.different;
  return times;
}

void LiveImage::sample_slice(const Slice& slice, const LiveOptions& options, LiveTimes& times) {
  const RayKind& kind = find_ray_kind(options.rays);
  Kernel& primary = kernel(primary_source(false, slice.features));
  primary.bind(BIND_RAYS, *rays_);
  run_pass(gpu_, primary, slice.count, &slice.camera, sizeof slice.camera, times.generate_ms);
  if (kind.from_camera()) {
    trace_and_shade(slice, *rays_, options, false, 0, times);
    if (options.other) trace_and_shade(slice, *rays_, options, true, 0, times);
  } else {
    Query first = options.query;
    first.want = Want::Nearest;
    first.rays = kPrimaryRays;
    tracer_.record(*rays_, *hits_, slice.count, first, [&times](double ms) { times.primary_ms += ms; });
    for (std::uint32_t part = 0; part < kind.generators.size(); ++part) {
      generate_secondary(kind.generators[part], slice, options, times);
      trace_and_shade(slice, *secondary_, options, false, part, times);
      if (options.other) trace_and_shade(slice, *secondary_, options, true, part, times);
    }
  }
  display(slice, options, times);
}

void LiveImage::generate_secondary(std::string_view generator, const Slice& slice, const LiveOptions& options,
                                   LiveTimes& times) {
  if (ballot::make_room(starts_, gpu_, chunk_rays_, "starts of rays") || width_ != options.width ||
      starts_first_ != slice.camera.first) {
    std::vector<Start> starts(chunk_rays_);
    for (std::uint32_t i = 0; i < chunk_rays_; ++i) {
      const glm::uvec2 at = pixel_of(slice.camera.first + i, options.width);
      starts[i] = {i, at.y * options.width + at.x};
    }
    starts_->upload(starts);
    width_ = options.width;
    starts_first_ = slice.camera.first;
  }
  Kernel& k = kernel(generator_source(generator, find_offset_policy(RayKindOptions{}.offset)));
  k.bind(BIND_RAYS, *secondary_);
  k.bind(BIND_HITS, *hits_);
  k.bind(BIND_PRIMARY, *rays_);
  k.bind(BIND_STARTS, *starts_);
  SecondaryPush push{};
  push.light = light_;
  const Bounds& b = scene_.scene().bounds;
  push.radius = options.ao_radius * glm::distance(b.lo, b.hi);
  push.constant_offset = RayKindOptions{}.constant_offset * glm::distance(b.lo, b.hi);
  push.count = slice.count;
  push.rays_per_hit = 1;
  push.sample_index = options.sample_index;
  run_pass(gpu_, k, slice.count, &push, sizeof push, times.generate_ms);
}

// `part` counts the generators of a kind: their colours add up like samples.
void LiveImage::trace_and_shade(const Slice& slice, const Buffer<Ray>& rays, const LiveOptions& options, bool second,
                                std::uint32_t part, LiveTimes& times) {
  const RayKind& kind = find_ray_kind(options.rays);
  const bool heat = find_shading(options.shading).heat;
  Buffer<Hit>& hits = kind.from_camera() ? *hits_ : *secondary_hits_;
  Buffer<FilmPixel>& film = (second ? other_film_ : film_)[slice.chunk];
  Query query = second ? *options.other : options.query;
  query.want = kind.want;
  query.rays = kind.name;
  double& trace_ms = second ? times.other_ms : times.trace_ms;
  if (heat)
    trace_ms += tracer_.trace_counted(rays, hits, slice.count, query, *stats_).device_ms;
  else
    tracer_.record(rays, hits, slice.count, query, [&trace_ms](double ms) { trace_ms += ms; });
  const std::uint32_t sample = options.sample_index + part;
  if (!heat || sample == 0) {
    const bool visible = kind.want == Want::Any;
    Kernel& shade = kernel(visible ? plain_source("visible") : shading_source(options.shading, scene_.features()));
    shade.bind(BIND_RAYS, rays);
    shade.bind(BIND_HITS, hits);
    shade.bind(BIND_FILM, film);
    const PixelCone cone = pixel_cone(slice.camera);
    const ShadePush push{.width = options.width,
                         .height = options.height,
                         .first = slice.camera.first,
                         .count = slice.count,
                         .sample_index = sample,
                         .cone_width = cone.width,
                         .cone_spread = cone.spread};
    run_pass(gpu_, shade, slice.count, &push, sizeof push, times.shade_ms);
  }
  if (heat) paint_heat(slice, options, query, film, sample, times);
}

void LiveImage::paint_heat(const Slice& slice, const LiveOptions& options, const Query& query, Buffer<FilmPixel>& film,
                           std::uint32_t sample, LiveTimes& times) {
  const HeatKind& kind = find_heat(options.heat);
  float top = kind.fixed_top(tracer_.variant(query).how.subgroup);
  if (top == 0) {
    // Some tiles stand for the picture; both queries and all samples of a picture share one scale.
    if (sample == 0 && slice.camera.first == 0 && times.heat_top == 0) {
      std::vector<float> values;
      std::vector<RayStats> tile(kTileRays);
      const std::uint32_t tiles = slice.count / kTileRays, step = std::max(1u, tiles / 12);
      for (std::uint32_t t = step / 2; t < tiles; t += step) {
        stats_->download(tile, std::size_t(t) * kTileRays);
        for (const RayStats& s : tile) values.push_back(kind.value(s));
      }
      heat_top_ = heat_top_of(std::move(values));
    }
    top = heat_top_;
  }
  times.heat_top = top;
  HeatPush push{};
  push.width = options.width;
  push.height = options.height;
  push.first = slice.camera.first;
  push.count = slice.count;
  push.sample_index = sample;
  push.words = sizeof(RayStats) / 4;
  push.value = word_of(kind.count);
  push.over_a = word_of(kind.over[0]);
  push.over_b = word_of(kind.over[1]);
  push.top = top;
  std::ranges::copy(heat_ramp(), push.ramp);
  Kernel& k = kernel(plain_source("heat"));
  k.bind(BIND_COUNTS, *stats_);
  k.bind(BIND_FILM, film);
  run_pass(gpu_, k, slice.count, &push, sizeof push, times.shade_ms);
}

void LiveImage::display(const Slice& slice, const LiveOptions& options, LiveTimes& times) {
  const RayKind& kind = find_ray_kind(options.rays);
  Kernel& k = kernel(plain_source("display"));
  k.bind(BIND_RAYS, kind.from_camera() ? *rays_ : *secondary_);
  k.bind(BIND_FILM, film_[slice.chunk]);
  k.bind(BIND_FILM_B, options.other ? other_film_[slice.chunk] : film_[slice.chunk]);
  k.bind(BIND_PIXELS, *pixels_);
  k.bind(BIND_TOTALS, totals_);
  DisplayPush push{};
  push.width = options.width;
  push.height = options.height;
  push.first = slice.camera.first;
  push.count = slice.count;
  push.scale = 1.0f / float((options.sample_index + 1) * kind.generators.size());
  push.split = options.other ? options.split : options.width;
  push.mark = options.other.has_value();
  push.swap_red = options.swap_red;
  run_pass(gpu_, k, slice.count, &push, sizeof push, times.shade_ms);
}

Probe LiveImage::probe(const View& view, const LiveOptions& options, std::uint32_t x, std::uint32_t y, bool count) {
  check(options);
  if (x >= options.width || y >= options.height)
    fail(Failure::Arguments, "pixel ({}, {}) is not in a picture of {}x{}", x, y, options.width, options.height);
  const std::uint32_t tiles_x = (options.width + TILE_SIZE - 1) / TILE_SIZE;
  PrimaryPush camera = camera_push(view, options.width, options.height);
  camera.first = (y / TILE_SIZE * tiles_x + x / TILE_SIZE) * kTileRays;
  camera.count = kTileRays;
  std::uint32_t index = 0;
  while (pixel_of(camera.first + index, options.width) != glm::uvec2(x, y)) ++index;
  Buffer<Ray> rays(gpu_, kTileRays, Access::Storage, "rays of a tile");
  Buffer<Hit> hits(gpu_, kTileRays, Access::Storage, "hits of a tile");
  Kernel& primary = kernel(primary_source(false, through(scene_.features(), view)));
  primary.bind(BIND_RAYS, rays);
  double ms = 0;
  const PassScope scope(gpu_);
  run_pass(gpu_, primary, kTileRays, &camera, sizeof camera, ms);
  Query query = options.query;
  query.want = Want::Nearest;
  query.rays = kPrimaryRays;
  Probe probe;
  if (count) {
    Buffer<RayStats> stats(gpu_, kTileRays, Access::Storage, "counters of a tile");
    tracer_.trace_counted(rays, hits, kTileRays, query, stats);
    stats.download(std::span(&probe.stats, 1), index);
    probe.counted = true;
  } else {
    tracer_.trace(rays, hits, kTileRays, query);
  }
  rays.download(std::span(&probe.ray, 1), index);
  hits.download(std::span(&probe.hit, 1), index);
  return probe;
}

}  // namespace ballot
