// Traces of arrays on the device by the C interface.
#include "engine/api/crossings.h"
#include "engine/api/outputs.h"
#include "engine/gpu/room.h"

namespace ballot::api {
namespace {

/// The arguments of a trace: the hits go to the caller's array if he wants them whole, else to one of the scene.
struct ArrayTrace {
  Buffer<Ray>& rays;
  std::uint32_t count;
  const Outputs& outputs;
  Buffer<Hit>& hits;
};

/// A trace of arrays on the device that has been submitted.
class DeviceJob : public JobState {
 public:
  explicit DeviceJob(std::shared_ptr<SceneState> scene) : JobState(scene->device), scene_(std::move(scene)) {}

  /// Submits the work. The device's mutex is held.
  void begin(const ArrayTrace& trace, const Query& query) {
    Tracer& tracer = scene_->world->tracer();
    const Query concrete = tracer.resolve(query, trace.rays, trace.count);
    const Context::Done add = [times = spent_](double ms) { times->device_ms += ms; };
    tracer.record(trace.rays, trace.hits, trace.count, concrete, add);
    record_columns(*scene_, {.found = trace.hits, .count = trace.count}, trace.outputs.to, add);
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

/// Checks the arguments of a trace of arrays on the device, and runs trace(ArrayTrace, options) while it holds that by
/// a DeviceHold or DeviceUse.
template <class Hold, class Trace>
void with_arrays(SceneState& scene, BallotBuffer* rays, std::uint64_t count, std::span<const BallotOutput> outputs,
                 const BallotQuery* query, const Kind& kind, const Trace& trace) {
  constexpr const char* kCall = "trace of arrays on the device";
  const auto from = use(rays);
  Buffer<Ray>& in = array_of<Ray>(*from, scene, count, kCall, "rays");
  const BallotQuery q = read_query(query, kind);
  const std::uint64_t all = count * std::max(q.first, 1u);
  const Outputs to(outputs, door::kHitRows, scene, *from, all, kCall);
  const Hold hold(*scene.device);
  keep_fit(scene);
  Buffer<Hit>& hits = to.hits ? *to.hits : buffer_for(answers_there(scene).hits, *scene.device->gpu, all, "hits");
  trace(ArrayTrace{in, std::uint32_t(count), to, hits}, q);
}

std::span<const BallotOutput> outputs_of(const BallotOutput* outputs, std::size_t count, const char* call) {
  if (count) need(outputs, call, "outputs");
  return {outputs, count};
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_trace_buffers(BallotScene* scene, BallotBuffer* rays, uint64_t count, const BallotOutput* outputs,
                                  size_t output_count, const BallotQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const Clock clock;
    const Watch watch(read_query(query, kArraysKind), *state->device);
    const auto to = outputs_of(outputs, output_count, "ballot_trace_buffers");
    const Watched watched(watch);
    with_arrays<DeviceUse>(*state, rays, count, to, query, kArraysKind, [&](const ArrayTrace& t, const BallotQuery& q) {
      ballot::Context& gpu = *state->device->gpu;
      const ballot::PassScope scope(gpu);
      const std::uint64_t all = t.count * std::uint64_t{std::max(q.first, 1u)};
      ballot::TraceTimes spent = asks_for_crossings(q)
                                     ? first_crossings(*state, t.rays, t.count, q, t.hits)
                                     : state->world->tracer().trace(t.rays, t.hits, t.count, hit_query(q));
      record_columns(*state, {.found = t.hits, .count = all}, t.outputs.to, [&](double ms) { spent.device_ms += ms; });
      gpu.finish();
      write_struct(times, clock.times(spent, 0), "BallotTimes");
    });
  });
}

BallotStatus ballot_submit_buffers(BallotScene* scene, BallotBuffer* rays, uint64_t count, const BallotOutput* outputs,
                                   size_t output_count, const BallotQuery* query, BallotJob** job) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(job, "ballot_submit_buffers", "job");
    auto begun = std::make_shared<DeviceJob>(state);
    const auto to = outputs_of(outputs, output_count, "ballot_submit_buffers");
    with_arrays<DeviceHold>(*state, rays, count, to, query, kArrayJobsKind,
                            [&](const ArrayTrace& t, const BallotQuery& q) { begun->begin(t, hit_query(q)); });
    *job = jobs().add(std::move(begun));
  });
}
