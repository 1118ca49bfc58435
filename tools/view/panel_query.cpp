// The panel that chooses method, numeric mode and knobs. It is built from the registries, so a new method or knob
// appears without a change here.
#include <imgui/imgui.h>

#include <charconv>
#include <vector>

#include "tools/view/panels.h"

namespace ballot::view {

namespace {

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(", "), text.size());
    words.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 2, text.size()));
  }
  return words;
}

/// Returns the knob's value in a kernel configuration; empty if the knob does not affect the method.
std::string value_of(std::string_view knob, const KernelConfig& f, const Method& method) {
  const std::string text = " " + describe(f, method) + " " + describe_threshold(f, method) + " ";
  const std::string key = " " + std::string(knob) + "=";
  const std::size_t at = text.find(key);
  if (at == std::string::npos) return knob == "subgroup" ? std::to_string(f.subgroup) : "";
  const std::size_t begin = at + key.size();
  return text.substr(begin, text.find(' ', begin) - begin);
}

/// Sets a knob if the device and the method support the value.
void try_knob(Query& query, std::string_view knob, const std::string& value, const DeviceInfo& device) {
  Knobs knobs = query.knobs;
  knobs[std::string(knob)] = value;
  try {
    kernel_config_for(find_method(query.method), find_numeric(query.numeric), device, knobs);
    query.knobs = knobs;
  } catch (const Error&) {
    // The device or the method does not support the value, so the old one stays.
  }
}

bool can_follow(const Query& query, std::string_view knob, const std::string& value, const DeviceInfo& device) {
  Query scratch = query;
  try_knob(scratch, knob, value, device);
  const auto found = scratch.knobs.find(std::string(knob));
  return found != scratch.knobs.end() && found->second == value;
}

void draw_choice(const KnobInfo& knob, const std::string& now, Query& query, const DeviceInfo& device) {
  if (!ImGui::BeginCombo(std::string(knob.name).c_str(), now.c_str())) return;
  for (const std::string& value : words_of(knob.values))
    if (can_follow(query, knob.name, value, device) && ImGui::Selectable(value.c_str(), value == now))
      try_knob(query, knob.name, value, device);
  ImGui::EndCombo();
}

void draw_number(const KnobInfo& knob, const std::string& now, Query& query, const DeviceInfo& device) {
  double value = 0;
  std::from_chars(now.data(), now.data() + now.size(), value);
  const std::string name(knob.name);
  if (knob.values == "0 to 1") {
    float share = float(value);
    if (ImGui::SliderFloat(name.c_str(), &share, 0, 1, "%.3g"))
      try_knob(query, knob.name, fmt::format("{:.4g}", share), device);
    return;
  }
  // Sizes of groups change by powers of two, other numbers by one.
  const bool powers = knob.name == "workgroup" || knob.name == "subgroup" || knob.name == "lanes";
  ImGui::PushItemWidth(-FLT_MIN - ImGui::CalcTextSize("packet_stack ").x - 60);
  ImGui::TextUnformatted(now.c_str());
  ImGui::PopItemWidth();
  ImGui::SameLine(ImGui::GetContentRegionAvail().x * 0.40f);
  ImGui::PushID(name.c_str());
  const auto step = [&](const char* sign, double next) {
    if (ImGui::SmallButton(sign) && next >= 0) try_knob(query, knob.name, fmt::format("{:.0f}", next), device);
  };
  step("-", powers ? value / 2 : value - 1);
  ImGui::SameLine();
  step("+", powers ? value * 2 : value + 1);
  ImGui::PopID();
  ImGui::SameLine(ImGui::GetContentRegionAvail().x * 0.64f + ImGui::GetStyle().WindowPadding.x);
  ImGui::TextUnformatted(name.c_str());
}

void draw_knobs(Query& query, const DeviceInfo& device) {
  const Method& method = find_method(query.method);
  const KernelConfig f = kernel_config_for(method, find_numeric(query.numeric), device, query.knobs);
  for (const KnobInfo& knob : knobs()) {
    const std::string now = value_of(knob.name, f, method);
    if (now.empty()) continue;
    if (knob.values.find(" to ") == std::string_view::npos && knob.name != "subgroup")
      draw_choice(knob, now, query, device);
    else
      draw_number(knob, now, query, device);
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("%s: %s", std::string(knob.values).c_str(), std::string(knob.what).c_str());
  }
  if (!query.knobs.empty() && ImGui::SmallButton("device defaults")) query.knobs.clear();
}

}  // namespace

void draw_query(const char* label, Query& query, const DeviceInfo& device) {
  ImGui::PushID(label);
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x * 0.52f);
  if (ImGui::BeginCombo("##method", query.method.c_str(), ImGuiComboFlags_HeightLargest)) {
    for (const Method& m : kMethods) {
      const std::string name(m.name);
      if (ImGui::Selectable(name.c_str(), name == query.method)) query.method = name, query.knobs.clear();
      if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", std::string(m.summary).c_str());
    }
    ImGui::EndCombo();
  } else if (ImGui::IsItemHovered()) {
    ImGui::SetTooltip("traversal method: %s", std::string(find_method(query.method).summary).c_str());
  }
  ImGui::SameLine();
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
  if (ImGui::BeginCombo("##numeric", query.numeric.c_str())) {
    for (const NumericMode& m : kNumericModes) {
      const std::string name(m.name);
      if (ImGui::Selectable(name.c_str(), name == query.numeric)) query.numeric = name;
      if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", std::string(m.summary).c_str());
    }
    ImGui::EndCombo();
  } else if (ImGui::IsItemHovered()) {
    ImGui::SetTooltip("numeric mode: %s", std::string(find_numeric(query.numeric).summary).c_str());
  }
  if (ImGui::TreeNode("knobs")) {
    draw_knobs(query, device);
    ImGui::TreePop();
  }
  ImGui::PopID();
}

}  // namespace ballot::view
