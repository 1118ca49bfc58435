#include "engine/answer/knobs.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "engine/core/registry.h"

namespace ballot {

namespace {

[[noreturn]] void refuse_value(std::string_view knob, std::string_view value, std::string_view takes) {
  fail(Failure::Arguments, "knob {}: '{}' is not one of its values; it takes {}", knob, value, takes);
}

std::string text_of(double value) {
  return value == std::floor(value) ? fmt::format("{:.0f}", value) : fmt::format("{:.6g}", value);
}

std::string takes_of(const Knob& knob) {
  if (!knob.takes.empty()) return std::string(knob.takes);
  std::string text;
  for (const std::string_view name : knob.names)
    if (!name.empty()) text += fmt::format("{}{}", text.empty() ? "" : ", ", name);
  for (const std::uint32_t number : knob.numbers)
    if (number) text += fmt::format("{}{}", text.empty() ? "" : ", ", number);
  if (!text.empty()) return text;
  return fmt::format("{} to {}", text_of(knob.least), text_of(knob.most));
}

double parse_number(const Knob& knob, std::string_view value) {
  double number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  const bool whole =
      knob.share || (number == std::floor(number) && value.find_first_not_of("0123456789") == value.npos);
  const bool listed = !knob.numbers[0] || std::ranges::find(knob.numbers, number) != knob.numbers.end();
  const bool within = knob.numbers[0] || (number >= knob.least && number <= knob.most);
  if (error != std::errc() || end != value.data() + value.size() || !whole || !listed || !within)
    refuse_value(knob.name, value, takes_of(knob));
  return number;
}

double parse(const Knob& knob, std::string_view value) {
  for (std::size_t i = 0; i < knob.names.size(); ++i)
    if (!knob.names[i].empty() && knob.names[i] == value) return double(i);
  if (!knob.names[0].empty()) refuse_value(knob.name, value, takes_of(knob));
  return parse_number(knob, value);
}

/// Returns all names in the order of help: knobs, then thresholds.
std::string knob_names() {
  std::string names;
  for (const KnobInfo& k : knobs()) names += fmt::format("{}{}", names.empty() ? "" : ", ", k.name);
  return names;
}

void check_vote(const Method& method, const KernelConfig& config) {
  if (method.takes(config.vote)) return;
  std::string votes;
  for (const Vote v : {Vote::Any, Vote::Count, Vote::Sum})
    if (method.takes(v)) votes += fmt::format("{}{}", votes.empty() ? "" : ", ", vote_name(v));
  fail(Failure::Arguments, "knob vote={}: method {} needs numbers of lanes; it takes {}", vote_name(config.vote),
       method.name, votes);
}

}  // namespace

Knob knob_of(const Threshold& t) {
  return {.name = t.knob,
          .help = t.what,
          .field = field<&KernelConfig::threshold>(),
          .share = t.unit == Threshold::Share,
          .most = t.unit == Threshold::Share ? 1 : t.most};
}

Knob find_knob(std::string_view name) {
  if (const Knob* knob = find_row(kKnobs, name)) return *knob;
  for (const Method& m : kMethods)
    if (m.threshold.unit != Threshold::None && m.threshold.knob == name) return knob_of(m.threshold);
  fail(Failure::Arguments, "no knob is called '{}'; there are: {}", name, knob_names());
}

const std::vector<KnobInfo>& knobs() {
  static const std::vector<KnobInfo> all = [] {
    std::vector<KnobInfo> list;
    for (const Knob& k : kKnobs) list.push_back({std::string(k.name), takes_of(k), std::string(k.help)});
    for (const Method& m : kMethods) {
      if (m.threshold.unit == Threshold::None) continue;
      const Knob k = knob_of(m.threshold);
      const std::string what = fmt::format("{}: {}", m.name, k.help);
      const auto known = std::ranges::find(list, k.name, &KnobInfo::name);
      if (known == list.end())
        list.push_back({std::string(k.name), takes_of(k), what});
      else
        known->what += "; " + what;
    }
    return list;
  }();
  return all;
}

std::string value_text(const Knob& knob, const KernelConfig& config) {
  const double value = knob.field.get(config);
  return knob.names[0].empty() ? text_of(value) : std::string(knob.names[std::size_t(value)]);
}

void apply_knobs(KernelConfig& config, const Knobs& knobs) {
  for (const auto& [name, value] : knobs) {
    const Knob knob = find_knob(name);
    knob.field.set(config, parse(knob, value));
  }
}

void check_knobs(const Method& method, const KernelConfig& config, const Knobs& knobs) {
  for (const auto& [name, value] : knobs) {
    const Knob* knob = find_row(kKnobs, name);
    if (!knob && name != method.threshold.knob)
      for (const Method& other : kMethods)
        if (other.threshold.knob == name)
          fail(Failure::Arguments, "knob {}: method {} has no such threshold; {} has", name, method.name, other.name);
    if (knob && !knob->without.empty() && !knob->applies_to(method, config))
      fail(Failure::Arguments, "knob {}: method {} {}", name, method.name, knob->without);
  }
  if (knobs.contains("vote")) check_vote(method, config);
}

bool concerns(const Method& method, std::string_view name, std::string_view value) {
  const Knob* knob = find_row(kKnobs, name);
  if (!knob) return method.threshold.knob == name;
  if (method.chooses)  // auto never chooses packets whose lanes vote
    return std::ranges::any_of(kMethods,
                               [&](const Method& m) { return !m.chooses && !m.packet() && concerns(m, name, value); });
  KernelConfig config;
  if (name == "vote") {
    knob->field.set(config, parse(*knob, value));
    return method.takes(config.vote);
  }
  if (name == "padding" && value == "tree") return format_of(method.tree).padded;
  return knob->without.empty() || knob->applies_to(method, config);
}

std::string_view vote_name(Vote vote) { return find_row(kKnobs, "vote")->names[std::size_t(vote)]; }

std::string describe(const KernelConfig& config, const Method& method) {
  std::string text;
  for (const Knob& knob : kKnobs)
    if (knob.named && knob.applies_to(method, config))
      text += fmt::format("{}{}={}", text.empty() ? "" : " ", knob.name, value_text(knob, config));
  return text;
}

std::string describe_threshold(const KernelConfig& config, const Method& method) {
  if (method.threshold.unit == Threshold::None) return "";
  return fmt::format("{}={:.6g}", method.threshold.knob, config.threshold);
}

std::uint32_t kernel_threshold(const KernelConfig& config, const Method& method) {
  if (method.threshold.unit == Threshold::Share)
    return std::uint32_t(std::ceil(config.threshold * config.subgroup - 1e-9));
  return std::uint32_t(config.threshold);
}

std::vector<std::pair<std::string, int>> knob_defines(const KernelConfig& config, const Method& method) {
  std::vector<std::pair<std::string, int>> defines;
  for (const Knob& knob : kKnobs)
    if (!knob.define.empty())
      defines.emplace_back(knob.define, knob.applies_to(method, config) ? int(knob.field.get(config)) : knob.idle);
  return defines;
}

}  // namespace ballot
