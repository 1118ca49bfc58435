#include "tools/view/session.h"

#include <algorithm>
#include <cmath>

namespace ballot::view {

namespace {

constexpr std::size_t kGraphFrames = 240;
constexpr double kPartMs = 60;  // of a sample of an integrator at rest, between looks at the hands

double ms_between(std::chrono::steady_clock::time_point a, std::chrono::steady_clock::time_point b) {
  return std::chrono::duration<double, std::milli>(b - a).count();
}

Scene load_noting(const std::string& file, const LoadOptions& options) {
  Scene scene = load_scene(file, options);
  for (const std::string& note : scene.notes) say_aside("ballot: {}: {}\n", file, note);
  return scene;
}

}  // namespace

Session::Session(SessionOptions options) : options_(std::move(options)), settings_(options_.settings) {
  Scene scene = load_noting(options_.scene, options_.load);
  window_ = std::make_unique<Window>("Ballot", options_.width, options_.height);
  open(std::move(scene));
}

std::size_t Session::run() {
  while (!window_->closed() && (options_.frames == 0 || shown_frames_ < options_.frames)) frame();
  if (options_.frames == 0)
    save_view();
  else
    say_times();
  return world_->messages().size();
}

void Session::say(const std::string& message, bool failed) {
  facts_.message = message;
  facts_.failed = failed;
  ballot::say("{}\n", message);
  std::fflush(stdout);
}

/// Returns how much larger text must be than on a usual screen, and the number of pixels in a unit of window
/// coordinates.
glm::dvec2 Session::screen_scale() const {
  const double units = window_->size().x, pixels = window_->pixels().x;
  return {window_->content_scale(), units > 0 && pixels > 0 ? pixels / units : 1};
}

void Session::make_overlay() {
  overlay_.reset();  // only one may exist at a time
  overlay_scale_ = screen_scale();
  overlay_ = std::make_unique<Overlay>(*world_->context(), presenter_->pass(), overlay_scale_.x, overlay_scale_.y);
}

bool Session::at_rest() const {
  return !dirty_ && !moved_ && !part_ && !settings_.play.playing && announced_ == 0 &&
         int(facts_.samples) >= settings_.samples && facts_.scale == 1;
}

void Session::frame() {
  window_->poll(window_->minimised() || at_rest() ? 0.1 : 0);
  const auto now = Clock::now();
  const double wall_ms = ms_between(last_frame_, now), dt = std::min(wall_ms * 1e-3, 0.25);
  last_frame_ = now;
  if (window_->minimised()) return;
  if (window_->pixels() != window_pixels_) {
    window_pixels_ = window_->pixels();
    dirty_ = true;
    say(fmt::format("size {}x{}", window_pixels_.x, window_pixels_.y));
  }
  // The window moved to another screen, or it was just shown: only then does Wayland report the scale.
  if (screen_scale() != overlay_scale_) make_overlay();
  watch_shaders();
  if (!window_->input().dropped.empty()) open_dropped(window_->input().dropped.back());
  const Settings before = settings_;
  overlay_->begin(*window_, window_->input(), dt);
  over_panel_ = overlay_->takes_mouse();
  if (!overlay_->takes_keys()) take_keys();
  facts_.speed = camera_->speed();
  const Wishes wishes = draw_panels(settings_, facts_);
  overlay_->end();
  if (wishes.forget_pick) facts_.picked.reset();
  if (wishes.count) count();
  if (!(settings_ == before)) dirty_ = true, facts_.counters.reset();
  scaler_.set_target(double(settings_.target_ms));
  const bool played = play(dt);
  CameraInput hands = take_mouse();
  if (options_.frames > 0) hands.look_x += 1;
  moved_ = camera_->update(dt, hands) || played;
  if (moved_) facts_.counters.reset(), facts_.picked.reset();
  raw_wall_ms_ = wall_ms;
  trace();
  show();
  if (!moved_) hover();
  note_time(wall_ms);
}

void Session::note_time(double wall_ms) {
  const bool rested = facts_.resting;  // then this frame's time includes waiting for events
  facts_.resting = at_rest();
  if (rested) return;
  wall_ms_ = wall_ms_ == 0 ? wall_ms : wall_ms_ + 0.1 * (wall_ms - wall_ms_);
  facts_.fps = wall_ms_ > 0 ? 1000 / wall_ms_ : 0;
}

/// Prints the mean times of the frames that the graph shows.
void Session::say_times() {
  const auto mean = [&](double FrameRecord::*ms) {
    double sum = 0;
    for (const FrameRecord& f : facts_.frames) sum += f.*ms;
    return sum / double(std::max<std::size_t>(1, facts_.frames.size()));
  };
  std::string passes;
  for (const FramePass& pass : kFramePasses)
    if (mean(pass.ms) > 0) passes += fmt::format("{} {:.1f}, ", pass.name, mean(pass.ms));
  say(fmt::format("{} frames, {:.1f} ms each: {}the last of {}x{} pixels", facts_.frames.size(),
                  mean(&FrameRecord::wall), passes, facts_.width, facts_.height));
}

LiveOptions Session::live_options(const glm::uvec2& size) const {
  LiveOptions o;
  o.width = size.x;
  o.height = size.y;
  if (!settings_.integrator()) o.rays = settings_.rays;
  o.shading = settings_.shading;
  o.heat = settings_.heat;
  o.query = settings_.query;
  return o;
}

/// Announces kernels that are used for the first time and take a while to compile. Returns true while a frame must
/// still show the announcement.
bool Session::announce_kernels() {
  if (announced_ > 0) return --announced_ > 0;
  const bool counters = settings_.heats();
  const std::string paths = settings_.integrator() ? settings_.shading : "";
  Query q = settings_.query;
  q.want = find_ray_kind(settings_.rays).want;
  q.rays = settings_.rays;
  // The method's own name is part of the key: auto runs kernels of other methods, and it tries several when it first
  // gets rays of a class.
  const std::string name = q.method + " " + world_->picture_tracer().variant(q, counters).kernel_name() + paths;
  if (!kernels_.insert(name).second) return false;
  facts_.message = "compiling " + (paths.empty() ? q.method : paths) + " ...";
  facts_.failed = false;
  announced_ = 2;
  return true;
}

void Session::trace() {
  try {
    if (dirty_ || moved_) {
      part_.reset();
      if (announce_kernels()) return;
      add_sample(0, 1, moved_ && settings_.scale ? scaler_.scale() : 1);
      jittered_ = false;
      dirty_ = false;
    } else if (part_) {
      add_sample(part_->index, part_->count, 1);
    } else if (facts_.scale != 1 || int(facts_.samples) < settings_.samples) {
      const auto samples = std::uint32_t(settings_.samples);
      const bool begin = facts_.scale != 1 || !jittered_;
      add_sample(begin ? 0 : facts_.samples, samples, 1);
      jittered_ = true;
    }
    last_good_ = settings_;
    if (facts_.message.starts_with("compiling"))
      say(fmt::format("method {} {}", settings_.query.method, settings_.query.numeric));
  } catch (const Error& error) {
    if (settings_ == last_good_) throw;  // these settings worked before, so there is nothing to go back to
    say(error.what(), true);
    const bool panels = settings_.panels, help = settings_.help;
    const Playback play = settings_.play;
    settings_ = last_good_;
    settings_.panels = panels, settings_.help = help, settings_.play = play;
    dirty_ = true;
    return;
  }
  if (facts_.shader_error != world_->shader_error()) {
    facts_.shader_error = world_->shader_error();
    if (!facts_.shader_error.empty()) say("a shader does not compile", true);
  }
}

void Session::add_sample(std::uint32_t index, std::uint32_t count, double scale) {
  const auto scaled = [&](std::uint32_t n) { return std::max(1u, std::uint32_t(std::lround(n * scale))); };
  const glm::uvec2 size(scaled(window_pixels_.x), scaled(window_pixels_.y));
  LiveOptions o = live_options(size);
  o.sample_index = index;
  o.sample_count = count;
  o.part_ms = moved_ ? 0 : kPartMs;
  o.goes_on = part_.has_value();
  const View view = camera_->view();
  const LiveTimes times = world_->live().add_sample(view, o);
  part_.reset();
  if (!times.finished) {
    part_ = {index, count};
    return;
  }
  traced_ = size;
  facts_.view_name = view.name;
  facts_.last = times;
  facts_.width = size.x;
  facts_.height = size.y;
  facts_.scale = scale;
  facts_.samples = index + 1;
  facts_.frames.push_back({facts_.pose_ms, facts_.tree_ms, times.generate_ms + times.primary_ms, times.trace_ms,
                           times.shade_ms, presenter_->last_ms(), raw_wall_ms_});
  ++shown_frames_;
  if (facts_.frames.size() > kGraphFrames) facts_.frames.pop_front();
  // The first sample of a picture at rest also predicts the time of a frame in motion, before the first move. Later
  // samples are not counted.
  if (settings_.scale && scale == scaler_.scale() && (moved_ || index == 0))
    scaler_.measured(times.total_ms(), presenter_->last_ms());
}

void Session::show() {
  ShownPicture picture;
  if (traced_.x) picture = {&world_->live().pixels(), traced_.x, traced_.y};
  const auto paint = [this](VkCommandBuffer cmd) { overlay_->paint(cmd); };
  presenter_->show(picture, paint, window_pixels_.x, window_pixels_.y);
}

}  // namespace ballot::view
