// The overlay's panels: ImGui calls that show settings and facts, built from the registries of methods, numeric modes
// and knobs.
#pragma once

#include <imgui/imgui.h>

#include "tools/view/state.h"

namespace ballot::view {

inline constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                                           ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                                           ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing;
inline constexpr float kMargin = 10;
inline const ImVec4 kRed{1.0f, 0.45f, 0.40f, 1};

inline float em() { return ImGui::GetFontSize(); }
inline void text(const std::string& line) { ImGui::TextUnformatted(line.c_str()); }
inline void faint(const std::string& line) { ImGui::TextDisabled("%s", line.c_str()); }
inline void wrapped(const std::string& lines, void (*draw)(const std::string&)) {
  ImGui::PushTextWrapPos(0);
  draw(lines);
  ImGui::PopTextWrapPos();
}
inline void title(const char* name) {
  ImGui::Spacing();
  ImGui::TextColored({0.45f, 0.72f, 1.0f, 1}, "%s", name);
  ImGui::Separator();
}

/// Draws all panels. The panels change `settings`; the result holds what they ask the session to do.
Wishes draw_panels(Settings& settings, const Facts& facts);

/// Draws a list of a registry's names, of which one is chosen. Returns true if another one was.
template <class List>
bool draw_list(const char* label, std::string& value, const List& list) {
  const auto explain = [](const auto& item) {
    if constexpr (requires { item.summary; }) ImGui::SetTooltip("%s", std::string(item.summary).c_str());
  };
  const std::string before = value;
  if (ImGui::BeginCombo(label, value.c_str(), ImGuiComboFlags_HeightLargest)) {
    for (const auto& item : list) {
      if (ImGui::Selectable(std::string(item.name).c_str(), item.name == value)) value = item.name;
      if (ImGui::IsItemHovered()) explain(item);
    }
    ImGui::EndCombo();
  } else if (ImGui::IsItemHovered()) {
    for (const auto& item : list)
      if (item.name == value) explain(item);
  }
  return value != before;
}

/// Draws method, numeric mode and knobs of a query.
void draw_query(Query& query, const DeviceInfo& device);

/// Returns the value of a knob in a query's kernel; empty if the knob does not affect the method.
std::string knob_value(std::string_view knob, const Query& query, const DeviceInfo& device);
/// Returns the values of a knob that the panel offers: those that the device and the method support.
std::vector<std::string> knob_choices(const KnobInfo& knob, const Query& query, const DeviceInfo& device);

/// Draws a graph of the times of the last frames, stacked by pass, and its legend.
void draw_times(const Facts& facts);

/// Draws what plays of an animation, if the scene has one, and what its tree costs.
void draw_play(Settings& settings, const Facts& facts);

void draw_inspector(const Facts& facts, Wishes& wishes);
void draw_help();

}  // namespace ballot::view
