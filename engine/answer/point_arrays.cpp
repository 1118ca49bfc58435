// Point queries of arrays that stay on the device.
#include <algorithm>

#include "engine/answer/point_parts.h"
#include "engine/core/interruption.h"

namespace ballot {

namespace {

KernelSource sign_source(int what) {
  return {.name = fmt::format("query.signs BALLOT_SIGNS={}", what),
          .file = "query/signs.comp",
          .defines = {{"BALLOT_SIGNS", what}},
          .group_size = SIGNS_GROUP};
}

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

std::vector<KernelSource> sign_sources() {
  return {sign_source(SIGNS_BY_PARITY), sign_source(SIGNS_BY_SIDES), sign_source(SIGNS_INSIDE)};
}

void PointQueries::Parts::write_signs(int what, const RawBuffer& to, std::uint32_t first, std::uint32_t count,
                                      TraceTimes& times) {
  std::unique_ptr<Kernel>& kernel = sign_kernels[what];
  refresh(gpu, kernel, sign_source(what));
  kernel->bind(BIND_HITS, *some_nearest);
  if (what == SIGNS_BY_PARITY) kernel->bind(BIND_CROSSINGS, *some_inside);
  kernel->bind(what == SIGNS_INSIDE ? BIND_CROSSINGS : BIND_DISTANCES, to);
  const SignsPush push{count, first};
  gpu.submit(kernel->name(), [&](Commands& cmd) { kernel->dispatch(cmd, groups_of(count, SIGNS_GROUP), push); });
  times.device_ms += gpu.last_ms();
  ++times.dispatches;
}

TraceTimes PointQueries::nearest(const Buffer<ProbePoint>& points, Buffer<Nearest>& answers, std::uint64_t count,
                                 const PointQuery& query) {
  check_rooms(points.size(), answers.size(), count);
  return run_there(parts_->gpu, parts_->nearest(query), points, answers, count, parts_->settle_nearest(query));
}

TraceTimes PointQueries::inside(const Buffer<ProbePoint>& points, Buffer<std::uint32_t>& answers, std::uint64_t count,
                                const PointQuery& query) {
  if (query.sides) return signs(points, answers, answers.size(), count, query, SIGNS_INSIDE);
  check_rooms(points.size(), answers.size(), count);
  return run_there(parts_->gpu, parts_->inside(query), points, answers, count, parts_->settle_inside(query));
}

TraceTimes PointQueries::signed_distances(const Buffer<ProbePoint>& points, Buffer<float>& answers, std::uint64_t count,
                                          const PointQuery& query) {
  return signs(points, answers, answers.size(), count, query, query.sides ? SIGNS_BY_SIDES : SIGNS_BY_PARITY);
}

/// Points are copied part by part, so that what lies between two kernels takes a bounded memory.
TraceTimes PointQueries::signs(const Buffer<ProbePoint>& points, RawBuffer& answers, std::uint64_t room,
                               std::uint64_t count, const PointQuery& query, int what) {
  check_rooms(points.size(), room, count);
  TraceTimes times;
  Parts& parts = *parts_;
  const PassScope scope(parts.gpu);
  auto& nearest = parts.nearest(query);
  auto* inside = what == SIGNS_BY_PARITY ? &parts.inside(query) : nullptr;
  const std::uint32_t most = std::min(nearest.most(), inside ? inside->most() : nearest.most());
  const auto size = std::size_t(std::min<std::uint64_t>(count, most));
  auto& asked = buffer_for(parts.some_points, parts.gpu, size, "points of a part");
  auto& found = buffer_for(parts.some_nearest, parts.gpu, size, "nearest points of a part");
  if (inside) buffer_for(parts.some_inside, parts.gpu, size, "inside tests of a part");
  in_parts(count, most, [&](std::uint32_t first, std::uint32_t some) {
    asked.copy_from(points, first, 0, some);
    nearest.run_there(asked, found, 0, some, parts.settle_nearest(query), times);
    if (inside) inside->run_there(asked, *parts.some_inside, 0, some, parts.settle_inside(query), times);
    parts.write_signs(what, answers, first, some, times);
    check_interruption();
  });
  parts.gpu.finish();
  return times;
}

}  // namespace ballot
