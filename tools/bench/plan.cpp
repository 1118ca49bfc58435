#include "tools/bench/plan.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "tools/program/views_file.h"

namespace ballot::bench {

namespace {

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find(at, begin)) != std::string::npos; begin = end + 1)
    parts.push_back(text.substr(begin, end - begin));
  parts.push_back(text.substr(begin));
  return parts;
}

/// Returns the items of a comma-separated list, without repetitions.
std::vector<std::string> items_of(const std::string& option, const std::string& text) {
  std::vector<std::string> items;
  for (const std::string& item : split(text, ',')) {
    if (item.empty())
      fail(Failure::Arguments, "{}: '{}' has an empty item; separate names by single commas", option, text);
    if (std::ranges::find(items, item) == items.end()) items.push_back(item);
  }
  return items;
}

std::pair<std::string, std::string> knob_of(const std::string& option, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) fail(Failure::Arguments, "{}: '{}' is not of the form NAME=VALUE", option, text);
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// Returns those of the knobs for every method that this method has.
Knobs shared_knobs(const Method& method, const std::vector<std::string>& texts) {
  Knobs knobs;
  for (const std::string& text : texts) {
    const auto [name, value] = knob_of("--knob", text);
    if (concerns(method, name, value)) knobs[name] = value;
  }
  return knobs;
}

/// Returns a threshold without an exponent, so that knobs that are whole numbers accept it.
std::string threshold_text(double value) {
  return value == std::floor(value) ? fmt::format("{:.0f}", value) : fmt::format("{}", value);
}

/// Returns the method's standard threshold; of stack-max those that Vinkler's Table 2 has for primary and for secondary
/// rays.
std::vector<std::string> standard_thresholds(const Method& method) {
  if (method.threshold.unit == Threshold::None) return {};
  if (method.name == "stack-max") return {"11", "7"};
  return {threshold_text(method.threshold.standard)};
}

/// Normalises a number so that the labels of all runs agree: "0.50" becomes "0.5".
std::string plain_number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value) ? threshold_text(value)
                                                                                          : text;
}

std::vector<std::string> modes_of(const std::string& text) {
  std::vector<std::string> modes;
  const auto add = [&](std::string_view mode) {
    if (std::ranges::find(modes, mode) == modes.end()) modes.emplace_back(mode);
  };
  for (const std::string& item : items_of("--numeric", text)) {
    if (item != "all") {
      add(find_numeric(item).name);
      continue;
    }
    for (const NumericMode& mode : kNumericModes) add(mode.name);
  }
  return modes;
}

class Entries {
 public:
  Entries(const PlanArgs& args, Plan& plan) : args_(args), plan_(plan), modes_(modes_of(args.numeric)) {
    KernelConfig scratch;
    for (const std::string& text : args.knobs) {
      const auto [name, value] = knob_of("--knob", text);
      apply_knobs(scratch, {{name, value}});
    }
  }

  /// Adds the entries of an item such as "packet", "packet:vote=sum" or "stack-max:k=7:vote=count".
  void add_item(const std::string& item) {
    const auto parts = split(item, ':');
    const Method& method = find_method(parts[0]);
    Knobs knobs = shared_knobs(method, args_.knobs);
    for (std::size_t i = 1; i < parts.size(); ++i) {
      const auto [name, value] = knob_of("--methods", parts[i]);
      knobs[name] = value;
    }
    KernelConfig scratch;
    apply_knobs(scratch, knobs);
    add_votes(method, std::move(knobs));
  }

 private:
  void add_votes(const Method& method, Knobs knobs) {
    if (!method.packet() || knobs.contains("vote")) return add_thresholds(method, std::move(knobs));
    for (const std::string& vote : votes_of(method)) {
      knobs["vote"] = vote;
      add_thresholds(method, knobs);
    }
  }

  void add_thresholds(const Method& method, Knobs knobs) {
    const std::string knob(method.threshold.knob);
    if (knob.empty()) return add(method, knobs);
    if (knobs.contains(knob)) {
      knobs[knob] = plain_number(knobs[knob]);
      return add(method, knobs);
    }
    for (const std::string& value : standard_thresholds(method)) {
      knobs[knob] = value;
      add(method, knobs);
    }
    if (args_.sweep) add_sweep(method, knobs);
  }

  void add(const Method& method, const Knobs& knobs) {
    for (const std::string& mode : modes_) {
      Entry entry = make_entry(method, knobs, mode, Role::Method);
      const bool there = std::ranges::any_of(plan_.entries, [&](const Entry& e) {
        return e.label == entry.label && e.query.numeric == entry.query.numeric;
      });
      if (!there) plan_.entries.push_back(std::move(entry));
    }
  }

  void add_sweep(const Method& method, Knobs knobs) {
    for (const std::string& mode : modes_) {
      Sweep sweep{label_of(method, knobs, true), {}};
      const bool there = std::ranges::any_of(plan_.sweeps, [&](const Sweep& s) {
        return s.best_label == sweep.best_label && s.entries.front().query.numeric == mode;
      });
      if (there) continue;
      for (const double value : method.threshold.sweep) {
        knobs[std::string(method.threshold.knob)] = threshold_text(value);
        sweep.entries.push_back(make_entry(method, knobs, mode, Role::Sweep));
      }
      plan_.sweeps.push_back(std::move(sweep));
    }
  }

