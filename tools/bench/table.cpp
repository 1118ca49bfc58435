#include "tools/bench/table.h"

#include <algorithm>
#include <cmath>

#include "tools/bench/markdown.h"

namespace ballot::bench {

namespace {

/// The sums over the views of an entry.
struct Row {
  const Record* first;
  std::size_t views = 0, frames = 0;
  double rays = 0, ms = 0, fps = 0;
  ErrorFigures errors;
  double squares = 0;  // of errors of the picture

  double mrays_per_s() const { return rays / ms * 1e-3; }
  void add(const Record& r) {
    ++views;
    rays += double(r.ray_count);
    ms += r.trace.median;
    if (r.frame) ++frames, fps += 1000 / r.frame->median;
    if (r.errors) bench::add(errors, *r.errors);
    if (r.image_rmse) squares += *r.image_rmse * *r.image_rmse * double(r.ray_count);
  }
};

std::vector<Row> rows_of(std::span<const Record> records) {
  std::vector<Row> rows;
  for (const Record& r : records) {
    if (r.role == Role::Sweep) continue;
    auto row = std::ranges::find_if(
        rows, [&](const Row& other) { return other.first->label == r.label && other.first->numeric == r.numeric; });
    if (row == rows.end()) row = rows.insert(rows.end(), Row{.first = &r, .errors = {}});
    row->add(r);
  }
  return rows;
}

std::string title_of(const Record& r) {
  if (r.runs != r.method) return fmt::format("{} ({})", r.label, r.runs);
  if (r.role == Role::Best) return fmt::format("{} {}={:g}", r.label, r.threshold->knob, r.threshold->value);
  return r.label;
}

std::vector<std::string> speed_cells(const Row& row, const std::vector<Row>& rows) {
  double best = 0;
  std::size_t views = 0;
  for (const Row& other : rows) views = std::max(views, other.views);
  for (const Row& other : rows)
    if (other.first->numeric == row.first->numeric && other.views == views) best = std::max(best, other.mrays_per_s());
  const double speed = row.mrays_per_s();
  return {figure(row.ms), row.frames ? figure(row.fps / double(row.frames)) : "",
          row.views < views ? "lacks views" : fmt::format("{:.0f} %{}", 100 * speed / best, speed == best ? " *" : "")};
}

std::vector<std::string> error_cells(const Row& row) {
  const ErrorFigures& e = row.errors;
  std::vector<std::string> cells;
  for (const std::uint64_t n : {e.rays, e.false_misses, e.false_hits, e.wrong_prims, e.ties, e.wrong_values,
                                e.beyond_bound, e.beyond_range, e.self_hits})
    cells.push_back(std::to_string(n));
  for (const double ulp : {e.t_ulp.median, e.t_ulp.p99, e.t_ulp.max}) cells.push_back(fmt::format("{:.3g}", ulp));
  cells.push_back(row.first->image_rmse ? fmt::format("{:.2g}", std::sqrt(row.squares / row.rays)) : "");
  return cells;
}

}  // namespace

std::string block_table(std::span<const Record> records) {
  const std::vector<Row> rows = rows_of(records);
  if (rows.empty()) return "";
  const Record& first = *rows.front().first;
  std::vector<std::string> header{fmt::format("{}, {}{}", first.scene, first.rays, first.any ? ", any hit" : ""),
                                  "mode", "Mrays/s"};
  if (first.errors)
    header.insert(header.end(),
                  {"rays", "false misses", "false hits", "wrong prims", "ties", "wrong values", "beyond bound",
                   "beyond range", "self hits", "t ulp: median", "p99", "max", "image RMSE"});
  else
    header.insert(header.end(), {"ms", "FPS", "of best"});
  Table table(header, 2);
  for (const Row& row : rows) {
    std::vector<std::string> cells{title_of(*row.first), row.first->numeric, figure(row.mrays_per_s())};
    const auto more = first.errors ? error_cells(row) : speed_cells(row, rows);
    cells.insert(cells.end(), more.begin(), more.end());
    table.row(std::move(cells));
  }
  return table.text();
}

}  // namespace ballot::bench
