// Tracing by the C interface: arrays in memory, in the background, buffers on the device.
#include <chrono>

#include "engine/api/arrays.h"

namespace ballot::api {
namespace {

/// The arguments of a trace, copied from the caller's structs.
struct Call {
  RayArray rays;
  BallotHits hits;
  Query query;
  Watch watch;
};

Call read_call(const BallotRays* rays, const BallotHits* hits, const BallotQuery* query) {
  need(rays, "ballot_trace", "rays");
  need(hits, "ballot_trace", "hits");
  const BallotQuery q = read_struct(query, "BallotQuery");
  return {RayArray(read_struct(rays, "BallotRays")), read_struct(hits, "BallotHits"), query_of(q), Watch(q)};
}

/// Measures a call.
class Clock {
 public:
  BallotTimes times(const TraceTimes& trace, std::uint64_t hits) const {
    BallotTimes t = BALLOT_INIT(BallotTimes);
    t.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    t.device_ms = trace.device_ms;
    t.hits = hits;
    return t;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

BallotTimes trace(SceneState& scene, const Call& call) {
  const Clock clock;
  HitArrays out(call.hits, scene);
  std::size_t taken = 0, given = 0;
  RayStream stream{
      .most = call.rays.count(),
      .next =
          [&](std::span<Ray> room) {
            call.rays.read(taken, room);
            taken += room.size();
            return room.size();
          },
      .take =
          [&](std::span<const Hit> hits) {
            out.write(given, hits);
            given += hits.size();
          },
  };
  if (call.watch) stream.progress = [&](std::uint64_t done) { call.watch(double(done) / double(call.rays.count())); };
  Tracer& tracer = scene.engine->tracer();
  tracer.variant(call.query);  // unknown names are an error even without rays
  const TraceTimes spent = tracer.trace(stream, call.query);
  return clock.times(spent, out.hits());
}

void end_job(JobState& job, SceneState& scene, const Call& call) {
  try {
    const std::lock_guard lock(scene.device->mutex);
    job.end(BALLOT_OK, trace(scene, call), {});
  } catch (...) {
    const BallotStatus status = report(&scene.error);
    job.end(status, {}, thread_text());
  }
}

void check_buffer(const BufferState& buffer, const SceneState& scene, std::uint64_t count, bool right_record,
                  const char* what) {
  if (!right_record)
    throw Refused(BALLOT_ERROR_ARGUMENT,
                  fmt::format("ballot_trace_buffers: the buffer of {} holds other records", what));
  if (buffer.device != scene.device)
    throw Refused(
        BALLOT_ERROR_ARGUMENT,
        fmt::format("ballot_trace_buffers: the buffer of {} is on another device than the scene ({} and {}); make "
                    "both by the same ballot_device_open()",
                    what, buffer.device->gpu->info().name, scene.device->gpu->info().name));
  if (buffer.count() < count)
    throw Refused(
        BALLOT_ERROR_ARGUMENT,
        fmt::format("ballot_trace_buffers: the buffer of {} has {} records; expected {}", what, buffer.count(), count));
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_trace(BallotScene* scene, const BallotRays* rays, const BallotHits* hits, const BallotQuery* query,
                          BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const Call call = read_call(rays, hits, query);
    const std::lock_guard lock(state->device->mutex);
    write_struct(times, trace(*state, call), "BallotTimes");
  });
}

BallotStatus ballot_submit(BallotScene* scene, const BallotRays* rays, const BallotHits* hits, const BallotQuery* query,
                           BallotJob** job) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(job, "ballot_submit", "job");
    const Call call = read_call(rays, hits, query);
    auto ended = std::make_shared<JobState>();
    state->device->jobs.add([state, call, ended] { end_job(*ended, *state, call); });
    *job = jobs().add(std::move(ended));
  });
}

BallotStatus ballot_job_wait(BallotJob* job, BallotTimes* times) {
  return guarded(nullptr, [&] {
    const auto state = use(job);
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
  if (state->is_ours())
    state->wait();
  else
    new std::shared_ptr<JobState>(std::move(state));  // stays: its thread is not in this process
}

BallotStatus ballot_trace_buffers(BallotScene* scene, BallotBuffer* rays, BallotBuffer* hits, uint64_t count,
                                  const BallotQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const Clock clock;
    const auto from = use(rays), to = use(hits);
    check_buffer(*from, *state, count, from->rays.has_value(), "rays");
    check_buffer(*to, *state, count, to->hits.has_value(), "hits");
    const BallotQuery q = read_struct(query, "BallotQuery");
    const std::lock_guard lock(state->device->mutex);
    ballot::Tracer& tracer = state->engine->tracer();
    const auto done = tracer.trace(*from->rays, *to->hits, std::uint32_t(count), query_of(q));
    write_struct(times, clock.times(done, 0), "BallotTimes");
  });
}
