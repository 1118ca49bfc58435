// Tracing by the C interface: arrays in memory, in the background, buffers on the device.
#include "engine/api/arrays.h"
#include "engine/api/crossings.h"

namespace ballot::api {
namespace {

/// The arguments of a trace, copied from the caller's structs.
struct Call {
  RayArray rays;
  BallotHits hits;
  BallotQuery query;
  Watch watch;
};

Call read_call(const SceneState& scene, const BallotRays* rays, const BallotHits* hits, const BallotQuery* query) {
  need(rays, "ballot_trace", "rays");
  need(hits, "ballot_trace", "hits");
  const BallotQuery q = read_query(query, kHitsKind);
  return {RayArray(read_struct(rays, "BallotRays")), read_struct(hits, "BallotHits"), q, Watch(q, *scene.device)};
}

/// Hits by the methods of `ballot methods`.
BallotTimes trace_by_method(SceneState& scene, const Call& call, Watch& watch) {
  const Clock clock;
  const RowOrder order = RowOrder::find(call.rays);
  HitArrays out(call.hits, scene, order, call.rays.count());
  RayStream stream{
      .most = call.rays.count(),
      .next =
          [&](std::uint64_t first, std::span<Ray> room) {
            call.rays.read(order, std::size_t(first), room);
            return room.size();
          },
      .take = [&](std::uint64_t first, std::span<const Hit> hits) { out.write(std::size_t(first), hits); },
      .in_place =
          [&](std::uint64_t first, std::size_t count) {
            if (order.width()) return RayStream::Places{};
            return RayStream::Places{call.rays.in_place(std::size_t(first), count), out.in_place(std::size_t(first))};
          },
  };
  if (watch) stream.progress = [&](std::uint64_t done) { watch(double(done) / double(call.rays.count())); };
  Tracer& tracer = scene.world->tracer();
  const Query query = hit_query(call.query);
  tracer.variant(query);  // unknown names are an error even without rays
  const TraceTimes spent = tracer.trace(stream, query);
  return clock.times(spent, out.hits());
}

BallotTimes trace(SceneState& scene, const Call& call) {
  keep_fit(scene);
  Watch watch = call.watch;
  const Watched watched(watch);
  if (!call.rays.masks() && !asks_for_crossings(call.query)) return trace_by_method(scene, call, watch);
  const Clock clock;
  std::uint64_t hits = 0;
  const TraceTimes spent = first_crossings(scene, call.rays, call.hits, call.query, watch, hits);
  return clock.times(spent, hits);
}

void end_job(QueuedJob& job, SceneState& scene, const Call& call) {
  try {
    const DeviceUse use(*scene.device);
    job.end(BALLOT_OK, trace(scene, call), {});
  } catch (...) {
    const BallotStatus status = report(&scene.error);
    job.end(status, {}, thread_text());
  }
}

/// A trace of arrays on the device that has been submitted.
class DeviceJob : public JobState {
 public:
  explicit DeviceJob(std::shared_ptr<SceneState> scene) : JobState(scene->device), scene_(std::move(scene)) {}

  /// Submits the work. The device's mutex is held.
  void begin(Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query) {
    Tracer& tracer = scene_->world->tracer();
    const Query concrete = tracer.resolve(query, rays, count);
    tracer.record(rays, hits, count, concrete, [times = spent_](double ms) { times->device_ms = ms; });
    // Work for an idle device is sent at once; behind two submissions it waits to be sent together with what follows.
    Context& gpu = *scene_->device->gpu;
    if (!gpu.has_recorded()) return;  // it was traced at once, as the host has to look at its results
    submission_ = gpu.recording();
    if (gpu.in_flight() < 2) gpu.flush();
  }
  BallotStatus wait() override {
    return end([&] { scene_->device->gpu->wait(submission_); });
  }
  BallotStatus poll() override {
    bool ended = false;
    const BallotStatus status = end([&] { ended = scene_->device->gpu->has_ended(submission_); });
    return status == BALLOT_OK && !ended ? BALLOT_NOT_READY : status;
  }

