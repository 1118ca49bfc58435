// Pictures of `ballot render --denoise`.
#pragma once

#include "tools/program/cli.h"

namespace ballot::cli {

/// Throws Error(Arguments) if pictures of these options cannot be denoised.
void check_denoised(const RenderOptions& options);

/// Replaces a picture's colours by those without noise, keeps the rendered ones as noisy.R, noisy.G and noisy.B, and
/// adds albedo.R, albedo.G and albedo.B. Renders albedo and normals of the view for it. Throws Error(Work).
void denoise(const Denoiser& denoiser, DeviceScene& world, const View& view, const RenderOptions& options,
             Image& image);

}  // namespace ballot::cli
