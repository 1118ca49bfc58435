// The file that keeps the choices of method auto.
#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <utility>

#include "ballot_commit.h"
#include "engine/core/cache_file.h"
#include "engine/core/error.h"
#include "engine/core/json_limits.h"
#include "engine/core/json_text.h"
#include "engine/trace/auto/auto.h"

namespace ballot {

namespace {

using Json = nlohmann::json;

std::string key_of(std::string_view rays, Want want, std::string_view numeric, const Knobs& knobs) {
  std::string key = fmt::format("{}|{}|{}", rays, want == Want::Any ? "any" : "nearest", numeric);
  for (const auto& [knob, value] : knobs) key += fmt::format("|{}={}", knob, value);
  return key;
}

Json to_json(const Choice& c) {
  Json candidates = Json::array();
  for (const Candidate& each : c.candidates)
    candidates.push_back({{"method", each.method},
                          {"knobs", each.knobs},
                          {"mrays_per_s", each.mrays_per_s},
                          {"tried", each.tried},
                          {"put_off_s", each.put_off_s}});
  return {{"rays", c.rays},
          {"any", c.want == Want::Any},
          {"numeric", c.numeric},
          {"knobs", c.knobs},
          {"candidates", candidates},
          {"sampled", c.sampled},
          {"calibration_s", c.seconds},
          {"runs", c.runs},
          {"since_entry_s", c.since_entry_s}};
}

bool has_put_off(const Choice& c) {
  return std::ranges::any_of(c.candidates, [](const Candidate& each) { return each.put_off_s > 0; });
}

/// Returns a whole number. Throws Error(Work) if it is none, or none that fits.
std::uint32_t count_of(const Json& json) {
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > 0xFFFFFFFFu)
    fail(Failure::Work, "expected a whole number below 2^32");
  return std::uint32_t(json.get<std::uint64_t>());
}

Choice from_json(const Json& json) {
  Choice c;
  c.rays = json.at("rays");
  c.want = json.at("any").get<bool>() ? Want::Any : Want::Nearest;
  c.numeric = json.at("numeric");
  c.knobs = json.at("knobs").get<Knobs>();
  for (const Json& each : json.at("candidates"))
    c.candidates.push_back({each.at("method"), each.at("knobs").get<Knobs>(), each.at("mrays_per_s"), each.at("tried"),
                            each.at("put_off_s")});
  c.sampled = count_of(json.at("sampled"));
  c.seconds = json.at("calibration_s");
  c.runs = int(std::min(count_of(json.at("runs")), std::uint32_t(kRunsOfTrials)));
  if (has_put_off(c)) c.since_entry_s = json.at("since_entry_s");
  c.remembered = true;
  return c;
}

/// Returns a text that tells a tree from others.
std::string scene_text(const BvhStats& t, const Bounds& b) {
  return fmt::format(
      "{} triangles, {} references, {} nodes, depth {}, SAH {:a}, ({:a}, {:a}, {:a}) to ({:a}, {:a}, {:a})",
      t.triangles, t.references, t.nodes, t.depth, t.sah, b.lo.x, b.lo.y, b.lo.z, b.hi.x, b.hi.y, b.hi.z);
}

bool is_among(const Candidate& chosen, const std::vector<Candidate>& candidates) {
  return std::ranges::any_of(candidates, [&](const Candidate& c) { return c.name() == chosen.name(); });
}

}  // namespace

Choices::Choices(const DeviceInfo& device, const BvhStats& tree, const Bounds& bounds)
    : device_(device), triangles_(tree.triangles), scene_(scene_text(tree, bounds)) {}

Choices::~Choices() { store_noted(); }

/// Stores what was traced for candidates that were put off, beside what other processes have stored meanwhile.
void Choices::store_noted() {
  if (!std::exchange(noted_, false) || file_.empty()) return;
  try {
    const auto own = std::exchange(all_, {});
    load();
    for (const auto& [key, choice] : own) {
      const auto stored = all_.emplace(key, choice).first;
      if (has_put_off(stored->second)) stored->second.since_entry_s = choice.since_entry_s;
    }
    save();
  } catch (const std::exception&) {
    // The next process counts from what was stored before.
  }
}

void Choices::keep_in(const std::filesystem::path& folder) {
  const std::string platform =
      fmt::format("{}|{}|{}|{}|{}", device_.name, device_.driver, device_.subgroup_size, BALLOT_COMMIT, scene_);
  folder_ = folder;
  file_ = folder / fmt::format("{:016x}.json", std::hash<std::string>()(platform));
  load();
  ++changes_;
}

void Choices::replace_scene(const BvhStats& tree, const Bounds& bounds) {
  store_noted();
  triangles_ = tree.triangles;
  scene_ = scene_text(tree, bounds);
  clear();
  if (!folder_.empty()) keep_in(folder_);
}

void Choices::load() {
  try {
    const std::optional<std::vector<std::byte>> bytes = read_cache(file_);
    if (!bytes) return;
    const char* text = reinterpret_cast<const char*>(bytes->data());
    check_json(file_, {text, bytes->size()});
    const Json json = Json::parse(text, text + bytes->size());
    if (json.at("scene") != scene_) return;
    for (const Json& each : json.at("choices")) {
      Choice c = from_json(each);
      const Query query{c.want, std::string(kAuto), c.numeric, c.knobs, c.rays};
      if (!c.candidates.empty() && is_among(c.chosen(), candidates_for(query, device_, triangles_)))
        all_.emplace(key_of(c.rays, c.want, c.numeric, c.knobs), std::move(c));
    }
  } catch (const std::exception&) {
    // A cache that cannot be read is no error: auto measures again.
  }
}

void Choices::save() const {
  if (file_.empty()) return;
  Json choices = Json::array();
  for (const auto& [key, choice] : all_) choices.push_back(to_json(choice));
  const Json json{{"device", device_.name},  {"driver", device_.driver}, {"subgroup_size", device_.subgroup_size},
                  {"commit", BALLOT_COMMIT}, {"scene", scene_},          {"choices", choices}};
  const std::string text = json_text(json);
  write_cache(file_, std::as_bytes(std::span(text)));
}

const Choice* Choices::find(const Query& q) const {
  const auto found = all_.find(key_of(q.rays, q.want, q.numeric, q.knobs));
  return found == all_.end() ? nullptr : &found->second;
}

bool Choices::has_tried(const Query& q, const Candidate& candidate) const {
  return std::ranges::any_of(all_, [&](const auto& each) {
    const Choice& c = each.second;
    if (c.want != q.want || c.numeric != q.numeric || c.knobs != q.knobs) return false;
    const auto found = std::ranges::find(c.candidates, candidate.name(), &Candidate::name);
    return found != c.candidates.end() && found->tried;
  });
}

void Choices::note(const Query& q, std::size_t rays) {
  if (!find_method(q.method).chooses) return;
  const auto found = all_.find(key_of(q.rays, q.want, q.numeric, q.knobs));
  if (found == all_.end()) return;
  Choice& c = found->second;
  if (c.chosen().mrays_per_s <= 0) return;
  const double seconds = double(rays) / c.chosen().mrays_per_s * 1e-6;
  c.traced_s += seconds;
  c.since_entry_s += seconds;
  noted_ |= has_put_off(c);
}

void Choices::add(Choice c) {
  all_.insert_or_assign(key_of(c.rays, c.want, c.numeric, c.knobs), std::move(c));
  ++changes_;
  save();
}

std::vector<Choice> Choices::all() const {
  std::vector<Choice> list;
  for (const auto& [key, choice] : all_) list.push_back(choice);
  return list;
}

}  // namespace ballot
