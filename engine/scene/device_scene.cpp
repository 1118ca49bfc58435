#include <cmath>
#include <glm/matrix.hpp>

#include "ballot_commit.h"
#include "engine/core/interruption.h"
#include "engine/core/memory.h"
#include "engine/core/stopwatch.h"
#include "engine/model/digest.h"
#include "engine/model/instances.h"
#include "engine/scene/device_scene.h"
#include "engine/scene/scene_tree.h"
#include "engine/tree/device/device_poser.h"

namespace ballot {

namespace {

/// Returns a matrix as OpenEXR stores it. OpenEXR multiplies row vectors from the left, so its row-by-row order is
/// glm's column-by-column order.
std::array<float, 16> exr_matrix(const glm::dmat4& m) {
  std::array<float, 16> values;
  for (int i = 0; i < 16; ++i) values[std::size_t(i)] = float(m[i / 4][i % 4]);
  return values;
}

/// Returns the matrix from the camera's frame to OpenEXR's NDC: (0, 0) is top left and (1, 1) bottom right; depth is 0
/// at distance near and 1 at infinity.
glm::dmat4 ndc_from_camera(const View& view, double aspect) {
  constexpr double near = 1e-3;
  glm::dmat4 m(0);
  if (view.orthographic) {
    m[0][0] = 0.5 / (view.ymag * aspect);
    m[1][1] = -0.5 / view.ymag;
    m[2][2] = -1e-6;
    m[3] = {0.5, 0.5, 0, 1};
    return m;
  }
  const double f = 1 / std::tan(view.yfov / 2);
  m[0][0] = 0.5 * f / aspect;
  m[1][1] = -0.5 * f;
  m[2] = {-0.5, -0.5, -1, -1};
  m[3][2] = -near;
  return m;
}

/// Returns the triangles of a scene that trees of a builder are made of on the device; null: the host has them now.
TrianglesThere* kept_there(TrianglesThere* there, Scene& scene, const Context& gpu, BuilderId builder) {
  if (!there || (gpu.info().float64 && builder_of(builder).on_device)) return there;
  if (!there->on_host) there->triangles.download(scene.triangles);
  return nullptr;
}

/// Returns true if the device can build all trees of a scene.
bool takes_builder(const DeviceInfo& device, const Scene& scene) {
  std::size_t largest = scene.triangles.size();
  if (scene.instanced()) {
    const std::vector<std::size_t> first = tree_layout(scene).first;
    largest = 0;
    for (std::size_t tree = 1; tree < first.size(); ++tree) largest = std::max(largest, first[tree] - first[tree - 1]);
  }
  return DeviceBuilder::runs_on(device) && largest <= DeviceBuilder::most_triangles(device);
}

}  // namespace

std::string commit() { return BALLOT_COMMIT; }

std::shared_ptr<Context> DeviceScene::open_device(const DeviceSceneOptions& options) {
  return std::make_shared<Context>(
      ContextOptions{options.device, options.validate, options.window, options.statistics});
}

DeviceScene::DeviceScene(Scene scene, const DeviceSceneOptions& options, const Progress& progress)
    : scene_(std::move(scene)), build_(options.build), gpu_(options.context ? options.context : open_device(options)) {
  times_.device_s = opened_.seconds();
  for (const Query& q : options.queries)
    kernel_config_for(find_method(q.method), find_numeric(q.numeric), gpu_->info(), q.knobs);
  build_.builder = choose_builder(build_.builder, {.on_cpu_device = gpu_->info().is_cpu(),
                                                   .takes_builder = takes_builder(gpu_->info(), scene_),
                                                   .triangles = scene_.triangles.size(),
                                                   .expected_rays = options.expected_rays});
  use_cache_ = options.use_cache;
  const Timer timer;
  TrianglesThere* const there = kept_there(options.triangles.get(), scene_, *gpu_, build_.builder);
  if (scene_.instanced()) {
    make_forest(options.use_cache, there, progress);
  } else {
    SceneTree built = there ? build_there(*gpu_, *there, 0, scene_.triangles.size(), build_)
                            : build_tree(*gpu_, scene_.triangles, build_, options.use_cache, progress);
    bvh_ = std::move(built.bvh);
    features_ = features_with(facts_of(bvh_));
    tracer_ = std::make_unique<Tracer>(*gpu_, bvh_, scene_.triangles, features_.tree, std::move(built.there));
  }
  times_.bvh_s = timer.seconds();
  policies_.resize(forest_ ? forest_->meshes().size() : 1);
  for (std::size_t i = 0; i < policies_.size(); ++i)
    policies_[i].built(times_.bvh_s, forest_ ? forest_->meshes()[i].bvh->stats.sah : bvh_.stats.sah);
  watch_lateness();
  for (std::size_t i = 0; there && !there->on_host && i < policies_.size(); ++i)
    if (const auto& built = tracer_->tree().built(i)) {
      triangles_are_there(i);
      release_pages(std::as_bytes(std::span(scene_.triangles).subspan(first_of(i), built->triangles().size())));
    }
  if (options.use_cache) tracer_->tree().keep_in(cache_folder() / "bvh");
  make_renderers();
}

/// Has the trees ask before they read triangles and nodes on the host, and give them back while the device has them.
/// Where an animation moves the scene each time is made of that on the host.
void DeviceScene::watch_lateness() {
  late_.parts.assign(policies_.size(), {});
  for (std::size_t i = 0; i < policies_.size(); ++i) {
    DeviceTree& tree = tracer_->tree();
    tree.set_host_copy(i, forest_ ? &late_.parts[i] : &late_);  // normals of a flat scene are late with them
    if (scene_.animation) continue;
    const std::size_t count = forest_ ? forest_->meshes()[i].triangles.size() : scene_.triangles.size();
    tree.may_let_go(i, {forest_ ? forest_->meshes()[i].bvh.get() : &bvh_,
                        std::span(scene_.triangles).subspan(first_of(i), count), &late_.parts[i]});
  }
}

SceneFeatures DeviceScene::features_with(const TreeFacts& tree) const {
  SceneFeatures features = features_of(scene_, tree);
  features.stored = SceneData::exceeds_texels(scene_, gpu_->info());
  return features;
}

void DeviceScene::drop_renderers() {
  checker_.reset();
  live_.reset();
  near_zero_.reset();
  batches_.reset();
  surface_columns_.reset();
  renderer_.reset();
}

void DeviceScene::make_renderers() {
  drop_renderers();
  scene_data_ = std::make_unique<SceneData>(*gpu_, scene_, features_, late_);
  renderer_ = std::make_unique<Renderer>(*gpu_, *tracer_, *scene_data_);
  batches_ = std::make_unique<Batches>(*gpu_, *tracer_, *scene_data_);
}

void DeviceScene::set_sky(Sky sky) {
  gpu_->finish();
  scene_.sky = std::move(sky);
  features_ = features_with(features_.tree);
  live_.reset();
  auto near = std::move(near_zero_);
  make_renderers();
  near_zero_ = std::move(near);
  if (near_zero_) near_zero_->set_sky(scene_.sky);
}

DeviceScene::~DeviceScene() = default;

HitChecker& DeviceScene::checker() {
  late_.bring();
  if (!checker_) checker_ = std::make_unique<HitChecker>(*tracer_, *batches_);
  return *checker_;
}

std::vector<OriginCheck> DeviceScene::check_origins(const RayBatch& batch, const Query& query) {
  refuse_instances("a check of origin offsets");
  return ballot::check_origins(*tracer_, *batches_, scene(), batch, query);
}

void DeviceScene::refuse_instances(const char* what) const {
  if (forest_)
    fail(Failure::Arguments,
         "scene '{}' keeps its meshes once, as instances, which {} does not take; load it with moved copies "
         "(instances 'copy')",
         scene_.name, what);
}

PointQueries& DeviceScene::points() {
  if (!points_) points_ = std::make_unique<PointQueries>(*gpu_, tracer_->tree());
  return *points_;
}

RayQueries& DeviceScene::rays() {
  if (rays_) return *rays_;
  SurfaceAlpha alpha;
  if (features_.alpha)
    alpha = {look_defines(alpha_features(features_), true), [this](Kernel& kernel) { scene_data_->bind(kernel); }};
  rays_ = std::make_unique<RayQueries>(*gpu_, tracer_->tree(), std::move(alpha));
  return *rays_;
}

SurfaceColumns& DeviceScene::surface_columns() {
  if (!surface_columns_) surface_columns_ = std::make_unique<SurfaceColumns>(*gpu_, *scene_data_);
  return *surface_columns_;
}

namespace {

/// Returns the first triangle and the number of each placement.
std::vector<glm::uvec2> places_of(const SceneInstances& all) {
  std::vector<glm::uvec2> places;
  std::uint32_t first = 0;
  for (std::size_t i = 0; i < all.placements.size(); ++i) {
    places.emplace_back(first, all.placement_labels[i].number);
    first += std::uint32_t(all.triangles_of(all.placements[i].mesh));
  }
  return places;
}

}  // namespace

UserKernel& DeviceScene::kernel(const UserText& text) {
  const auto found = kernels_.find(&text);
  if (found != kernels_.end() && found->second.first == features_.stored) return found->second.second;
  kernels_.erase(&text);
  UserTriangles triangles{.defines = {{"BALLOT_HAS_INSTANCES", features_.instances()},
                                      {"BALLOT_STORED", features_.stored},
                                      {"BALLOT_HAS_SHAPES", features_.tree.shapes != 0}},
                          .bind = [this](Kernel& kernel) { scene_data_->bind(kernel); },
                          .places = [this] { return places_of(scene_.instances); }};
  UserKernel made(*gpu_, tracer_->tree(), text, std::move(triangles));
  return kernels_.try_emplace(&text, features_.stored, std::move(made)).first->second.second;
}

const Topology& DeviceScene::topology() {
  if (!topology_) {
    ask_interruption();
    late_.bring();
    topology_ = std::make_unique<Topology>(forest_ ? topology_of(*forest_) : topology_of(scene().triangles));
  }
  return *topology_;
}

std::unique_ptr<Presenter> DeviceScene::make_presenter() {
  if (!gpu_->surface()) fail(Failure::Arguments, "the engine was opened without a window (DeviceSceneOptions::window)");
  return std::make_unique<Presenter>(*gpu_);
}

Image DeviceScene::picture(const Film& film, const View& view, const RenderOptions& options, RenderTimes& times) {
  Image image = pictures().renderer_->picture(film, options, times);
  Query primary = options.query;
  primary.rays = kPrimaryRays;
  const Variant variant = picture_tracer().variant(primary);
  const glm::dmat4 kLeftHanded(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 0, -1, 0),
                               glm::dvec4(0, 0, 0, 1));
  const glm::dmat4 camera_from_world = glm::inverse(view.world_from_camera);
  image.attributes = {
      {"scene", scene_.name},
      {"view", view.name},
      {"shading", options.shading},
      {"method", fmt::format("{} {} {}", variant.method->name, describe(variant.config, *variant.method),
                             describe_threshold(variant.config, *variant.method))},
      {"numeric", std::string(variant.numeric->name)},
      {"device", gpu_->info().name},
      {"driver", gpu_->info().driver},
      {"subgroup_size", int(variant.config.subgroup)},
      {"spp", int(film.samples)},
      {"seconds", float(times.seconds)},
      {"commit", ballot::commit()},
      {"worldToCamera", exr_matrix(kLeftHanded * camera_from_world)},
      {"worldToNDC", exr_matrix(ndc_from_camera(view, double(options.width) / options.height) * camera_from_world)},
  };
  if (times.heat_top > 0) {
    image.attributes["heat"] = options.heat;
    image.attributes["heat_top"] = times.heat_top;
  }
  if (options.clamp > 0) image.attributes["clamp"] = options.clamp;
  if (film.shard.count > 1) image.attributes["part"] = fmt::format("{}/{}", film.shard.index, film.shard.count);
  return image;
}

