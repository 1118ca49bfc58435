// Crossings by the values of an attribute.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/api/crossings.h"
#include "engine/api/mesh_attributes.h"
#include "engine/core/parallel.h"

namespace ballot::api {
namespace {

constexpr std::size_t kRowsAtOnce = 1 << 16;
constexpr Hit kNone{std::numeric_limits<float>::infinity(), NO_HIT, 0, 0};

/// Throws Refused unless some mesh has an attribute of this name, of one number.
void check_value(const SceneState& scene, const std::string& name) {
  const MeshAttribute* attribute = find_attribute(scene, name);
  if (!attribute)
    refuse(fmt::format("value: no mesh has an attribute '{}'; there are: {}", name, attribute_names(scene)));
  if (attribute->components != 1)
    refuse(fmt::format("value: attribute '{}' has {} numbers; expected one", name, attribute->components));
}

/// The crossings of all rays, one ray's after the other, and their values.
struct Valued {
  std::vector<std::uint32_t> counts;
  std::vector<Hit> hits;
  std::vector<float> values;
};

/// Writes the hits of the largest values to a row, the largest first, of equal ones the first.
void choose(std::span<const Hit> hits, std::span<const float> values, std::span<Hit> row) {
  constexpr std::size_t kMost = 16;  // of a row
  std::array<float, kMost> kept{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const float value = std::isnan(values[i]) ? -std::numeric_limits<float>::infinity() : values[i];
    std::size_t place = count;
    while (place > 0 && kept[place - 1] < value) --place;
    if (place == row.size()) continue;
    count = std::min(count + 1, row.size());
    for (std::size_t k = count - 1; k > place; --k) row[k] = row[k - 1], kept[k] = kept[k - 1];
    row[place] = hits[i], kept[place] = value;
  }
}

/// Passes rows of the strongest hits on.
void pass_rows(const Valued& all, std::uint32_t most, const TakeFirst& take) {
  std::vector<std::size_t> begins;
  std::vector<Hit> rows;
  for (std::size_t first = 0, next = 0; first < all.counts.size(); first += kRowsAtOnce) {
    const std::size_t count = std::min(kRowsAtOnce, all.counts.size() - first);
    begins.assign(1, next);
    for (std::size_t i = 0; i < count; ++i) begins.push_back(next += all.counts[first + i]);
    rows.assign(count * most, kNone);
    for_chunks(count, kChunk, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        const std::size_t begin = begins[i], some = begins[i + 1] - begin;
        choose(std::span(all.hits).subspan(begin, some), std::span(all.values).subspan(begin, some),
               std::span(rows).subspan(i * most, most));
      }
    });
    take(first, rows);
  }
}

}  // namespace

TraceTimes strongest_crossings(SceneState& scene, const RaySource& rays, const BallotQuery& query,
                               const CrossingQuery& how, const TakeFirst& take) {
  const std::string name = query.value.text;
  check_value(scene, name);
  Valued all;
  const auto keep = [&](std::uint64_t, std::span<const std::uint32_t> counts, std::span<const Hit> hits) {
    all.counts.insert(all.counts.end(), counts.begin(), counts.end());
    all.hits.insert(all.hits.end(), hits.begin(), hits.end());
  };
  TraceTimes spent = scene.world->rays().list(rays, keep, how);
  all.values.resize(all.hits.size());
  const WantedValues wanted[] = {{name, all.values.data()}};
  MadeColumns made(BALLOT_INIT(BallotHits), wanted, scene, RowOrder(), all.hits.size());
  made.add(0, all.hits);
  made.end(spent);
  pass_rows(all, query.strongest, take);
  return spent;
}

}  // namespace ballot::api