 private:
  template <class Wait>
  BallotStatus end(const Wait& wait) {
    const DeviceHold hold(*scene_->device);
    try {
      wait();
      times_ = clock_.times(*spent_, 0);
      return BALLOT_OK;
    } catch (...) {
      const BallotStatus status = report(&scene_->error);
      error_ = thread_text();
      return status;
    }
  }

  Clock clock_;
  std::shared_ptr<SceneState> scene_;
  std::shared_ptr<TraceTimes> spent_ = std::make_shared<TraceTimes>();
  std::uint64_t submission_ = 0;
};

/// Checks the arguments of a trace of arrays on the device, and runs trace(rays, hits, query) while no other call uses
/// it.
template <class Trace>
void with_buffers(SceneState& scene, BallotBuffer* rays, BallotBuffer* hits, std::uint64_t count,
                  const BallotQuery* query, const Trace& trace) {
  const auto from = use(rays), to = use(hits);
  constexpr const char* kCall = "trace of arrays on the device";
  Buffer<Ray>& in = array_of<Ray>(*from, scene, count, kCall, "rays");
  Buffer<Hit>& out = array_of<Hit>(*to, scene, count, kCall, "hits");
  const Query q = hit_query(read_query(query, kArraysKind));
  const DeviceHold hold(*scene.device);
  keep_fit(scene);
  trace(in, out, q);
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_trace(BallotScene* scene, const BallotRays* rays, const BallotHits* hits, const BallotQuery* query,
                          BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const Call call = read_call(*state, rays, hits, query);
    const Watched watched(call.watch);
    const DeviceUse use(*state->device);
    write_struct(times, trace(*state, call), "BallotTimes");
  });
}

BallotStatus ballot_submit(BallotScene* scene, const BallotRays* rays, const BallotHits* hits, const BallotQuery* query,
                           BallotJob** job) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(job, "ballot_submit", "job");
    const Call call = read_call(*state, rays, hits, query);
    auto ended = std::make_shared<QueuedJob>(state->device);
    state->device->jobs.add([state, call, ended] { end_job(*ended, *state, call); });
    *job = jobs().add(std::move(ended));
  });
}

BallotStatus ballot_job_wait(BallotJob* job, BallotTimes* times) {
  return guarded(nullptr, [&] {
    const auto state = use(job);
    InCallback::refuse(state->device());
    const BallotStatus status = state->wait();
    if (status != BALLOT_OK) throw Refused(status, state->error());
    write_struct(times, state->times(), "BallotTimes");
  });
}

BallotStatus ballot_job_poll(BallotJob* job) {
  BallotStatus status = BALLOT_OK;
  const BallotStatus failed = guarded(nullptr, [&] {
    const auto state = use(job);
    status = state->poll();
    if (status != BALLOT_OK && status != BALLOT_NOT_READY) throw Refused(status, state->error());
  });
  return failed != BALLOT_OK ? failed : status;
}

void ballot_job_destroy(BallotJob* job) {
  auto state = jobs().remove(job);
  if (!state) return;
  if (!state->is_ours())
    new std::shared_ptr<JobState>(std::move(state));  // stays: its thread is not in this process
  else if (InCallback::of(state->device()))
    state->end_late();
  else
    state->wait();
}

BallotStatus ballot_trace_buffers(BallotScene* scene, BallotBuffer* rays, BallotBuffer* hits, uint64_t count,
                                  const BallotQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const Clock clock;
    const Watch watch(read_query(query, kArraysKind), *state->device);
    with_buffers(*state, rays, hits, count, query, [&](auto& from, auto& to, const ballot::Query& q) {
      const Watched watched(watch);
      const auto done = state->world->tracer().trace(from, to, std::uint32_t(count), q);
      write_struct(times, clock.times(done, 0), "BallotTimes");
    });
  });
}

BallotStatus ballot_submit_buffers(BallotScene* scene, BallotBuffer* rays, BallotBuffer* hits, uint64_t count,
                                   const BallotQuery* query, BallotJob** job) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(job, "ballot_submit_buffers", "job");
    auto begun = std::make_shared<DeviceJob>(state);
    with_buffers(*state, rays, hits, count, query, [&](auto& from, auto& to, const ballot::Query& q) {
      begun->begin(from, to, std::uint32_t(count), q);
    });
    *job = jobs().add(std::move(begun));
  });
}
