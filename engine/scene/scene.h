// A scene as the engine sees it: flat world-space triangles, materials and viewpoints. No Vulkan.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/features.h"
#include "engine/scene/light.h"
#include "engine/scene/material.h"

namespace ballot {

using Triangle = std::array<glm::vec3, 3>;  // 36 bytes, world space, scene units
static_assert(sizeof(Triangle) == 36);

struct Bounds {
  glm::vec3 lo{0}, hi{0};
};

/// A viewpoint. Right-handed, looks along -z of its own frame, +y up (glTF's camera).
struct View {
  std::string name;
  glm::dmat4 world_from_camera{1};   // rigid: rotation and translation, no scale
  double yfov = 1.0471975511965976;  // full vertical angle, radians
  bool orthographic = false;
  double ymag = 1;  // orthographic: half the height, scene units
};

struct Scene {
  std::string name;                               // file name without folders and extension
  std::vector<Triangle> triangles;                // index = prim; numbering: see load_scene
  std::vector<std::array<glm::vec3, 3>> normals;  // unit, one per corner; empty if no primitive of the file has normals
  std::vector<std::uint32_t> material_of;         // per triangle, an index into materials
  std::vector<Material> materials;                // never empty
  std::vector<Texture> textures;                  // those that materials in use name
  std::vector<TextureImage> images;               // of those textures
  /// Texture coordinates, three a triangle; a set that no material in use asks for is empty.
  std::array<std::vector<std::array<glm::vec2, 3>>, kUvSets> uvs;
  std::vector<Light> lights;       // KHR_lights_punctual
  Sky sky;                         // scene files have none: whoever renders sets it
  std::vector<View> views;         // never empty: a scene without cameras gets "view0", which frames it
  Bounds bounds;                   // of all vertices; zero for an empty scene
  std::vector<std::string> notes;  // what the loader ignored or mended, a sentence each
};

/// What the scene holds, of materials in use, and its tree once there is one; the one place that derives it.
SceneFeatures features_of(const Scene& scene, const TreeFacts& tree = {});

/// Loads a scene file; the extension chooses the loader (see formats()).
///
/// Triangles are numbered so: walk the default scene's nodes depth first in file order; for each mesh its primitives
/// in order; for each its triangles in index order. Node matrices are composed and applied in double and rounded to
/// float once. Triangles of zero area keep their number; no ray hits them.
/// Throws Error(Work) on a file that is missing, empty, truncated, of another format, inconsistent (index or accessor
/// out of range, counts beyond the file), or that holds a NaN or infinite vertex; the text names file, place, value.
/// A scene without triangles is valid. Thread-safe for different files and for the same file.
Scene load_scene(const std::filesystem::path& path);

/// Checks and completes a scene built in memory as load_scene does (bounds, default material and view, sizes).
/// Throws Error(Arguments) if array sizes disagree, an index of a material, texture, image or set of coordinates is out of
/// range, or a vertex is not finite.
void finish_scene(Scene& scene);

/// The view of this name. Throws Error(Arguments) that lists the names there are.
const View& find_view(const Scene& scene, std::string_view name);

/// One line per scene format: extensions and loader. A new format is one loader and one line in load.cpp.
struct SceneFormat {
  std::string_view extension;  // with the dot, lower case
  Scene (*load)(const std::filesystem::path&);
};
std::span<const SceneFormat> scene_formats();

}  // namespace ballot
