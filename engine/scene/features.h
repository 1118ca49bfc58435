// What a scene holds. What it lacks gets no code, binding, buffer or dispatch.
#pragma once

#include <cstdint>

namespace ballot {

/// What the built tree asks of a traversal; made by facts_of (bvh/bvh.h).
struct TreeFacts {
  std::uint32_t depth = 0;         // inner nodes on the longest path from the root: sizes every stack
  std::uint32_t largest_leaf = 0;  // triangles
  bool far = false;                // boxes are not measured from zero: box_origin(), bvh/bvh.h
  bool operator==(const TreeFacts&) const = default;
};

/// Made by features_of (scene.h). Of materials, those count that some triangle has.
struct SceneFeatures {
  bool shading_normals = false;
  bool reflects = false;         // a mirror (metallic 1, roughness below kMirrorRoughness); glossy besides
  bool refracts = false;         // transmission
  bool emits = false;            // emission, and so triangles that light
  bool glossy = false;           // anything but Lambert's law (Material::is_lambert)
  bool unlit = false;            // KHR_materials_unlit
  bool alpha = false;            // alpha masks or blending
  bool base_texture = false;     // colour and alpha
  bool surface_texture = false;  // metallic and roughness
  bool emissive_texture = false;
  bool normal_texture = false;
  bool lights = false;        // punctual
  bool sky = false;           // any
  bool sky_map = false;       // one of the pictures of a sky
  bool perspective = false;   // kinds of cameras; of a picture, that of its view alone
  bool orthographic = false;  // (through(), render/camera.h)
  TreeFacts tree = {};

  bool textures() const { return base_texture || surface_texture || emissive_texture || normal_texture; }
  bool operator==(const SceneFeatures&) const = default;

  /// Everything that a scene may have, but for the picture of a sky: what kernels cost that are not made for one scene. Stacks
  /// then have the 64 entries that are common where nobody asks how deep a tree is.
  static constexpr SceneFeatures every() {
    return {.shading_normals = true,
            .reflects = true,
            .refracts = true,
            .emits = true,
            .glossy = true,
            .unlit = true,
            .alpha = true,
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
