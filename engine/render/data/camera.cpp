#include "engine/render/data/camera.h"

#include <cmath>

#include <glm/geometric.hpp>

#include "engine/core/error.h"
#include "engine/core/morton.h"

namespace ballot {

View moved_back(View view, const glm::vec3& by) {
  view.world_from_camera[3] -= glm::dvec4(glm::dvec3(by), 0);
  return view;
}

PrimaryPush camera_push(const View& view, std::uint32_t width, std::uint32_t height) {
  const glm::dmat4& m = view.world_from_camera;
  const glm::dvec3 right(m[0]), up(m[1]), back(m[2]), eye(m[3]);
  const double half_y = view.orthographic ? view.ymag : std::tan(view.yfov / 2);
  const double half_x = half_y * width / height;
  PrimaryPush push{};
  push.width = width;
  push.height = height;
  push.sample_count = push.together = 1;
  push.orthographic = view.orthographic;
  const glm::dvec3 centre = view.orthographic ? eye : -back;
  push.origin = glm::vec3(view.orthographic ? -back : eye);
  push.corner = glm::vec3(centre - right * half_x + up * half_y);
  push.step_x = glm::vec3(right * (2 * half_x / width));
  push.step_y = glm::vec3(up * (-2 * half_y / height));
  return push;
}

std::vector<PrimaryPush> cameras_of(PrimaryPush camera, std::uint32_t pixels, std::uint32_t samples,
                                    const Part& largest, std::uint32_t first_sample) {
  std::vector<PrimaryPush> cameras;
  for_parts(pixels, samples, largest, [&](const Part& part) {
    camera.first = part.pixel;
    camera.count = part.rays();
    camera.together = part.samples;
    camera.sample_index = first_sample + part.sample;
    cameras.push_back(camera);
  });
  return cameras;
}

PixelCone pixel_cone(const PrimaryPush& camera) {
  const float pixel = glm::length(camera.step_y);
  return camera.orthographic ? PixelCone{pixel, 0} : PixelCone{0, pixel};
}

namespace {

SceneFeatures with_camera(SceneFeatures features, bool orthographic) {
  features.perspective = !orthographic;
  features.orthographic = orthographic;
  return features;
}

}  // namespace

SceneFeatures through(const SceneFeatures& features, const View& view) {
  return with_camera(features, view.orthographic);
}

std::vector<SceneFeatures> by_camera(const SceneFeatures& features) {
  std::vector<SceneFeatures> all;
  if (features.perspective) all.push_back(with_camera(features, false));
  if (features.orthographic) all.push_back(with_camera(features, true));
  return all;
}

Defines camera_defines(const SceneFeatures& features) {
  return {{"BALLOT_PERSPECTIVE", features.perspective}, {"BALLOT_ORTHOGRAPHIC", features.orthographic}};
}

std::string camera_name(const SceneFeatures& features) {
  return std::string(features.perspective ? "+perspective" : "") + (features.orthographic ? "+orthographic" : "");
}

KernelSource primary_source(bool listed, const SceneFeatures& features) {
  Defines defines = camera_defines(features);
  defines.emplace_back("BALLOT_LISTED", listed);
  return {.name = (listed ? "rays.primary.listed" : "rays.primary") + camera_name(features),
          .file = "rays/primary.comp",
          .defines = std::move(defines)};
}

void check_size(std::uint32_t width, std::uint32_t height) {
  if (width < 1 || height < 1 || width > 16384 || height > 16384)
    fail(Failure::Arguments, "size: {}x{} is not between 1x1 and 16384x16384", width, height);
}

std::uint32_t padded_rays(std::uint32_t width, std::uint32_t height) {
  const std::uint32_t tiles_x = (width + TILE_SIZE - 1) / TILE_SIZE, tiles_y = (height + TILE_SIZE - 1) / TILE_SIZE;
  return tiles_x * tiles_y * kTileRays;
}

glm::uvec2 pixel_of(std::uint32_t ray, std::uint32_t width) {
  const std::uint32_t tiles_x = (width + TILE_SIZE - 1) / TILE_SIZE;
  const std::uint32_t tile = ray / kTileRays, inner = ray % kTileRays;
  return {tile % tiles_x * TILE_SIZE + even_bits(inner), tile / tiles_x * TILE_SIZE + even_bits(inner >> 1)};
}

}  // namespace ballot
