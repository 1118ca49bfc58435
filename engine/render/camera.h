// Views as the ray generators take them.
#pragma once

#include <glm/vec2.hpp>

#include "engine/scene/scene.h"
#include "shaders/shared/render.h"

namespace ballot {

/// What shaders/rays/primary.comp wants of a view: one sample through pixel centres, from ray number 0.
PrimaryPush camera_push(const View& view, std::uint32_t width, std::uint32_t height);

/// How wide a pixel's cone grows in a unit of length at the picture's middle; of an orthographic view a pixel's width, scene
/// units.
float pixel_spread(const PrimaryPush& camera);

/// Rays of a picture, those of tiles that reach beyond it included. Order: shaders/shared/render.h.
std::uint32_t padded_rays(std::uint32_t width, std::uint32_t height);

/// Where a ray lies in the picture; the same as shaders/lib/film.glsl.
glm::uvec2 pixel_of(std::uint32_t ray, std::uint32_t width);

}  // namespace ballot
