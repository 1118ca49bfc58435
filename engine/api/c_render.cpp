// Rays and pictures of a view, by the C interface.
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>

#include "engine/api/arrays.h"

namespace ballot::api {
namespace {

glm::dvec3 finite_vector(const double (&v)[3], const char* what) {
  for (const double x : v)
    if (!std::isfinite(x))
      throw Refused(BALLOT_ERROR_ARGUMENT,
                    fmt::format("view: {} is ({}, {}, {}); expected finite numbers", what, v[0], v[1], v[2]));
  return {v[0], v[1], v[2]};
}

/// Returns the view that a caller describes, or names.
ballot::View view_of(const BallotView& v, const ballot::Scene& scene) {
  if (v.name) return find_view(scene, v.name.text);
  const glm::dvec3 eye = finite_vector(v.eye, "eye"), target = finite_vector(v.target, "target");
  if (eye == target) return scene.views.front();
  ballot::View view{.name = "view"};
  const glm::dvec3 back = glm::normalize(eye - target);
  glm::dvec3 up = finite_vector(v.up, "up");
  if (up == glm::dvec3(0)) up = {0, 1, 0};
  glm::dvec3 right = glm::cross(up, back);
  if (glm::length(right) < 1e-12 * glm::length(up))
    throw Refused(BALLOT_ERROR_ARGUMENT, "view: up is parallel to the view direction; choose another");
  right = glm::normalize(right);
  view.world_from_camera = {glm::dvec4{right, 0}, glm::dvec4{glm::cross(back, right), 0}, glm::dvec4{back, 0},
                            glm::dvec4{eye - scene.origin, 1}};
  if (v.yfov != 0) view.yfov = v.yfov;
  if (!(view.yfov > 0 && view.yfov < 3.14159265))
    throw Refused(BALLOT_ERROR_ARGUMENT, fmt::format("view: yfov is {}; expected radians between 0 and pi", view.yfov));
  if (!(v.ymag >= 0 && std::isfinite(v.ymag)))
    throw Refused(BALLOT_ERROR_ARGUMENT,
                  fmt::format("view: ymag is {}; expected a finite number, above 0 for an orthographic view", v.ymag));
  view.orthographic = v.ymag > 0;
  if (view.orthographic) view.ymag = v.ymag;
  return view;
}

ballot::RenderOptions options_of(const BallotPicture& p, const BallotQuery& query) {
  ballot::RenderOptions o;
  o.width = p.width ? p.width : 512;
  o.height = p.height ? p.height : 512;
  if (p.samples) o.spp = p.samples;
  if (p.shading) o.shading = p.shading;
  if (p.bounces) o.bounces = p.bounces;
  o.seed = p.seed;
  o.query = hit_query(query);
  o.aovs = {"color"};
  check_options(o);
  return o;
}

/// Gives the scene the sky that a picture names; empty: its own. On an error the scene keeps the one that it has.
void use_sky(SceneState& state, DeviceScene& world, const std::string& named) {
  if (state.sky == named) return;
  ballot::Sky wanted = named.empty() ? *state.own_sky : make_sky(named);
  if (!state.own_sky) state.own_sky = world.scene_facts().sky;
  world.set_sky(std::move(wanted));
  state.sky = named;
}

/// The rays that a caller asks for.
struct AskedRays {
  const BallotView* view;
  const char* kind;
  std::uint32_t width, height;
};

/// Returns the first `room` rays about the origin of the scene. Writes to `count` how many there are. The device is
/// held.
std::vector<ballot::Ray> make_rays(SceneState& state, const AskedRays& asked, std::size_t room, std::size_t& count) {
  keep_fit(state);
  ballot::DeviceScene& world = *state.world;
  const auto view = view_of(read_struct(asked.view, "BallotView"), world.scene_facts());
  const auto& kind = ballot::find_ray_kind(asked.kind ? asked.kind : "primary");
  const auto batch = world.make_batch(view, kind, asked.width, asked.height);
  count = batch->count();
  if (room == 0) return {};
  std::vector<ballot::Ray> made = batch->rays();
  made.resize(std::min(room, made.size()));
  return made;
}

/// Writes the colour channels, rows from the top.
void write_rgba(const ballot::Image& image, float* rgba) {
  const char* const kChannels[] = {"R", "G", "B", "A"};
  for (std::size_t c = 0; c < 4; ++c) {
    const std::vector<float>& values = image.channel(kChannels[c]).floats;
    for (std::size_t i = 0; i < values.size(); ++i) rgba[4 * i + c] = values[i];
  }
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_make_rays(BallotScene* scene, const BallotView* view, const char* kind, uint32_t width,
                              uint32_t height, BallotRay* rays, size_t room, size_t* count) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(count, "ballot_make_rays", "count");
    if (room) need(rays, "ballot_make_rays", "rays");
    const DeviceUse use(*state->device);
    if (const glm::dvec3& o = state->world->scene_facts().origin; o != glm::dvec3(0))
      refuse(
          fmt::format("ballot_make_rays: the scene's numbers are counted from ({}, {}, {}), and float32 rays of the "
                      "world would lose digits; expected ballot_make_rays_double()",
                      o.x, o.y, o.z));
    const std::vector<ballot::Ray> made = make_rays(*state, {view, kind, width, height}, room, *count);
    std::memcpy(static_cast<void*>(rays), made.data(), made.size() * sizeof(ballot::Ray));
  });
}

BallotStatus ballot_make_rays_double(BallotScene* scene, const BallotView* view, const char* kind, uint32_t width,
                                     uint32_t height, double* rays, size_t room, size_t* count) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(count, "ballot_make_rays_double", "count");
    if (room) need(rays, "ballot_make_rays_double", "rays");
    const DeviceUse use(*state->device);
    std::size_t i = 0;
    for (const ballot::Ray& made : make_rays(*state, {view, kind, width, height}, room, *count)) {
      ballot::RayInDouble ray = ballot::in_double(made);
      ray.origin += state->world->scene_facts().origin;
      std::memcpy(rays + 8 * i++, &ray, sizeof ray);
    }
  });
}

BallotStatus ballot_render(BallotScene* scene, const BallotView* view, const BallotPicture* picture,
                           const BallotQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(picture, "ballot_render", "picture");
    const BallotPicture p = read_struct(picture, "BallotPicture");
    need(p.rgba, "ballot_render", "rgba");
    const BallotQuery q = read_query(query, kPictureKind);
    Watch watch(q, *state->device, "picture");
    const DeviceUse use(*state->device);
    keep_fit(*state);
    const Watched watched(watch);
    ballot::DeviceScene& world = *state->world;
    const auto v = view_of(read_struct(view, "BallotView"), world.scene_facts());
    const auto options = options_of(p, q);
    use_sky(*state, world, p.sky ? p.sky.text : "");
    ballot::RenderTimes spent;
    const auto progress = [&](double done) { watch(done); };
    write_rgba(world.render(v, options, &spent, watch ? ballot::Progress(progress) : ballot::Progress()), p.rgba);
    BallotTimes t = BALLOT_INIT(BallotTimes);
    t.seconds = spent.seconds;
    t.device_ms = spent.device_ms;
    write_struct(times, t, "BallotTimes");
  });
}
