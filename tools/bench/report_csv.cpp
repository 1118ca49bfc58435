#include <set>

#include "tools/bench/csv.h"
#include "tools/bench/report.h"

namespace ballot::bench {

namespace {

void add_times(std::vector<std::string>& cells, const Times* times) {
  for (const auto field : {&Times::median, &Times::p10, &Times::p90})
    cells.push_back(times ? csv_number(times->*field) : "");
}

void add_check(std::vector<std::string>& cells, const Checked* c) {
  for (const auto field : {&Checked::rays, &Checked::same, &Checked::tie, &Checked::false_misses, &Checked::false_hits,
                           &Checked::wrong_prims, &Checked::wrong_t, &Checked::unwritten})
    cells.push_back(c ? std::to_string(c->*field) : "");
}

std::string record_line(const Document& d, const Record& r, const std::set<std::string>& counters) {
  std::vector<std::string> cells{d.device,
                                 d.driver,
                                 d.clock,
                                 r.numeric,
                                 r.scene,
                                 r.view,
                                 r.rays,
                                 r.any ? "true" : "false",
                                 r.label,
                                 role_name(r.role),
                                 r.method,
                                 knobs_text(r.knobs),
                                 r.threshold ? csv_number(r.threshold->value) : "",
                                 r.variant,
                                 std::to_string(r.workgroup),
                                 std::to_string(r.subgroup),
                                 std::to_string(r.resident_lanes),
                                 std::to_string(r.ray_count),
                                 csv_number(r.mrays_per_s())};
  add_times(cells, &r.trace);
  add_times(cells, r.frame ? &*r.frame : nullptr);
  add_check(cells, r.check ? &*r.check : nullptr);
  for (const std::string& name : counters)
    cells.push_back(r.counters.contains(name) ? csv_number(r.counters.at(name)) : "");
  return csv_line(cells);
}

}  // namespace

std::string csv_text(const std::vector<Document>& documents) {
  std::set<std::string> counters;
  for (const Document& d : documents)
    for (const Record& r : d.records)
      for (const auto& [name, value] : r.counters) counters.insert(name);
  std::vector<std::string> header{
      "device",       "driver",     "clock",          "numeric",      "scene",        "view",         "rays",
      "any",          "label",      "role",           "method",       "knobs",        "threshold",    "variant",
      "workgroup",    "subgroup",   "resident_lanes", "ray_count",    "mrays_per_s",  "trace_ms",     "trace_p10_ms",
      "trace_p90_ms", "frame_ms",   "frame_p10_ms",   "frame_p90_ms", "checked_rays", "checked_same", "checked_ties",
      "false_misses", "false_hits", "wrong_prims",    "wrong_t",      "unwritten"};
  for (const std::string& name : counters) header.push_back("counter_" + name);
  std::string text = csv_line(header);
  for (const Document& d : documents)
    for (const Record& r : d.records) text += record_line(d, r, counters);
  return text;
}

}  // namespace ballot::bench
