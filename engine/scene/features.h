// What a scene holds. What it lacks gets no code, binding, buffer or dispatch.
#pragma once

namespace ballot {

/// Made by features_of (scene.h). Of materials, those count that some triangle has.
struct SceneFeatures {
  bool shading_normals = false;
  bool reflects = false;         // a mirror (metallic 1, roughness below kMirrorRoughness)
  bool refracts = false;         // transmission
  bool emits = false;            // emission, and so triangles that light
  bool glossy = false;           // anything but Lambert's law (Material::is_lambert)
  bool unlit = false;            // KHR_materials_unlit
  bool alpha = false;            // alpha masks or blending
  bool base_texture = false;     // colour and alpha
  bool surface_texture = false;  // metallic and roughness
  bool emissive_texture = false;
  bool normal_texture = false;
  bool lights = false;   // punctual
  bool sky = false;      // any
  bool sky_map = false;  // one of the pictures of a sky

  bool textures() const { return base_texture || surface_texture || emissive_texture || normal_texture; }
  bool operator==(const SceneFeatures&) const = default;

  /// Everything that a scene may have, but for the picture of a sky: what kernels cost that are not made for one scene.
  static constexpr SceneFeatures every() {
    return {true, true, true, true, true, true, true, true, true, true, true, true, true, false};
  }
};

}  // namespace ballot
