// The scene that the engine traces: triangles, materials, lights and views. No Vulkan.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/geometry.h"
#include "engine/model/features.h"
#include "engine/model/heights.h"
#include "engine/model/light.h"
#include "engine/model/material.h"
#include "engine/model/placement.h"

namespace ballot {

/// A camera. Its frame is right-handed; it looks along -z with +y up, as in glTF.
struct View {
  std::string name;
  glm::dmat4 world_from_camera{1};   // rigid: rotation and translation, no scale
  double yfov = 1.0471975511965976;  // full vertical angle, radians
  bool orthographic = false;
  double ymag = 1;  // orthographic: half the height of the view, scene units
  int node = -1;    // of Scene::animation, that moves the camera; -1: none
};

struct Animation;  // animation.h

/// A scene. load_scene() (load.h) loads one; finish_scene() completes one that is built in memory.
struct Scene {
  std::string name;  // file name without folders and extension
  /// Mesh by mesh. In a flat scene they lie in the world, and the index is the prim of hits; numbering: see load.h.
  /// The lists that follow, up to shapes, are of these triangles.
  UnsetVector<Triangle> triangles;
  /// Unit normals, three per triangle; empty if no primitive of the file has normals.
  std::vector<std::array<glm::vec3, 3>> normals;
  std::vector<std::uint32_t> material_of;  // per triangle, an index into materials; empty: 0
  std::vector<Material> materials;         // never empty
  std::vector<Texture> textures;           // textures of materials in use
  std::vector<TextureImage> images;        // images of those textures
  /// Texture coordinates, three per triangle. A set that no material in use needs is empty.
  std::array<std::vector<std::array<glm::vec2, 3>>, kUvSets> uvs;
  /// Colours of the vertices, three per triangle: linear RGBA, which multiply the base colour and alpha; empty if no
  /// primitive of the file has them.
  std::vector<std::array<glm::vec4, 3>> colors;
  /// The shapes that triangles of a mesh stand in for (MeshLabel::kind); empty if there is no such mesh.
  std::vector<Shape> shapes;
  /// The raster that tells the triangles of a file's only mesh (MeshLabel::columns), about the world's zero; or null.
  std::shared_ptr<const HeightField> heights;
  SceneInstances instances;        // the meshes, and where they lie
  std::vector<Light> lights;       // KHR_lights_punctual
  Sky sky;                         // scene files have none: the caller sets it
  std::vector<View> views;         // never empty: a scene without cameras gets "view0", which frames the scene
  Bounds bounds;                   // of all vertices; zero for an empty scene
  glm::dvec3 origin{0};            // the point of the world that all coordinates are counted from
  std::vector<std::string> notes;  // what the loader ignored or mended, one sentence each
  std::shared_ptr<const Animation> animation;  // null: nothing moves
  std::vector<bool> turned;  // each part of the animation: its triangles' corners 1 and 2 have changed places (pose.h)

  /// Returns the material of a triangle, an index into materials.
  std::uint32_t material(std::size_t triangle) const { return material_of.empty() ? 0 : material_of[triangle]; }
  /// Returns false if the scene is flat: each mesh is placed once, in order, with the identity.
  bool instanced() const { return instances.kept > 0; }
};

/// Returns the features of a scene's materials in use, lights, sky and views, and of its tree if there is one. No other
/// code derives features.
SceneFeatures features_of(const Scene& scene, const TreeFacts& tree = {});

/// Checks and completes a scene built in memory, as load_scene() does: bounds, default material, default view, and what
/// lacks of its meshes and placements (complete_instances() in instances.h). `of_meshes`: the bounds of each, whose
/// triangles lie elsewhere; placements are then identities.
/// Throws Error(Arguments) if array sizes disagree, if an index of a material, texture, image or set of coordinates is
/// out of range, if a vertex is not finite, or as complete_instances() does.
void finish_scene(Scene& scene, std::span<const Bounds> of_meshes = {});

/// Returns the bounds of triangles; zero if there are none. Throws Error(Arguments), which names the scene, if a vertex
/// is not finite.
Bounds bounds_of_vertices(std::span<const Triangle> triangles, std::string_view scene);

/// Returns the geometric unit normal of a triangle, by the right-hand rule over its vertices; (0, 1, 0) if it has no
/// area.
glm::vec3 geometric_normal(const Triangle& triangle);

/// Throws Error(Arguments), which names `what`, if the scene has shapes other than triangles.
void need_triangles(const Scene& scene, std::string_view what);

/// Returns the view of this name. Throws Error(Arguments) that lists the names of the views.
const View& find_view(const Scene& scene, std::string_view name);

}  // namespace ballot