std::string DeviceScene::made_of(const View& view, const RenderOptions& o) const {
  const std::uint64_t digest = digest_of(scene());
  const Sky& sky = scene_.sky;
  const glm::dmat4& m = view.world_from_camera;
  const Window w = o.window();
  std::string text =
      fmt::format("scene: {} ({} triangles, digest {:016x})\nsky: {} {} {} {} {} {} {} {} {} {} {}\n", scene_.name,
                  triangle_count(), digest, int(sky.kind), sky.zenith.x, sky.zenith.y, sky.zenith.z, sky.horizon.x,
                  sky.horizon.y, sky.horizon.z, sky.ground.x, sky.ground.y, sky.ground.z, sky.map_name);
  text += fmt::format("view: {} yfov {} ymag {} {} at {}\n", view.name, view.yfov, view.ymag, view.orthographic,
                      fmt::join(&m[0][0], &m[0][0] + 16, " "));
  text += fmt::format("size: {}x{}\ncrop: {},{},{},{}\ntiles: {}/{}\nspp: {}\nshading: {}\n", o.width, o.height, w.x0,
                      w.y0, w.x1, w.y1, o.shard.index, o.shard.count, o.spp, o.shading);
  text += fmt::format("bounces: {}\nao radius: {}\nclamp: {}\nseed: {}\nvariance: {}\n", o.bounces, o.ao_radius,
                      o.clamp, o.seed, o.wants("variance"));
  const bool by_any_method = find_numeric(o.query.numeric).conservative;
  text += fmt::format("numeric: {}{}\n", o.query.numeric, by_any_method ? "" : ", method " + o.query.method);
  return text + fmt::format("device: {}, {}\ncommit: {}\n", gpu_->info().name, gpu_->info().driver, ballot::commit());
}

}  // namespace ballot
