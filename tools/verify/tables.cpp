#include "tools/verify/tables.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/bench/markdown.h"

namespace ballot::verify {

namespace {

using bench::Accuracy;
using bench::Table;

/// Puts the platform's name before the text if there are several platforms.
std::string titled(const std::vector<Platform>& platforms, const Platform& platform, const std::string& text) {
  return platforms.size() == 1 ? text : platform.name + ": " + text;
}

/// Returns the modes of all platforms, each once.
std::vector<std::string> modes_of(const std::vector<Platform>& platforms) {
  std::vector<std::string> all;
  for (const Platform& platform : platforms)
    for (const std::string& mode : platform.modes())
      if (std::ranges::find(all, mode) == all.end()) all.push_back(mode);
  return all;
}

std::string count_or_rate(std::uint64_t n, std::uint64_t rays) {
  return n == 0 ? "0" : rate_text(per_million(n, rays));
}

const Place* find_place(const Platform& platform, const std::string& scene, const std::string& rays) {
  for (const Place& place : platform.places)
    if (place.scene == scene && place.rays == rays) return &place;
  return nullptr;
}

}  // namespace

std::string count_text(std::uint64_t n) {
  if (n >= 999'950'000) return fmt::format("{:.1f} billion", double(n) * 1e-9);
  if (n >= 999'950) return fmt::format("{:.1f} million", double(n) * 1e-6);
  return std::to_string(n);
}

std::string rate_text(double rate) {
  if (rate == 0) return "0";
  if (rate < 0.01 || rate >= 1e6) return fmt::format("{:.1e}", rate);
  return fmt::format("{:.{}f}", rate, rate < 1 ? 2 : rate < 99.95 ? 1 : 0);
}

std::string place_table(const Place& place) {
  const bool image =
      std::ranges::any_of(place.rows, [](const Row& row) { return row.accuracy.image_rmse.has_value(); });
  std::vector<std::string> header{fmt::format("{}, {}", place.scene, place.rays),
                                  "mode",
                                  "Mrays/s",
                                  "rays",
                                  "false misses",
                                  "false hits",
                                  "wrong prims",
                                  "ties",
                                  "wrong values",
                                  "beyond bound",
                                  "t ulp: median",
                                  "p99",
                                  "max",
                                  "self hits"};
  const bool beyond = std::ranges::any_of(place.rows, [](const Row& row) { return row.accuracy.beyond_range > 0; });
  if (beyond) header.emplace_back("beyond range");
  if (image) header.emplace_back("image RMSE");
  Table table(header, 2);
  for (const Row& row : place.rows) {
    const Accuracy& a = row.accuracy;
    std::vector<std::string> cells{row.label, row.numeric, bench::figure(row.cell.mrays_per_s())};
    for (const std::uint64_t n :
         {a.rays, a.false_misses, a.false_hits, a.wrong_prims, a.ties, a.wrong_values, a.beyond_bound})
      cells.push_back(std::to_string(n));
    for (const double ulp : {a.t_ulp_median, a.t_ulp_p99, a.t_ulp_max}) cells.push_back(rate_text(ulp));
    cells.push_back(std::to_string(a.self_hits));
    if (beyond) cells.push_back(std::to_string(a.beyond_range));
    if (image) cells.push_back(a.image_rmse ? rate_text(*a.image_rmse) : "");
    table.row(std::move(cells));
  }
  return table.text();
}

std::string mode_table(const std::vector<Platform>& platforms) {
  const bool several = platforms.size() > 1;
  std::vector<std::string> header{"mode"};
  if (several) header.emplace_back("device");
  for (const char* title : {"time, median", "time, worst", "answers", "wrong per million", "of these beyond bound",
                            "ties per million", "t ulp: p99", "max", "self hits per million", "unwritten"})
    header.emplace_back(title);
  Table table(header, several ? 2 : 1);
  for (const std::string& mode : modes_of(platforms))
    for (const Platform& platform : platforms) {
      const Accuracy total = total_of(platform, mode);
      if (total.rays == 0) continue;
      const std::string base = base_mode(platform);
      const auto cost = cost_of(platform, mode, base);
      std::vector<std::string> cells{mode};
      if (several) cells.push_back(platform.name);
      if (mode == base)
        cells.insert(cells.end(), {"base", ""});
      else if (cost)
        cells.insert(cells.end(),
                     {bench::percent(cost->median), bench::percent(cost->worst) + " (" + cost->where + ")"});
      else
        cells.insert(cells.end(), {"", ""});
      cells.push_back(count_text(total.rays));
      for (const std::uint64_t n : {total.wrong(), total.beyond_bound, total.ties})
        cells.push_back(count_or_rate(n, total.rays));
      cells.push_back(rate_text(total.t_ulp_p99));
      cells.push_back(rate_text(total.t_ulp_max));
      cells.push_back(count_or_rate(total.self_hits, total.rays));
      cells.push_back(std::to_string(total.unwritten));
      table.row(std::move(cells));
    }
  return table.empty() ? "" : table.text();
}

std::string rate_table(const std::vector<Platform>& platforms) {
  std::vector<std::string> header{"scene", "rays"};
  std::vector<std::pair<std::string, std::string>> places;
  for (const Platform& platform : platforms) {
    for (const std::string& mode : platform.modes()) header.push_back(titled(platforms, platform, mode));
    for (const Place& place : platform.places)
      if (std::ranges::find(places, std::pair(place.scene, place.rays)) == places.end())
        places.emplace_back(place.scene, place.rays);
  }
  Table table(header, 2);
  for (const auto& [scene, rays] : places) {
    std::vector<std::string> cells{scene, rays};
    for (const Platform& platform : platforms) {
      const Place* place = find_place(platform, scene, rays);
      for (const std::string& mode : platform.modes()) {
        const Row* row = place ? worst_row(*place, mode) : nullptr;
        if (!row) {
          cells.emplace_back();
          continue;
        }
        const Accuracy& a = row->accuracy;
        cells.push_back(count_or_rate(a.wrong(), a.rays) +
                        (a.beyond_bound ? " (" + count_or_rate(a.beyond_bound, a.rays) + ")" : ""));
      }
    }
    table.row(std::move(cells));
  }
  return table.empty() ? "" : table.text();
}

}  // namespace ballot::verify
