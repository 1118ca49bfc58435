// Loads scene files: the formats, and what all of them promise.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "engine/model/scene.h"

namespace ballot {

/// How a scene file is loaded.
struct LoadOptions {
  bool allow_outside = false;  // read buffers, images and materials outside of the scene's folder too
  InstancePolicy instances = InstancePolicy::Auto;  // of glTF; other formats place each mesh once
  Layout layout = Layout::Auto;
  /// What points of PLY and rows of arrays become, even if the file has triangles; null: what the file tells.
  const ShapeInfo* shapes = nullptr;
  float radius = 0;       // of points, lines and rows that have none, in the world; 0: none is given
  glm::dvec2 spacing{0};  // of a raster of heights, along x and y; zero: 1
};

/// Loads a scene file; the extension chooses the loader (see formats()).
///
/// Triangles are numbered in this order, whether meshes are kept once or copied: the nodes of the default scene, depth
/// first in file order; for each node its instances, if it has some, and the primitives of its mesh in order; for each
/// primitive its triangles in index order. Node matrices are composed in double and rounded to float once: applied to
/// the triangles, or as the matrix of an instance. Triangles of zero area keep their number; no ray hits them. Points
/// and lines of glTF come behind the triangles of their node, spheres before capsules. A scene without triangles is
/// valid. A file with animations, skins or morph targets is loaded at rest: nodes have their own transforms, skins
/// follow them. `animation` then tells what moves (set_pose() in pose.h).
/// Throws Error(Arguments) for a radius or spacing that is negative or not finite, for shapes or a radius of a format
/// that has no points, and for a spacing of what is no heights. Throws Error(Work) on a file that is missing, empty,
/// truncated, of another format, inconsistent (an index or accessor out of range, counts beyond the file), that has a
/// NaN or infinite vertex, that names a file outside of its folder, or that needs more memory than there is (memory.h).
/// The text names file, place and value.
/// Thread-safe for different files and for the same file.
Scene load_scene(const std::filesystem::path& path, const LoadOptions& options = {});

/// Throws as load_scene() does for a file that is missing, empty or of another format. Does not read the file.
void check_scene_file(const std::filesystem::path& path);

/// A scene format: its extension and its loader. A new format is one loader and one line in load.cpp.
struct SceneFormat {
  std::string_view extension;  // with the dot, lower case
  Scene (*load)(const std::filesystem::path&, const LoadOptions&);
  bool points = false;          // its points and lines may become shapes: LoadOptions::radius
  bool chooses_shapes = false;  // LoadOptions::shapes too
};
/// Returns all scene formats.
std::span<const SceneFormat> scene_formats();

}  // namespace ballot
