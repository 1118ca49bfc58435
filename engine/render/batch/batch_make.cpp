// Makes batches of ray kinds. The buffers and kernels of a frame are made once; its passes then run repeatedly.
#include <algorithm>
#include <glm/geometric.hpp>

#include "engine/core/error.h"
#include "engine/render/batch/batch_frame.h"
#include "engine/render/data/camera.h"

namespace ballot {

namespace {

/// Returns the pixels of a picture, in the order of their rays.
std::vector<std::uint32_t> pixels_inside(std::uint32_t width, std::uint32_t height) {
  std::vector<std::uint32_t> pixels;
  pixels.reserve(std::size_t(width) * height);
  for (std::uint32_t i = 0; i < padded_rays(width, height); ++i) {
    const glm::uvec2 at = pixel_of(i, width);
    if (at.x < width && at.y < height) pixels.push_back(LISTED_PIXEL(at.x, at.y));
  }
  return pixels;
}

}  // namespace

Kernel& Batches::generator(const KernelSource& source) {
  auto& kernel = kernels_[source.name];
  if (!kernel) {
    kernel = std::make_unique<Kernel>(gpu_, source);
    scene_.bind(*kernel);
    gpu_.save_pipeline_cache();
  }
  return *kernel;
}

void Batches::make_primaries(RayBatch& batch, const View& view, std::uint32_t width, std::uint32_t height) {
  Frame& frame = *batch.frame_;
  const bool listed = width % TILE_SIZE || height % TILE_SIZE;
  frame.camera = camera_push(view, width, height);
  frame.primary = &generator(primary_source(listed, through(scene_.features(), view)));
  RayBatch primaries("primary", view.name, std::string(kPrimaryRays), Want::Nearest);
  primaries.add_chunks(gpu_, std::size_t(width) * height, chunk_rays());
  if (listed) {
    const std::vector<std::uint32_t> all = pixels_inside(width, height);
    std::size_t first = 0;
    for (const Chunk& c : primaries.chunks_) {
      frame.listed.emplace_back(gpu_, c.count, Access::Storage, "listed pixels");
      frame.listed.back().upload(std::span(all).subspan(first, c.count));
      first += c.count;
    }
  }
  if (!frame.from_camera) {
    frame.primaries = std::move(primaries.chunks_);
    frame.scratch =
        std::make_unique<Buffer<Hit>>(gpu_, frame.primaries[0].count, Access::Storage, "primary hits of frames");
    return;
  }
  batch.count_ = primaries.count_;
  batch.chunks_ = std::move(primaries.chunks_);
}

double Batches::generate_primaries(RayBatch& batch) {
  Frame& frame = *batch.frame_;
  const std::vector<Chunk>& chunks = frame.from_camera ? batch.chunks_ : frame.primaries;
  PrimaryPush push = frame.camera;
  const bool listed = !frame.listed.empty();
  double ms = 0;
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    frame.primary->bind(BIND_RAYS, chunks[i].rays);
    if (listed) frame.primary->bind(BIND_LISTED, frame.listed[i]);
    push.count = chunks[i].count;
    gpu_.submit(frame.primary->name(),
                [&](Commands& cmd) { frame.primary->dispatch(cmd, groups_of(chunks[i].count, kPassGroup), push); });
    ms += gpu_.last_ms();
    if (!listed) push.first += chunks[i].count;
  }
  return ms;
}

// The starts are the hits of the default query, whatever the query of a later frame is.
void Batches::make_starts(Frame& frame) {
  const std::vector<std::uint32_t> listed =
      frame.listed.empty() ? std::vector<std::uint32_t>{} : pixels_inside(frame.camera.width, frame.camera.height);
  std::uint32_t first = 0;
  for (Chunk& c : frame.primaries) {
    tracer_.trace(c.rays, c.hits, c.count, Query{.rays = std::string(kPrimaryRays)});
    std::vector<Hit> hits(c.count);
    c.hits.download(hits);
    std::vector<Start> starts;
    for (std::uint32_t i = 0; i < c.count; ++i) {
      if (hits[i].prim == NO_HIT) continue;
      const glm::uvec2 at = listed.empty() ? pixel_of(first + i, frame.camera.width) : listed_pixel(listed[first + i]);
      starts.push_back({i, at.y * frame.camera.width + at.x});
    }
    frame.starts.emplace_back(gpu_, starts.size(), Access::Storage, "starts of rays");
    frame.starts.back().upload(starts);
    frame.start_count.push_back(std::uint32_t(starts.size()));
    first += c.count;
  }
}

namespace {

// The distance of the point light from the camera: a share of the scene's diagonal, so that it follows the size of the
// scene, but at most a share of the distance to the nearest surface in that direction, so that the light is never
// behind a wall. The two values are those that ray kind "shadow" began with; no measurement chose them. All
// measurements of shadow rays are made with them, and other values would give other rays.
constexpr double kLightDistance = 0.15;
constexpr double kLightClearance = 0.7;

glm::dvec3 light_direction(const View& view) {
  const glm::dvec3 right(view.world_from_camera[0]), up(view.world_from_camera[1]);
  return glm::normalize(up + 0.5 * right);
}

}  // namespace

