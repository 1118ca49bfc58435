#include "engine/trace/auto/auto.h"

#include <algorithm>
#include <array>
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
  /// Names and values; empty: as the tuning table has it. A value of the query takes precedence.
  std::array<std::pair<std::string_view, std::string_view>, 2> knobs = {};
  bool any_only = false;
  bool coherent = false;    // comes second for ray classes that are likely to be coherent
  bool incoherent = false;  // not tried for ray classes that are likely to be coherent
  bool large = false;       // for scenes of is_large() triangles alone
  double entry_s = 0;       // entry_seconds(), measured on lavapipe 22.3.6
};

/// The candidates of method auto: those that measured best somewhere (tools/measured/traversal.md, "How far auto is
/// from the best method in hindsight"). They are tried in this order, but for `coherent`. On CPUs, where a run has no
/// time to compile more than two or three, the first is the one that compiles fastest: it serves all rays before the
/// choice. The second is for incoherent rays or, if the class is likely to be coherent, for coherent ones. packet-wide
/// with two rays a lane compiles in 0.4 of the time of eight, at 0.7 to 0.95 of the speed. packet-wide with fallback is
/// no candidate: it compiles longer than either, and was best by more than 3 % in 1 of 70 pairs of scene and ray class.
/// On GPUs leaves one at a time (leaf_run=0) pay in scenes of large triangles.
constexpr CandidateRow kCandidateRows[] = {
    {.cpu = true, .method = "while-while", .entry_s = 0.10},
    {.cpu = true, .method = "bvh4-turns", .entry_s = 0.15},
    {.cpu = true,
     .method = "packet-wide",
     .knobs = {{{"fallback", "0"}, {"rays", "2"}}},
     .coherent = true,
     .entry_s = 0.17},
    {.cpu = true, .method = "dynamic-fetch", .entry_s = 0.12},
    {.cpu = true,
     .method = "bvh4-turns",
     .knobs = {{{"reorder", "1"}}},
     .incoherent = true,
     .large = true,
     .entry_s = 0.2},
    {.cpu = true,
     .method = "while-while",
     .knobs = {{{"reorder", "1"}}},
     .incoherent = true,
     .large = true,
     .entry_s = 0.2},
    {.cpu = true, .method = "packet-wide", .knobs = {{{"fallback", "0"}}}, .entry_s = 0.34},
    {.method = "while-while"},
    {.method = "frontier"},
    {.method = "frontier", .knobs = {{{"sorted", "0"}}}, .any_only = true},
    {.method = "dynamic-fetch"},
    {.method = "bvh8", .incoherent = true},
    {.method = "bvh8", .knobs = {{{"reorder", "1"}}}, .incoherent = true, .large = true},
    {.method = "dynamic-fetch", .knobs = {{{"reorder", "1"}}}, .incoherent = true, .large = true},
    {.method = "bvh8", .knobs = {{{"sorted", "0"}}}, .any_only = true, .incoherent = true},
    {.method = "if-if"},
    {.method = "frontier", .knobs = {{{"frontier", "32"}}}},
    {.method = "while-while", .knobs = {{{"sorted", "0"}}}, .any_only = true},
    {.method = "while-while", .knobs = {{{"leaf_run", "0"}}}},
    {.method = "frontier", .knobs = {{{"leaf_run", "0"}}}},
    {.method = "dynamic-fetch", .knobs = {{{"leaf_run", "0"}}}},
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

/// Returns the kernel configuration of a candidate for the query, or nothing if the method cannot follow a knob or the
/// device cannot run it. Then the reason goes into `why`, unless that has one.
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

/// Returns true if the candidate has this value of a knob, or if the knob has no name.
bool has_knob(const Candidate& candidate, const std::pair<std::string_view, std::string_view>& knob) {
  if (knob.first.empty()) return true;
  const auto found = candidate.knobs.find(std::string(knob.first));
  return found != candidate.knobs.end() && found->second == knob.second;
}

}  // namespace

std::string Candidate::name() const {
  std::string text = method;
  for (const auto& [knob, value] : knobs) text += fmt::format(" {}={}", knob, value);
  return text;
}

std::vector<Candidate> candidates_for(const Query& query, const DeviceInfo& device, std::size_t triangles) {
  std::vector<Candidate> candidates;
  std::vector<std::pair<std::string_view, KernelConfig>>
      kernels;  // of the candidates so far; a row that repeats one is left out
  std::string why;
  for (const CandidateRow& row : kCandidateRows) {
    if (row.cpu != device.is_cpu() || (row.any_only && query.want != Want::Any)) continue;
    if (row.incoherent && is_likely_coherent(query.rays)) continue;
    if (row.large && (!is_large(triangles, device) || !can_reorder(device))) continue;
    // In modes that need float64, kernels take seconds to compile, and those over wider trees gain nothing.
    const Method& method = find_method(row.method);
    if (format_of(method.tree).collapsed() && find_numeric(query.numeric).needs_float64) continue;
    Candidate c{std::string(row.method), query.knobs};
    for (const auto& [knob, value] : row.knobs)
      if (!knob.empty()) c.knobs.emplace(knob, value);
    const std::optional<KernelConfig> config = config_on(device, query, c, why);
    if (!config || std::ranges::find(kernels, std::pair{row.method, *config}) != kernels.end()) continue;
    kernels.emplace_back(row.method, *config);
    const bool second = row.coherent && !candidates.empty() && is_likely_coherent(query.rays);
    candidates.insert(second ? candidates.begin() + 1 : candidates.end(), std::move(c));
  }
  if (candidates.empty()) fail(Failure::Arguments, "method auto has nothing to choose from: {}", why);
  return candidates;
}

double entry_seconds(const Candidate& candidate, const DeviceInfo& device) {
  double longest = 0;
  const CandidateRow* nearest = nullptr;  // the row that has the most of the candidate's knobs
  std::ptrdiff_t most = 0;
  for (const CandidateRow& row : kCandidateRows) {
    if (row.cpu != device.is_cpu() || row.method != candidate.method) continue;
    longest = std::max(longest, row.entry_s);
    if (!std::ranges::all_of(row.knobs, [&](const auto& knob) { return has_knob(candidate, knob); })) continue;
    const auto named = std::ranges::count_if(row.knobs, [](const auto& knob) { return !knob.first.empty(); });
    if (named >= most) most = named, nearest = &row;
  }
  return nearest ? nearest->entry_s : longest;
}

Query unmeasured(const Query& query, const DeviceInfo& device) {
  const std::vector<Candidate> candidates = candidates_for(query, device);
  // The plainest method is the reference of a first race.
  const auto plainest = std::ranges::find(candidates, kPlainestMethod, &Candidate::method);
  const Candidate& likely = plainest == candidates.end() ? candidates.front() : *plainest;
  Query concrete = query;
  concrete.method = likely.method;
  concrete.knobs = likely.knobs;
  return concrete;
}

bool Choice::complete() const {
  return std::ranges::all_of(candidates, [](const Candidate& c) { return c.tried || c.put_off_s > 0; });
}

double Choice::paid_s(std::size_t count) const {
  const double batch_s = chosen().mrays_per_s > 0 ? double(count) / chosen().mrays_per_s * 1e-6 : 0;
  return std::max((is_likely_coherent(rays) ? kShareIfCoherent : kShareOfTrials) * since_entry_s,
                  kShareOfTrials * batch_s);
}

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
