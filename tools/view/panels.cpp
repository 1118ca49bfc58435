#include "tools/view/panels.h"

#include <algorithm>

#include "tools/program/pieces.h"

namespace ballot::view {

namespace {

const ImVec4 kWarm{1.0f, 0.72f, 0.35f, 1};

void draw_heat_legend(float top) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float width = ImGui::GetContentRegionAvail().x, height = em() * 0.7f;
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const auto ramp = heat_ramp();
  const auto color = [&](std::size_t i) { return ImGui::GetColorU32({ramp[i].r, ramp[i].g, ramp[i].b, 1}); };
  const float step = width / float(ramp.size() - 1);
  for (std::size_t i = 0; i + 1 < ramp.size(); ++i)
    draw.AddRectFilledMultiColor({at.x + step * float(i), at.y}, {at.x + step * float(i + 1), at.y + height}, color(i),
                                 color(i + 1), color(i + 1), color(i));
  ImGui::Dummy({width, height});
  const std::string most = fmt::format("{:.4g}", top);
  faint("0");
  ImGui::SameLine(ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(most.c_str()).x +
                  ImGui::GetStyle().WindowPadding.x);
  faint(most);
}

void draw_picture(Settings& s, const Facts& facts) {
  title("Picture");
  ImGui::BeginDisabled(s.integrator());  // they trace rays of their own
  draw_list("rays", s.rays, kRayKinds);
  ImGui::EndDisabled();
  draw_list("shading", s.shading, shadings());
  if (s.heats()) {
    draw_list("heat", s.heat, kHeatKinds);
    draw_heat_legend(facts.last.heat_top);
    faint("times are those of the counting kernel");
  }
}

void draw_quality(Settings& s) {
  ImGui::Spacing();
  if (!ImGui::TreeNode("quality")) return;
  ImGui::Checkbox("fewer pixels while moving", &s.scale);
  if (s.scale) ImGui::SliderFloat("ms per frame", &s.target_ms, 4, 200, "%.0f", ImGuiSliderFlags_Logarithmic);
  ImGui::SliderInt("samples at rest", &s.samples, 1, 1024, "%d", ImGuiSliderFlags_Logarithmic);
  ImGui::TreePop();
}

void draw_counters(const Counters& c) {
  const double rays = double(std::max<std::uint64_t>(1, c.rays));
  text(fmt::format("{:.1f} nodes, {:.1f} triangles per ray", double(c["nodes"]) / rays,
                   double(c["triangles_tested"]) / rays));
  faint(fmt::format("{:.0f} % lanes active, {:.0f} % of nodes shared", 100 * c.active_lanes(), 100 * c.packet_share()));
}

void draw_figures(const Facts& facts, Wishes& wishes) {
  title("Speed");
  text(fmt::format("trace {:.2f} ms   {:.1f} Mrays/s", facts.last.trace_ms, facts.last.mrays_per_s()));
  draw_times(facts);
  if (facts.counters) draw_counters(*facts.counters);
  wishes.count = ImGui::SmallButton("count nodes and lanes (C)");
}

void draw_main(Settings& s, const Facts& facts, Wishes& wishes) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float width = 21 * em();
  ImGui::SetNextWindowPos({kMargin, kMargin});
  ImGui::SetNextWindowSizeConstraints({width, 0}, {width, std::max(100.0f, size.y - 3 * kMargin - 2.6f * em())});
  ImGui::Begin("main", nullptr, kFixed);
  const DeviceInfo& device = facts.world->device();
  text(facts.world->scene_facts().name + "   " + facts.view_name);
  faint(fmt::format("{}, subgroup of {}", cli::pieces_text(facts.world->scene_facts()), device.subgroup_size));
  wrapped(device.name, faint);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", device.driver.c_str());
  ImGui::PushItemWidth(-7.5f * em());
  title("Traversal");
  draw_query(s.query, device);
  draw_picture(s, facts);
  draw_play(s, facts);
  draw_figures(facts, wishes);
  draw_quality(s);
  ImGui::PopItemWidth();
  ImGui::End();
}

