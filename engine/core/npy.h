// NumPy .npy files: rays in, hits and triangles out.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "engine/scene/scene.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// float32 or float64 (n,8), C order, little endian, in the order of Ray. float64 is rounded to float32; a finite value
/// beyond float32 becomes the largest float32, since an infinite one would make the ray dead.
/// Throws Error(Work) naming file, found dtype/shape and what was expected.
std::vector<Ray> read_rays(const std::filesystem::path& path);
void write_rays(const std::filesystem::path& path, std::span<const Ray> rays);

/// Structured array [('t','<f4'),('prim','<u4'),('u','<f4'),('v','<f4')], shape (n,).
void write_hits(const std::filesystem::path& path, std::span<const Hit> hits);
std::vector<Hit> read_hits(const std::filesystem::path& path);

/// float32 (n,3,3).
void write_triangles(const std::filesystem::path& path, std::span<const Triangle> triangles);

}  // namespace ballot
