// The passes of waves. What a pass starts lies in queues; calls.comp makes of their counts the calls of the passes that follow.
#include <algorithm>

#include "engine/core/error.h"
#include "engine/render/ray_kinds.h"
#include "engine/render/wave_batch.h"

namespace ballot {

namespace {

constexpr double kLongMs = 200, kShortMs = 50;  // of a submission: no watchdog fires, and looks at the counts are rare
constexpr std::uint32_t kMostDepthsTogether = 8;

std::uint32_t groups_of(std::uint32_t count, std::uint32_t size) { return count / size + (count % size != 0); }

}  // namespace

std::uint32_t Waves::reported(const Count& count) const {
  if (count.known) return count.rays;
  return reinterpret_cast<const std::uint32_t*>(reports_->mapped())[count.record * QUEUES + count.queue];
}

/// Waits until the host knows a count.
void Waves::look(Count& count) {
  if (count.known) return;
  gpu_.finish();
  count.rays = reported(count);
  count.known = true;
}

/// A count that the host knows, for kernels that look it up; and empty queues.
Waves::Count Waves::known_count(std::uint32_t rays, const Query& query) {
  const Count count{next_record(), QUEUE_NEXT, rays, true};
  const RayGroups trace = tracer_.groups_of(query);
  Call calls[CALLS] = {};
  calls[QUEUE_NEXT] = {std::min(groups_of(rays, trace.rays), trace.most), 1, 1, rays};
  calls[QUEUE_NEXT + QUEUES] = {groups_of(rays, kWaveGroup), 1, 1, rays};
  gpu_.pass("counts of rays", [&](VkCommandBuffer cmd) {
    vkCmdFillBuffer(cmd, queues_->handle(), 0, VK_WHOLE_SIZE, 0);
    vkCmdUpdateBuffer(cmd, calls_->handle(), count.record * sizeof calls, sizeof calls, calls);
  });
  return count;
}

Context::Done Waves::told(std::string_view name, const Count& count, PassTimes& times) const {
  return [this, name = std::string(name), count, &times](double ms) { times.add(name, ms, reported(count)); };
}

/// A kernel of a ray an invocation; and `then`, what its queues hold to calls.
void Waves::run(Kernel& kernel, const Count& count, const void* push, std::uint32_t push_bytes, std::string_view name,
                PassTimes& times, const CallPush* then) {
  Kernel* calls = then ? &this->kernel(calls_source()) : nullptr;
  if (calls) {
    calls->bind(BIND_QUEUES, *queues_);
    calls->bind(BIND_WAVE_CALLS, *calls_);
    calls->bind(BIND_REPORTS, *reports_);
  }
  gpu_.pass(
      kernel.name(),
      [&](VkCommandBuffer cmd) {
        if (count.known)
          kernel.dispatch(cmd, groups_of(count.rays, kWaveGroup), push, push_bytes);
        else
          kernel.dispatch(cmd, *calls_, count.wave_call() * sizeof(Call), push, push_bytes);
        if (!calls) return;
        memory_barrier(cmd);
        calls->dispatch(cmd, 1, *then);
      },
      told(name, count, times));
}

/// False: there are no rays, as the host knows. Where the trace cannot be recorded, the host finds out.
bool Waves::trace(const Buffer<Ray>& rays, Buffer<Hit>& hits, Count& count, const Query& query, std::string_view name,
                  PassTimes& times) {
  const std::string sort = fmt::format("{} {}", query.rays, int(query.want));
  const auto seen = seen_.find(sort);
  if (tracer_.can_record(query, seen == seen_.end() ? count.rays : seen->second)) {
    tracer_.record(rays, hits, RayCall{*calls_, count.trace_call()}, query, told(name, count, times));
    return true;
  }
  look(count);
  seen_[sort] = count.rays;
  if (count.rays == 0) return false;
  times.add(name, tracer_.trace(rays, hits, count.rays, query).device_ms, count.rays);
  return true;
}

void Waves::pass_through(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                         const SceneFeatures& features, PassTimes& times) {
  if (!features.alpha || count == 0) return;
  const PassScope scope(gpu_);
  make_alpha(count);
  pass_through(rays, hits, known_count(count, query), query, features, times);
  gpu_.finish();
}

void Waves::pass_through(const Buffer<Ray>& rays, Buffer<Hit>& hits, const Count& count, const Query& query,
                         const SceneFeatures& features, PassTimes& times) {
  if (!features.alpha) return;
  Kernel& test = kernel(alpha_source(features));
  test.bind(BIND_WAVE_HITS, hits);
  test.bind(BIND_QUEUES, *queues_);
  test.bind(BIND_WAVE_CALLS, *calls_);
  const RayGroups groups = tracer_.groups_of(query);
  Count left = count;
  for (std::uint32_t turn = 0; !left.known || left.rays > 0; ++turn) {
    Alpha::Side &from = alpha_->sides[turn % 2], &to = alpha_->sides[(turn + 1) % 2];
    test.bind(BIND_RAYS, turn == 0 ? rays : from.rays);
    test.bind(BIND_HITS, turn == 0 ? hits : from.hits);
    test.bind(BIND_NUMBERS, from.ids);
    test.bind(BIND_NEXT_RAYS, to.rays);
    test.bind(BIND_NEXT_IDS, to.ids);
    const AlphaPush push{left.wave_call(), turn == 0};
    CallPush then{next_record(), {1, 1, 1}, {1, 1, 1}};
    then.trace_rays[QUEUE_PASSED] = groups.rays;
    then.trace_groups[QUEUE_PASSED] = groups.most;
    run(test, left, &push, sizeof push, "alpha", times, &then);
    left = {then.record, QUEUE_PASSED, left.rays, false};
    look(left);
    if (left.rays > 0) trace(to.rays, to.hits, left, query, "trace behind", times);
  }
}

Waves::Batch Waves::batch_of(const WaveSettings& settings, Buffer<FilmPixel>& film, PassTimes& times) {
  const Integrator& integrator = *settings.integrator;
  Batch b{settings, plan_of(integrator, settings.features), film, times};
  b.scatter = &kernel(scatter_source(integrator, settings.features, settings.sky));
  b.connect = b.plan.shadow ? &kernel(connect_source()) : nullptr;
  b.primary = b.next = b.shadow = settings.query;
  b.primary.want = b.next.want = Want::Nearest;
  b.primary.rays = kPrimaryRays;
  b.next.rays = integrator.next_kind;
  // Where the scene has alpha, the nearest hit is asked for, so that rays to lights see what all others see.
  b.shadow.want = settings.features.alpha ? Want::Nearest : Want::Any;
  b.shadow.rays = integrator.value == INTEGRATOR_AO ? "ao" : "shadow";
  b.push = {0,
            0,
            settings.last_depth,
            settings.ao_radius,
            0,
            0,
            std::uint32_t(scene_.scene().lights.size()),
            room_,
            scene_.scene().sky.kind != Sky::Kind::None};
  if (b.scatter->wants(BIND_EMITTERS)) {
    b.push.emitted = scene_.emitters().total;
    b.push.emitters = std::uint32_t(scene_.emitters().texels.size());
  }
  return b;
}

void Waves::scatter(Batch& b, Wave& wave, Wave& next, Count& count, Count& shadow) {
  Kernel& k = *b.scatter;
  k.bind(BIND_RAYS, wave.rays);
  k.bind(BIND_HITS, wave.hits);
  k.bind(BIND_CARRIED, wave.carried);
  k.bind(BIND_PATHS, *paths_);
  k.bind(BIND_FILM, b.film);
  k.bind(BIND_QUEUES, *queues_);
  k.bind(BIND_WAVE_CALLS, *calls_);
  if (k.wants(BIND_SHADOW_RAYS)) {
    k.bind(BIND_SHADOW_RAYS, *shadow_rays_);
    k.bind(BIND_SHADOW_LIGHT, *shadow_light_);
  }
  if (k.wants(BIND_NEXT_RAYS)) {
    k.bind(BIND_NEXT_RAYS, next.rays);
    k.bind(BIND_NEXT_CARRIED, next.carried);
  }
  if (k.wants(BIND_PUT_OFF)) {
    k.bind(BIND_PUT_OFF_RAYS, *put_off_rays_);
    k.bind(BIND_PUT_OFF_CARRIED, *put_off_carried_);
    k.bind(BIND_PUT_OFF, *put_off_);
  }
  const RayGroups on = tracer_.groups_of(b.next), lit = tracer_.groups_of(b.shadow);
  const CallPush then{next_record(), {on.rays, lit.rays, 1}, {on.most, lit.most, 1}};
  b.push.call = count.wave_call();
  run(k, count, &b.push, sizeof b.push, "scatter", b.times, &then);
  shadow = {then.record, QUEUE_SHADOW, count.rays, false};
  count = {then.record, QUEUE_NEXT, count.rays, false};
}

void Waves::connect(Batch& b, Count& count) {
  if (!trace(*shadow_rays_, *shadow_hits_, count, b.shadow, "trace " + b.shadow.rays, b.times)) return;
  pass_through(*shadow_rays_, *shadow_hits_, count, b.shadow, b.settings.features, b.times);
  Kernel& k = *b.connect;
  k.bind(BIND_HITS, *shadow_hits_);
  k.bind(BIND_SHADOW_LIGHT, *shadow_light_);
  k.bind(BIND_PATHS, *paths_);
  k.bind(BIND_WAVE_CALLS, *calls_);
  const std::uint32_t call = count.wave_call();
  run(k, count, &call, sizeof call, "connect", b.times);
}

// Some depths are submitted together, and while the device works on them the host looks whether those before them left rays. If
// not, these were empty calls, and the batch has ended.
bool Waves::has_ended(Batch& b, const Count& count) {
  if (count.known) return count.rays == 0;
  if (++b.together < depths_together_) return false;
  b.together = 0;
  const std::uint64_t submission = gpu_.flush();
  const bool looks = b.submission != 0;
  if (looks) {
    gpu_.wait(b.submission);
    const bool ended = reported(b.left) == 0;
    if (gpu_.ended_ms() > kLongMs) depths_together_ = std::max(1u, depths_together_ / 2);
    if (gpu_.ended_ms() < kShortMs) depths_together_ = std::min(kMostDepthsTogether, depths_together_ * 2);
    if (ended) return true;
  }
  b.submission = submission;
  b.left = count;
  return false;
}

// A path is at one ray at a time, so that its sums have one order. One whose rays part goes depth first: after the mirrored ray
// comes all that follows from it, then the refracted one.
void Waves::run_waves(Batch& b, Count count) {
  Wave *wave = waves_[0].get(), *next = waves_[1].get();
  b.push.depth = 0;
  b.submission = 0;
  for (const Query* query = &b.primary;; query = &b.next, ++b.push.depth) {
    if (!trace(wave->rays, wave->hits, count, *query, "trace " + query->rays, b.times)) return;
    pass_through(wave->rays, wave->hits, count, *query, b.settings.features, b.times);
    Count shadow;
    scatter(b, *wave, b.plan.next ? *next : *wave, count, shadow);
    if (b.plan.shadow) connect(b, shadow);
    const bool goes_on = b.plan.second ? b.settings.last_depth > 0 : b.push.depth < b.settings.last_depth;
    if (!b.plan.next || !goes_on) return;
    if (has_ended(b, count)) return;
    std::swap(wave, next);
  }
}

}  // namespace ballot
