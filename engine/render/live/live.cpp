#include "engine/render/live/live.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "engine/core/error.h"
#include "engine/gpu/room.h"
#include "engine/render/batch/batch.h"
#include "engine/render/data/camera.h"
#include "engine/render/data/run_pass.h"

namespace ballot {

namespace {

KernelSource plain_source(const std::string& folder, const std::string& name) {
  return {.name = folder + "." + name, .file = folder + "/" + name + ".comp"};
}
KernelSource visible_source() { return plain_source("shade", "visible"); }
KernelSource heat_source() { return plain_source("shade", "heat"); }
KernelSource tiles_source() { return plain_source("rays", "tiles"); }

/// Returns the query for a picture's rays.
Query query_of(const LiveOptions& options) {
  const RayKind& kind = find_ray_kind(options.rays);
  Query query = options.query;
  query.want = kind.want;
  query.rays = kind.name;
  return query;
}

/// Returns the scale of the shown colours: the film holds sums over samples and generators.
float shown_scale(const LiveOptions& options) {
  return 1.0f / float((options.sample_index + 1) * find_ray_kind(options.rays).generators.size());
}

/// Returns the index of a counter among the 32-bit words of RayStats; ~0 for null.
std::uint32_t word_of(HeatKind::Field field) {
  const RayStats s{};
  if (!field) return ~0u;
  return std::uint32_t(reinterpret_cast<const std::byte*>(&(s.*field)) - reinterpret_cast<const std::byte*>(&s)) / 4;
}

}  // namespace

std::vector<KernelSource> live_sources() { return {visible_source(), heat_source(), tiles_source(), show_source()}; }

LiveImage::LiveImage(Context& gpu, Tracer& tracer, SceneData& scene, const glm::vec3& origin)
    : gpu_(gpu),
      tracer_(tracer),
      scene_(scene),
      origin_(origin),
      camera_(gpu, 1, Access::Storage, "camera"),
      totals_(gpu, 1, Access::Storage, "totals"),
      totals_seen_(gpu, 1, Access::Host, "totals seen") {}

LiveImage::~LiveImage() = default;

void LiveImage::check(const LiveOptions& o) const {
  check_options(
      RenderOptions{.width = o.width, .height = o.height, .spp = o.sample_count, .shading = o.shading, .heat = o.heat});
  const bool primary = find_ray_kind(o.rays).name == kPrimaryRays;
  if (find_integrator(o.shading) && !primary)
    fail(Failure::Arguments, "shading '{}' traces rays of its own: it takes no --rays", o.shading);
  check_options(RayKindOptions{.ao_radius = o.ao_radius});
  tracer_.variant(o.query);
}

void LiveImage::make_room(const LiveOptions& o, bool counts) {
  const std::uint32_t total = padded_rays(o.width, o.height);
  const std::uint32_t most = tracer_.chunk_rays() / kTileRays * kTileRays;
  const std::uint32_t wanted = std::min(total, most);
  const bool from_hits = !find_ray_kind(o.rays).from_camera();
  // The picture of a window changes its size often, so buffers only grow.
  if (wanted > chunk_rays_) gpu_.wait_idle("waiting for the window");
  if (wanted > chunk_rays_) {
    film_.clear();
    starts_.reset();
    chunk_rays_ = wanted;
  }
  make_pixels(o);
  ballot::make_room(hits_, gpu_, chunk_rays_, "hits");
  if (from_hits) ballot::make_room(secondary_, gpu_, chunk_rays_, "rays from hits");
  if (from_hits) ballot::make_room(secondary_hits_, gpu_, chunk_rays_, "hits of rays from hits");
  if (counts) ballot::make_room(stats_, gpu_, chunk_rays_, "counters");
  const std::size_t chunks = (total + chunk_rays_ - 1) / chunk_rays_;
  while (film_.size() < chunks) film_.emplace_back(gpu_, chunk_rays_, Access::Storage, "film");
}

void LiveImage::make_pixels(const LiveOptions& o) {
  const std::size_t pixels = std::size_t(o.width) * o.height;
  if (pixels_ && pixels_->size() >= pixels) return;
  gpu_.wait_idle("waiting for the window");
  ballot::make_room(pixels_, gpu_, pixels, "pixels");
}

LiveTimes LiveImage::add_paths(const View& view, const LiveOptions& options, const Integrator& integrator) {
  if (!paths_) paths_ = std::make_unique<LivePaths>(gpu_, tracer_, scene_);
  LiveTimes times = paths_->add(view, options, integrator);
  if (!times.finished) return times;
  make_pixels(options);
  paths_->show(options, integrator, *pixels_, times);
  return times;
}

Kernel& LiveImage::kernel(const KernelSource& source) {
  auto& kernel = kernels_[source.name];
  if (refresh(gpu_, kernel, source)) {
    scene_.bind(*kernel);
    gpu_.save_pipeline_cache();
  }
  return *kernel;
}

LiveTimes LiveImage::add_sample(const View& asked, const LiveOptions& options) {
  check(options);
  const View view = moved_back(asked, origin_);
  if (const Integrator* integrator = find_integrator(options.shading)) return add_paths(view, options, *integrator);
  const bool counts = find_shading(options.shading).heat;
  make_room(options, counts);
  const std::uint32_t total = padded_rays(options.width, options.height);
  PrimaryPush camera = camera_push(view, options.width, options.height);
  camera.sample_count = options.sample_count;
  camera.sample_index = options.sample_index;
  const RayKind& kind = find_ray_kind(options.rays);
  if (kind.generators[0] == kShadowGenerator[0] && options.sample_index == 0)
    light_ = point_light(tracer_, scene_.scene(), view);
  LiveTimes times;
  const SceneFeatures features = through(scene_.features(), view);
  const PassScope scope(gpu_);
  const bool made = makes_rays(options, std::min(chunk_rays_, total));
  const TilesPush tiles = made ? make_tiles({options.width, total}, times) : tiles_of_;
  gpu_.pass("totals", [&](Commands& cmd) { cmd.fill(totals_, 0); });
  std::size_t chunk = 0;
  for (camera.first = 0; camera.first < total; camera.first += chunk_rays_) {
    camera.count = std::min(chunk_rays_, total - camera.first);
    sample_slice({chunk++, features, camera, camera.count, made}, options, times);
  }
  gpu_.pass("totals", [&](Commands& cmd) { cmd.copy(totals_, totals_seen_, sizeof(std::uint32_t)); });
  std::uint32_t live = 0;
  totals_seen_.download(std::span(&live, 1));
  tiles_of_ = tiles;
  // Heat maps shade and count only the rays of the first generator in the first sample.
  if (kind.from_camera())
    counted_ = std::uint64_t(options.width) * options.height;
  else if (!counts || options.sample_index == 0)
    counted_ = std::uint64_t(live) * (counts ? kind.generators.size() : 1);
  times.rays = counted_;
  return times;
}

/// Returns true if the traversal kernel makes the picture's rays, which no other pass may then read.
bool LiveImage::makes_rays(const LiveOptions& o, std::uint32_t count) const {
  if (!find_ray_kind(o.rays).from_camera() || find_shading(o.shading).heat || !tracer_.makes_rays()) return false;
  return tracer_.can_record(query_of(o), count);
}

void LiveImage::sample_slice(const Slice& slice, const LiveOptions& options, LiveTimes& times) {
  const RayKind& kind = find_ray_kind(options.rays);
  if (slice.made) {
    gpu_.pass("camera", [&](Commands& cmd) { cmd.write(camera_, slice.camera); });
  } else {
    ballot::make_room(rays_, gpu_, chunk_rays_, "rays");
    Kernel& primary = kernel(primary_source(false, slice.features));
    primary.bind(BIND_RAYS, *rays_);
    run_pass(gpu_, primary, slice.count, &slice.camera, sizeof slice.camera, times.generate_ms);
  }
  if (kind.from_camera()) {
    trace_and_shade(slice, slice.made ? nullptr : rays_.get(), options, 0, times);
  } else {
    Query first = options.query;
    first.want = Want::Nearest;
    first.rays = kPrimaryRays;
    tracer_.record(*rays_, *hits_, slice.count, first, [&times](double ms) { times.primary_ms += ms; });
    for (std::uint32_t part = 0; part < kind.generators.size(); ++part) {
      generate_secondary(kind.generators[part], slice, options, times);
      trace_and_shade(slice, secondary_.get(), options, part, times);
    }
  }
}

/// Makes the list of pixels for rays that the traversal kernel makes. Returns the picture that the list is for. The
/// caller stores it in tiles_of_ only once the pass has run, because a failure may come in between.
TilesPush LiveImage::make_tiles(const TilesPush& tiles, LiveTimes& times) {
  const bool kept = tiles.width == tiles_of_.width && tiles.count <= tiles_of_.count;
  if (!ballot::make_room(tiles_, gpu_, tiles.count, "pixels of tiles") && kept) return tiles_of_;
  tiles_of_ = {};
  Kernel& k = kernel(tiles_source());
  k.bind(BIND_LISTED, *tiles_);
  run_pass(gpu_, k, tiles.count, &tiles, sizeof tiles, times.generate_ms);
  return tiles;
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
  Kernel& k = kernel(generator_source(generator, find_offset_policy(RayKindOptions{}.offset), scene_.features()));
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

// `rays` is null if the traversal kernel makes the rays. `part` is the index of the kind's generator; the colours of
// all generators add up like those of samples.
void LiveImage::trace_and_shade(const Slice& slice, const Buffer<Ray>* rays, const LiveOptions& options,
                                std::uint32_t part, LiveTimes& times) {
  const bool heat = find_shading(options.shading).heat;
  Buffer<Hit>& hits = find_ray_kind(options.rays).from_camera() ? *hits_ : *secondary_hits_;
  const Query query = query_of(options);
  const auto add = [&times](double ms) { times.trace_ms += ms; };
  if (heat) {
    add(tracer_.trace_counted(*rays, hits, slice.count, query, *stats_).device_ms);
  } else if (!rays) {
    const CameraKind kind = slice.camera.orthographic ? CameraKind::Orthographic : CameraKind::Perspective;
    tracer_.record(CameraRays{camera_, 0, *tiles_, kind}, hits, slice.count, query, add);
  } else {
    tracer_.record(*rays, hits, slice.count, query, add);
  }
  const std::uint32_t sample = options.sample_index + part;
  const bool last = part + 1 == find_ray_kind(options.rays).generators.size();
  if (!heat || sample == 0) shade_slice(slice, rays, hits, options, sample, last && !heat, times);
  if (heat) paint_heat(slice, options, query, sample, times);
}

void LiveImage::shade_slice(const Slice& slice, const Buffer<Ray>* rays, const Buffer<Hit>& hits,
                            const LiveOptions& options, std::uint32_t sample, bool shown, LiveTimes& times) {
  const RayKind& kind = find_ray_kind(options.rays);
  const bool visible = kind.want == Want::Any;
  Kernel& k = kernel(visible ? visible_source() : live_source(options.shading, slice.features, !rays));
  if (rays) k.bind(BIND_RAYS, *rays);
  k.bind(BIND_HITS, hits);
  k.bind(BIND_FILM, film_[slice.chunk]);
  k.bind(BIND_PIXELS, *pixels_);
  k.bind(BIND_TOTALS, totals_);
  const PixelCone cone = pixel_cone(slice.camera);
  const std::uint32_t flags = (shown ? LIVE_SHOWN : 0) | (kind.from_camera() ? 0 : LIVE_COUNTED);
  LivePush push{slice.camera, cone.width, cone.spread, shown_scale(options), flags};
  push.camera.sample_index = sample;
  run_pass(gpu_, k, slice.count, &push, sizeof push, times.shade_ms);
}

void LiveImage::paint_heat(const Slice& slice, const LiveOptions& options, const Query& query, std::uint32_t sample,
                           LiveTimes& times) {
  const HeatKind& kind = find_heat(options.heat);
  float top = kind.fixed_top(tracer_.variant(query).config.subgroup);
  if (top == 0) {
    // The scale is estimated from some tiles. All samples of a picture share it.
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
  push.scale = shown_scale(options);
  std::ranges::copy(heat_ramp(), push.ramp);
  Kernel& k = kernel(heat_source());
  k.bind(BIND_COUNTS, *stats_);
  k.bind(BIND_FILM, film_[slice.chunk]);
  k.bind(BIND_PIXELS, *pixels_);
  run_pass(gpu_, k, slice.count, &push, sizeof push, times.shade_ms);
}

Probe LiveImage::probe(const View& view, const LiveOptions& options, std::uint32_t x, std::uint32_t y, bool count) {
  check(options);
  if (x >= options.width || y >= options.height)
    fail(Failure::Arguments, "pixel ({}, {}) is not in the picture of {}x{}", x, y, options.width, options.height);
  const std::uint32_t tiles_x = (options.width + TILE_SIZE - 1) / TILE_SIZE;
  PrimaryPush camera = camera_push(moved_back(view, origin_), options.width, options.height);
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
  query = tracer_.resolve(query, padded_rays(options.width, options.height));  // not what auto takes for a tile
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
  probe.ray.origin += origin_;
  hits.download(std::span(&probe.hit, 1), index);
  return probe;
}

}  // namespace ballot
