// Point queries of arrays that stay on the device.
#include <algorithm>

#include "engine/answer/point_parts.h"
#include "engine/core/interruption.h"

namespace ballot {

namespace {

void check_rooms(std::uint64_t points, std::uint64_t answers, std::uint64_t count) {
  if (points >= count && answers >= count) return;
  fail(Failure::Arguments, "point query on the device: {} points and room for {} answers; expected {} of both", points,
       answers, count);
}

/// Calls run(first, count) for parts of [0, count), at most `most` long each.
template <class Run>
void in_parts(std::uint64_t count, std::uint32_t most, const Run& run) {
  for (std::uint64_t first = 0; first < count; first += most)
    run(std::uint32_t(first), std::uint32_t(std::min<std::uint64_t>(most, count - first)));
}

template <class Runner, class Answer>
TraceTimes run_there(Context& gpu, Runner& runner, const Buffer<ProbePoint>& points, Buffer<Answer>& answers,
                     std::uint64_t count, const point_queries::Settle<Answer>& settle) {
  TraceTimes times;
  const PassScope scope(gpu);
  in_parts(count, runner.most(), [&](std::uint32_t first, std::uint32_t some) {
    runner.run_there(points, answers, first, some, settle, times);
    gpu.flush();
    check_interruption();
  });
  gpu.finish();
  return times;
}

}  // namespace

TraceTimes PointQueries::nearest(const Buffer<ProbePoint>& points, Buffer<Nearest>& answers, std::uint64_t count,
                                 const PointQuery& query) {
  check_rooms(points.size(), answers.size(), count);
  return run_there(parts_->gpu, parts_->nearest(query), points, answers, count, parts_->settle_nearest(query));
}

TraceTimes PointQueries::inside(const Buffer<ProbePoint>& points, Buffer<std::uint32_t>& answers, std::uint64_t count,
                                const PointQuery& query) {
  check_rooms(points.size(), answers.size(), count);
  return run_there(parts_->gpu, parts_->inside(query), points, answers, count, parts_->settle_inside(query));
}

}  // namespace ballot