  static Entry make_entry(const Method& method, const Knobs& knobs, const std::string& mode, Role role) {
    Entry entry{label_of(method, knobs, false), role, {Want::Nearest, std::string(method.name), mode, knobs}, {}};
    KernelConfig scratch;
    apply_knobs(scratch, knobs);
    if (method.threshold.unit != Threshold::None)
      entry.threshold = ThresholdValue{std::string(method.threshold.knob), scratch.threshold};
    return entry;
  }

  const PlanArgs& args_;
  Plan& plan_;
  std::vector<std::string> modes_;
};

/// A parsed item of --rays that names a file: "rays.npy", "rays.npy:any", or with a name "short=rays.npy:any".
struct ForeignItem {
  std::string name;
  std::filesystem::path file;
  Want want;
};

bool is_foreign(const std::string& item) { return item.ends_with(".npy") || item.ends_with(".npy:any"); }

ForeignItem foreign_item(const std::string& item) {
  const bool any = item.ends_with(":any");
  const std::size_t equals = item.find('=');
  const bool named = equals < item.find('/') && equals > 0;  // a '=' after a '/' belongs to the path
  const std::size_t begin = named ? equals + 1 : 0;
  const std::filesystem::path file = item.substr(begin, item.size() - begin - (any ? 4 : 0));
  const std::string name = named ? item.substr(0, equals) : file.filename().string();
  for (const RayKind& kind : kRayKinds)
    if (kind.name == name)
      fail(Failure::Arguments, "--rays {}: '{}' is the name of a ray kind; give the file another one", item, name);
  return {name, file, any ? Want::Any : Want::Nearest};
}

void add_foreign(const std::string& item, std::vector<RaySet>& sets) {
  const ForeignItem foreign = foreign_item(item);
  const std::string view = foreign.file.string();
  RaySet* set = nullptr;
  for (RaySet& other : sets)
    if (other.name == foreign.name && other.want == foreign.want) set = &other;
  if (!set) set = &sets.emplace_back(RaySet{foreign.name, nullptr, {}, foreign.want});
  for (const RayFile& other : set->files)
    if (std::filesystem::path(other.view).lexically_normal() == foreign.file.lexically_normal())
      fail(Failure::Arguments, "--rays: {} is given twice for one set of rays; name each file once", view);
  set->files.push_back({view, read_rays(foreign.file)});
  if (set->files.back().rays.empty())
    fail(Failure::Work, "{}: found no rays, expected at least one", foreign.file.string());
}

void add_rays(const std::string& item, std::vector<RaySet>& sets) {
  if (item == "all") {
    for (const RayKind& kind : kRayKinds) add_rays(std::string(kind.name), sets);
    return;
  }
  if (is_foreign(item)) return add_foreign(item, sets);
  const RayKind& kind = find_ray_kind(item);
  for (const RaySet& other : sets)
    if (other.kind == &kind) return;
  sets.push_back({std::string(kind.name), &kind, {}, kind.want});
}

/// Names the views of rays from files: "" if a set has one file, else the files' stems, or their paths if stems are
/// equal.
void name_views(RaySet& set) {
  std::map<std::string, int> uses;
  for (const RayFile& file : set.files) ++uses[std::filesystem::path(file.view).stem().string()];
  for (RayFile& file : set.files) {
    const std::string stem = std::filesystem::path(file.view).stem().string();
    if (set.files.size() == 1)
      file.view.clear();
    else if (uses[stem] == 1)
      file.view = stem;
  }
}

/// Throws Error(Arguments) for a knob that no chosen method has: it would silently do nothing.
void check_concern(const PlanArgs& args, const Plan& plan) {
  for (const std::string& text : args.knobs) {
    const auto [name, value] = knob_of("--knob", text);
    if (std::ranges::none_of(plan.entries,
                             [&](const Entry& e) { return concerns(find_method(e.query.method), name, value); }))
      fail(Failure::Arguments, "--knob {}: it concerns none of the chosen methods", text);
  }
}

}  // namespace

std::vector<Query> Plan::queries() const {
  std::vector<Query> all;
  for (const Entry& entry : entries) all.push_back(entry.query);
  for (const Sweep& sweep : sweeps)
    for (const Entry& entry : sweep.entries) all.push_back(entry.query);
  return all;
}

Plan make_plan(const PlanArgs& args) {
  Plan plan;
  Entries entries(args, plan);
  for (const std::string& item : items_of("--methods", args.methods)) {
    if (item != "all") {
      entries.add_item(item);
      continue;
    }
    for (const Method& method : kMethods) entries.add_item(std::string(method.name));
  }
  const auto rays = items_of("--rays", args.rays);
  for (const std::string& item : rays)  // names are checked first: reading files takes longer
    if (item != "all" && !is_foreign(item)) find_ray_kind(item);
  for (const std::string& item : rays) add_rays(item, plan.rays);
  for (RaySet& set : plan.rays) name_views(set);
  check_concern(args, plan);
  if (!args.views_file.empty()) plan.given_views = cli::read_views(args.views_file);
  if (args.views != "all") plan.views = items_of("--views", args.views);
  return plan;
}

}  // namespace ballot::bench
