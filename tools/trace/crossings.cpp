#include "tools/trace/crossings.h"

#include <algorithm>

namespace ballot::cli {

namespace {

/// A crossing as files have it.
struct Record {
  std::uint32_t ray;
  Hit hit;
};
static_assert(sizeof(Record) == 20);

RaySource source_of(RayFile& file, const CrossingsWanted& want, const Progress& progress) {
  RaySource source;
  source.count = file.count();
  source.read = [&file](std::uint64_t, std::span<Ray> room) {
    const std::size_t some = file.read(room);
    if (some < room.size()) fail(Failure::Work, "rays were asked for beyond the end of their file");
  };
  if (!want.ray_masks.empty())
    source.filters.of[FILTER_MASK] = [&want](std::uint64_t first, std::span<std::uint32_t> room) {
      std::ranges::copy(want.ray_masks.subspan(std::size_t(first), room.size()), room.begin());
    };
  source.progress = [&progress, count = file.count()](std::uint64_t done) { progress(double(done) / double(count)); };
  return source;
}

CrossingTrace count_crossings(DeviceScene& world, RayFile& file, const std::string& to, const CrossingsWanted& want,
                              const Progress& progress) {
  CrossingTrace result;
  std::vector<std::uint32_t> counts;
  file.ask(world.recentring());
  const RaySource source = source_of(file, want, progress);
  counts.reserve(std::size_t(source.count));
  const auto take = [&](std::uint64_t, std::span<const std::uint32_t> some) {
    for (const std::uint32_t n : some) result.crossings += n;
    counts.insert(counts.end(), some.begin(), some.end());
  };
  result.times = world.rays().count(source, take, want.query);
  write_numbers(to, std::span<const std::uint32_t>(counts));
  return result;
}

CrossingTrace list_crossings(DeviceScene& world, RayFile& file, const std::string& to, const CrossingsWanted& want,
                             const Progress& progress) {
  CrossingTrace result;
  const std::shared_ptr<MovedRays> moved = file.ask(world.recentring());
  const RaySource source = source_of(file, want, progress);
  std::vector<Hit> told;
  write_atomically(to, [&](OutputFile& out) {
    std::string start = crossings_start(0);
    out.write(start.data(), start.size());
    std::vector<Record> records;
    const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Hit> hits) {
      records.clear();
      told.assign(hits.begin(), hits.end());
      moved->tell_as_given(counts, told);
      std::size_t next = 0;
      for (std::size_t i = 0; i < counts.size(); ++i)
        for (std::uint32_t k = 0; k < counts[i]; ++k) records.push_back({std::uint32_t(first + i), told[next++]});
      out.write(records.data(), records.size() * sizeof(Record));
      result.crossings += records.size();
    };
    std::vector<std::uint32_t> counts;
    std::vector<Hit> met;
    const auto take_rows = [&](std::uint64_t first, std::span<const Hit> rows) {
      counts.assign(rows.size() / want.last, 0), met.clear();
      for (std::size_t i = 0; i < rows.size(); ++i)
        if (rows[i].prim != NO_HIT) ++counts[i / want.last], met.push_back(rows[i]);
      take(first, counts, met);
    };
    result.times = want.last ? world.rays().first(source, want.last, take_rows, want.query)
                             : world.rays().list(source, take, want.query);
    start = crossings_start(result.crossings);
    out.seek(0);
    out.write(start.data(), start.size());
  });
  return result;
}

CrossingTrace first_crossings(DeviceScene& world, RayFile& file, const std::string& to, const CrossingsWanted& want,
                              const Progress& progress) {
  CrossingTrace result;
  const std::shared_ptr<MovedRays> moved = file.ask(world.recentring());
  const RaySource source = source_of(file, want, progress);
  std::vector<Hit> told;
  write_atomically(to, [&](OutputFile& out) {
    const std::string start = hits_start(source.count);
    out.write(start.data(), start.size());
    const auto take = [&](std::uint64_t, std::span<const Hit> hits) {
      for (const Hit& hit : hits) result.crossings += hit.prim != NO_HIT;
      told.assign(hits.begin(), hits.end());
      moved->tell_as_given(told);
      out.write(told.data(), told.size() * sizeof(Hit));
    };
    result.times = world.rays().first(source, 1, take, want.query);
  });
  return result;
}

}  // namespace

CrossingTrace trace_crossings(DeviceScene& world, RayFile from, const std::string& to, const CrossingsWanted& want,
                              const Progress& progress) {
  const std::uint64_t rays = from.count();
  if (!want.ray_masks.empty() && want.ray_masks.size() != rays)
    fail(Failure::Arguments, "--ray-masks: found {} masks; expected one for each of the {} rays", want.ray_masks.size(),
         rays);
  const auto answer = want.as == CrossingsWanted::Counts  ? count_crossings
                      : want.as == CrossingsWanted::Lists ? list_crossings
                                                          : first_crossings;
  CrossingTrace result = answer(world, from, to, want, progress);
  result.rays = rays;
  result.dead = from.dead();
  return result;
}

}  // namespace ballot::cli
