// Pictures of a DeviceScene. A scene far from the origin is rendered from a copy of itself near it.
//
// A path goes on from points that are rounded to float32: at 2e5 to 1/64, and then some start behind the next wall. So
// where the scene lies 16 times its longest side or more from zero, pictures are made of the scene moved by
// box_origin(). There differences of vertices and that point are exact, so that the copy has the very same shape; and
// the rounding of its points is a share of its size. Queries are answered in the scene's own coordinates.
#include <algorithm>
#include <atomic>
#include <glm/common.hpp>

#include "engine/core/parallel.h"
#include "engine/model/instances.h"
#include "engine/render/data/camera.h"
#include "engine/scene/device_scene.h"

namespace ballot {

namespace {

constexpr std::size_t kMovedAtOnce = 1 << 14;

void move_back(std::span<Triangle> triangles, const glm::vec3& by) {
  for_chunks(triangles.size(), kMovedAtOnce, [&](std::size_t begin, std::size_t end) {
    for (Triangle& t : triangles.subspan(begin, end - begin))
      for (glm::vec3& vertex : t) vertex -= by;
  });
}

/// Moves the shapes of a mesh, and has their triangles stand in for these.
void move_shapes_back(Scene& scene, std::size_t mesh, const glm::vec3& by) {
  const ShapeKind kind = scene.instances.mesh_labels[mesh].kind;
  const std::size_t first = scene.instances.first[mesh];
  const std::span shapes = std::span(scene.shapes).subspan(first, scene.instances.triangles_of(mesh));
  for (Shape& s : shapes) {
    s.a -= glm::vec4(by, 0);
    if (info_of(kind).vertices == 2) s.b -= glm::vec4(by, 0);
  }
  std::ranges::copy(stand_ins(kind, shapes), scene.triangles.begin() + std::ptrdiff_t(first));
}

/// Moves the instances of a scene. Meshes that lie in the world move with it, so that instances with the identity keep
/// that and stay closed where they meet. Other meshes that lie far from the zero of their own space come near it.
void move_instances_back(Scene& scene, const glm::vec3& by) {
  SceneInstances& all = scene.instances;
  std::vector<glm::vec3> of_mesh(all.meshes());
  for (std::size_t m = 0; m < all.meshes(); ++m)
    of_mesh[m] = box_origin(
        bounds_of_vertices(std::span(scene.triangles).subspan(all.first[m], all.triangles_of(m)), scene.name));
  for (const Placement& p : all.placements)
    if (is_identity(p.transform)) of_mesh[p.mesh] = by;
  for (std::size_t m = 0; m < all.meshes(); ++m) {
    move_back(std::span(scene.triangles).subspan(all.first[m], all.triangles_of(m)), of_mesh[m]);
    if (all.mesh_labels[m].kind != ShapeKind::Triangles) move_shapes_back(scene, m, of_mesh[m]);
  }
  for (Placement& p : all.placements)
    for (int r = 0; r < 3; ++r) {
      float(&row)[4] = p.transform.m[r];
      double to = double(row[3]) - double(by[r]);
      for (int c = 0; c < 3; ++c) to += double(row[c]) * double(of_mesh[p.mesh][c]);
      row[3] = float(to);
    }
}

/// Returns the scene with `by` at its zero. It is at rest.
Scene scene_moved_back(Scene scene, const glm::vec3& by) {
  scene.animation = nullptr;
  if (scene.instanced())
    move_instances_back(scene, by);
  else
    move_back(scene.triangles, by);
  for (Light& light : scene.lights) light.position -= by;
  for (View& view : scene.views) view = moved_back(std::move(view), by);
  scene.bounds = scene.instanced() ? bounds_of_instances(scene) : Bounds{scene.bounds.lo - by, scene.bounds.hi - by};
  return scene;
}

}  // namespace

DeviceScene& DeviceScene::pictures() {
  if (picture_origin() == glm::vec3(0)) return *this;
  if (!near_zero_) {
    DeviceSceneOptions options;
    options.context = gpu_, options.build = build_, options.use_cache = use_cache_;
    near_zero_ = std::make_unique<DeviceScene>(scene_moved_back(scene(), picture_origin()), options);
  }
  return *near_zero_;
}

glm::vec3 DeviceScene::picture_origin() const {
  if (forest_) late_.bring();
  return box_origin(scene_.bounds);
}

std::string DeviceScene::picture_note() const {
  // Roundings in the longest side of a triangle. A closed furnace of 168 is 0.1 % too dark, one of 84 0.2 %.
  constexpr double kRounding = 0x1p-24, kFine = 256;
  if (scene_.instanced()) return {};
  const glm::dvec3 origin(picture_origin());
  const glm::dvec3 most =
      glm::max(glm::abs(glm::dvec3(scene_.bounds.lo) - origin), glm::abs(glm::dvec3(scene_.bounds.hi) - origin));
  const double reach = std::max({most.x, most.y, most.z}), least = kFine * kRounding * reach;
  std::atomic<std::size_t> small{0};
  const std::span<const Triangle> triangles = scene().triangles;
  for_chunks(triangles.size(), kMovedAtOnce, [&](std::size_t begin, std::size_t end) {
    small += std::size_t(std::ranges::count_if(triangles.subspan(begin, end - begin), [&](const Triangle& t) {
      const glm::dvec3 sides =
          glm::dvec3(glm::max(t[0], glm::max(t[1], t[2]))) - glm::dvec3(glm::min(t[0], glm::min(t[1], t[2])));
      const double longest = std::max({sides.x, sides.y, sides.z});
      return longest > 0 && longest < least;
    }));
  });
  if (100 * small <= triangles.size()) return {};
  return fmt::format(
      "{} of {} triangles are smaller than {:.3g}, and the scene reaches {:.3g} from its middle, where points are "
      "rounded to {:.3g}: light and shadows on them may be wrong; render them without what lies far from them",
      small.load(), triangles.size(), least, reach, kRounding * reach);
}

void DeviceScene::advance(Film& film, const View& view, const RenderOptions& options, std::uint32_t samples,
                          RenderTimes& times, const Progress& progress) {
  pictures().renderer_->advance(film, moved_back(view, picture_origin()), options, samples, times, progress);
}

void DeviceScene::advance_there(Film& film, const View& view, const RenderOptions& options, std::uint32_t samples,
                                RenderTimes& times, const Progress& progress) {
  pictures().renderer_->advance(film, moved_back(view, picture_origin()), options, samples, times, progress,
                                Sums::OnDevice);
}

Image DeviceScene::render(const View& view, const RenderOptions& options, RenderTimes* times,
                          const Progress& progress) {
  constexpr std::uint32_t kSamplesAtOnce = 16;
  RenderTimes spent;
  Film film = start_film(options);
  while (film.samples < options.spp) advance_there(film, view, options, kSamplesAtOnce, spent, progress);
  collect(film, spent);
  Image image = picture(film, view, options, spent);
  if (times) *times = spent;
  return image;
}

std::uint64_t DeviceScene::render_bytes() {
  DeviceScene& by = pictures();
  return by.scene_data_->bytes() + by.renderer_->bytes();
}

LiveImage& DeviceScene::live() {
  DeviceScene& by = pictures();
  if (!live_ || live_->origin() != picture_origin())
    live_ = std::make_unique<LiveImage>(*gpu_, *by.tracer_, *by.scene_data_, picture_origin());
  return *live_;
}

}  // namespace ballot
