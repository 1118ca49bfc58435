#include "tools/verify/origins.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tools/bench/plots.h"
#include "tools/verify/origin_scenes.h"

namespace ballot::verify {

namespace {

namespace fs = std::filesystem;

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

OriginRecord measure(Engine& engine, const OriginPolicy& policy, const OriginStudy& study) {
  OriginRecord record;
  record.policy = policy.label;
  std::vector<double> offsets, ulps;
  for (const View& view : engine.scene().views)
    for (const RayKind* kind : studied_kinds()) {
      const auto batch = engine.make_batch(view, *kind, study.width, study.height, policy.options);
      for (const OriginCheck& check : engine.check_origins(*batch)) {
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

void describe(OriginStudy& study, const Engine& engine, const OriginStudyArgs& args) {
  study.device = engine.device().name;
  study.driver = engine.device().driver;
  study.subgroup_size = engine.device().subgroup_size;
  study.commit = commit();
  study.command = args.command;
  study.width = args.width;
  study.height = args.height;
}

OriginStudy measure_all(const OriginStudyArgs& args) {
  const Grid grid = grid_of(args.quick);
  const std::vector<OriginPolicy> policies = studied_policies();
  OriginStudy study;
  EngineOptions options = args.engine;
  options.use_cache = false;  // no other command uses the scenes of this study
  ProgressBar bar("tracing from hits");
  double done = 0;
  const double all = double(origin_scenes().size() * grid.sizes.size() * grid.distances.size() * policies.size());
  for (const OriginScene& scene : origin_scenes())
    for (const double size : grid.sizes)
      for (const double distance : grid.distances) {
        Engine engine(scene.make(size, distance), options);
        options.context = engine.context();
        describe(study, engine, args);
        for (const OriginPolicy& policy : policies) {
          OriginRecord record = measure(engine, policy, study);
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

void write_report(const fs::path& folder, const OriginStudy& study, const std::string& tables) {
  const std::string head =
      fmt::format("# Where secondary rays start\n\n{}, {}, subgroups of {}, commit {}.\n\n```\n{}\n```\n\n",
                  study.device, study.driver, study.subgroup_size, study.commit, study.command);
  write_file(folder / "origins.json", json_text(to_json(study)), Links::Replace);
  write_file(folder / "origins.md", head + tables, Links::Replace);
  const bench::Plots plots = bench::draw_plots(folder, "plot_origins.py", "origins.json");
  write_file(folder / "origins.md", head + tables + bench::plot_section(plots), Links::Replace);
  if (!plots.missing.empty()) say_aside("ballot: {}\n", plots.missing);
  say("wrote {}\n", (folder / "origins.md").string());
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
  const std::string tables = origin_tables(study);
  say("{}", tables);
  if (!args.json.empty()) write_file(args.json, json_text(to_json(study)));
  if (!args.report.empty()) write_report(args.report, study, tables);
}

}  // namespace ballot::verify
