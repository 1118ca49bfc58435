// The panels of frame times, of animations, and of the pixel inspector.
#include <algorithm>

#include "tools/view/panels.h"

namespace ballot::view {

namespace {

constexpr ImU32 kPassColors[] = {IM_COL32(240, 98, 146, 255),  IM_COL32(255, 213, 79, 255),
                                 IM_COL32(120, 144, 156, 255), IM_COL32(79, 163, 255, 255),
                                 IM_COL32(111, 207, 117, 255), IM_COL32(186, 130, 224, 255)};
static_assert(std::size(kPassColors) == std::size(kFramePasses));

double sum_of(const FrameRecord& frame) {
  double ms = 0;
  for (const FramePass& pass : kFramePasses) ms += frame.*pass.ms;
  return ms;
}

/// Returns the top of the graph: a round number of milliseconds above all but the slowest 5 % of the frames.
double top_of(const std::deque<FrameRecord>& frames) {
  std::vector<double> sums;
  for (const FrameRecord& f : frames) sums.push_back(sum_of(f));
  std::ranges::sort(sums);
  const double most = sums.empty() ? 1 : sums[sums.size() * 19 / 20] * 1.1;
  for (double top = 1;; top *= 2)
    if (top >= most) return top;
}

void row(const char* name, const std::string& value) {
  faint(name);
  ImGui::SameLine(6.5f * em());
  text(value);
}

void draw_hit(const Inspection& i, const Scene& scene) {
  const Hit& hit = i.probe.hit;
  row("pixel", fmt::format("{}, {}", i.pixel.x, i.pixel.y));
  if (hit.prim == NO_HIT) {
    row("prim", "none: a miss");
    return;
  }
  row("prim", std::to_string(hit.prim));
  row("t", fmt::format("{:.7g}", hit.t));
  row("u, v", fmt::format("{:.5f}, {:.5f}", hit.u, hit.v));
  const Material& material = scene.materials[scene.material(hit.prim)];
  row("material", material.name.empty() ? "unnamed" : material.name);
}

void draw_exact(const Inspection& i) {
  if (i.exact.prim == NO_HIT) {
    row("exact", "a miss");
  } else {
    row("exact", fmt::format("prim {}, t {:.10g}", i.exact.prim, i.exact.t));
    if (i.probe.hit.prim == i.exact.prim) row("error of t", fmt::format("{:.3g} ulp", i.t_ulp));
  }
  if (i.agrees)
    ImGui::TextColored({0.45f, 0.85f, 0.5f, 1}, "agrees with the exact oracle");
  else
    ImGui::TextColored(kRed, "differs from the exact oracle");
  if (!i.reason.empty()) wrapped(i.reason, faint);
}

}  // namespace

void draw_play(Settings& settings, const Facts& facts) {
  const Animation* animation = facts.world->scene_facts().animation.get();
  if (!animation) return;
  Playback& p = settings.play;
  title("Animation");
  if (animation->clips.size() > 1 && ImGui::BeginCombo("clip", animation->clips[p.clip].name.c_str())) {
    for (std::size_t i = 0; i < animation->clips.size(); ++i)
      if (ImGui::Selectable(fmt::format("{}##{}", animation->clips[i].name, i).c_str(), i == p.clip))
        p.clip = i, p.seconds = 0;
    ImGui::EndCombo();
  }
  if (ImGui::SmallButton(p.playing ? "pause (P)" : "play (P)")) p.playing = !p.playing;
  const auto most = float(animation->clips[p.clip].seconds);
  float seconds = float(p.seconds);
  if (ImGui::SliderFloat("seconds", &seconds, 0, most, "%.3f", ImGuiSliderFlags_AlwaysClamp)) {
    p.seconds = double(seconds);
    p.playing = false;
  }
  ImGui::SliderFloat("speed", &p.speed, 0.05f, 4, "%.2f", ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp);
  std::string update(std::ranges::find(kUpdateModes, p.update, &UpdateModeRow::id)->name);
  if (draw_list("tree", update, kUpdateModes)) p.update = find_named(kUpdateModes, update, "update mode").id;
  faint(fmt::format("{}, SAH {:.3f} of its build's", facts.refitted ? "refitted" : "built",
                    facts.world->refit_policy().decay()));
}

void draw_times(const Facts& facts) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float width = ImGui::GetContentRegionAvail().x, height = 4.2f * em();
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  draw.AddRectFilled(at, {at.x + width, at.y + height}, IM_COL32(20, 22, 27, 255), 3);
  const double top = top_of(facts.frames);
  constexpr std::size_t kShown = 120;
  const float bar = width / float(kShown);
  const std::size_t count = std::min(kShown, facts.frames.size());
  for (std::size_t i = 0; i < count; ++i) {
    const FrameRecord& frame = facts.frames[facts.frames.size() - count + i];
    const float x = at.x + bar * float(kShown - count + i);
    float y = at.y + height;
    for (std::size_t p = 0; p < std::size(kFramePasses); ++p) {
      const float part = float(frame.*kFramePasses[p].ms / top) * height;
      const float up = std::max(at.y, y - part);
      if (part > 0) draw.AddRectFilled({x, up}, {x + std::max(1.0f, bar - 0.5f), y}, kPassColors[p]);
      y = up;
    }
  }
  draw.AddText({at.x + 4, at.y + 1}, IM_COL32(160, 166, 176, 255), fmt::format("{:.0f} ms", top).c_str());
  ImGui::Dummy({width, height});
  int placed = 0;
  for (std::size_t p = 0; p < std::size(kFramePasses); ++p) {
    const FramePass& pass = kFramePasses[p];
    if (pass.moves && !facts.world->scene_facts().animation) continue;
    const double ms = facts.frames.empty() ? 0 : facts.frames.back().*pass.ms;
    if (placed++ % 2) ImGui::SameLine(width / 2 + ImGui::GetStyle().WindowPadding.x);
    const ImVec2 spot = ImGui::GetCursorScreenPos();
    const float size = em() * 0.6f, drop = em() * 0.25f;
    draw.AddRectFilled({spot.x, spot.y + drop}, {spot.x + size, spot.y + drop + size}, kPassColors[p], 2);
    ImGui::Dummy({size, size});
    ImGui::SameLine();
    text(fmt::format("{} {:.{}f} ms", pass.name, ms, ms < 100 ? 2 : 0));
  }
}

void draw_inspector(const Facts& facts, Wishes& wishes) {
  const bool picked = facts.picked.has_value();
  if (!picked && !facts.hovered) return;
  const Inspection& i = picked ? *facts.picked : *facts.hovered;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float width = 19 * em();
  ImGui::SetNextWindowPos({size.x - kMargin, kMargin}, 0, {1, 0});
  ImGui::SetNextWindowSizeConstraints({width, 0}, {width, size.y - 2 * kMargin});
  ImGui::Begin("inspector", nullptr, kFixed | (picked ? 0 : ImGuiWindowFlags_NoInputs));
  title(picked ? "Picked pixel" : "Pixel under the mouse");
  draw_hit(i, facts.world->scene_facts());
  if (picked) {
    for (const HeatKind& kind : kHeatKinds)
      if (i.probe.counted) row(std::string(kind.name).c_str(), fmt::format("{:.4g}", kind.value(i.probe.stats)));
    if (i.judged) draw_exact(i);
    wishes.forget_pick = ImGui::SmallButton("close");
  } else {
    faint("click for counters and the exact answer");
  }
  ImGui::End();
}

}  // namespace ballot::view
