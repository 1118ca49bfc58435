#include "tools/bench/csv.h"
#include "tools/verify/report.h"

namespace ballot::verify {

namespace {

using bench::Accuracy;
using bench::csv_number;

std::string text_of(bool truth) { return truth ? "true" : "false"; }

void add_accuracy(std::vector<std::string>& cells, const Accuracy& a) {
  for (const std::uint64_t n : {a.false_misses, a.false_hits, a.wrong_prims, a.ties, a.wrong_values, a.within_bound,
                                a.beyond_bound, a.unwritten, a.self_hits, a.beyond_range})
    cells.push_back(std::to_string(n));
  for (const double ulp : {a.t_ulp_median, a.t_ulp_p99, a.t_ulp_max}) cells.push_back(csv_number(ulp));
  cells.push_back(a.image_rmse ? csv_number(*a.image_rmse) : "");
}

/// Returns the cells that identify a line, which a Record and a HardRecord share.
template <class R>
std::vector<std::string> name_cells(const bench::Document& d, const std::string& scene, const std::string& view,
                                    const R& r) {
  return {d.device, d.driver, scene, view, r.rays, text_of(r.any), r.label, r.method, bench::knobs_text(r.knobs),
          r.numeric};
}

std::string record_line(const bench::Document& d, const bench::Record& r) {
  std::vector<std::string> cells = name_cells(d, r.scene, r.view, r);
  cells.insert(cells.end(), {std::to_string(r.ray_count), csv_number(r.mrays_per_s()), csv_number(r.trace.median)});
  add_accuracy(cells, *r.accuracy);
  cells.insert(cells.end(), {"", "", ""});
  return bench::csv_line(cells);
}

std::string hard_line(const bench::Document& d, const bench::HardRecord& r) {
  std::vector<std::string> cells = name_cells(d, "hard/" + r.name, "", r);
  cells.insert(cells.end(), {std::to_string(r.accuracy.rays), "", ""});
  add_accuracy(cells, r.accuracy);
  for (const std::uint64_t n : {r.leaks, r.unlike, r.differing}) cells.push_back(std::to_string(n));
  return bench::csv_line(cells);
}

}  // namespace

std::string csv_text(const std::vector<bench::Document>& documents) {
  std::string text =
      bench::csv_line({"device",       "driver",       "scene",      "view",        "rays",         "any",
                       "label",        "method",       "knobs",      "numeric",     "ray_count",    "mrays_per_s",
                       "trace_ms",     "false_misses", "false_hits", "wrong_prims", "ties",         "wrong_values",
                       "within_bound", "beyond_bound", "unwritten",  "self_hits",   "beyond_range", "t_ulp_median",
                       "t_ulp_p99",    "t_ulp_max",    "image_rmse", "leaks",       "unlike_known", "differing"});
  for (const bench::Document& d : documents) {
    for (const bench::Record& r : d.records)
      if (r.accuracy) text += record_line(d, r);
    for (const bench::HardRecord& r : d.hard)
      if (r.failed.empty()) text += hard_line(d, r);
  }
  return text;
}

}  // namespace ballot::verify
