#include "engine/render/batch/batch.h"

#include <algorithm>
#include <cstring>

#include "engine/core/error.h"
#include "engine/render/batch/batch_frame.h"

namespace ballot {

RayBatch::RayBatch(std::string name, std::string view, std::string ray_class, Want want)
    : name_(std::move(name)), view_(std::move(view)), ray_class_(std::move(ray_class)), want_(want) {}

RayBatch::~RayBatch() = default;

void RayBatch::add_chunks(Context& gpu, std::size_t count, std::uint32_t most) {
  count_ = count;
  for (std::size_t first = 0; first < count; first += most) {
    const std::uint32_t part = std::uint32_t(std::min<std::size_t>(most, count - first));
    chunks_.push_back(
        {{gpu, part, Access::Storage, name_ + " rays"}, {gpu, part, Access::Storage, name_ + " hits"}, part});
  }
}

template <class T>
std::vector<T> RayBatch::download(Buffer<T> Chunk::*records) const {
  std::vector<T> all(count_);
  std::size_t first = 0;
  for (const Chunk& c : chunks_) {
    (c.*records).download(std::span(all).subspan(first, c.count));
    first += c.count;
  }
  return all;
}

std::vector<Ray> RayBatch::rays() const { return download(&Chunk::rays); }
std::vector<Hit> RayBatch::hits() const { return download(&Chunk::hits); }

std::vector<RayStart> RayBatch::starts() const {
  if (!frame_ || frame_->from_camera) return {};
  std::vector<std::vector<RayStart>> sources;  // for each chunk of primary rays, in the order of its list of starts
  for (std::size_t i = 0; i < frame_->primaries.size(); ++i) {
    const Chunk& c = frame_->primaries[i];
    std::vector<Ray> rays(c.count);
    std::vector<Hit> hits(c.count);
    std::vector<Start> list(frame_->start_count[i]);
    c.rays.download(rays);
    c.hits.download(hits);
    frame_->starts[i].download(list);
    sources.emplace_back();
    for (const Start& s : list) sources.back().push_back({rays[s.ray], hits[s.ray]});
  }
  std::vector<RayStart> all;
  for (const GeneratorRun& run : frame_->runs)  // in the order of the rays
    for (std::uint32_t i = 0; i < run.push.count; ++i)
      all.push_back(sources[run.source][(run.push.first + i) / run.push.rays_per_hit]);
  return all;
}

std::vector<std::uint32_t> RayBatch::start_prims() const {
  std::vector<std::uint32_t> prims;
  for (const RayStart& s : starts()) prims.push_back(s.hit.prim);
  return prims;
}

void RayBatch::fill_hits(std::uint8_t byte) {
  if (chunks_.empty()) return;
  std::vector<Hit> pattern(chunks_[0].count);
  std::memset(static_cast<void*>(pattern.data()), byte, pattern.size() * sizeof(Hit));
  for (Chunk& c : chunks_) c.hits.upload(std::span<const Hit>(pattern).first(c.count));
}

Batches::Batches(Context& gpu, Tracer& tracer, SceneData& scene) : gpu_(gpu), tracer_(tracer), scene_(scene) {}

Batches::~Batches() = default;

// A batch is one dispatch if possible, because every split leaves the device idle at its end. A dispatch must stay
// within the limits of a binding, of an allocation (never above 2 GiB) and of a dispatch, and below a second at 20
// Mrays/s, so that no watchdog fires.
std::uint32_t Batches::chunk_rays() const {
  const DeviceInfo& d = gpu_.info();
  constexpr std::uint64_t kLargestRecord = std::max({sizeof(Ray), sizeof(FilmPixel), sizeof(RayStats)});
  const std::uint64_t bytes = std::min({d.max_storage_range, d.max_allocation, std::uint64_t(1) << 31});
  const std::uint64_t rays = std::min({bytes / kLargestRecord, std::uint64_t(d.max_group_count_x) * kPassGroup,
                                       std::uint64_t(1) << (d.is_cpu() ? 20 : 24)});
  return std::uint32_t(rays / kPassGroup * kPassGroup);
}

std::unique_ptr<RayBatch> Batches::make(std::string name, std::span<const Ray> rays, Want want) {
  std::unique_ptr<RayBatch> batch(new RayBatch(std::move(name), "", ray_class(rays), want));
  batch->add_chunks(gpu_, rays.size(), chunk_rays());
  std::size_t first = 0;
  for (Chunk& c : batch->chunks_) {
    c.rays.upload(rays.subspan(first, c.count));
    first += c.count;
  }
  return batch;
}

Query Batches::resolve(const RayBatch& batch, Query query) {
  query.want = batch.want_;
  query.rays = batch.ray_class_;
  if (batch.chunks_.empty()) return tracer_.resolve(query);
  return tracer_.resolve(query, batch.chunks_[0].rays, batch.chunks_[0].count, batch.count());
}

// Chunks use one method: the one that auto takes for the first chunk.
TraceTimes Batches::trace(RayBatch& batch, Query query) {
  query = resolve(batch, std::move(query));
  tracer_.variant(query);  // throws on an unknown method even if there are no rays
  TraceTimes times;
  for (Chunk& c : batch.chunks_) {
    const TraceTimes part = tracer_.trace(c.rays, c.hits, c.count, query);
    times.device_ms += part.device_ms;
    times.dispatches += part.dispatches;
    times.retraced += part.retraced;
  }
  return times;
}

Counters Batches::count(RayBatch& batch, Query query) {
  query = resolve(batch, std::move(query));
  Counters counters;
  counters.subgroup = tracer_.variant(query).config.subgroup;
  for (Chunk& c : batch.chunks_) {
    Buffer<RayStats> stats(gpu_, c.count, Access::Storage, "counters");
    tracer_.trace_counted(c.rays, c.hits, c.count, query, stats);
    std::vector<RayStats> records(c.count);
    stats.download(std::span(records));
    counters.add(records);
  }
  return counters;
}

FrameTimes Batches::frame(RayBatch& batch, Query query) {
  if (!batch.frame_)
    fail(Failure::Arguments, "rays '{}' have no frame: no camera made them; trace them instead", batch.name_);
  Frame& frame = *batch.frame_;
  FrameTimes times;
  times.generate_ms = generate_primaries(batch);
  if (!frame.from_camera) {
    Query primary = query;
    primary.want = Want::Nearest;
    primary.rays = kPrimaryRays;
    for (const Chunk& c : frame.primaries) {
      times.trace_ms += tracer_.trace(c.rays, *frame.scratch, c.count, primary).device_ms;
    }
    times.generate_ms += generate_from_hits(batch);
  }
  times.trace_ms += trace(batch, query).device_ms;
  times.shade_ms = shade(batch);
  return times;
}

}  // namespace ballot