glm::vec3 point_light(Tracer& tracer, const Scene& scene, const View& view) {
  const glm::dvec3 eye(view.world_from_camera[3]), direction = light_direction(view);
  const Ray ray{glm::vec3(eye), 0, glm::vec3(direction), 1e30f};
  Hit hit{};
  tracer.trace(std::span(&ray, 1), std::span(&hit, 1), Query{});
  const double diagonal = glm::length(glm::dvec3(scene.bounds.hi) - glm::dvec3(scene.bounds.lo));
  return glm::vec3(eye + direction * std::min(kLightDistance * diagonal, kLightClearance * double(hit.t)));
}

// Plans the runs: the rays of every generator and chunk of primary hits, in this order, split where a chunk of the
// batch ends.
void Batches::plan(RayBatch& batch, const RayKind& kind, const RayKindOptions& options) {
  Frame& frame = *batch.frame_;
  SecondaryPush push{};
  push.rays_per_hit = kind.rays_per_hit ? kind.rays_per_hit : options.ao_rays;
  const Bounds& b = scene_.scene().bounds;
  push.radius = options.ao_radius * glm::distance(b.lo, b.hi);
  push.constant_offset = options.constant_offset * glm::distance(b.lo, b.hi);
  const OffsetPolicy& policy = find_offset_policy(options.offset);
  std::size_t total = 0;
  for (const std::uint32_t n : frame.start_count) total += std::size_t(n) * push.rays_per_hit * kind.generators.size();
  batch.add_chunks(gpu_, total, chunk_rays());
  std::size_t target = 0;
  for (const std::string_view name : kind.generators)
    for (std::size_t source = 0; source < frame.starts.size(); ++source) {
      const std::uint32_t rays = frame.start_count[source] * push.rays_per_hit;
      for (push.first = 0; push.first < rays; push.first += push.count) {
        push.count = std::min(rays - push.first, batch.chunks_[target].count - push.offset);
        frame.runs.push_back({&generator(generator_source(name, policy, scene_.features())), source, target, push});
        push.offset += push.count;
        if (push.offset == batch.chunks_[target].count) ++target, push.offset = 0;
      }
    }
}

double Batches::generate_from_hits(RayBatch& batch) {
  Frame& frame = *batch.frame_;
  double ms = 0;
  for (const GeneratorRun& run : frame.runs) {
    Kernel& kernel = *run.kernel;
    kernel.bind(BIND_RAYS, batch.chunks_[run.target].rays);
    kernel.bind(BIND_HITS, frame.primaries[run.source].hits);
    kernel.bind(BIND_PRIMARY, frame.primaries[run.source].rays);
    kernel.bind(BIND_STARTS, frame.starts[run.source]);
    gpu_.submit(kernel.name(),
                [&](Commands& cmd) { kernel.dispatch(cmd, groups_of(run.push.count, kPassGroup), run.push); });
    ms += gpu_.last_ms();
  }
  return ms;
}

double Batches::shade(RayBatch& batch) {
  Frame& frame = *batch.frame_;
  double ms = 0;
  for (const Chunk& c : batch.chunks_) {
    frame.shade->bind(BIND_RAYS, c.rays);
    frame.shade->bind(BIND_HITS, c.hits);
    frame.shade->bind(BIND_FILM, *frame.film);
    const ShadePush push{c.count};
    gpu_.submit(frame.shade->name(),
                [&](Commands& cmd) { frame.shade->dispatch(cmd, groups_of(c.count, kPassGroup), push); });
    ms += gpu_.last_ms();
  }
  return ms;
}

std::unique_ptr<RayBatch> Batches::make(const View& view, const RayKind& kind, std::uint32_t width,
                                        std::uint32_t height, const RayKindOptions& options) {
  check_options(options);
  check_size(width, height);
  std::unique_ptr<RayBatch> batch(new RayBatch(std::string(kind.name), view.name, std::string(kind.name), kind.want));
  batch->frame_ = std::make_unique<Frame>();
  Frame& frame = *batch->frame_;
  frame.from_camera = kind.from_camera();
  make_primaries(*batch, view, width, height);
  generate_primaries(*batch);
  if (!frame.from_camera) {
    make_starts(frame);
    plan(*batch, kind, options);
    const glm::vec3 light = point_light(tracer_, scene_.scene(), view);
    for (GeneratorRun& run : frame.runs) run.push.light = light;
    generate_from_hits(*batch);
  }
  if (batch->chunks_.empty()) return batch;
  frame.film = std::make_unique<Buffer<FilmPixel>>(gpu_, batch->chunks_[0].count, Access::Storage, "film");
  auto& shade = kernels_["shade"];
  if (!shade) {
    shade = std::make_unique<Kernel>(gpu_, shading_source("eyelight", scene_.features()));
    scene_.bind(*shade);
    gpu_.save_pipeline_cache();
  }
  frame.shade = shade.get();
  return batch;
}

}  // namespace ballot
