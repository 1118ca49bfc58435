// Views as the ray generators take them.
#pragma once

#include <glm/vec2.hpp>

#include "engine/render/film/parts.h"
#include "engine/scene/scene.h"
#include "engine/vk/shader.h"
#include "shaders/shared/render.h"

namespace ballot {

/// What shaders/rays/primary.comp wants of a view: one sample through pixel centres, from pixel number 0; no rays yet.
PrimaryPush camera_push(const View& view, std::uint32_t width, std::uint32_t height);

/// The same camera for each part of a picture: samples from first_sample on of so many listed pixels.
std::vector<PrimaryPush> cameras_of(PrimaryPush camera, std::uint32_t pixels, std::uint32_t samples,
                                    const Part& largest, std::uint32_t first_sample);

/// What a pixel sees, at the picture's middle: how wide at the eye, scene units, and how much wider with each unit of length.
struct PixelCone {
  float width, spread;
};
PixelCone pixel_cone(const PrimaryPush& camera);

/// The scene as a view shows it: the only kind of camera is the view's, be it one of the scene's or not.
SceneFeatures through(const SceneFeatures& features, const View& view);

/// The same for each kind of camera that the scene has.
std::vector<SceneFeatures> by_camera(const SceneFeatures& features);

/// BALLOT_PERSPECTIVE and BALLOT_ORTHOGRAPHIC of shaders/lib/camera/camera.glsl, and what they add to a kernel's name.
Defines camera_defines(const SceneFeatures& features);
std::string camera_name(const SceneFeatures& features);

/// Rays of a picture, those of tiles that reach beyond it included. Order: shaders/shared/render.h.
std::uint32_t padded_rays(std::uint32_t width, std::uint32_t height);

/// Where a ray lies in the picture; the same as shaders/lib/shade/film.glsl.
glm::uvec2 pixel_of(std::uint32_t ray, std::uint32_t width);

/// Of LISTED_PIXEL.
inline glm::uvec2 listed_pixel(std::uint32_t word) { return {word & 0xFFFF, word >> 16}; }

}  // namespace ballot
