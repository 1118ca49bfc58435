// Crossings of rays of arrays that stay on the device.
#include <algorithm>

#include "engine/answer/crossing_lists.h"
#include "engine/answer/list_there.h"

namespace ballot {

using namespace ray_queries;

namespace {

/// Returns rays on the device as a source of the host.
RaySource source_of(const DeviceRays& there) {
  RaySource source{.count = there.count, .read = [&](std::uint64_t first, std::span<Ray> room) {
                     there.rays.download(room, std::size_t(first));
                   }};
  source.filters = there.filters.readers();
  return source;
}

void check_rays(const DeviceRays& there, const char* what) {
  check_there(there.rays.size(), there.count, what, "rays");
  check_there(there.filters, there.count, what);
}

/// Returns true if the host takes part: it decides, or the device is the host and its rays are sorted.
bool goes_through_host(Context& gpu, const CrossingQuery& query) {
  return query.exact || StreamRing::of(gpu).is_alone();
}

}  // namespace

/// Counts on the device. Returns false if the driver cut a walk short.
bool RayQueries::Parts::count_there(const DeviceRays& there, Buffer<std::uint32_t>& counts, TraceTimes& times) {
  QueryKernel& kernel = kernels.kernel(variant, false);
  kernel.bind(BIND_RAYS, there.rays);
  kernel.bind(BIND_CROSSINGS, counts);
  kernels.filters().bind_there(kernel, there.filters, 0, std::size_t(there.count));
  const std::uint32_t most = part_size(gpu, kernel.most());
  for (std::uint64_t first = 0; first < there.count; first += most) {
    const auto some = std::uint32_t(std::min<std::uint64_t>(most, there.count - first));
    if (kernel.answer(std::uint32_t(first), some, {kernels.tree().root()}, times) > 0) return false;
    gpu.flush();
    check_interruption();
  }
  gpu.finish();
  return true;
}

/// Finds rows of first crossings on the device. Returns false if the driver cut a walk short.
bool RayQueries::Parts::first_there(const DeviceRays& there, Buffer<Hit>& hits, TraceTimes& times) {
  const RaySource none;
  Crossings crossings(*this, none, there.filters);
  if (crossings.has_rest()) {
    ListsThere lists(gpu, crossings, rooms, there.rays, there.count, times);
    return lists.rows(buffer_for(numbers, gpu, std::size_t(there.count), "numbers of crossings"), hits);
  }
  QueryKernel& kernel = crossings.kernel(ListForm::Rows, false);
  const std::uint64_t row = crossings.row() * sizeof(Hit);
  const std::uint32_t most = part_size(gpu, std::min<std::size_t>(kernel.most(), kChunk));
  QuestionParts<Ray> parts(gpu, there.rays, there.count);
  kernel.bind(BIND_CROSSINGS,
              buffer_for(numbers, gpu, std::min<std::size_t>(most, there.count), "numbers of crossings"));
  for (std::uint64_t first = 0; first < there.count; first += most) {
    const auto some = std::uint32_t(std::min<std::uint64_t>(most, there.count - first));
    kernel.bind(BIND_RAYS, parts.of(first, some));
    kernel.bind(BIND_RECORDS, {hits, first * row, some * row});
    crossings.bind_words_there(kernel, first, some);
    if (kernel.answer(0, some, crossings.whole(), times) > 0) return false;
    gpu.flush();
    check_interruption();
  }
  gpu.finish();
  return true;
}

TraceTimes RayQueries::count(const DeviceRays& there, Buffer<std::uint32_t>& counts, const CrossingQuery& query) {
  check_rays(there, "counts");
  check_there(counts.size(), there.count, "counts", "counts");
  if (there.count == 0) return {};
  Parts& parts = *parts_;
  parts.begin(there.filters.bits(), query);
  if (!goes_through_host(parts.gpu, query)) {
    TraceTimes times;
    const PassScope scope(parts.gpu);
    if (parts.count_there(there, counts, times)) return times;
  }
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> some) {
    counts.upload(some, std::size_t(first));
  };
  return count(source_of(there), take, query);
}

