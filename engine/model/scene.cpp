#include "engine/model/scene.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include "engine/core/error.h"
#include "engine/core/exact_area.h"
#include "engine/core/parallel.h"
#include "engine/core/registry.h"
#include "engine/model/instances.h"

namespace ballot {
namespace {

bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

void check_sizes(const Scene& scene) {
  const std::size_t count = scene.triangles.size();
  if (!scene.normals.empty() && scene.normals.size() != count)
    fail(Failure::Arguments, "scene '{}' has {} triangles, but {} triples of normals; expected as many, or none",
         scene.name, count, scene.normals.size());
  if (!scene.colors.empty() && scene.colors.size() != count)
    fail(Failure::Arguments, "scene '{}' has {} triangles, but {} triples of colours; expected as many, or none",
         scene.name, count, scene.colors.size());
  if (scene.material_of.empty()) return;
  if (scene.material_of.size() != count)
    fail(Failure::Arguments, "scene '{}' has {} triangles, but {} entries in material_of; expected as many", scene.name,
         count, scene.material_of.size());
  for (std::size_t i = 0; i < count; ++i)
    if (scene.material_of[i] >= scene.materials.size())
      fail(Failure::Arguments, "scene '{}': triangle {} names material {}, but there are {}", scene.name, i,
           scene.material_of[i], scene.materials.size());
}

void check_textures(const Scene& scene) {
  for (const Texture& t : scene.textures)
    if (t.image >= scene.images.size())
      fail(Failure::Arguments, "scene '{}': a texture names image {}, but there are {}", scene.name, t.image,
           scene.images.size());
  for (const TextureImage& i : scene.images)
    if (i.width < 1 || i.height < 1 || i.rgba.size() != std::size_t{4} * i.width * i.height)
      fail(Failure::Arguments, "scene '{}': image '{}' of {} x {} pixels has {} bytes; expected 4 a pixel", scene.name,
           i.name, i.width, i.height, i.rgba.size());
  for (const Material& m : scene.materials)
    for (const TextureUse* use : m.uses()) {
      if (!*use) continue;
      if (use->texture >= scene.textures.size() || use->set >= kUvSets)
        fail(Failure::Arguments,
             "scene '{}': material '{}' names texture {} and coordinates {}, but there are {} and {}", scene.name,
             m.name, use->texture, use->set, scene.textures.size(), kUvSets);
      if (scene.uvs[use->set].size() != scene.triangles.size())
        fail(Failure::Arguments,
             "scene '{}' has {} triangles, but {} triples of texture coordinates {}, which material "
             "'{}' wants; expected as many",
             scene.name, scene.triangles.size(), scene.uvs[use->set].size(), use->set, m.name);
    }
}

/// Returns the bounds of meshes that are placed by the identity, if at all.
Bounds bounds_of_placed(const SceneInstances& all, std::span<const Bounds> of_meshes) {
  std::optional<Bounds> bounds;
  for (const Placement& p : all.placements) {
    if (p.mask == 0 || all.triangles_of(p.mesh) == 0) continue;
    const Bounds& mesh = of_meshes[p.mesh];
    bounds = bounds ? Bounds{glm::min(bounds->lo, mesh.lo), glm::max(bounds->hi, mesh.hi)} : mesh;
  }
  return bounds.value_or(Bounds{});
}

/// Returns a view of the whole bounding sphere, from the front right and a little above.
View framing_view(const Bounds& bounds) {
  const glm::dvec3 lo{bounds.lo}, hi{bounds.hi};
  const double radius = glm::length(hi - lo) / 2;
  View view{.name = "view0"};
  const glm::dvec3 back = glm::normalize(glm::dvec3{0.5, 0.4, 1.0});
  const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3{0, 1, 0}, back));
  const double distance = (radius > 0 ? radius : 1) / std::sin(view.yfov / 2);
  view.world_from_camera = {glm::dvec4{right, 0}, glm::dvec4{glm::cross(back, right), 0}, glm::dvec4{back, 0},
                            glm::dvec4{(lo + hi) / 2.0 + distance * back, 1}};
  return view;
}

}  // namespace

Bounds bounds_of_vertices(std::span<const Triangle> triangles, std::string_view scene) {
  if (triangles.empty()) return {};
  std::atomic<bool> all_finite{true};
  const auto of = [&](std::size_t begin, std::size_t end) {
    Bounds to{triangles[begin][0], triangles[begin][0]};
    for (const Triangle& triangle : triangles.subspan(begin, end - begin))
      for (const glm::vec3& v : triangle) {
        if (!finite(v)) all_finite = false;
        to = {glm::min(to.lo, v), glm::max(to.hi, v)};
      }
    return to;
  };
  const auto united = [](const Bounds& a, const Bounds& b) {
    return Bounds{glm::min(a.lo, b.lo), glm::max(a.hi, b.hi)};
  };
  const Bounds start{triangles[0][0], triangles[0][0]};
  const Bounds bounds = joined_chunks(triangles.size(), 1 << 15, start, of, united);
  for (std::size_t i = 0; i < triangles.size() && !all_finite; ++i)
    for (const glm::vec3& v : triangles[i])
      if (!finite(v))
        fail(Failure::Arguments, "scene '{}': triangle {} has the vertex ({}, {}, {}); expected finite numbers", scene,
             i, v.x, v.y, v.z);
  return bounds;
}

void finish_scene(Scene& scene, std::span<const Bounds> of_meshes) {
  if (scene.materials.empty()) scene.materials.push_back({.name = "default"});
  check_sizes(scene);
  if (scene.materials.size() == 1) scene.material_of = {};
  check_textures(scene);
  if (of_meshes.empty()) scene.bounds = bounds_of_vertices(scene.triangles, scene.name);
  complete_instances(scene);
  if (!of_meshes.empty())
    scene.bounds = bounds_of_placed(scene.instances, of_meshes);
  else if (scene.instanced())
    scene.bounds = bounds_of_instances(scene);
  if (scene.views.empty()) scene.views.push_back(framing_view(scene.bounds));
}

void need_triangles(const Scene& scene, std::string_view what) {
  for (const MeshLabel& label : scene.instances.mesh_labels)
    if (label.kind != ShapeKind::Triangles)
      fail(Failure::Arguments, "scene '{}' has {}, but {} takes triangles alone", scene.name, info_of(label.kind).name,
           what);
}

const View& find_view(const Scene& scene, std::string_view name) {
  if (const View* view = find_row(scene.views, name)) return *view;
  fail(Failure::Arguments, "scene '{}' has no view '{}'; there are: {}", scene.name, name, names_of(scene.views));
}

glm::vec3 geometric_normal(const Triangle& triangle) {
  const glm::dvec3 normal = exact_cross(triangle[0], triangle[1], triangle[2]);
  const double length = glm::length(normal);
  return length > 0 ? glm::vec3{normal / length} : glm::vec3{0, 1, 0};
}

}  // namespace ballot
