// The triangles within a radius of a point.
#include "engine/answer/point_lists.h"

namespace ballot {

/// Lists of triangles, each of which lies in one leaf of the tree.
class PointQueries::Parts::WithinLists : public TriangleLists<ProbePoint> {
 public:
  WithinLists(Parts& parts, const PointQuery& query, const DeviceFilters& words_there = {})
      : TriangleLists(parts, "within", query, words_there) {}
  bool order(std::span<const ProbePoint> points, std::vector<std::uint32_t>& order) override {
    order_points(points, parts_.whole.tree().bvh().bounds, order);
    return true;
  }
};

namespace {

void refuse_exact(const PointQuery& query) {
  if (query.exact)
    fail(Failure::Arguments,
         "triangles within a radius: found mode exact; expected mode watertight: distances are computed in float32");
}

}  // namespace

TraceTimes PointQueries::within(const InsideStream& stream, const TakeWithin& take, const PointQuery& query) {
  refuse_exact(query);
  Parts::WithinLists kind(*parts_, query);
  return parts_->list(kind, parts_->lists, stream, take);
}

DeviceListed PointQueries::within(const DevicePoints& there, const DeviceLists<Within>& to, const PointQuery& query) {
  refuse_exact(query);
  check_there(there.points.size(), "points", to, there.count);
  check_there(there.filters, there.count, "lists");
  DeviceListed listed;
  PointQuery asked = query;
  asked.filters = there.filters.readers();
  if (there.count > 0 && !StreamRing::of(parts_->gpu).is_alone()) {
    Parts::WithinLists kind(*parts_, asked, there.filters);
    const PassScope scope(parts_->gpu);
    ListsThere lists(parts_->gpu, kind, parts_->lists, there.points, there.count, listed.times);
    if (const auto all = lists.list(to)) return listed.records = *all, listed;
  }
  DeviceListsSink<Within> sink(to);
  InsideStream stream{.most = there.count};
  stream.next = [&](std::uint64_t first, std::span<ProbePoint> room) {
    there.points.download(room, std::size_t(first));
    return room.size();
  };
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Within> found) {
    sink.take(first, counts, found);
  };
  listed.times = within(stream, take, asked);
  listed.records = sink.sum();
  return listed;
}

DeviceListed PointQueries::within(const DevicePoints& there, const DeviceLists<Hit>& to, const PointQuery& query) {
  if (!to.records) return within(there, DeviceLists<Within>{to.counts, to.offsets}, query);
  Parts& parts = *parts_;
  auto& found = buffer_for(parts.some_within, parts.gpu, to.records->size(), "triangles within a radius");
  DeviceListed listed = within(there, DeviceLists<Within>{to.counts, to.offsets, &found}, query);
  const auto all = std::uint32_t(std::min<std::uint64_t>(listed.records, to.records->size()));
  refresh(parts.gpu, parts.lists.widen, pick_source(true));
  parts.lists.widen->bind(BIND_ROWS, found);
  parts.lists.widen->bind(BIND_RECORDS, *to.records);
  constexpr std::uint32_t kGroups = 1024;
  parts.gpu.submit(parts.lists.widen->name(), [&](Commands& cmd) {
    parts.lists.widen->dispatch(cmd, kGroups, PickPush{all, 0, 0});
  });
  listed.times.device_ms += parts.gpu.last_ms();
  ++listed.times.dispatches;
  return listed;
}

}  // namespace ballot
