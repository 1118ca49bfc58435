// The features of a scene. A feature that the scene lacks gets no code, binding, buffer or dispatch.
#pragma once

#include <cstdint>

namespace ballot {

/// The properties of a BVH that traversal kernels depend on; made by facts_of() (engine/tree/host/bvh.h).
struct TreeFacts {
  std::uint32_t depth = 0;         // inner nodes on the longest path from the root: the size of every stack
  std::uint32_t largest_leaf = 0;  // triangles
  bool far = false;                // boxes are measured from a nonzero origin: box_origin(), engine/tree/host/bvh.h
  std::uint32_t top_depth = 0;     // of the tree over instances (forest.h), at least 1; 0: no instances
  std::uint32_t shapes = 0;        // a bit for each kind of shape (shaders/shared/shapes.h); 0: triangles alone
  bool large = false;              // the trees of all instances' meshes together may take more than 4 GiB
  bool doubles = false;            // there are vertices in double (engine/tree/device/double_corners.h)
  bool operator==(const TreeFacts&) const = default;
};

/// The features of a scene; made by features_of() (scene.h). Only materials that some triangle uses count.
struct SceneFeatures {
  bool shading_normals = false;
  bool reflects = false;         // a mirror (metallic 1, roughness below kMirrorRoughness); such a scene is glossy too
  bool refracts = false;         // transmission
  bool emits = false;            // emission, hence triangles that are light sources
  bool glossy = false;           // a material that is not purely Lambertian (Material::is_lambert)
  bool unlit = false;            // KHR_materials_unlit
  bool alpha = false;            // alpha masks or blending
  bool vertex_colors = false;    // colours of vertices
  bool base_texture = false;     // texture of colour and alpha
  bool surface_texture = false;  // texture of metallic and roughness
  bool emissive_texture = false;
  bool normal_texture = false;
  bool lights = false;   // punctual lights
  bool sky = false;      // a sky of any kind
  bool sky_map = false;  // a sky that is a picture
  // The kinds of cameras. For a picture only the kind of its view is set (through(), engine/render/data/camera.h).
  bool perspective = false;
  bool orthographic = false;
  /// More triangles than a texel buffer of the device holds: shading reads storage buffers instead.
  bool stored = false;
  TreeFacts tree = {};

  bool instances() const { return tree.top_depth > 0; }
  bool textures() const { return base_texture || surface_texture || emissive_texture || normal_texture; }
  bool operator==(const SceneFeatures&) const = default;

  /// Returns every feature except a sky map. It serves to measure the cost of kernels that are not compiled for one
  /// scene. Stacks then have 64 entries, the common choice where the depth of the tree is unknown.
  static constexpr SceneFeatures every() {
    return {.shading_normals = true,
            .reflects = true,
            .refracts = true,
            .emits = true,
            .glossy = true,
            .unlit = true,
            .alpha = true,
            .vertex_colors = true,
            .base_texture = true,
            .surface_texture = true,
            .emissive_texture = true,
            .normal_texture = true,
            .lights = true,
            .sky = true,
            .sky_map = false,
            .perspective = true,
            .orthographic = true,
            .tree = {.depth = 63, .largest_leaf = 6, .far = true}};
  }
};

}  // namespace ballot
