// The part of Session that handles keys and mouse.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tools/view/session.h"

namespace ballot::view {

namespace {

constexpr double kClickPixels = 4;

/// Returns the name after `now` in a registry, or the one before it; wraps around at the ends.
template <class List>
std::string next_in(const List& list, const std::string& now, bool back) {
  const std::size_t count = std::size(list);
  std::size_t at = 0;
  for (std::size_t i = 0; i < count; ++i)
    if (list[i].name == now) at = i;
  return std::string(list[(at + (back ? count - 1 : 1)) % count].name);
}

}  // namespace

void Session::take_keys() {
  for (const KeyPress& press : window_->input().pressed) take_key(press);
}

void Session::take_key(const KeyPress& press) {
  const bool back = (press.mods & GLFW_MOD_SHIFT) != 0;
  if (press.mods & GLFW_MOD_CONTROL) {
    if (press.key == GLFW_KEY_Q) window_->close();
    return;
  }
  Settings& s = settings_;
  switch (press.key) {
    case GLFW_KEY_M:
      s.query.method = next_in(kMethods, s.query.method, back);
      s.query.knobs.clear();
      return;
    case GLFW_KEY_N:
      s.query.numeric = next_in(kNumericModes, s.query.numeric, back);
      return say("numeric " + s.query.numeric);
    case GLFW_KEY_K:
      s.rays = next_in(kRayKinds, s.rays, back);
      return say("rays " + s.rays);
    case GLFW_KEY_G:
      s.shading = next_in(shadings(), s.shading, back);
      return say("shading " + s.shading);
    case GLFW_KEY_B:
      s.heat = next_in(kHeatKinds, s.heat, back);
      return say("heat " + s.heat);
    case GLFW_KEY_P:
      return toggle_play();
    case GLFW_KEY_C:
      return count();
    case GLFW_KEY_V:
      return append_view();
    case GLFW_KEY_R:
      return reload("key R");
    case GLFW_KEY_TAB:
      s.panels = !s.panels;
      return;
    case GLFW_KEY_H:
    case GLFW_KEY_SLASH:
      s.help = !s.help;
      return;
    case GLFW_KEY_ESCAPE:
      s.help = false;
      return facts_.picked.reset();
    case GLFW_KEY_F11:
      return window_->toggle_full_screen();
    case GLFW_KEY_F12:
      return shoot();
    default:
      if (press.key >= GLFW_KEY_1 && press.key <= GLFW_KEY_9) choose_number(press.key - GLFW_KEY_1);
  }
}

void Session::choose_number(int digit) {
  if (std::size_t(digit) >= views_.size())
    return say(fmt::format("there are {} views, no view {}", views_.size(), digit + 1), true);
  go_to(views_[std::size_t(digit)]);
  say("view " + views_[std::size_t(digit)].name);
}

CameraInput Session::take_mouse() {
  const Input& in = window_->input();
  CameraInput hands;
  const bool control = in.down[GLFW_KEY_LEFT_CONTROL] || in.down[GLFW_KEY_RIGHT_CONTROL];
  if (!overlay_->takes_keys() && !control) {
    const auto axis = [&](int plus, int minus) { return double(in.down[plus]) - double(in.down[minus]); };
    hands.move = {axis(GLFW_KEY_D, GLFW_KEY_A), axis(GLFW_KEY_E, GLFW_KEY_Q), axis(GLFW_KEY_S, GLFW_KEY_W)};
    hands.fast = in.down[GLFW_KEY_LEFT_SHIFT] || in.down[GLFW_KEY_RIGHT_SHIFT];
  }
  take_click();
  if (over_panel_) return hands;
  hands.look_x = in.dragged[1].x, hands.look_y = in.dragged[1].y;
  if (dragged_) hands.orbit_x = in.dragged[0].x, hands.orbit_y = in.dragged[0].y;
  if (in.scrolled != 0) camera_->change_speed(std::pow(1.15, in.scrolled));
  return hands;
}

/// Handles the left button. A press sets the point that a drag orbits about; press and release in one place pick the
/// pixel.
void Session::take_click() {
  const Input& in = window_->input();
  static constexpr double kNever = -1e9;
  if (in.clicked[0]) {
    pressed_at_ = over_panel_ ? glm::dvec2(kNever) : in.mouse;
    dragged_ = false;
    if (over_panel_) return;
    if (const auto pixel = pixel_at(in.mouse)) {
      const Probe p = world_->live().probe(camera_->view(), live_options(window_pixels_), pixel->x, pixel->y, false);
      if (p.hit.prim != NO_HIT) camera_->set_pivot(glm::dvec3(p.ray.origin) + double(p.hit.t) * glm::dvec3(p.ray.dir));
    }
  }
  if (pressed_at_.x == kNever) return;
  if (glm::distance(pressed_at_, in.mouse) > kClickPixels) dragged_ = true;
  if (in.buttons[0]) return;
  if (!dragged_) pick(pressed_at_);
  pressed_at_ = glm::dvec2(kNever);
}

std::optional<glm::uvec2> Session::pixel_at(const glm::dvec2& mouse) const {
  const glm::dvec2 size = window_->size(), at = mouse / size * glm::dvec2(window_pixels_);
  if (at.x < 0 || at.y < 0 || at.x >= window_pixels_.x || at.y >= window_pixels_.y) return std::nullopt;
  return glm::uvec2(at);
}

void Session::hover() {
  const Input& in = window_->input();
  const auto pixel = over_panel_ || in.buttons[1] ? std::nullopt : pixel_at(in.mouse);
  if (!pixel || !settings_.panels || traced_.x == 0) return facts_.hovered.reset();
  if (facts_.hovered && facts_.hovered->pixel == *pixel && at_rest()) return;
  const Probe probe = world_->live().probe(camera_->view(), live_options(window_pixels_), pixel->x, pixel->y, false);
  facts_.hovered.emplace();
  facts_.hovered->pixel = *pixel;
  facts_.hovered->probe = probe;
}

void Session::judge(Inspection& i, const Query& query) {
  const auto batch = world_->make_batch("pixel", std::span(&i.probe.ray, 1), Want::Nearest);
  const ExactTruth truth = world_->checker().exact_truth(*batch);
  const ErrorFigures figures =
      world_->checker().judge(std::span(&i.probe.ray, 1), std::span(&i.probe.hit, 1), truth, query, 1);
  i.exact = truth.hits[0];
  i.agrees = figures.errors() == 0;
  i.t_ulp = figures.t_ulp.max;
  if (figures.cases.empty()) return;
  const ErrorCase& c = figures.cases[0];
  i.reason = fmt::format("{}: {}{}", name_of(c.kind), c.reason, c.within_bound ? " (within the mode's bound)" : "");
}

void Session::pick(const glm::dvec2& mouse) {
  const auto pixel = pixel_at(mouse);
  if (!pixel) return;
  const LiveOptions o = live_options(window_pixels_);
  Inspection i;
  i.pixel = *pixel;
  i.picked = true;
  i.probe = world_->live().probe(camera_->view(), o, pixel->x, pixel->y, true);
  i.judged = world_->features().tree.shapes == 0;
  if (i.judged) judge(i, o.query);
  facts_.picked = i;
  say(fmt::format("pixel {}, {}: prim {}{}", pixel->x, pixel->y, i.probe.hit.prim,
                  i.judged ? fmt::format(", exact {}", i.exact.prim) : ""));
}

void Session::count() {
  const auto batch =
      world_->make_batch(camera_->view(), find_ray_kind(settings_.rays), window_pixels_.x, window_pixels_.y);
  facts_.counters = world_->count(*batch, settings_.query);
  const double rays = double(std::max<std::uint64_t>(1, facts_.counters->rays));
  say(fmt::format("{}: {:.1f} nodes per ray", settings_.query.method, double((*facts_.counters)["nodes"]) / rays));
}

}  // namespace ballot::view
