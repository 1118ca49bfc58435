#include "engine/render/live/live_paths.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "engine/core/stopwatch.h"
#include "engine/gpu/room.h"
#include "engine/render/data/camera.h"
#include "engine/render/data/run_pass.h"
#include "engine/render/film/renderer.h"

namespace ballot {

namespace {

constexpr std::uint32_t kFirstPart = 1 << 14;  // pixels, until the speed is known
constexpr double kGrowth = 4;                  // largest ratio of a part to the one before it

}  // namespace

KernelSource show_source() { return {.name = "shade.show", .file = "shade/show.comp"}; }

LivePaths::LivePaths(Context& gpu, Tracer& tracer, SceneData& scene)
    : gpu_(gpu), scene_(scene), waves_(gpu, tracer, scene) {}

/// Lists the pixels in the order of the renderer's films: tile by tile, so that the rays of a subgroup are alike.
void LivePaths::list_pixels(std::uint32_t width, std::uint32_t height) {
  const std::uint32_t count = width * height;
  make_room(film_, gpu_, count, "film of paths");
  if (!make_room(listed_, gpu_, count, "pixels of paths") && width == width_ && height == height_) return;
  std::vector<std::uint32_t> listed;
  listed.reserve(count);
  for (std::uint32_t ray = 0; ray < padded_rays(width, height); ++ray) {
    const glm::uvec2 at = pixel_of(ray, width);
    if (at.x < width && at.y < height) listed.push_back(LISTED_PIXEL(at.x, at.y));
  }
  listed_->upload(listed);
  width_ = width, height_ = height;
}

/// Returns how many pixels the next part has.
std::uint32_t LivePaths::next_part(double part_ms) const {
  const std::uint32_t left = width_ * height_ - done_;
  if (part_ms <= 0) return left;
  if (places_a_ms_ <= 0) return std::min(left, kFirstPart);
  return std::min(left, std::uint32_t(std::clamp(part_ms * places_a_ms_, 1024.0, 4e6)));
}

void LivePaths::note_speed(std::uint32_t places, double ms) {
  const double now = places / std::max(ms, 1e-3);
  places_a_ms_ = places_a_ms_ > 0 ? std::min(now, kGrowth * places_a_ms_) : now;
}

LiveTimes LivePaths::add(const View& view, const LiveOptions& options, const Integrator& integrator) {
  if (!options.goes_on) done_ = 0, passes_ = {};
  list_pixels(options.width, options.height);
  const std::uint32_t count = next_part(options.part_ms);
  const RenderOptions defaults;
  WaveSettings settings{.integrator = &integrator,
                        .camera = camera_push(view, options.width, options.height),
                        .last_depth = integrator.last_depth,
                        .clamp = integrator.clamp,
                        .query = options.query,
                        .features = through(scene_.features(), view),
                        .sky = scene_.scene().sky.kind,
                        .first_place = done_};
  settings.camera.sample_count = options.sample_count;
  const Bounds& b = scene_.scene().bounds;
  settings.ao_radius = std::max(defaults.ao_radius * glm::distance(b.lo, b.hi), 1e-30f);
  settings.most_paths = waves_.capacity(integrator, settings.features, settings.last_depth, count);
  const Timer timer;
  waves_.add_samples(settings, *listed_, count, options.sample_index, 1, *film_, nullptr, passes_, {});
  note_speed(count, timer.ms());
  done_ += count;
  LiveTimes times;
  times.generate_ms = passes_.ms("begin");
  times.trace_ms = passes_.ms("trace");
  times.shade_ms = passes_.ms("") - times.generate_ms - times.trace_ms;
  for (const PassTime& t : passes_.all())
    if (t.name.starts_with("trace")) times.rays += t.rays;
  times.finished = done_ == width_ * height_;
  return times;
}

void LivePaths::show(const LiveOptions& options, const Integrator& integrator, Buffer<std::uint32_t>& pixels,
                     LiveTimes& times) {
  if (refresh(gpu_, show_, show_source())) gpu_.save_pipeline_cache();
  show_->bind(BIND_LISTED, *listed_);
  show_->bind(BIND_FILM, *film_);
  show_->bind(BIND_PIXELS, pixels);
  const ShowPush push{.width = width_,
                      .count = width_ * height_,
                      .scale = 1.0f / float(options.sample_index + 1),
                      .neutral = integrator.sees == Sees::Materials};
  const PassScope scope(gpu_);
  run_pass(gpu_, *show_, push.count, &push, sizeof push, times.shade_ms);
  gpu_.finish();
}

}  // namespace ballot