// The window's size is set here. ImGui would know it one frame later, and a frame may take long.
void draw_status(const Facts& facts) {
  std::string line = facts.resting ? "at rest" : fmt::format("{:.0f} fps", facts.fps);
  line += fmt::format("   {}x{}", facts.width, facts.height);
  if (facts.scale < 1) line += fmt::format(" ({:.0f} %)", 100 * facts.scale);
  line += facts.samples > 1 ? fmt::format("   {} samples", facts.samples) : "";
  line += fmt::format("   speed {:.3g}/s   H help", facts.speed);
  const ImVec2 size = ImGui::GetIO().DisplaySize, padding(10, 4);
  const float gap = facts.message.empty() ? 0 : 1.5f * em();
  const float width = ImGui::CalcTextSize(line.c_str()).x + gap + ImGui::CalcTextSize(facts.message.c_str()).x;
  ImGui::SetNextWindowSize({std::min(width + 2 * padding.x, size.x - 2 * kMargin), em() + 2 * padding.y + 4});
  ImGui::SetNextWindowPos({kMargin, size.y - kMargin}, 0, {0, 1});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, padding);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1, 1));
  ImGui::Begin("status", nullptr, (kFixed & ~ImGuiWindowFlags_AlwaysAutoResize) | ImGuiWindowFlags_NoScrollbar);
  text(line);
  if (!facts.message.empty()) {
    ImGui::SameLine(0, gap);
    ImGui::TextColored(facts.failed ? kRed : kWarm, "%s", facts.message.c_str());
  }
  ImGui::End();
  ImGui::PopStyleVar(2);
}

void draw_shader_error(const std::string& message) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({size.x - kMargin, size.y - kMargin - 2.2f * em()}, 0, {1, 1});
  const float width = std::min(46 * em(), size.x - 24 * em());
  ImGui::SetNextWindowSizeConstraints({std::max(width, 15 * em()), 0}, {std::max(width, 15 * em()), size.y * 0.5f});
  ImGui::Begin("shader error", nullptr, kFixed);
  ImGui::TextColored(kRed, "A shader does not compile; the last one that did is in use.");
  wrapped(message.substr(0, message.find_last_not_of('\n') + 1), text);
  ImGui::End();
}

}  // namespace

const std::vector<NamedShading>& shadings() {
  static const std::vector<NamedShading> all = [] {
    std::vector<NamedShading> names;
    for (const Shading& s : kShadings) names.push_back({s.name, s.summary});
    for (const Integrator& i : kIntegrators) names.push_back({i.name, i.summary});
    return names;
  }();
  return all;
}

std::string shading_named(const std::string& name) {
  const Integrator* integrator = find_integrator(name);
  return std::string(integrator ? integrator->name : find_shading(name).name);
}

bool Settings::operator==(const Settings& o) const {
  return query.method == o.query.method && query.numeric == o.query.numeric && query.knobs == o.query.knobs &&
         rays == o.rays && shading == o.shading && heat == o.heat;
}

void draw_help() {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({size.x / 2, size.y / 2}, 0, {0.5f, 0.5f});
  ImGui::Begin("help", nullptr, kFixed);
  static constexpr std::pair<const char*, const char*> kKeys[] = {
      {"W A S D, E Q", "fly; E up, Q down"},
      {"Shift", "faster; the wheel changes the speed"},
      {"right button", "look round"},
      {"left button", "drag: orbit; click: inspect the pixel"},
      {"1 to 9", "go to a view of the scene"},
      {"M, N", "next method, numeric mode (Shift: previous)"},
      {"K, G, B", "next ray kind, shading, heat map"},
      {"P", "play or pause the scene's animation"},
      {"C", "count nodes and lanes"},
      {"V", "append the view to the views file"},
      {"F12", "write the view as EXR and PNG"},
      {"R", "reload shaders (also done when a file changes)"},
      {"Tab, H or ?", "show or hide the panels, this help"},
      {"F11, Ctrl+Q", "full screen, quit"},
      {"drop a file", "opens that scene"},
  };
  title("Keys");
  if (ImGui::BeginTable("keys", 2)) {
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, 9 * em());
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, 24 * em());
    for (const auto& [keys, what] : kKeys) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      text(keys);
      ImGui::TableNextColumn();
      faint(what);
    }
    ImGui::EndTable();
  }
  ImGui::End();
}

Wishes draw_panels(Settings& settings, const Facts& facts) {
  Wishes wishes;
  if (settings.panels) {
    draw_main(settings, facts, wishes);
    draw_inspector(facts, wishes);
  }
  draw_status(facts);
  if (!facts.shader_error.empty()) draw_shader_error(facts.shader_error);
  if (settings.help) draw_help();
  return wishes;
}

}  // namespace ballot::view
