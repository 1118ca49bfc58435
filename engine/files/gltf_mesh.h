// Converts glTF primitives to numbered world-space triangles. Internal to engine/files.
#pragma once

#include <array>
#include <glm/mat4x4.hpp>
#include <optional>

#include "engine/files/gltf_accessor.h"
#include "engine/model/scene.h"

namespace ballot {

/// A primitive of triangles, points or lines, with its accessors checked. The numbers are indices into GltfFile::model.
struct OpenPrimitive {
  std::size_t mesh = 0, primitive = 0;
  AccessorView positions{};
  std::optional<AccessorView> normals{}, indices{}, colors{};
  bool color_alpha = false;  // of colors
  std::array<std::optional<AccessorView>, kUvSets> uvs{};
  int mode = 0;
  std::uint32_t material = 0;
  std::size_t triangle_count = 0;           // or of its shapes
  ShapeKind shapes = ShapeKind::Triangles;  // spheres of points, capsules of lines
  std::string place{};                      // "mesh 3 ('chair') primitive 0"
};

/// Opens a primitive. Returns nothing for primitives without POSITION, and for points and lines unless the options
/// have a radius, and adds a note.
/// Throws Error(Work).
std::optional<OpenPrimitive> open_primitive(GltfFile& file, std::size_t mesh, std::size_t primitive);

/// The vertex attributes that a scene's triangles carry besides positions.
struct Carried {
  bool normals = false;
  bool colors = false;              // white where a primitive has none
  std::array<bool, kUvSets> uvs{};  // coordinates (0, 0) where a primitive has none
};

/// Returns the vertices of triangle i, or of shape i, whose last one comes again. Throws Error(Work) on an index out of
/// range.
std::array<std::size_t, 3> primitive_corners(const OpenPrimitive& primitive, std::size_t i);

/// Appends the triangles of a primitive and the attributes that they carry. Positions are transformed in double and
/// rounded once. `turned`: corners 1 and 2 of each triangle change places, as the winding does under a node that
/// mirrors (glTF 2.0, 3.7.4).
/// Throws Error(Work) on an index out of range and on a vertex that is not finite.
void append_primitive(const OpenPrimitive& primitive, const glm::dmat4& world_from_node, bool turned,
                      const Carried& carried, Scene& scene);

/// Appends the shapes of a primitive in the same way. Their radius is one of the world. Throws as append_shapes() does,
/// too.
void append_primitive_shapes(const OpenPrimitive& primitive, const glm::dmat4& world_from_node, float radius,
                             const Carried& carried, Scene& scene);

}  // namespace ballot
