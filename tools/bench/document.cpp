#include "tools/bench/document.h"

#include <algorithm>
#include <cmath>

namespace ballot::bench {

namespace {

struct Count {
  const char* name;
  std::uint64_t ErrorFigures::*member;
};
constexpr Count kCounts[] = {
    {"false_misses", &ErrorFigures::false_misses}, {"false_hits", &ErrorFigures::false_hits},
    {"wrong_prims", &ErrorFigures::wrong_prims},   {"ties", &ErrorFigures::ties},
    {"wrong_values", &ErrorFigures::wrong_values}, {"within_bound", &ErrorFigures::within_bound},
    {"beyond_bound", &ErrorFigures::beyond_bound}, {"unwritten", &ErrorFigures::unwritten},
    {"self_hits", &ErrorFigures::self_hits},       {"beyond_range", &ErrorFigures::beyond_range},
};

const char* role_name(Role role) { return role == Role::Method ? "method" : role == Role::Sweep ? "sweep" : "best"; }

nlohmann::json times_json(const Times& times) {
  return {{"median", times.median}, {"p10", times.p10}, {"p90", times.p90}, {"samples", times.samples}};
}

nlohmann::json check_json(const HitCheck& check) {
  const Judgement& j = check.judgement;
  return {{"rays", j.rays},
          {"same", j.same},
          {"tie", j.tie},
          {"false_misses", j.false_miss},
          {"false_hits", j.false_hit},
          {"wrong_prims", j.wrong_prim},
          {"wrong_t", j.wrong_t},
          {"unwritten", check.unwritten}};
}

nlohmann::json case_json(const ErrorCase& c) {
  const Ray& r = c.ray;
  return {{"index", c.index},
          {"kind", name_of(c.kind)},
          {"within_bound", c.within_bound},
          {"reason", c.reason},
          {"ray", {r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, r.t_max}},
          {"answer", {{"t", c.answer.t}, {"prim", c.answer.prim}, {"u", c.answer.u}, {"v", c.answer.v}}},
          {"truth", {{"t", c.truth.t}, {"prim", c.truth.prim}}}};
}

void add_errors(nlohmann::json& record, const ErrorFigures& errors) {
  record["verified_rays"] = errors.rays;
  for (const Count& count : kCounts) record[count.name] = errors.*count.member;
  record["t_ulp"] = {{"median", errors.t_ulp.median}, {"p99", errors.t_ulp.p99}, {"max", errors.t_ulp.max}};
  record["cases"] = nlohmann::json::array();
  for (const ErrorCase& c : errors.cases) record["cases"].push_back(case_json(c));
}

nlohmann::json record_json(const Record& r) {
  nlohmann::json json{{"scene", r.scene},
                      {"view", r.view},
                      {"rays", r.rays},
                      {"any", r.any},
                      {"label", r.label},
                      {"role", role_name(r.role)},
                      {"method", r.method},
                      {"runs", r.runs},
                      {"knobs", r.knobs},
                      {"numeric", r.numeric},
                      {"variant", r.variant},
                      {"workgroup", r.workgroup},
                      {"subgroup", r.subgroup},
                      {"resident_lanes", r.resident_lanes},
                      {"ray_count", r.ray_count},
                      {"mrays_per_s", double(r.ray_count) / r.trace.median * 1e-3},
                      {"trace_ms", times_json(r.trace)}};
  if (r.threshold) json["threshold"] = {{"knob", r.threshold->knob}, {"value", r.threshold->value}};
  if (r.frame) json["frame_ms"] = times_json(*r.frame);
  if (!r.counters.empty()) json["counters"] = r.counters;
  if (r.check) json["check"] = check_json(*r.check);
  if (r.errors) add_errors(json, *r.errors);
  if (r.image_rmse) json["image_rmse"] = *r.image_rmse;
  return json;
}

nlohmann::json hard_json(const HardRecord& r) {
  nlohmann::json json{{"case", r.name},
                      {"from", r.from},
                      {"what", r.what},
                      {"rays", r.rays},
                      {"any", r.any},
                      {"closed", r.closed},
                      {"label", r.label},
                      {"method", r.method},
                      {"knobs", r.knobs},
                      {"numeric", r.numeric},
                      {"ray_count", r.errors.rays},
                      {"leaks", r.leaks},
                      {"unlike_known", r.unlike},
                      {"differing", r.differing}};
  if (!r.failed.empty()) json["failed"] = r.failed;
  add_errors(json, r.errors);
  return json;
}

}  // namespace

void add(ErrorFigures& sum, const ErrorFigures& other) {
  sum.rays += other.rays;
  for (const Count& count : kCounts) sum.*count.member += other.*count.member;
  sum.t_ulp.median = std::max(sum.t_ulp.median, other.t_ulp.median);
  sum.t_ulp.p99 = std::max(sum.t_ulp.p99, other.t_ulp.p99);
  sum.t_ulp.max = std::max(sum.t_ulp.max, other.t_ulp.max);
}

std::uint64_t wrong_of(const ErrorFigures& errors) {
  return errors.false_misses + errors.false_hits + errors.wrong_prims;
}

std::uint64_t broken_promises(const ErrorFigures& errors, const std::string& numeric) {
  if (numeric == "exact") return errors.errors() + errors.ties;
  return find_numeric(numeric).conservative ? errors.beyond_bound + errors.wrong_values : errors.unwritten;
}

nlohmann::json scene_json(const SceneFigures& s) {
  return {{"name", s.name},
          {"triangles", s.bvh.triangles},
          {"degenerate", s.bvh.degenerate},
          {"references", s.bvh.references},
          {"nodes", s.bvh.nodes},
          {"leaves", s.bvh.leaves},
          {"depth", s.bvh.depth},
          {"sah", s.bvh.sah},
          {"bytes", s.bvh.bytes},
          {"build_s", s.bvh.build_s},
          {"from_cache", s.bvh.from_cache},
          {"builder", builder_of(s.bvh.builder).name},
          {"load_s", s.load_s}};
}

nlohmann::json longest_json(const Context::Timed& pass) { return {{"name", pass.what}, {"ms", pass.ms}}; }

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  const double place = share * double(values.size() - 1);
  const auto below = std::size_t(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - double(below)) * (values[above] - values[below]);
}

Times times_of(std::vector<double> samples) {
  if (samples.empty()) return {};
  return {quantile(samples, 0.5), quantile(samples, 0.1), quantile(samples, 0.9), std::move(samples)};
}

nlohmann::json to_json(const Document& d) {
  nlohmann::json json{{"kind", "methods"},
                      {"device", d.device},
                      {"driver", d.driver},
                      {"cpu", d.cpu},
                      {"subgroup_size", d.subgroup_size},
                      {"commit", d.commit},
                      {"command", d.command},
                      {"environment", d.environment},
                      {"clock", d.clock},
                      {"date", d.date},
                      {"size", d.size},
                      {"ao_rays", d.ao_rays},
                      {"ao_radius", d.ao_radius},
                      {"offset", d.offset},
                      {"repeats", d.repeats},
                      {"sweep_repeats", d.sweep_repeats},
                      {"partial", d.partial},
                      {"longest_pass", longest_json(d.longest)},
                      {"scenes", nlohmann::json::array()},
                      {"records", nlohmann::json::array()}};
  for (const SceneFigures& scene : d.scenes) json["scenes"].push_back(scene_json(scene));
  for (const Record& record : d.records) json["records"].push_back(record_json(record));
  for (const HardRecord& record : d.hard) json["hard"].push_back(hard_json(record));
  return json;
}

}  // namespace ballot::bench
