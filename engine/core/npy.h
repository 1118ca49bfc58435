// NumPy .npy files of rays, hits and triangles.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "engine/scene/scene.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// Reads rays: float32 or float64 of shape (n, 8), C order, little endian, with the columns in the order of Ray.
/// float64 is rounded to float32. A finite value beyond the range of float32 becomes the largest float32, because an
/// infinite one would make the ray dead.
/// Throws Error(Work) that names the file, the dtype and shape found, and those expected.
std::vector<Ray> read_rays(const std::filesystem::path& path);
/// Writes rays as float32 of shape (n, 8), atomically. Throws Error(Work).
void write_rays(const std::filesystem::path& path, std::span<const Ray> rays);

/// Writes hits as a structured array [('t','<f4'),('prim','<u4'),('u','<f4'),('v','<f4')] of shape (n,), atomically.
/// Throws Error(Work).
void write_hits(const std::filesystem::path& path, std::span<const Hit> hits);
/// Reads a file of write_hits(). Throws Error(Work) as read_rays() does.
std::vector<Hit> read_hits(const std::filesystem::path& path);

/// Writes triangles as float32 of shape (n, 3, 3): triangle, vertex, coordinate; atomically. Throws Error(Work).
void write_triangles(const std::filesystem::path& path, std::span<const Triangle> triangles);

}  // namespace ballot
