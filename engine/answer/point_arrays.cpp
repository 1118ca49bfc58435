// Point queries of arrays that stay on the device.
#include <algorithm>

#include "engine/answer/list_there.h"
#include "engine/answer/point_parts.h"
#include "engine/core/interruption.h"

namespace ballot {

namespace {

void check_points(const DevicePoints& there, std::uint64_t answers) {
  check_there(there.points.size(), there.count, "point query", "points");
  check_there(answers, there.count, "point query", "answers");
  check_there(there.filters, there.count, "point query");
}

/// Calls run(first, count) for parts of [0, count), at most `most` long each.
template <class Run>
void in_parts(std::uint64_t count, std::uint32_t most, const Run& run) {
  for (std::uint64_t first = 0; first < count; first += most)
    run(std::uint32_t(first), std::uint32_t(std::min<std::uint64_t>(most, count - first)));
}

template <class Runner, class Answer>
TraceTimes run_there(Context& gpu, Runner& runner, const DevicePoints& there, Buffer<Answer>& answers,
                     const point_queries::Settle<Answer>& settle) {
  TraceTimes times;
  const PassScope scope(gpu);
  in_parts(there.count, runner.most(), [&](std::uint32_t first, std::uint32_t some) {
    runner.run_there(there.points, answers, first, some, {.there = &there.filters}, settle, times);
    gpu.flush();
    check_interruption();
  });
  gpu.finish();
  return times;
}

}  // namespace

TraceTimes PointQueries::nearest(const DevicePoints& there, Buffer<Nearest>& answers, const PointQuery& query) {
  check_points(there, answers.size());
  auto& runner = parts_->nearest(query, there.filters.bits());
  return run_there(parts_->gpu, runner, there, answers, parts_->settle_nearest(query));
}

TraceTimes PointQueries::inside(const DevicePoints& there, Buffer<std::uint32_t>& answers, const PointQuery& query) {
  check_points(there, answers.size());
  return run_there(parts_->gpu, parts_->inside(query, there.count), there, answers, parts_->settle_inside(query));
}

TraceTimes PointQueries::winding(const DevicePoints& there, Buffer<float>& answers, const PointQuery& query) {
  check_points(there, answers.size());
  return run_there(parts_->gpu, parts_->winding(query), there, answers, point_queries::Settle<float>());
}

}  // namespace ballot
