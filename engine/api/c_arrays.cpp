// Traces of arrays on the device by the C interface.
#include <algorithm>

#include "engine/api/crossings.h"
#include "engine/api/in_double.h"
#include "engine/api/outputs.h"
#include "engine/gpu/room.h"

namespace ballot::api {
namespace {

constexpr const char* kTrace = "trace of arrays on the device";

/// The arguments of a trace: the hits go to the caller's array if he wants them whole, else to one of the scene.
struct ArrayTrace {
  Buffer<Ray>& rays;
  std::uint32_t count;
  const Outputs& outputs;
  Buffer<Hit>& hits;
};

/// The sums of a trace.
class SumsThere {
 public:
  /// Throws Refused if they do not fit.
  SumsThere(SceneState& scene, const ArrayTrace& trace, const BallotQuery& query)
      : sums_(answers_there(scene).sums), from_{trace.hits, trace.count, hits_of_each(query)}, to_(trace.outputs.sums) {
    if (!query.weights) return;
    given_ = use(query.weights);
    if (!trace.outputs.has_sums()) refuse(fmt::format("{}: weights are given, but no sums are wanted", kTrace));
    if (std::ranges::count(trace.outputs.arrays, given_))
      refuse(fmt::format("{}: one array is given for weights and an output", kTrace));
    from_.weights = &array_beside<float>(*given_, scene, trace.count, kTrace, "weights");
  }
  /// Sums up what earlier passes find, and waits.
  void end(Context& gpu, TraceTimes& times) {
    const bool any = to_ != SumBuffers{};
    if (any) sums_.record(from_, to_, [&](double ms) { times.device_ms += ms; });
    gpu.finish();
    if (any) sums_.check(from_);
  }

 private:
  SumWriter& sums_;
  WeighedHits from_;
  const SumBuffers& to_;
  std::shared_ptr<BufferState> given_;
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
    record_columns(*scene_, {.found = trace.hits, .count = trace.count, .rays = &trace.rays}, trace.outputs.to, add);
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
  const auto from = use(rays);
  Buffer<Ray>& in = array_of<Ray>(*from, scene, count, kTrace, "rays");
  const BallotQuery q = read_query(query, kind);
  const std::uint64_t all = count * hits_of_each(q);
  const Outputs to(outputs, door::kHitRows, scene, *from, all, kTrace);
  const Hold hold(*scene.device);
  to.check_held(scene);
  keep_fit(scene);
  if (is_double(q)) take_doubles(scene);
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
      const std::uint64_t all = t.count * std::uint64_t{hits_of_each(q)};
      SumsThere sums(*state, t, q);
      ballot::TraceTimes spent = asks_for_crossings(q)
                                     ? first_crossings(*state, t.rays, t.count, q, t.hits)
                                     : state->world->tracer().trace(t.rays, t.hits, t.count, hit_query(q));
      record_columns(*state, {.found = t.hits, .count = all, .rays = &t.rays, .row = hits_of_each(q)}, t.outputs.to,
                     [&](double ms) { spent.device_ms += ms; });
      sums.end(gpu, spent);
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
                            [&](const ArrayTrace& t, const BallotQuery& q) {
                              if (t.outputs.has_sums())
                                refuse("ballot_submit_buffers: sums are wanted; expected ballot_trace_buffers()");
                              begun->begin(t, hit_query(q));
                            });
    *job = jobs().add(std::move(begun));
  });
}
