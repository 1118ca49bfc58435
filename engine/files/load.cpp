// The scene formats, and the checks before a loader runs.
#include "engine/files/load.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <new>
#include <system_error>

#include "engine/files/loaders.h"

namespace ballot {
namespace {

constexpr std::array kFormats{
    SceneFormat{".gltf", load_gltf, true},
    SceneFormat{".glb", load_gltf, true},
    SceneFormat{".obj", load_obj},
    SceneFormat{".ply", load_ply, true, true},
    SceneFormat{".stl", load_stl},
    SceneFormat{".npy", load_npy, true, true},
    SceneFormat{".npz", load_npz, true, true},
};

const SceneFormat& format_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string(), known;
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const SceneFormat& format : kFormats) {
    if (format.extension == extension) return format;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", format.extension);
  }
  refuse("scene files of type '{}' cannot be read; there are loaders for {}; convert the scene to .glb", extension,
         known);
}

/// Returns the format of a scene file that exists and is not empty.
const SceneFormat& checked_format(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) refuse("there is no such scene file; check the path");
  if (std::filesystem::is_directory(status)) refuse("is a folder; expected a scene file in it");
  const SceneFormat& format = format_of(path);
  if (std::filesystem::is_regular_file(status) && std::filesystem::file_size(path, error) == 0 && !error)
    refuse("is empty (0 bytes); expected a {} scene", format.extension);
  return format;
}

/// Throws Error(Arguments) for options of shapes that a format has no use for.
void check_shape_options(const SceneFormat& format, const LoadOptions& options) {
  const auto has = [&](auto member) {
    std::string names;
    for (const SceneFormat& f : kFormats)
      if (f.*member) names += fmt::format("{}{}", names.empty() ? "" : ", ", f.extension);
    return names;
  };
  if (!(options.radius >= 0 && options.radius <= 1e12f))
    fail(Failure::Arguments, "radius of points: {}; expected more than 0, at most 1e12", options.radius);
  if (options.radius > 0 && !format.points)
    fail(Failure::Arguments, "radius of points: {} files have triangles alone; those with points: {}", format.extension,
         has(&SceneFormat::points));
  const bool heights = options.shapes && options.shapes->raster;
  if (options.spacing != glm::dvec2(0) && !heights)
    fail(Failure::Arguments, "spacing ({}, {}): it is of heights, but the shapes are others; expected none",
         options.spacing.x, options.spacing.y);
  const auto is_spacing = [](double x) { return x > 0 && std::isfinite(x); };
  if (options.spacing != glm::dvec2(0) && (!is_spacing(options.spacing.x) || !is_spacing(options.spacing.y)))
    fail(Failure::Arguments, "spacing of heights: ({}, {}); expected finite numbers above 0", options.spacing.x,
         options.spacing.y);
  if (!options.shapes) return;
  if (options.shapes == &kShapes[0])
    fail(Failure::Arguments, "shapes: triangles are what files of triangles have; expected a kind of points, or none");
  if (!format.chooses_shapes)
    fail(Failure::Arguments, "shapes '{}': {} files tell themselves what they hold; those that do not: {}",
         options.shapes->name, format.extension, has(&SceneFormat::chooses_shapes));
}

/// Adds a note if float32 numbers are so far apart where the vertices lie that rounding to them moves a vertex by more
/// than 2^-20 of the scene's size, and the vertices use all of their bits, as rounded ones do.
void note_rounding(Scene& scene) {
  const glm::dvec3 lo{scene.bounds.lo}, hi{scene.bounds.hi}, middle = 0.5 * (lo + hi);
  double size = 0, reach = 0;
  for (int axis = 0; axis < 3; ++axis) {
    size = std::max(size, hi[axis] - lo[axis]);
    reach = std::max({reach, std::abs(lo[axis]), std::abs(hi[axis])});
  }
  int exponent = 0;
  std::frexp(reach, &exponent);
  const double half_apart = std::ldexp(1.0, exponent - 25), farthest = std::ldexp(0.5, exponent);
  if (!(size > 0 && half_apart > std::ldexp(size, -20))) return;
  const auto full = [&](float c) { return std::abs(c) >= farthest && (std::bit_cast<std::uint32_t>(c) & 1) != 0; };
  const auto any_full = [&](const glm::vec3& v) { return full(v.x) || full(v.y) || full(v.z); };
  const bool rounded =
      scene.shapes.empty()
          ? std::ranges::any_of(scene.triangles, [&](const Triangle& t) { return std::ranges::any_of(t, any_full); })
          : std::ranges::any_of(scene.shapes, [&](const Shape& s) { return any_full(glm::vec3(s.a)); });
  if (!rounded) return;
  scene.notes.push_back(
      fmt::format("Far from the origin, up to {:.9g}, float32 rounds coordinates by up to {:.3g}, which is {:.1e} of "
                  "the scene's size "
                  "of {:.6g}; finer numbers of the file are lost, so subtract ({:.9g}, {:.9g}, {:.9g}) from its "
                  "vertices before you "
                  "save it.",
                  reach, half_apart, half_apart / size, size, middle.x, middle.y, middle.z));
}

}  // namespace

void check_scene_file(const std::filesystem::path& path) {
  naming(path, [&] { checked_format(path); });
}

void complete_mesh(Scene& scene) {
  for (std::size_t t = 0; t < scene.triangles.size(); ++t)
    for (const glm::vec3& v : scene.triangles[t])
      if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
        refuse("triangle {} has a vertex ({}, {}, {}); expected finite numbers", t, v.x, v.y, v.z);
  scene.materials.push_back({.name = "default"});
}

std::span<const SceneFormat> scene_formats() { return kFormats; }

Scene load_scene(const std::filesystem::path& path, const LoadOptions& options) {
  return naming(path, [&] {
    const SceneFormat& format = checked_format(path);
    check_shape_options(format, options);
    try {
      Scene scene = format.load(path, options);
      scene.name = path.stem().string();
      scene.instances.layout = options.layout;
      finish_scene(scene);
      if (scene.triangles.empty()) scene.notes.emplace_back("The file holds no triangle, so there is nothing to hit.");
      note_rounding(scene);
      return scene;
    } catch (const std::bad_alloc&) {
      refuse("does not fit into memory; use a smaller scene or a machine with more");
    }
  });
}

}  // namespace ballot
