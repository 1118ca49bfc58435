// The part of Session that reads and writes scenes, views and pictures, and reloads shaders.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <filesystem>

#include "tools/program/pieces.h"
#include "tools/program/views_file.h"
#include "tools/view/session.h"

namespace ballot::view {

namespace {

namespace fs = std::filesystem;

/// Returns a scene's name as part of a file name: folder separators and control characters become '_'.
std::string file_name(std::string name) {
  for (char& c : name)
    if (c == '/' || static_cast<unsigned char>(c) < 32) c = '_';
  return name;
}

double diagonal_of(const Scene& scene) {
  const glm::dvec3 size = glm::dvec3(scene.bounds.hi) - glm::dvec3(scene.bounds.lo);
  const double length = std::sqrt(size.x * size.x + size.y * size.y + size.z * size.z);
  return length > 0 ? length : 1;
}

/// Returns when the newest file of a folder was written; the beginning of time if there is none.
fs::file_time_type newest_in(const fs::path& folder) {
  fs::file_time_type newest = fs::file_time_type::min();
  std::error_code error, gone;  // `gone` is set if an editor is just replacing a file
  for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    newest = std::max(newest, at->last_write_time(gone));
  return newest;
}

/// Returns the tone mapping that the window shows an integrator's pictures with.
Tone tone_of(const Integrator* integrator) { return {.neutral = integrator && integrator->sees == Sees::Materials}; }

}  // namespace

void Session::open(Scene scene) {
  const WindowSurface surface = window_->surface();
  DeviceSceneOptions options = options_.world;
  options.window = &surface;
  if (world_) options.context = world_->context();  // it owns the window's surface
  world_.reset();
  const std::string name = scene.name;
  if (options_.light) options_.light(scene);
  ProgressBar bar("building BVH");
  world_ = std::make_unique<DeviceScene>(std::move(scene), options, [&](double done) {
    bar.update(done);
    window_->set_title(fmt::format("Ballot: {} - building BVH {:.0f} %", name, 100 * done));
  });
  bar.hide();
  if (!presenter_) {
    presenter_ = world_->make_presenter();
    make_overlay();
  }
  window_->set_title("Ballot: " + name);
  if (!options_.target_given) settings_.target_ms = world_->device().is_cpu() ? 50.0f : 8.0f;
  scaler_ = Scaler(double(settings_.target_ms));
  camera_ = std::make_unique<FlyCamera>(diagonal_of(world_->scene()));
  facts_ = Facts{};
  facts_.world = world_.get();
  facts_.scene_file = options_.scene;
  kernels_.clear();
  settings_.play = {};
  shown_time_ = {0, 0.0};
  traced_ = {0, 0};
  last_good_ = settings_;
  dirty_ = true;
  shaders_of_ = newest_in(shaders_);
  load_views();
  say(fmt::format("{}: {} on {} ({})", name, cli::pieces_text(world_->scene_facts()), world_->device().name,
                  world_->device().driver));
}

void Session::load_views() {
  views_ = world_->scene().views;
  std::error_code error;
  if (fs::exists(views_file(), error))
    for (View& v : cli::read_views(views_file())) views_.push_back(std::move(v));
  if (!options_.view.empty()) {
    for (const View& v : views_)
      if (v.name == options_.view) return go_to(v);
    find_view(world_->scene(), options_.view);  // throws an error that lists the names
  }
  if (const auto kept = options_.frames == 0 ? read_cache(saved_view_file()) : std::nullopt) {
    try {
      return go_to(cli::views_in(saved_view_file(), *kept).front());
    } catch (const Error&) {
      // A damaged cache file loses the last position, nothing else.
    }
  }
  go_to(views_.front());
}

void Session::go_to(const View& view) {
  camera_->set(view);
  facts_.picked.reset();
  dirty_ = true;
}

void Session::open_dropped(const std::string& path) {
  try {
    Scene scene = load_scene(path, options_.load);
    save_view();
    const std::string before = options_.scene;
    options_.scene = path;
    options_.view.clear();
    try {
      open(std::move(scene));
    } catch (const Error& error) {
      options_.scene = before;
      open(load_scene(before, options_.load));
      throw;
    }
  } catch (const Error& error) {
    say(error.what(), true);
  }
}

// The name depends on path and content, so another scene of the same name has its own file.
fs::path Session::saved_view_file() const {
  std::error_code error;
  const fs::path path = fs::weakly_canonical(options_.scene, error);
  const std::string text = error ? options_.scene : path.string();
  const auto& triangles = world_->scene().triangles;
  const XXH64_hash_t content = XXH3_64bits(triangles.data(), triangles.size() * sizeof(Triangle));
  const XXH64_hash_t hash = XXH3_64bits_withSeed(text.data(), text.size(), content);
  return cache_folder() / "views" / fmt::format("{:016x}.json", hash);
}

void Session::save_view() const {
  try {
    const std::string text = cli::views_text({camera_->view()});
    write_cache(saved_view_file(), std::as_bytes(std::span(text)));
  } catch (const Error&) {
    // Without a folder for caches the last position is lost, nothing else.
  }
}

fs::path Session::views_file() const {
  if (!options_.views_file.empty()) return options_.views_file;
  return fs::path(options_.out) / (file_name(world_->scene().name) + "-views.json");
}

// Also moves the camera to exactly the view in the file, so that a later picture of that view equals the one shown.
void Session::append_view() {
  try {
    View view = cli::as_written(camera_->view());
    std::set<std::string> names;
    for (const View& v : views_) names.insert(v.name);
    for (int n = 1; names.contains(view.name = fmt::format("saved-{}", n));) ++n;
    cli::append_view(views_file(), view, options_.views_file.empty() ? Links::Replace : Links::Follow);
    views_.push_back(view);
    go_to(view);
    say(fmt::format("{} appended to {}", view.name, views_file().string()));
  } catch (const Error& error) {
    say(error.what(), true);
  }
}

fs::path Session::next_shot() const {
  std::error_code error;
  for (int n = 1;; ++n) {
    const fs::path file = fs::path(options_.out) / fmt::format("{}-shot-{}.exr", file_name(world_->scene().name), n);
    if (!fs::exists(file, error)) return file;
  }
}

void Session::shoot() {
  try {
    const fs::path exr = next_shot();
    fs::path beside = exr;
    if (!camera_->untouched()) {
      View view = cli::as_written(camera_->view());
      view.name = exr.stem().string();
      go_to(view);
      cli::write_views(beside.replace_extension(".json"), {view}, Links::Replace);
    }
    RenderOptions o;
    o.width = window_pixels_.x;
    o.height = window_pixels_.y;
    o.shading = settings_.shading;
    o.heat = settings_.heat;
    o.query = settings_.query;
    const Integrator* integrator = settings_.integrator();
    if (integrator) o.spp = std::uint32_t(settings_.samples), o.clamp = integrator->clamp;
    const Image image = world_->render(camera_->view(), o);
    write_exr(exr, image, Links::Replace);
    write_png(beside.replace_extension(".png"), image, tone_of(integrator), Links::Replace);
    say(fmt::format("wrote {} and .png of view {}", exr.string(), camera_->view().name));
  } catch (const Error& error) {
    say(error.what(), true);
  }
}

/// Reloads the shaders if a file of them was written. Looks at them twice a second at most.
void Session::watch_shaders() {
  if (Clock::now() - looked_ < std::chrono::milliseconds(500)) return;
  looked_ = Clock::now();
  const fs::file_time_type newest = newest_in(shaders_);
  if (std::exchange(shaders_of_, newest) != newest) reload("a shader file changed");
}

void Session::reload(const char* why) {
  world_->reload_shaders();
  kernels_.clear();
  facts_.shader_error.clear();
  dirty_ = true;
  say(fmt::format("shaders reloaded: {}", why));
}

}  // namespace ballot::view
