// The passes of waves. A pass appends the rays that it starts to queues. indirect.comp turns the counts of the queues
// into the indirect arguments of the following passes.
#include <algorithm>

#include "engine/core/error.h"
#include "engine/render/data/camera.h"
#include "engine/render/data/run_pass.h"
#include "engine/render/path/wave_batch.h"

namespace ballot {

namespace {

// A submission should take between these times: short enough that no watchdog fires, long enough that the host rarely
// waits for counts.
constexpr double kLongMs = 200, kShortMs = 50;
constexpr std::uint32_t kMostDepthsTogether = 8;

}  // namespace

std::uint32_t Waves::reported(const Count& count) const {
  if (count.known) return count.rays;
  return reinterpret_cast<const std::uint32_t*>(reports_->mapped())[count.record * QUEUES + count.queue];
}

/// Waits for the device, so that the host knows the count.
void Waves::look(Count& count) {
  if (count.known) return;
  gpu_.finish();
  count.rays = reported(count);
  count.known = true;
}

/// Writes indirect arguments for a count that the host knows, and empties the queues.
Waves::Count Waves::known_count(std::uint32_t rays, const Query& query) {
  const Count count{next_record(), QUEUE_NEXT, rays, true};
  const RayGroups trace = tracer_.groups_of(query);
  IndirectArgs indirect[INDIRECT_RECORDS] = {};
  indirect[QUEUE_NEXT] = {std::min(groups_of(rays, trace.rays), trace.most), 1, 1, rays};
  indirect[QUEUE_NEXT + QUEUES] = {groups_of(rays, kPassGroup), 1, 1, rays};
  gpu_.pass("counts of rays", [&](Commands& cmd) {
    cmd.fill(*queues_, 0);
    cmd.write(*indirect_, count.record * sizeof indirect, indirect, sizeof indirect);
  });
  return count;
}

/// Returns the callback that adds a pass over `count` rays to `times` when the pass has ended.
Context::Done Waves::told(std::string_view name, const Count& count, PassTimes& times) const {
  return [this, name = std::string(name), count, &times](double ms) { times.add(name, ms, reported(count)); };
}

/// Runs a kernel with one ray per invocation. With `then`, turns the queues that it filled into indirect arguments.
void Waves::run(Kernel& kernel, const Count& count, const void* push, std::uint32_t push_bytes, std::string_view name,
                PassTimes& times, const CallPush* then) {
  Kernel* indirect = then ? &indirect_kernel() : nullptr;
  if (indirect) {
    indirect->bind(BIND_QUEUES, *queues_);
    indirect->bind(BIND_WAVE_INDIRECT, *indirect_);
    indirect->bind(BIND_REPORTS, *reports_);
  }
  gpu_.pass(
      kernel.name(),
      [&](Commands& cmd) {
        if (count.known)
          kernel.dispatch(cmd, groups_of(count.rays, kPassGroup), push, push_bytes);
        else
          kernel.dispatch(cmd, *indirect_, count.wave_args() * sizeof(IndirectArgs), push, push_bytes);
        if (!indirect) return;
        cmd.barrier();
        indirect->dispatch(cmd, 1, *then);
      },
      told(name, count, times));
}

/// Traces the rays of a count. If the trace can be recorded, the host need not know the count; else it waits for it.
/// Returns false if the host knows that there are no rays.
bool Waves::trace(const Buffer<Ray>& rays, Buffer<Hit>& hits, Count& count, Asked& asked, std::string_view name,
                  PassTimes& times) {
  if (tracer_.can_record(asked.query, asked.seen.value_or(count.rays))) {
    tracer_.record(rays, hits, IndirectRays{*indirect_, count.trace_args()}, asked.query, told(name, count, times));
    return true;
  }
  look(count);
  asked.seen = count.rays;
  if (count.rays == 0) return false;
  times.add(name, tracer_.trace(rays, hits, count.rays, asked.query).device_ms, count.rays);
  return true;
}

void Waves::pass_through(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                         const SceneFeatures& features, PassTimes& times) {
  if (!features.alpha || count == 0) return;
  const PassScope scope(gpu_);
  make_alpha(count);
  if (!shown_ || shown_->query != query) shown_ = std::make_unique<Asked>(Asked{query});
  pass_through(rays, hits, known_count(count, query), *shown_, kernel(alpha_source(features)), nullptr, times);
  gpu_.finish();
}

// Records as many turns as were needed before. Then the host reads whether rays are left: at once, or in a batch that
// guesses, after the whole batch has run.
void Waves::pass_through(const Buffer<Ray>& rays, Buffer<Hit>& hits, const Count& count, Asked& asked, Kernel& test,
                         std::deque<Awaiting>* leftovers, PassTimes& times) {
  Count left = count;
  for (std::uint32_t turn = 0; !left.known || left.rays > 0; ++turn) {
    Alpha::Side& to = alpha_->sides[(turn + 1) % 2];
    left = alpha_turn(rays, hits, left, turn, asked, test, times);
    if (leftovers && turn > asked.turns) {  // one turn more than were needed before
      leftovers->push_back({left, gpu_.recording()});
      return;
    }
    if (!leftovers && turn >= asked.turns) {
      look(left);
      if (left.rays == 0) return;
      asked.turns = turn + 1;
    }
    trace(to.rays, to.hits, left, asked, "trace behind", times);
  }
}

/// Finds the rays that pass through their hits, and moves their t_min behind those hits.
Waves::Count Waves::alpha_turn(const Buffer<Ray>& rays, Buffer<Hit>& hits, const Count& count, std::uint32_t turn,
                               const Asked& asked, Kernel& test, PassTimes& times) {
  Alpha::Side &from = alpha_->sides[turn % 2], &to = alpha_->sides[(turn + 1) % 2];
  test.bind(BIND_WAVE_HITS, hits);
  test.bind(BIND_QUEUES, *queues_);
  test.bind(BIND_WAVE_INDIRECT, *indirect_);
  test.bind(BIND_RAYS, turn == 0 ? rays : from.rays);
  test.bind(BIND_HITS, turn == 0 ? hits : from.hits);
  test.bind(BIND_IDS, from.ids);
  test.bind(BIND_NEXT_RAYS, to.rays);
  test.bind(BIND_NEXT_IDS, to.ids);
  const AlphaPush push{count.wave_args(), turn == 0};
  const RayGroups groups = tracer_.groups_of(asked.query);
  CallPush then{next_record(), {1, 1, 1}, {1, 1, 1}};
  then.trace_rays[QUEUE_PASSED] = groups.rays;
  then.trace_groups[QUEUE_PASSED] = groups.most;
  run(test, count, &push, sizeof push, "alpha", times, &then);
  return {then.record, QUEUE_PASSED, count.rays, false};
}

Waves::Batch Waves::batch_of(const WaveSettings& settings, const Buffer<std::uint32_t>& listed, Buffer<FilmPixel>& film,
                             PassTimes& times) {
  const Integrator& integrator = *settings.integrator;
  Batch b{settings, plan_of(integrator, settings.features), listed, film, &times};
  b.makes_rays = tracer_.makes_rays() && !b.plan.alpha;
  b.scatter = &kernel(scatter_source(integrator, settings.features, settings.sky, b.makes_rays));
  b.connect = b.plan.shadow ? &kernel(connect_source()) : nullptr;
  b.alpha = b.plan.alpha ? &kernel(alpha_source(settings.features)) : nullptr;
  const auto asked = [&](Want want, std::string_view rays) {
    Asked a{settings.query, fmt::format("trace {}", rays)};
    a.query.want = want;
    a.query.rays = rays;
    return a;
  };
  b.primary = asked(Want::Nearest, kPrimaryRays);
  b.next = asked(Want::Nearest, integrator.next_kind);
  // In a scene with alpha, shadow rays ask for the nearest hit too, so that they meet the same surfaces as all other
  // rays.
  b.shadow = asked(settings.features.alpha ? Want::Nearest : Want::Any, integrator.shadow_kind);
  // Shadow rays from later hits are less coherent: the method that suits the first may not suit them.
  b.next_shadow = b.shadow;
  b.next_shadow.query.rays += fmt::format(" of {}", integrator.next_kind);
  const PixelCone cone = pixel_cone(settings.camera);
  b.push.last_depth = settings.last_depth;
  b.push.ao_radius = settings.ao_radius;
  b.push.lights = std::uint32_t(scene_.scene().lights.size());
  b.push.sky = scene_.scene().sky.kind != Sky::Kind::None;
  b.push.cone_width = cone.width;
  b.push.cone_spread = cone.spread;
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
  if (k.wants(BIND_CAMERAS)) k.bind(BIND_CAMERAS, *cameras_);
  k.bind(BIND_LISTED, b.listed);
  k.bind(BIND_PATHS, *paths_);
  k.bind(BIND_FILM, b.film);
  k.bind(BIND_QUEUES, *queues_);
  k.bind(BIND_WAVE_INDIRECT, *indirect_);
  if (k.wants(BIND_SHADOW_RAYS)) {
    k.bind(BIND_SHADOW_RAYS, *shadow_rays_);
    k.bind(BIND_SHADOW_LIGHT, *shadow_payload_);
  }
  if (k.wants(BIND_NEXT_RAYS)) {
    k.bind(BIND_NEXT_RAYS, next.rays);
    k.bind(BIND_CARRIED, *wave.carried);
    k.bind(BIND_NEXT_CARRIED, *next.carried);
  }
  if (k.wants(BIND_DEFERRED)) {
    k.bind(BIND_DEFERRED_RAYS, *deferred_rays_);
    k.bind(BIND_DEFERRED_CARRIED, *deferred_carried_);
    k.bind(BIND_DEFERRED, *deferred_);
  }
  const RayGroups on = tracer_.groups_of(b.next.query), lit = tracer_.groups_of(b.shadow_at_hand().query);
  const CallPush then{next_record(), {on.rays, lit.rays, 1}, {on.most, lit.most, 1}};
  b.push.args = count.wave_args();
  run(k, count, &b.push, sizeof b.push, "scatter", *b.times, &then);
  shadow = {then.record, QUEUE_SHADOW, count.rays, false};
  count = {then.record, QUEUE_NEXT, count.rays, false};
}

void Waves::connect(Batch& b, Count& count) {
  if (!trace(b, *shadow_rays_, *shadow_hits_, count, b.shadow_at_hand())) return;
  Kernel& k = *b.connect;
  k.bind(BIND_HITS, *shadow_hits_);
  k.bind(BIND_SHADOW_LIGHT, *shadow_payload_);
  k.bind(BIND_PATHS, *paths_);
  k.bind(BIND_WAVE_INDIRECT, *indirect_);
  const std::uint32_t args = count.wave_args();
  run(k, count, &args, sizeof args, "connect", *b.times);
}

/// Traces the camera rays of a batch. If the traversal kernel makes them, they are never stored.
bool Waves::trace(Batch& b, const PrimaryPush& camera, Wave& wave, Count& count) {
  if (b.push.made == 0) return trace(b, wave.rays, wave.hits, count, b.primary);
  const CameraKind kind = camera.orthographic ? CameraKind::Orthographic : CameraKind::Perspective;
  tracer_.record(CameraRays{*cameras_, b.push.camera, b.listed, kind}, wave.hits, count.rays, b.primary.query,
                 told(b.primary.pass, count, *b.times));
  return true;
}

/// Traces rays of the batch, and continues them through transparent surfaces.
bool Waves::trace(Batch& b, const Buffer<Ray>& rays, Buffer<Hit>& hits, Count& count, Asked& asked) {
  if (!trace(rays, hits, count, asked, asked.pass, *b.times)) return false;
  if (b.alpha) pass_through(rays, hits, count, asked, *b.alpha, b.guesses ? &b.leftovers : nullptr, *b.times);
  return true;
}

/// Reads the counts of submissions that have ended.
void Waves::hear(Batch& b) {
  const auto has_come = [&](const std::deque<Awaiting>& all) {
    return !all.empty() && all.front().submission <= gpu_.ended();
  };
  for (; has_come(b.lefts); b.lefts.pop_front(), ++b.heard)
    if (b.ended_at == 0 && reported(b.lefts.front().count) == 0) b.ended_at = b.heard + 1;
  for (; has_come(b.leftovers); b.leftovers.pop_front()) b.guessed_wrong |= reported(b.leftovers.front().count) > 0;
  if (gpu_.ended() == paced_) return;
  paced_ = gpu_.ended();
  if (gpu_.ended_ms() > kLongMs) depths_together_ = std::max(1u, depths_together_ / 2);
  if (gpu_.ended_ms() < kShortMs) depths_together_ = std::min(kMostDepthsTogether, depths_together_ * 2);
}

// Returns true if the batch is known to have no rays left, or must be run again.
//
// Several depths go into one submission. The host reads no counts before the depth at which earlier batches had no rays
// left; at that depth it waits and reads. Beyond that depth, and in a first batch, the host reads whether the previous
// submission left rays while the device works on the current one. If none were left, the current dispatches are empty
// and the batch has ended.
bool Waves::has_ended(Batch& b, const Count& count) {
  if (count.known) return count.rays == 0;
  b.lefts.push_back({count, gpu_.recording()});
  const std::uint32_t depths = b.push.depth + 1;
  const bool begins = depths == 1 && b.expected > 0;  // gives the device work while the host records more
  if (++b.together < depths_together_ && !begins && depths != b.expected) return false;
  b.together = 0;
  gpu_.flush();
  const std::uint64_t before = std::exchange(b.submission, gpu_.recording() - 1);
  if (depths == b.expected)
    gpu_.wait(b.submission);
  else if (depths > b.expected)
    gpu_.wait(before);
  hear(b);
  return b.ended_at > 0 || b.guessed_wrong;
}

// A path has one ray in flight at a time, so its sums have a fixed order. A path that branches is walked depth first:
// the reflected ray with everything that follows from it, then the refracted ray.
void Waves::run_waves(Batch& b, const PrimaryPush& camera, Count count) {
  Wave *wave = waves_[0].get(), *next = waves_[1].get();
  b.push.depth = b.together = b.heard = b.ended_at = 0;
  b.submission = 0;
  b.lefts.clear();
  for (;; b.push.made = 0, ++b.push.depth) {
    const bool traced =
        b.push.depth == 0 ? trace(b, camera, *wave, count) : trace(b, wave->rays, wave->hits, count, b.next);
    if (!traced) return;
    Count shadow;
    scatter(b, *wave, b.plan.next ? *next : *wave, count, shadow);
    if (b.plan.shadow) connect(b, shadow);
    const bool goes_on = b.plan.second ? b.settings.last_depth > 0 : b.push.depth < b.settings.last_depth;
    if (!b.plan.next || !goes_on) return;
    if (has_ended(b, count)) return;
    std::swap(wave, next);
  }
}

/// Makes the camera rays, unless the traversal kernel makes them.
void Waves::begin(Batch& b, const PrimaryPush& camera, const Count& paths) {
  b.push.made = b.makes_rays && tracer_.can_record(b.primary.query, paths.rays);
  if (b.push.made) return;
  Kernel& primary = kernel(primary_source(true, b.settings.features));
  primary.bind(BIND_RAYS, waves_[0]->rays);
  primary.bind(BIND_LISTED, b.listed);
  run(primary, paths, &camera, sizeof camera, "begin", *b.times);
}

// A batch whose guess was wrong is run again. This is safe: everything that a batch writes to the film before its last
// pass is the same in every run.
Waves::Count Waves::run_batch(Batch& b, const PrimaryPush& camera) {
  PassTimes spent, &times = *b.times;
  for (;;) {
    const Count paths = known_count(camera.count, b.primary.query);
    if (b.guesses) b.times = &spent;
    begin(b, camera, paths);
    run_waves(b, camera, paths);
    b.expected = b.ended_at > 0 ? std::max(b.ended_at, b.expected - std::min(b.expected, 1u)) : 0;
    if (b.guesses) {
      gpu_.finish();
      hear(b);
    }
    b.times = &times;
    b.guesses = b.plan.alpha && !std::exchange(b.guessed_wrong, false);
    if (!b.plan.alpha || b.guesses) {
      times.add(spent);
      return paths;
    }
    spent = {};
  }
}

}  // namespace ballot
