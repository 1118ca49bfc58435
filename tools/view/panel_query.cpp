// The panel that chooses method, numeric mode and knobs. It is built from the registries, so a new method or knob
// appears without a change here.
#include <charconv>
#include <set>

#include "tools/view/panels.h"

namespace ballot::view {

namespace {

void draw_knobs(Query& query, const DeviceInfo& device) {
  for (const KnobInfo& knob : knobs()) {
    const std::string now = knob_value(knob.name, query, device);
    if (now.empty()) continue;
    if (ImGui::BeginCombo(knob.name.c_str(), now.c_str())) {
      for (const std::string& value : knob_choices(knob, query, device))
        if (ImGui::Selectable(value.c_str(), value == now)) query.knobs[knob.name] = value;
      ImGui::EndCombo();
    }
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s: %s", knob.values.c_str(), knob.what.c_str());
  }
  if (!query.knobs.empty() && ImGui::SmallButton("device defaults")) query.knobs.clear();
}

}  // namespace

std::string knob_value(std::string_view knob, const Query& query, const DeviceInfo& device) {
  const Method& method = find_method(query.method);
  const KernelConfig config = kernel_config_for(method, find_numeric(query.numeric), device, query.knobs);
  if (knob == "subgroup") return std::to_string(config.subgroup);
  const std::string text = " " + describe(config, method) + " " + describe_threshold(config, method) + " ";
  const std::string key = " " + std::string(knob) + "=";
  const std::size_t at = text.find(key);
  if (at == std::string::npos) return "";
  const std::size_t begin = at + key.size();
  return text.substr(begin, text.find(' ', begin) - begin);
}

std::vector<std::string> knob_choices(const KnobInfo& knob, const Query& query, const DeviceInfo& device) {
  std::vector<std::string> values;
  const bool share = knob.values == "0 to 1", number = knob.values.find(" to ") != std::string::npos;
  if (share) {
    for (int eighths = 0; eighths <= 8; ++eighths) values.push_back(fmt::format("{}", eighths / 8.0));
  } else if (number || knob.name == "subgroup") {  // powers of two, and the numbers beside the present one
    const std::string now = knob_value(knob.name, query, device);
    std::int64_t present = 0;
    std::from_chars(now.data(), now.data() + now.size(), present);
    std::set<std::int64_t> numbers{0, present - 1, present, present + 1};
    for (std::int64_t power = 1; power <= 1 << 24; power *= 2) numbers.insert(power);
    for (const std::int64_t n : numbers) values.push_back(std::to_string(n));
  } else {
    for (std::size_t at = 0, end = 0; end != std::string::npos; at = end + 2) {
      end = knob.values.find(", ", at);
      values.push_back(knob.values.substr(at, end - at));
    }
  }
  std::erase_if(values, [&](const std::string& value) {
    Query other = query;
    other.knobs[knob.name] = value;
    try {
      return knob_value(knob.name, other, device).empty();
    } catch (const Error&) {
      return true;  // the device or the method does not support the value
    }
  });
  return values;
}

void draw_query(Query& query, const DeviceInfo& device) {
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x * 0.52f);
  if (draw_list("##method", query.method, kMethods)) query.knobs.clear();
  ImGui::SameLine();
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
  draw_list("##numeric", query.numeric, kNumericModes);
  if (!ImGui::TreeNode("knobs")) return;
  draw_knobs(query, device);
  ImGui::TreePop();
}

}  // namespace ballot::view
