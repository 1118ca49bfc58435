#include "engine/answer/tracer.h"

#include <algorithm>

#include "engine/answer/host_walk.h"
#include "engine/answer/repair.h"
#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"

namespace ballot {

namespace {

// Batches that the host traces, and that one thread traces alone. Random rays at an icosphere of 20 480 triangles, two
// cores, lavapipe 22.3.6 with two threads, from Python, us: 64 rays 45 by the host and 238 by bvh4-turns, 256 rays 146
// and 298, 1024 rays 298 and 413, 2048 rays 487 and 406.
constexpr std::uint64_t kFewRays = 1 << 10;
constexpr std::size_t kRaysAlone = 1 << 6;

/// Returns true if the host traces so many rays by such a query sooner than the device.
bool is_few(std::uint64_t rays, const Query& query) {
  return rays <= kFewRays && find_method(query.method).chooses && query.knobs.empty() &&
         query.numeric == kDefaultNumeric;
}

/// Returns a variant with or without counters. A kernel that counts decides rays in doubt at once, so it counts all.
Variant counted(Variant v, bool counters) {
  v.counters = counters;
  if (counters) v.config.doubtful = Doubtful::Decided;
  return v;
}

constexpr std::size_t kCpuChunk = 1u << 18;  // rays of a stream on a device that is the CPU: they stay in its cache

/// Traces the rays of a stream. Rays of a query whose method is auto are classified chunk by chunk, unless query.rays
/// names their class.
class RayAnswerer : public Answerer<Ray, Hit> {
 public:
  RayAnswerer(Tracer& tracer, const Query& query, std::uint64_t batch, std::size_t most)
      : tracer_(tracer), query_(query), batch_(std::size_t(batch)), most_(most) {}
  std::size_t most() const override { return most_; }
  bool in_place() const override { return true; }
  void answer(const Chunk<Ray, Hit>& c, TraceTimes& times) override {
    Query query = query_;
    if (!tracer_.traces_here(query)) tracer_.classify(query, c.here, batch_);
    if (tracer_.prefill) {
      const std::vector<std::uint8_t> pattern(c.here.size() * sizeof(Hit), *tracer_.prefill);
      c.answers.RawBuffer::upload(0, pattern.data(), pattern.size());
    }
    if (!tracer_.traces_here(query)) query = tracer_.resolve(std::move(query), c.questions, c.count(), batch_);
    if (tracer_.can_record(query, c.count())) {
      ++times.dispatches;
      tracer_.record(c.questions, c.answers, c.count(), query, [&times](double ms) { times.device_ms += ms; });
      return;
    }
    times += tracer_.trace(c.questions, c.answers, c.count(), query);
  }

 private:
  Tracer& tracer_;
  const Query& query_;
  std::size_t batch_, most_;
};

/// The same of rays in double.
class DoubleRayAnswerer : public Answerer<RayInDouble, Hit> {
 public:
  DoubleRayAnswerer(Tracer& tracer, const Query& query, std::uint64_t batch, std::size_t most)
      : tracer_(tracer), query_(query), batch_(std::size_t(batch)), most_(most) {}
  std::size_t most() const override { return most_; }
  void answer(const Chunk<RayInDouble, Hit>& c, TraceTimes& times) override {
    Query query = query_;
    const auto read = [&](std::size_t first, std::span<Ray> to) {
      std::ranges::transform(c.here.part(first, to.size()), to.begin(), rounded);
    };
    tracer_.classify(query, Questions<Ray>(c.here.size(), read), batch_);
    times += tracer_.trace(c.questions, c.answers, c.count(), query);
  }