TraceTimes RayQueries::first(const DeviceRays& there, std::uint32_t most, Buffer<Hit>& hits,
                             const CrossingQuery& wanted) {
  check_most(most, wanted);
  check_rays(there, "first crossings");
  check_there(hits.size() / most, there.count, "first crossings", fmt::format("rows of {} hits", most).c_str());
  if (there.count == 0) return {};
  CrossingQuery query = wanted;
  query.most = most;
  Parts& parts = *parts_;
  parts.begin(there.filters.bits(), query);
  if (!goes_through_host(parts.gpu, query)) {
    TraceTimes times;
    const PassScope scope(parts.gpu);
    if (parts.first_there(there, hits, times)) return times;
  }
  const auto take = [&](std::uint64_t first, std::span<const Hit> rows) {
    hits.upload(rows, std::size_t(first) * most);
  };
  return first(source_of(there), most, take, query);
}

DeviceListed RayQueries::list(const DeviceRays& there, const DeviceLists<Hit>& to, const CrossingQuery& query) {
  check_rays(there, "lists");
  check_there(there.rays.size(), "rays", to, there.count);
  Parts& parts = *parts_;
  parts.begin(there.filters.bits(), query);
  DeviceListed listed;
  if (there.count > 0 && !goes_through_host(parts.gpu, query) && query.most > 0) {
    const RaySource none;
    Parts::Crossings crossings(parts, none, there.filters);
    const PassScope scope(parts.gpu);
    ListsThere lists(parts.gpu, crossings, parts.rooms, there.rays, there.count, listed.times);
    if (const auto all = lists.list(to)) return listed.records = *all, listed;
  }
  DeviceListsSink<Hit> sink(to);
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Hit> hits) {
    sink.take(first, counts, hits);
  };
  listed.times = list(source_of(there), take, query);
  listed.records = sink.sum();
  return listed;
}

DeviceListed RayQueries::hits_alone(const Buffer<Hit>& hits, std::uint64_t count, std::uint32_t row, Buffer<Hit>& to,
                                    Buffer<std::uint32_t>& numbers) {
  check_there(hits.size(), count, "hits alone", "hits");
  DeviceListed found;
  Context& gpu = parts_->gpu;
  const PassScope scope(gpu);
  const auto all = std::uint32_t(count);
  const std::uint32_t tiles = all / PLACES_TILE + 1;
  auto& rooms = parts_->rooms;
  refresh(gpu, rooms.alone, places_source(PLACES_HITS));
  buffer_for(rooms.appended, gpu, 1, "sum of lists").record_upload(std::vector<AppendedLists>(1));
  rooms.alone->bind(BIND_HITS, hits);
  rooms.alone->bind(BIND_RECORDS, to);
  rooms.alone->bind(BIND_CROSSINGS, numbers);
  rooms.alone->bind(BIND_APPENDED, *rooms.appended);
  rooms.alone->bind(BIND_TILES, buffer_for(rooms.tiles, gpu, 2 * std::size_t(tiles), "sums of lists"));
  const auto room = std::uint32_t(std::min<std::uint64_t>({to.size(), numbers.size(), ~0u}));
  for (const std::uint32_t step : {PLACES_TILES, PLACES_SUM, PLACES_PLACE})
    gpu.pass(
        rooms.alone->name(),
        [&](Commands& cmd) {
          rooms.alone->dispatch(cmd, step == PLACES_SUM ? 1 : tiles, PlacesPush{all, tiles, step, row, room});
        },
        [&](double ms) { found.times.device_ms += ms; });
  found.times.dispatches = 3;
  AppendedLists sum{};
  rooms.appended->download(std::span(&sum, 1));
  found.records = sum.low;
  return found;
}

}  // namespace ballot
