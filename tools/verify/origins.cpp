#include "tools/verify/origins.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "tools/bench/markdown.h"
#include "tools/verify/origin_scenes.h"

namespace ballot::verify {

namespace {

/// Returns the kinds of secondary rays, without those that join the rays of others.
std::vector<const RayKind*> studied_kinds() {
  std::vector<const RayKind*> kinds;
  for (const RayKind& kind : kRayKinds)
    if (!kind.from_camera() && kind.generators.size() == 1) kinds.push_back(&kind);
  return kinds;
}

struct Grid {
  std::vector<double> sizes, distances;
};

Grid grid_of(bool quick) {
  if (quick) return {{1e-3, 1e3}, {0, 1e2}};
  return {{1e-6, 1e-4, 1e-2, 1, 1e2, 1e4, 1e6}, {0, 1, 1e2, 1e4, 1e6}};
}

double median(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

OriginRecord measure(DeviceScene& world, const OriginPolicy& policy, const OriginStudy& study) {
  OriginRecord record;
  record.policy = policy.label;
  std::vector<double> offsets, ulps;
  for (const View& view : world.scene().views)
    for (const RayKind* kind : studied_kinds()) {
      const auto batch = world.make_batch(view, *kind, study.width, study.height, policy.options);
      for (const OriginCheck& check : world.check_origins(*batch)) {
        ++record.rays;
        record.self_hits += check.self_hit;
        record.lost_contacts += check.lost_contact;
        offsets.push_back(check.offset);
        ulps.push_back(check.ulps);
      }
    }
  record.offset_share = median(offsets);
  record.offset_ulps = median(ulps);
  return record;
}

void describe(OriginStudy& study, const DeviceScene& world, const OriginStudyArgs& args) {
  study.device = world.device().name;
  study.driver = world.device().driver;
  study.subgroup_size = world.device().subgroup_size;
  study.commit = commit();
  study.command = args.command;
  study.width = args.width;
  study.height = args.height;
}

OriginStudy measure_all(const OriginStudyArgs& args) {
  const Grid grid = grid_of(args.quick);
  const std::vector<OriginPolicy> policies = studied_policies();
  OriginStudy study;
  DeviceSceneOptions options = args.world;
  options.use_cache = false;  // no other command uses the scenes of this study
  ProgressBar bar("tracing from hits");
  double done = 0;
  const double all = double(origin_scenes().size() * grid.sizes.size() * grid.distances.size() * policies.size());
  for (const OriginScene& scene : origin_scenes())
    for (const double size : grid.sizes)
      for (const double distance : grid.distances) {
        DeviceScene world(scene.make(size, distance), options);
        options.context = world.context();
        describe(study, world, args);
        for (const OriginPolicy& policy : policies) {
          OriginRecord record = measure(world, policy, study);
          record.scene = scene.name;
          record.size = size, record.distance = distance;
          record.offset_share /= size;
          study.records.push_back(record);
          bar.update(++done / all);
        }
      }
  for (const std::string& message : options.context->messages()) say_aside("ballot: {}\n", message);
  return study;
}

/// The sums over the records of a policy.
struct OriginSum {
  std::uint64_t rays = 0, self_hits = 0, lost = 0;
  double worst_self = 0, worst_lost = 0;                              // highest rates of one record, per million rays
  double share_low = 0, share_high = 0, ulps_low = 0, ulps_high = 0;  // range of the records' medians

  void add(const OriginRecord& r) {
    const bool first = rays == 0;
    rays += r.rays, self_hits += r.self_hits, lost += r.lost_contacts;
    if (r.rays > 0) {
      worst_self = std::max(worst_self, 1e6 * double(r.self_hits) / double(r.rays));
      worst_lost = std::max(worst_lost, 1e6 * double(r.lost_contacts) / double(r.rays));
    }
    share_low = first ? r.offset_share : std::min(share_low, r.offset_share);
    ulps_low = first ? r.offset_ulps : std::min(ulps_low, r.offset_ulps);
    share_high = std::max(share_high, r.offset_share);
    ulps_high = std::max(ulps_high, r.offset_ulps);
  }
  double per_million(std::uint64_t count) const { return rays ? 1e6 * double(count) / double(rays) : 0; }
};

std::string rate(double per_million) {
  return per_million == 0    ? "0"
         : per_million < 100 ? fmt::format("{:.2g}", per_million)
                             : fmt::format("{:.0f}", per_million);
}

std::string range(double low, double high) { return fmt::format("{:.1e} to {:.1e}", low, high); }

/// Returns a table by policy. The highest rates are those of one scene at one size and distance; offsets are the range
/// of the records' medians.
std::string origin_table(const OriginStudy& study) {
  std::map<std::string, OriginSum> sums;
  for (const OriginRecord& r : study.records) sums[r.policy].add(r);
  bench::Table table({"policy", "rays", "self hits per million", "highest", "lost contacts per million", "highest",
                      "offset / size, medians", "offset in ulp, medians"});
  for (const OriginPolicy& policy : studied_policies()) {
    const OriginSum& s = sums[policy.label];
    table.row({policy.label, std::to_string(s.rays), rate(s.per_million(s.self_hits)), rate(s.worst_self),
               rate(s.per_million(s.lost)), rate(s.worst_lost), range(s.share_low, s.share_high),
               range(s.ulps_low, s.ulps_high)});
  }
  return table.text();
}

nlohmann::json to_json(const OriginStudy& study) {
  nlohmann::json json{{"kind", "origins"},
                      {"device", study.device},
                      {"driver", study.driver},
                      {"subgroup_size", study.subgroup_size},
                      {"commit", study.commit},
                      {"command", study.command},
                      {"size", {study.width, study.height}},
                      {"records", nlohmann::json::array()}};
  for (const OriginRecord& r : study.records)
    json["records"].push_back({{"policy", r.policy},
                               {"scene", r.scene},
                               {"scene_size", r.size},
                               {"distance", r.distance},
                               {"rays", r.rays},
                               {"self_hits", r.self_hits},
                               {"lost_contacts", r.lost_contacts},
                               {"offset_share", r.offset_share},
                               {"offset_ulps", r.offset_ulps}});
  return json;
}

}  // namespace

std::vector<OriginPolicy> studied_policies() {
  std::vector<OriginPolicy> all;
  for (const OffsetPolicy& policy : kOffsetPolicies) {
    RayKindOptions options;
    options.ao_rays = 2;
    options.offset = policy.name;
    if (policy.value != ORIGIN_CONSTANT) {
      all.push_back({options.offset, options});
      continue;
    }
    for (const auto& [share, label] : {std::pair{1e-3f, "1e-3"}, {1e-4f, "1e-4"}, {1e-5f, "1e-5"}, {1e-6f, "1e-6"}}) {
      options.constant_offset = share;
      all.push_back({fmt::format("{} {}", policy.name, label), options});
    }
  }
  return all;
}

void run_origin_study(const OriginStudyArgs& args) {
  check_options(RenderOptions{.width = args.width, .height = args.height});
  const OriginStudy study = measure_all(args);
  say("{}", origin_table(study));
  if (!args.json.empty()) write_file(args.json, json_text(to_json(study)));
}

}  // namespace ballot::verify
