// Tracing by the C interface: arrays in memory, at once and in the background.
#include "engine/api/arrays.h"
#include "engine/api/crossings.h"
#include "engine/api/in_double.h"
#include "engine/api/sums.h"

namespace ballot::api {
namespace {

/// The arguments of a trace, copied from the caller's structs.
struct Call {
  RayArray rays;
  BallotHits hits;
  std::vector<WantedValues> values;
  BallotQuery query;
  Watch watch;
};

Call read_call(const SceneState& scene, const BallotRays* rays, const BallotHits* hits, const BallotQuery* query) {
  need(rays, "ballot_trace", "rays");
  need(hits, "ballot_trace", "hits");
  const BallotQuery q = read_query(query, kHitsKind);
  const BallotHits to = read_struct(hits, "BallotHits");
  return {RayArray(read_struct(rays, "BallotRays")), to, read_values(to, "hits"), q, Watch(q, *scene.device)};
}

/// Returns a stream of the same rays in double.
Stream<RayInDouble, Hit> in_double(const RayStream& stream, const RayArray& rays, const RowOrder& order) {
  const auto next = [&](std::uint64_t first, std::span<RayInDouble> room) {
    rays.read_in_double(order, std::size_t(first), room);
    return room.size();
  };
  return {.most = stream.most, .next = next, .take = stream.take, .progress = stream.progress};
}

/// Hits by the methods of `ballot methods`.
BallotTimes trace_by_method(SceneState& scene, const Call& call, Watch& watch) {
  const Clock clock;
  const RowOrder order = RowOrder::find(call.rays);
  HitArrays out(call.hits, call.values, scene, order, call.rays.count(), {&call.rays, 1, is_double(call.query)});
  SumArrays sums(call.hits, scene, call.rays, order, 1);
  RayStream stream{
      .most = call.rays.count(),
      .next =
          [&](std::uint64_t first, std::span<Ray> room) {
            call.rays.read(order, std::size_t(first), room);
            return room.size();
          },
      .make = call.rays.make_there(*scene.device->gpu, order),
      .take =
          [&](std::uint64_t first, std::span<const Hit> hits) {
            out.write(std::size_t(first), hits);
            sums.add(std::size_t(first), hits);
          },
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
  TraceTimes spent;
  if (is_double(call.query) && call.rays.in_double())
    spent = tracer.trace(in_double(stream, call.rays, order), query);
  else
    spent = tracer.trace(stream, query);
  out.end(spent);
  sums.end();
  return clock.times(spent, out.hits());
}

BallotTimes trace(SceneState& scene, Call& call) {
  keep_fit(scene);
  call.rays.ask(scene, is_double(call.query));
  if (is_double(call.query)) take_doubles(scene);
  Watch watch = call.watch;
  const Watched watched(watch);
  if (!call.rays.filters() && !asks_for_crossings(call.query)) return trace_by_method(scene, call, watch);
  const Clock clock;
  std::uint64_t hits = 0;
  const TraceTimes spent = first_crossings(scene, call.rays, {call.hits, call.values}, call.query, watch, hits);
  return clock.times(spent, hits);
}

void end_job(QueuedJob& job, SceneState& scene, Call& call) {
  try {
    const DeviceUse use(*scene.device);
    job.end(BALLOT_OK, trace(scene, call), {});
  } catch (...) {
    const BallotStatus status = report(&scene.error);
    job.end(status, {}, thread_text());
  }
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_trace(BallotScene* scene, const BallotRays* rays, const BallotHits* hits, const BallotQuery* query,
                          BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    Call call = read_call(*state, rays, hits, query);
    const Watched watched(call.watch);
    const DeviceUse use(*state->device);
    write_struct(times, trace(*state, call), "BallotTimes");
  });
}

BallotStatus ballot_submit(BallotScene* scene, const BallotRays* rays, const BallotHits* hits, const BallotQuery* query,
                           BallotJob** job) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(job, "ballot_submit", "job");
    Call call = read_call(*state, rays, hits, query);
    auto ended = std::make_shared<QueuedJob>(state->device);
    state->device->jobs.add([state, call, ended]() mutable { end_job(*ended, *state, call); });
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
