#include "engine/trace/auto/auto.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "engine/trace/reorder.h"

namespace ballot {

namespace {

/// A row of the table of candidates.
struct CandidateRow {
  bool cpu = false;
  std::string_view method;
  std::string_view knob = {}, value = {};  // empty: as the tuning table has it; a value of the query takes precedence
  bool any_only = false;
  bool incoherent = false;  // not tried for these
  bool large = false;       // for scenes of is_large() triangles alone
  double entry_s = 0;       // entry_seconds(), measured on lavapipe 22.3.6
};

/// The candidates of method auto: those that measured best somewhere (tools/measured/traversal.md, "How far auto is
/// from the best method in hindsight"). They are tried in this order. On CPUs, where a run has no time to compile more
/// than one or two, those that compile fastest come first: the first serves all rays before the choice, and the others
/// tell how slow the machine is before the slowest is considered. packet-wide with fallback is no candidate: it takes
/// as long to compile as all of these together, and was best by more than 3 % in 1 of 70 pairs of scene and ray class.
/// On GPUs leaves one at a time (leaf_run=0) pay in scenes of large triangles.
constexpr CandidateRow kCandidateRows[] = {
    {.cpu = true, .method = "while-while", .entry_s = 0.10},
    {.cpu = true, .method = "dynamic-fetch", .entry_s = 0.09},
    {.cpu = true, .method = "bvh4-turns", .entry_s = 0.12},
    {.cpu = true, .method = "bvh4-turns", .knob = "reorder", .value = "1", .incoherent = true, .large = true},
    {.cpu = true, .method = "while-while", .knob = "reorder", .value = "1", .incoherent = true, .large = true},
    {.cpu = true, .method = "packet-wide", .knob = "fallback", .value = "0", .entry_s = 0.34},
    {.method = "while-while"},
    {.method = "frontier"},
    {.method = "frontier", .knob = "sorted", .value = "0", .any_only = true},
    {.method = "dynamic-fetch"},
    {.method = "bvh8", .incoherent = true},
    {.method = "bvh8", .knob = "reorder", .value = "1", .incoherent = true, .large = true},
    {.method = "dynamic-fetch", .knob = "reorder", .value = "1", .incoherent = true, .large = true},
    {.method = "bvh8", .knob = "sorted", .value = "0", .any_only = true, .incoherent = true},
    {.method = "if-if"},
    {.method = "frontier", .knob = "frontier", .value = "32"},
    {.method = "while-while", .knob = "sorted", .value = "0", .any_only = true},
    {.method = "while-while", .knob = "leaf_run", .value = "0"},
    {.method = "frontier", .knob = "leaf_run", .value = "0"},
    {.method = "dynamic-fetch", .knob = "leaf_run", .value = "0"},
};

/// Returns true for the ray classes whose neighbours mostly walk alike.
bool is_likely_coherent(std::string_view rays) {
  return rays == "primary" || rays == "shadow" || rays.starts_with("foreign: coherent");
}

/// Returns true for scenes in which it may pay to sort rays without coherence (tools/measured/traversal.md, "Knob
/// reorder"): in smaller ones it seldom does.
bool is_large(std::size_t triangles, const DeviceInfo& device) {
  return triangles >= (device.is_cpu() ? std::size_t(1) << 16 : std::size_t(1) << 22);
}

/// Returns the kernel configuration of a candidate for the query, or nothing if the device cannot run it. Then the
/// reason goes into `why`, unless that has one.
std::optional<KernelConfig> config_on(const DeviceInfo& device, const Query& query, const Candidate& candidate,
                                      std::string& why) {
  try {
    return kernel_config_for(find_method(candidate.method), find_numeric(query.numeric, device), device,
                             candidate.knobs);
  } catch (const Error& e) {
    if (why.empty()) why = e.what();
    return std::nullopt;
  }
}

}  // namespace

std::string Candidate::name() const {
  std::string text = method;
  for (const auto& [knob, value] : knobs) text += fmt::format(" {}={}", knob, value);
  return text;
}

std::vector<Candidate> candidates_for(const Query& query, const DeviceInfo& device, std::size_t triangles) {
  std::vector<Candidate> candidates;
  std::vector<std::pair<std::string_view, KernelConfig>> kernels;  // theirs: a row may ask for what is set anyway
  std::string why;
  for (const CandidateRow& row : kCandidateRows) {
    if (row.cpu != device.is_cpu() || (row.any_only && query.want != Want::Any)) continue;
    if (row.incoherent && is_likely_coherent(query.rays)) continue;
    if (row.large && (!is_large(triangles, device) || !can_reorder(device))) continue;
    // In modes that need float64, kernels take seconds to compile, and those over wider trees gain nothing.
    const Method& method = find_method(row.method);
    if (format_of(method.tree).collapsed() && find_numeric(query.numeric).needs_float64) continue;
    Candidate c{std::string(row.method), query.knobs};
    if (!row.knob.empty()) c.knobs.emplace(row.knob, row.value);
    const std::optional<KernelConfig> config = config_on(device, query, c, why);
    if (!config || std::ranges::find(kernels, std::pair{row.method, *config}) != kernels.end()) continue;
    kernels.emplace_back(row.method, *config);
    candidates.push_back(std::move(c));
  }
  if (candidates.empty()) fail(Failure::Arguments, "method auto has nothing to choose from: {}", why);
  return candidates;
}

double entry_seconds(const Candidate& candidate, const DeviceInfo& device) {
  for (const CandidateRow& row : kCandidateRows)
    if (row.cpu == device.is_cpu() && row.method == candidate.method) return row.entry_s;
  return 0;
}

Query unmeasured(const Query& query, const DeviceInfo& device) {
  const std::vector<Candidate> candidates = candidates_for(query, device);
  const Candidate* likely = &candidates.front();
  for (const Candidate& c : candidates)
    if (c.method == kPlainestMethod) likely = &c;  // it compiles fastest
  Query concrete = query;
  concrete.method = likely->method;
  concrete.knobs = likely->knobs;
  return concrete;
}

bool Choice::complete() const {
  return std::ranges::all_of(candidates, [](const Candidate& c) { return c.tried || c.put_off_s > 0; });
}

double Choice::paid_s() const { return (is_likely_coherent(rays) ? kShareForPackets : kShareOfTrials) * since_entry_s; }

bool Choice::pays(double time_s) const {
  return std::ranges::any_of(candidates, [&](const Candidate& c) { return c.put_off_s > 0 && c.put_off_s <= time_s; });
}

int Choice::runs_left() const { return std::max(1, kRunsOfTrials + 1 - runs); }

Query Choice::apply(Query query) const {
  query.method = chosen().method;
  query.knobs = chosen().knobs;
  return query;
}

}  // namespace ballot