 private:
  Tracer& tracer_;
  const Query& query_;
  std::size_t batch_, most_;
};

}  // namespace

Tracer::Tracer(Context& gpu, const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
               std::shared_ptr<DeviceBuild> built)
    : gpu_(gpu),
      tree_(gpu, bvh, triangles, facts, std::move(built)),
      kernels_(gpu, tree_),
      dispatcher_(gpu, tree_, kernels_),
      chooser_(gpu, gpu.info(), bvh, triangles,
               [this](const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query) {
                 return trace(rays, hits, count, query).device_ms;
               }) {}

Tracer::Tracer(Context& gpu, Forest& forest)
    : gpu_(gpu),
      tree_(gpu, forest),
      kernels_(gpu, tree_),
      dispatcher_(gpu, tree_, kernels_),
      chooser_(gpu, gpu.info(), forest.summary(), std::nullopt,
               [this](const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query) {
                 return trace(rays, hits, count, query).device_ms;
               }) {}

Tracer::~Tracer() = default;

void Tracer::replace(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
                     std::shared_ptr<DeviceBuild> built) {
  tree_.replace(bvh, triangles, facts, std::move(built));
  chooser_.replace(bvh, triangles);
}

void Tracer::take(Forest& forest, std::span<const std::optional<std::uint32_t>> from) {
  tree_.take(forest, from);
  chooser_.replace(forest.summary(), std::nullopt);
}

void Tracer::moved(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts) {
  tree_.moved(bvh, triangles, facts);
  chooser_.moved(bvh);
}

void Tracer::rebuilt(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
                     std::shared_ptr<DeviceBuild> built) {
  tree_.replace(bvh, triangles, facts, std::move(built));
  chooser_.moved(bvh);
}

KernelConfig Tracer::config_of(const Query& query) const {
  if (tree_.forest() && !find_method(query.method).instances) {
    std::string others;
    for (const Method& m : kMethods)
      if (m.instances) others += fmt::format("{}{}", others.empty() ? "" : ", ", m.name);
    fail(Failure::Arguments, "method {}: it has no kernel for scenes with instances; expected one of: {}", query.method,
         others);
  }
  KernelConfig config =
      kernel_config_for(find_method(query.method), find_numeric(query.numeric, gpu_.info()), gpu_.info(), query.knobs);
  if (!query.knobs.contains("fetch")) config.fetch = tree_.fitting_fetch(config.fetch);
  if (config.reorder) check_can_reorder(gpu_.info());
  if (config.padding == Padding::Ray || tree_.padded_reach() > 0) return config;
  const Bounds& b = tree_.bvh().bounds;
  if (query.knobs.contains("padding") && !tree_.bvh().is_empty())
    fail(Failure::Arguments,
         "knob padding=tree: found scene bounds ({}, {}, {}) to ({}, {}, {}); expected a longest side of 2^-60 to 2^44 "
         "and coordinates within +-2^60; leave the knob out",
         b.lo.x, b.lo.y, b.lo.z, b.hi.x, b.hi.y, b.hi.z);
  config.padding = Padding::Ray;
  return config;
}

Tracer::Resolved& Tracer::resolved(const Query& asked) const {
  constexpr std::size_t kKept = 32;
  const std::uint64_t now = tree_.generation();
  if (resolved_by_ != now || resolved_.size() == kKept) resolved_.clear();
  resolved_by_ = now;
  const Query query = resolve(asked);
  if (const auto found = std::ranges::find(resolved_, query, &Resolved::asked); found != resolved_.end()) return *found;
  const Method& method = find_method(query.method);
  const NumericMode& numeric = find_numeric(query.numeric, gpu_.info());
  return resolved_.emplace_back(Resolved{query, {&method, &numeric, query.want, config_of(query)}});
}

Variant Tracer::variant(const Query& asked, bool counters) const { return counted(resolved(asked).variant, counters); }

Job Tracer::job(const Query& query, bool counters, bool indirect, CameraKind camera) {
  Resolved& found = resolved(query);
  Variant v = counted(found.variant, counters);
  v.indirect = indirect;
  v.camera = camera;
  TraceKernel*& known = found.kernels[camera != CameraKind::None ? 2 + int(camera) : indirect ? 2 : int(counters)];
  if (!known || !kernels_.is_current(*known)) known = &kernels_.get(v);
  return {v, known};
}

Job Tracer::job_in_double(const Query& query) {
  Resolved& found = resolved(query);
  Variant v = found.variant;
  if (v.numeric->triangle != TRIANGLE_DOUBLE)
    fail(Failure::Arguments, "rays in double: found numeric mode {}; expected double", v.numeric->name);
  if (v.config.reorder) fail(Failure::Arguments, "knob reorder=1: rays in double are traced in their order");
  v.rays_in_double = true;
  TraceKernel*& known = found.kernels.back();
  if (!known || !kernels_.is_current(*known)) known = &kernels_.get(v);
  return {v, known};
}

void Tracer::prepare(const Query& query, bool counters, CameraKind camera) {
  try {
    Variant v = variant(query, counters);
    v.camera = camera;
    prepare_pipeline(gpu_, kernel_source(v, gpu_.info(), tree_.facts()));
    // A recorded pass has the kernel that takes rays in doubt, too.
    if (camera != CameraKind::None && v.config.lists())
      prepare_pipeline(gpu_, kernel_source(v.taking(), gpu_.info(), tree_.facts()));
    tree_.prepare(v.method->tree, v.config.tree_access(), tree_.source_of(v.method->tree, v.numeric->leaves));
  } catch (const Error&) {
  }
}

std::uint32_t Tracer::chunk_rays() const {
  // Bounded, so that no watchdog fires and progress is shown. A CPU device takes about a second for this many rays.
  const std::uint64_t bounded = gpu_.info().is_cpu() ? 1u << 20 : 1u << 22;
  // The largest record that may belong to a ray, and the smallest workgroup of a pass over the rays.
  constexpr std::uint64_t kLargestRecord = sizeof(RayStats), kSmallestGroup = 64;
  return std::uint32_t(std::min(
      {bounded, gpu_.info().max_storage_range / kLargestRecord, gpu_.info().max_group_count_x * kSmallestGroup}));
}

void Tracer::trace(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, RayRange range, const Query& query,
                   TraceTimes& times) {
  const Work work = dispatcher_.run(job, rays, hits, range, times);
  if (work.unfinished)
    Repair(gpu_, tree_, dispatcher_, this->job(repair_query(query))).run(rays, hits, range.end, times);
}

void Tracer::trace_reordered(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, RayRange range,
                             const Query& query, TraceTimes& times, Buffer<RayStats>* stats) {
  if (!reorder_) reorder_.emplace(gpu_, sorts_on_host());
  const PassScope scope(gpu_);
  const Context::Done spent = [&times](double ms) { times.device_ms += ms; };
  for (RayRange part{range.begin, range.begin}; part.begin < range.end; part.begin = part.end) {
    part.end = part.begin + std::min(range.end - part.begin, Reorder::kMost);
    reorder_->sort({rays, part}, tree_.bvh().bounds, spent);
    if (stats) job.kernel->kernel->bind(BIND_STATS, reorder_->stats());
    trace(job, reorder_->rays(), reorder_->hits(), {0, part.end - part.begin}, query, times);
    reorder_->put_back(hits, spent, stats);
    gpu_.finish();
  }
}

void Tracer::trace(const Buffer<Ray>& rays, Buffer<Hit>& hits, RayRange range, const Query& query, TraceTimes& times) {
  if (range.begin == range.end) return;
  const Job found = job(query);
  if (found.variant.config.reorder)
    trace_reordered(found, rays, hits, range, query, times);
  else
    trace(found, rays, hits, range, query, times);
}

/// Traces by the exact oracle: also any hits, for the nearest is one. The device reads rays and hits in its turn.
TraceTimes Tracer::trace_here(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count) {
  const OracleScene& scene = tree_.oracle_scene();
  if (!exact_ || exact_of_ != tree_.generation()) exact_.emplace(scene);
  exact_of_ = tree_.generation();
  std::vector<Ray> all(count);
  rays.download(all);
  const Stopwatch watch(tree_.walked_s());
  const Timer timer;
  std::vector<Hit> found(count, kMiss);
  constexpr std::size_t kAtOnce = 1 << 16;  // rays between looks whether somebody wants to stop
  for (std::size_t first = 0; first < all.size(); first += kAtOnce) {
    check_interruption();
    const auto some = std::span<const Ray>(all).subspan(first, std::min(kAtOnce, all.size() - first));
    std::ranges::transform(exact_->nearest(some), found.begin() + std::ptrdiff_t(first), [](const ExactHit& hit) {
      return hit.prim == NO_HIT ? kMiss : Hit{float(hit.t), hit.prim, float(hit.u), float(hit.v)};
    });
  }
  hits.upload(found);
  return {.device_ms = 1e3 * timer.seconds()};
}

TraceTimes Tracer::trace(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query) {
  if (traces_here(query)) return count ? trace_here(rays, hits, count) : TraceTimes{};
  TraceTimes times;
  trace(rays, hits, {0, count}, resolve(query, rays, count), times);
  return times;
}

TraceTimes Tracer::trace_counted(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                                 Buffer<RayStats>& stats) {
  if (stats.size() < count)
    fail(Failure::Arguments, "trace_counted: {} rays, but room for {} records", count, stats.size());
  if (count == 0) return {};
  const Query concrete = resolve(query, rays, count);
  const Job counted = job(concrete, true);
  TraceTimes times;
  if (counted.variant.config.reorder) {
    trace_reordered(counted, rays, hits, {0, count}, concrete, times, &stats);
    return times;
  }
  counted.kernel->kernel->bind(BIND_STATS, stats);
  trace(counted, rays, hits, {0, count}, concrete, times);
  return times;
}

TraceTimes Tracer::trace(std::span<const Ray> rays, std::span<Hit> hits, const Query& asked, const Progress& progress) {
  if (rays.size() != hits.size())
    fail(Failure::Arguments, "trace: {} rays, but room for {} hits", rays.size(), hits.size());
  variant(asked);  // an unknown method is an error even without rays
  Query query = asked;
  classify(query, rays);
  RayStream stream = stream_of(rays, hits);
  if (progress) stream.progress = [&](std::uint64_t done) { progress(double(done) / double(rays.size())); };
  return trace(stream, query);
}

TraceTimes Tracer::trace(const RayStream& stream, const Query& query) {
  if (is_few(stream.most, query))
    if (const auto walk = HostWalk::over(gpu_, tree_, HostWalk::Of::Rays))
      return answer_here(stream, kRaysAlone, tree_.walked_s(),
                         [&, want = query.want](const Ray& ray) { return walk->trace(ray, want); });
  ask_interruption();
  const std::size_t most = gpu_.info().is_cpu() ? kCpuChunk : kChunk;
  RayAnswerer answerer(*this, query, stream.most, std::min<std::size_t>(most, chunk_rays()));
  return StreamRing::of(gpu_).run(stream, answerer);
}

TraceTimes Tracer::trace(const Stream<RayInDouble, Hit>& stream, const Query& query) {
  ask_interruption();
  job_in_double(query);  // what it refuses is an error even without rays
  const std::size_t most = gpu_.info().is_cpu() ? kCpuChunk : kChunk / 2;
  DoubleRayAnswerer answerer(*this, query, stream.most, std::min<std::size_t>(most, chunk_rays()));
  return StreamRing::of(gpu_).run(stream, answerer);
}

TraceTimes Tracer::trace(const Buffer<RayInDouble>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query) {
  TraceTimes times;
  if (count == 0) return times;
  const Query concrete = resolve(query, count);
  if (dispatcher_.run(job_in_double(concrete), rays, hits, {0, count}, times).unfinished)
    Repair(gpu_, tree_, dispatcher_, job_in_double(repair_query(concrete))).run(rays, hits, count, times);
  return times;
}

bool Tracer::can_record(const Query& query, std::uint32_t most) const {
  if (!gpu_.batches() || traces_here(query) || !chooser_.is_resolved(query, most)) return false;
  const Variant& v = resolved(resolve(query, most)).variant;
  return dispatcher_.can_record(v, most) && (!v.config.reorder || (!sorts_on_host() && most <= Reorder::kMost));
}

/// Records a trace of rays in another order. `trace` records that of the sorted rays. `done` is given the time of all
/// passes together.
template <class Trace>
void Tracer::record_reordered(const GivenRays& given, Buffer<Hit>& hits, Context::Done done, const Trace& trace) {
  if (!reorder_) reorder_.emplace(gpu_, sorts_on_host());
  const auto all = std::make_shared<double>(0);
  const Context::Done spent = [all](double ms) { *all += ms; };
  reorder_->sort(given, tree_.bvh().bounds, spent);
  trace(reorder_->rays(), reorder_->hits(), spent);
  reorder_->put_back(hits, [all, done = std::move(done)](double ms) {
    if (done) done(*all + ms);
  });
}

void Tracer::record(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                    Context::Done done) {
  if (count == 0 || !can_record(query, count)) {
    done(trace(rays, hits, count, query).device_ms);
    return;
  }
  const Job found = job(resolve(query, count));
  if (!found.variant.config.reorder) return dispatcher_.record(found, rays, hits, count, std::move(done));
  record_reordered({rays, {0, count}}, hits, std::move(done),
                   [&](const Buffer<Ray>& sorted, Buffer<Hit>& found_hits, const Context::Done& spent) {
                     dispatcher_.record(found, sorted, found_hits, count, spent);
                   });
}

void Tracer::record(const CameraRays& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                    Context::Done done) {
  dispatcher_.record(job(resolve(query, count), false, false, rays.kind), rays, hits, count, std::move(done));
}

void Tracer::record(const Buffer<Ray>& rays, Buffer<Hit>& hits, const IndirectRays& indirect, const Query& query,
                    Context::Done done) {
  const Job found = job(query, false, true);
  if (!found.variant.config.reorder) return dispatcher_.record(found, rays, hits, indirect, std::move(done));
  record_reordered({rays, {0, std::uint32_t(rays.size())}, &indirect}, hits, std::move(done),
                   [&](const Buffer<Ray>& sorted, Buffer<Hit>& found_hits, const Context::Done& spent) {
                     dispatcher_.record(found, sorted, found_hits, indirect, spent);
                   });
}

}  // namespace ballot
