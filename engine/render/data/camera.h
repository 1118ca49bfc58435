// Cameras in the form that the ray generators read.
#pragma once

#include <glm/vec2.hpp>
#include <string_view>
#include <vector>

#include "engine/gpu/pipeline.h"
#include "engine/model/scene.h"
#include "engine/render/data/parts.h"
#include "shaders/shared/render.h"

namespace ballot {

/// Camera rays of a tile, one a pixel.
inline constexpr std::uint32_t kTileRays = TILE_SIZE * TILE_SIZE;

/// The ray kind of camera rays.
inline constexpr std::string_view kPrimaryRays = "primary";

/// Returns a view as it is in a scene whose vertices are moved by -`by`.
View moved_back(View view, const glm::vec3& by);

/// Returns the push constants of shaders/rays/primary.comp for a view: one sample at pixel centres, from pixel 0 on.
/// The ray count is 0; the caller sets it.
PrimaryPush camera_push(const View& view, std::uint32_t width, std::uint32_t height);

/// Returns the camera for each part of a picture. The parts cover the samples [first_sample, first_sample + samples) of
/// `pixels` listed pixels; none is larger than `largest`.
std::vector<PrimaryPush> cameras_of(PrimaryPush camera, std::uint32_t pixels, std::uint32_t samples,
                                    const Part& largest, std::uint32_t first_sample);

/// The cone of a pixel in the middle of the picture: its width at the camera in scene units, and the growth of that
/// width per unit of distance.
struct PixelCone {
  float width, spread;
};
PixelCone pixel_cone(const PrimaryPush& camera);

/// Returns the features with the view's kind of camera as the only one, even if no camera of the scene is of that kind.
SceneFeatures through(const SceneFeatures& features, const View& view);

/// Returns the features once for each kind of camera that they name, with that kind as the only one.
std::vector<SceneFeatures> by_camera(const SceneFeatures& features);

/// Returns the defines BALLOT_PERSPECTIVE and BALLOT_ORTHOGRAPHIC of shaders/lib/camera/camera.glsl.
Defines camera_defines(const SceneFeatures& features);
/// Returns what these defines add to a kernel's name: "+perspective", "+orthographic", both or nothing.
std::string camera_name(const SceneFeatures& features);

/// Returns the kernel that makes primary rays, for the kinds of cameras among the features. With `listed` the kernel
/// reads a list of pixels, as a picture that cuts tiles needs.
KernelSource primary_source(bool listed, const SceneFeatures& features);

/// Throws Error(Arguments) unless a picture may have this size, in pixels.
void check_size(std::uint32_t width, std::uint32_t height);

/// Returns the ray count of a picture, with the dead rays of tiles that extend beyond it. Order of the rays:
/// shaders/shared/render.h.
std::uint32_t padded_rays(std::uint32_t width, std::uint32_t height);

/// Returns the pixel (column, row) of a ray of a picture; the same as in shaders/lib/shade/film.glsl.
glm::uvec2 pixel_of(std::uint32_t ray, std::uint32_t width);

/// Returns the pixel (column, row) of a LISTED_PIXEL word.
inline glm::uvec2 listed_pixel(std::uint32_t word) { return {word & 0xFFFF, word >> 16}; }

}  // namespace ballot
