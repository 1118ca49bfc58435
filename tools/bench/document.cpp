#include "tools/bench/document.h"

#include <algorithm>
#include <cmath>

namespace ballot::bench {

namespace {

nlohmann::json times_json(const Times& times) {
  return {{"median", times.median}, {"p10", times.p10}, {"p90", times.p90}, {"samples", times.samples}};
}

nlohmann::json check_json(const Checked& c) {
  return {{"rays", c.rays},
          {"same", c.same},
          {"tie", c.tie},
          {"false_misses", c.false_misses},
          {"false_hits", c.false_hits},
          {"wrong_prims", c.wrong_prims},
          {"wrong_t", c.wrong_t},
          {"unwritten", c.unwritten}};
}

nlohmann::json record_json(const Record& r) {
  nlohmann::json json{{"scene", r.scene},
                      {"view", r.view},
                      {"rays", r.rays},
                      {"any", r.any},
                      {"label", r.label},
                      {"role", role_name(r.role)},
                      {"method", r.method},
                      {"knobs", r.knobs},
                      {"numeric", r.numeric},
                      {"variant", r.variant},
                      {"workgroup", r.workgroup},
                      {"subgroup", r.subgroup},
                      {"resident_lanes", r.resident_lanes},
                      {"ray_count", r.ray_count},
                      {"mrays_per_s", r.mrays_per_s()},
                      {"trace_ms", times_json(r.trace)}};
  if (r.threshold) json["threshold"] = {{"knob", r.threshold->knob}, {"value", r.threshold->value}};
  if (r.frame) json["frame_ms"] = times_json(*r.frame);
  if (!r.counters.empty()) json["counters"] = r.counters;
  if (r.check) json["check"] = check_json(*r.check);
  if (r.accuracy) add_json(json, *r.accuracy);
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
                      {"ray_count", r.accuracy.rays},
                      {"leaks", r.leaks},
                      {"unlike_known", r.unlike},
                      {"differing", r.differing}};
  if (!r.failed.empty()) json["failed"] = r.failed;
  add_json(json, r.accuracy);
  return json;
}

}  // namespace

const char* role_name(Role role) {
  switch (role) {
    case Role::Method:
      return "method";
    case Role::Sweep:
      return "sweep";
    case Role::Best:
      return "best";
  }
  return "";
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
  nlohmann::json json{{"device", d.device},
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

nlohmann::json to_json(const std::vector<Document>& documents) {
  if (documents.size() == 1) return to_json(documents.front());
  nlohmann::json all = nlohmann::json::array();
  for (const Document& document : documents) all.push_back(to_json(document));
  return {{"documents", all}};
}

}  // namespace ballot::bench
