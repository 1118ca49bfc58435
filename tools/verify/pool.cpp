#include "tools/verify/pool.h"

#include <algorithm>
#include <cmath>

namespace ballot::verify {

namespace {

constexpr std::string_view kCheapest = "fast";

Platform& platform_of(std::vector<Platform>& platforms, const bench::Document* document) {
  for (Platform& platform : platforms)
    if (bench::same_platform(*platform.document, *document)) return platform;
  return platforms.emplace_back(Platform{{}, document, {}});
}

Place& place_of(Platform& platform, const bench::Block& block) {
  for (Place& place : platform.places)
    if (place.scene == block.scene && place.rays == block.rays) return place;
  return platform.places.emplace_back(Place{block.scene, block.rays, {}});
}

/// Makes a row of the cell's views that were verified; none if there are none.
std::optional<Row> row_of(const bench::Cell& cell, const std::string& numeric) {
  Row row{cell.label, numeric, {cell.label, cell.role, {}}, {}};
  for (const auto& [view, record] : cell.views)
    if (record->accuracy) {
      row.cell.views[view] = record;
      row.accuracy.add(*record->accuracy);
    }
  return row.cell.views.empty() ? std::nullopt : std::optional(std::move(row));
}

/// Sorts the rows so that the modes of one entry are next to each other.
void sort_by_entry(std::vector<Row>& rows) {
  std::vector<std::string> labels;
  for (const Row& row : rows)
    if (std::ranges::find(labels, row.label) == labels.end()) labels.push_back(row.label);
  std::ranges::stable_sort(rows, {}, [&](const Row& row) { return std::ranges::find(labels, row.label); });
}

double median_of(const std::vector<double>& values) { return bench::quantile(values, 0.5); }

}  // namespace

std::vector<std::string> Platform::modes() const {
  std::vector<std::string> found, ordered;
  for (const Place& place : places)
    for (const Row& row : place.rows)
      if (std::ranges::find(found, row.numeric) == found.end()) found.push_back(row.numeric);
  for (const NumericMode& mode : kNumericModes)
    if (std::ranges::find(found, mode.name) != found.end()) ordered.emplace_back(mode.name);
  for (const std::string& mode : found)
    if (std::ranges::find(ordered, mode) == ordered.end()) ordered.push_back(mode);
  return ordered;
}

std::vector<Platform> platforms_of(const std::vector<bench::Document>& documents) {
  std::vector<Platform> platforms;
  for (const bench::Setting& setting : bench::arrange(documents).settings)
    for (const bench::Block& block : setting.blocks)
      for (const bench::Cell& cell : block.cells)
        if (auto row = row_of(cell, setting.numeric))
          place_of(platform_of(platforms, setting.document), block).rows.push_back(*std::move(row));
  std::vector<std::string> names;
  std::vector<const bench::Document*> firsts;
  for (Platform& platform : platforms) {
    for (Place& place : platform.places) sort_by_entry(place.rows);
    names.push_back(platform.document->device);
    firsts.push_back(platform.document);
  }
  bench::tell_apart(names, firsts);
  for (std::size_t i = 0; i < platforms.size(); ++i) platforms[i].name = names[i];
  return platforms;
}

bench::Accuracy total_of(const Platform& platform, const std::string& numeric) {
  bench::Accuracy total;
  for (const Place& place : platform.places)
    for (const Row& row : place.rows)
      if (row.numeric == numeric) total.add(row.accuracy);
  return total;
}

const Row* worst_row(const Place& place, const std::string& numeric) {
  const Row* worst = nullptr;
  const auto rate = [](const Row& r) { return per_million(r.accuracy.wrong(), r.accuracy.rays); };
  for (const Row& row : place.rows)
    if (row.numeric == numeric && (!worst || rate(row) > rate(*worst))) worst = &row;
  return worst;
}

std::optional<Cost> cost_of(const Platform& platform, const std::string& numeric, const std::string& base) {
  std::vector<double> ratios;
  Cost cost;
  for (const Place& place : platform.places)
    for (const Row& row : place.rows)
      for (const Row& other : place.rows) {
        if (row.numeric != numeric || other.numeric != base || row.label != other.label) continue;
        const auto ratio = bench::time_ratio(row.cell, other.cell);
        if (!ratio) continue;
        if (ratios.empty() || *ratio > cost.worst) {
          cost.worst = *ratio;
          cost.where = fmt::format("{}, {}, {}", place.scene, place.rays, row.label);
        }
        ratios.push_back(*ratio);
      }
  if (ratios.empty()) return std::nullopt;
  cost.median = median_of(ratios);
  cost.cases = ratios.size();
  return cost;
}

std::string base_mode(const Platform& platform) {
  const auto modes = platform.modes();
  if (modes.empty()) return "";
  if (std::ranges::find(modes, kCheapest) != modes.end()) return std::string(kCheapest);
  const auto median = [&](const std::string& mode) {
    const auto cost = cost_of(platform, mode, modes.front());
    return cost ? cost->median : 1;
  };
  return *std::ranges::min_element(modes, {}, median);
}

double per_million(std::uint64_t n, std::uint64_t rays) { return rays == 0 ? 0 : 1e6 * double(n) / double(rays); }

}  // namespace ballot::verify
