// Builders of invented JSON documents in the format that `ballot bench` writes.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace ballot::test {

/// Returns timing statistics whose samples lie within 1 % of `ms` and whose median is `ms`, in milliseconds.
inline nlohmann::json made_up_times(double ms, int samples = 21) {
  std::vector<double> all;
  for (int i = 0; i < samples; ++i) all.push_back(ms * (1 + 0.01 * (2.0 * (i * 7 % samples) / (samples - 1) - 1)));
  return {{"median", ms}, {"p10", ms * 0.992}, {"p90", ms * 1.008}, {"samples", all}};
}

/// The fields of an invented record of a bench run; `ms` is the median time of the traversal in milliseconds.
struct MadeUpRecord {
  std::string scene = "sponza", view = "view0", rays = "primary", label = "packet(any)", method = "packet";
  double ms = 1;
  std::string role = "method";
  nlohmann::json knobs = {{"vote", "any"}};
  bool any = false;
  std::uint64_t ray_count = 1000000;
};

/// Returns the record as JSON. A record of role "sweep" has no frame times.
inline nlohmann::json made_up(const MadeUpRecord& r) {
  nlohmann::json json{{"scene", r.scene},
                      {"view", r.view},
                      {"rays", r.rays},
                      {"any", r.any},
                      {"label", r.label},
                      {"role", r.role},
                      {"method", r.method},
                      {"knobs", r.knobs},
                      {"numeric", "watertight"},
                      {"variant", r.label},
                      {"workgroup", 64},
                      {"subgroup", 32},
                      {"resident_lanes", 0},
                      {"ray_count", r.ray_count},
                      {"mrays_per_s", double(r.ray_count) / r.ms * 1e-3},
                      {"trace_ms", made_up_times(r.ms)}};
  if (r.role != "sweep") json["frame_ms"] = made_up_times(r.ms + 1);
  return json;
}

/// Returns a run of one scene, without records.
inline nlohmann::json made_up_run(const std::string& device = "Imagined GPU") {
  return {{"device", device},
          {"driver", "imagined 1.0"},
          {"subgroup_size", 32},
          {"commit", "0123456789ab"},
          {"command", "ballot bench sponza.glb --report out"},
          {"clock", "GPU timestamps"},
          {"date", "2026-11-21T00:00:00Z"},
          {"size", {1024, 1024}},
          {"repeats", 21},
          {"sweep_repeats", 3},
          {"partial", false},
          {"scenes",
           {{{"name", "sponza"},
             {"triangles", 76154},
             {"degenerate", 0},
             {"references", 114231},
             {"nodes", 52001},
             {"leaves", 26001},
             {"depth", 25},
             {"sah", 60.5},
             {"bytes", 2000000},
             {"build_s", 1.5},
             {"load_s", 0.1}}}},
          {"records", nlohmann::json::array()}};
}

/// Returns a run over two views, with primary and shadow rays: packet with its three votes, if-if, a sweep of cut and
/// the best of that sweep.
inline nlohmann::json made_up_bench(const std::string& device = "Imagined GPU") {
  nlohmann::json run = made_up_run(device);
  for (const char* rays : {"primary", "shadow"})
    for (const char* view : {"view0", "view1"}) {
      const auto add = [&](const char* label, const char* method, double ms, const char* role, nlohmann::json knobs) {
        MadeUpRecord r{"sponza", view, rays, label, method, ms, role, std::move(knobs)};
        r.any = r.rays == "shadow";
        run["records"].push_back(made_up(r));
      };
      add("packet(any)", "packet", 1, "method", {{"vote", "any"}});
      add("packet(count)", "packet", 0.8, "method", {{"vote", "count"}});
      add("packet(sum)", "packet", 2, "method", {{"vote", "sum"}});
      add("if-if", "if-if", 1.25, "method", nlohmann::json::object());
      add("cut(0.25)", "cut", 1.5, "sweep", {{"f", "0.25"}, {"vote", "count"}});
      add("cut(0.5)", "cut", 0.5, "sweep", {{"f", "0.5"}, {"vote", "count"}});
      add("cut(best)", "cut", 0.5, "best", {{"f", "0.5"}, {"vote", "count"}});
    }
  return run;
}

}  // namespace ballot::test
