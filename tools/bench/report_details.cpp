// The detailed sections of a report: sweeps, counters and checks.
#include <algorithm>
#include <set>

#include "tools/bench/markdown.h"
#include "tools/bench/report.h"

namespace ballot::bench {

namespace {

/// Returns what the sweep records of one sweep share, that is all but the threshold: "cut, vote=sum".
std::string family_of(const Cell& cell) {
  const Record& record = cell.first();
  std::string family = record.method;
  for (const auto& [name, value] : record.knobs)
    if (name != record.threshold->knob) family += fmt::format(", {}={}", name, value);
  return family;
}

std::string sweep_table(const Setting& setting, const std::string& family, const std::string& rays) {
  std::vector<const Block*> blocks;
  std::vector<std::map<double, double>> speeds;  // by block: threshold to Mrays/s
  std::set<double> thresholds;
  std::string knob;
  for (const Block& block : setting.blocks) {
    std::map<double, double> speed;
    for (const Cell& cell : block.sweep) {
      if (block.rays != rays || family_of(cell) != family) continue;
      knob = cell.first().threshold->knob;
      speed[cell.first().threshold->value] = cell.mrays_per_s();
      thresholds.insert(cell.first().threshold->value);
    }
    if (speed.empty()) continue;
    blocks.push_back(&block);
    speeds.push_back(std::move(speed));
  }
  if (blocks.empty()) return "";
  std::vector<std::string> header{family + ", " + rays + ": " + knob};
  for (const Block* block : blocks) header.push_back(block->scene);
  Table table(header);
  for (const double threshold : thresholds) {
    std::vector<std::string> cells{fmt::format("{:g}", threshold)};
    for (const auto& speed : speeds) {
      const auto found = speed.find(threshold);
      const auto best = std::ranges::max_element(speed, {}, [](const auto& entry) { return entry.second; });
      cells.push_back(found == speed.end() ? "-" : found == best ? bold(figure(found->second)) : figure(found->second));
    }
    table.row(std::move(cells));
  }
  return table.text();
}

/// The counters of a cell over all its views: sums over rays, and the largest value of each maximum.
struct Pool {
  std::map<std::string, double> sums;
  double subgroup = 0;

  explicit Pool(const Cell& cell) : subgroup(cell.first().subgroup) {
    for (const auto& [view, record] : cell.views) {
      if (record->counters.empty()) continue;
      sums["rays"] += double(record->ray_count);
      for (const auto& [name, value] : record->counters)
        if (name.ends_with("_max"))
          sums[name] = std::max(sums[name], value);
        else
          sums[name] += value * double(record->ray_count);
    }
  }
  /// Returns `sum` divided by `times` times the sum called `base`; "-" if that is missing or 0.
  std::string over(double sum, const std::string& base, double times = 1) const {
    const auto found = sums.find(base);
    return found == sums.end() || found->second * times == 0 ? "-" : figure(sum / (found->second * times));
  }
};

/// Returns a counter's column title. Counters of events on a packet's shared path are shown relative to their own kind
/// of event, not per ray.
std::string counter_title(const std::string& name) {
  if (name == "switch_depth") return "mean depth of a switch";
  if (name == "disagreements") return "disagreements / votes";
  if (name == "few" || name == "unneeded") return name + " / packet node visits";
  return name;
}

std::string counter_text(const std::string& name, const Pool& pool) {
  const auto found = pool.sums.find(name);
  if (found == pool.sums.end()) return "-";
  const double sum = found->second;
  if (name.ends_with("_max")) return figure(sum);
  if (name == "switch_depth") return pool.over(sum, "switches");
  if (name == "disagreements") return pool.over(sum, "votes");
  if (name == "few" || name == "unneeded") return pool.over(sum, "packet_nodes", 1 / pool.subgroup);
  const auto has = [&](const char* other) { return pool.sums.contains(other); };
  if (name == "active_share" && has("steps") && has("nodes_needed") && has("leaves_needed"))
    return pool.over(pool.sums.at("nodes_needed") + pool.sums.at("leaves_needed"), "steps", pool.subgroup);
  if (name == "packet_share" && has("packet_nodes")) return pool.over(pool.sums.at("packet_nodes"), "nodes");
  return pool.over(sum, "rays");
}

Checked sum_of_checks(const Cell& cell) {
  Checked sum;
  for (const auto& [view, record] : cell.views) {
    if (!record->check) continue;
    const Checked& c = *record->check;
    sum.rays += c.rays;
    sum.same += c.same;
    sum.tie += c.tie;
    sum.false_misses += c.false_misses;
    sum.false_hits += c.false_hits;
    sum.wrong_prims += c.wrong_prims;
    sum.wrong_t += c.wrong_t;
    sum.unwritten += c.unwritten;
  }
  return sum;
}

}  // namespace

std::string sweep_section(const Setting& setting) {
  std::vector<std::string> families;
  for (const Block& block : setting.blocks)
    for (const Cell& cell : block.sweep)
      if (std::ranges::find(families, family_of(cell)) == families.end()) families.push_back(family_of(cell));
  std::string tables;
  for (const std::string& family : families)
    for (const std::string& rays : setting.ray_kinds()) tables += sweep_table(setting, family, rays);
  if (tables.empty()) return "";
  return "## Mrays/s by threshold: " + setting.name + "\n\n" + tables;
}

std::string counter_section(const Setting& setting) {
  std::set<std::string> names;
  for (const Block& block : setting.blocks)
    for (const Cell& cell : block.cells)
      for (const auto& [view, record] : cell.views)
        for (const auto& [name, value] : record->counters) names.insert(name);
  if (names.empty()) return "";
  std::vector<std::string> header{"scene", "rays", "method"};
  for (const std::string& name : names) header.push_back(counter_title(name));
  Table table(header, 3);
  for (const Block& block : setting.blocks)
    for (const Cell& cell : block.cells) {
      const Pool pool(cell);
      if (pool.sums.empty()) continue;
      std::vector<std::string> cells{block.scene, block.rays, cell.label};
      for (const std::string& name : names) cells.push_back(counter_text(name, pool));
      table.row(std::move(cells));
    }
  return "## Counters: " + setting.name +
         "\n\nMeans per ray over all views, unless the title says otherwise. `_share` is between 0 and 1, `_max` is "
         "the "
         "largest value. A node visit of a packet counts once for each full subgroup. `engine/trace/counters.h` "
         "defines "
         "the counters.\n\n" +
         table.text();
}

std::string check_section(const Setting& setting) {
  Table table({"scene", "rays", "method", "rays compared", "same", "ties", "false misses", "false hits", "wrong prims",
               "wrong t", "unwritten"},
              3);
  std::uint64_t rays = 0, errors = 0;
  for (const Block& block : setting.blocks)
    for (const Cell& cell : block.cells) {
      const Checked c = sum_of_checks(cell);
      if (c.rays == 0) continue;
      rays += c.rays;
      errors += c.errors();
      std::vector<std::string> cells{block.scene, block.rays, cell.label};
      for (const std::uint64_t n :
           {c.rays, c.same, c.tie, c.false_misses, c.false_hits, c.wrong_prims, c.wrong_t, c.unwritten})
        cells.push_back(std::to_string(n));
      table.row(std::move(cells));
    }
  if (table.empty()) return "";
  return fmt::format("## Hits checked against the oracle: {}\n\n{} rays compared, {} errors.\n\n", setting.name, rays,
                     errors) +
         table.text();
}

}  // namespace ballot::bench
