// Shapes other than triangles: kinds, records, and the triangles that stand in for them in trees. No Vulkan.
#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/geometry.h"
#include "shaders/shared/shapes.h"

namespace ballot {

/// The kind of what trees hold for a mesh. Each is SHAPE_... of shaders/shared/shapes.h.
enum class ShapeKind : std::uint32_t {
  Triangles = SHAPE_TRIANGLE,
  Spheres = SHAPE_SPHERE,
  Discs = SHAPE_DISC,
  Capsules = SHAPE_CAPSULE,
  Boxes = SHAPE_BOX
};

/// What a mesh may be made of.
struct ShapeInfo {
  std::string_view name;  // of a mesh of them
  ShapeKind kind;
  std::uint32_t vertices;  // of each
  bool radii, normals;     // vertices have a radius, a normal
  bool closed;             // it has an inside
  std::string_view summary;
  bool raster = false;  // its vertices are samples of one (heights.h)
};
inline constexpr std::string_view kHeights = "heights";
inline constexpr ShapeInfo kShapes[] = {
    {"triangles", ShapeKind::Triangles, 3, false, false, true, "three vertices each"},
    {"spheres", ShapeKind::Spheres, 1, true, false, true, "a vertex with a radius each"},
    {"discs", ShapeKind::Discs, 1, true, true, false, "a vertex with a radius and a normal each; flat"},
    {"capsules", ShapeKind::Capsules, 2, true, false, true,
     "the convex hull of two spheres each: two vertices with radii; a cone with round ends where these differ"},
    {"boxes", ShapeKind::Boxes, 2, false, false, true, "two opposite corners each, along the axes of the mesh"},
    {kHeights, ShapeKind::Triangles, 3, false, false, false, "a raster of heights, two triangles a cell", true},
};
/// Returns the first row of a kind.
const ShapeInfo& info_of(ShapeKind kind);

/// A shape, as shaders/shared/shapes.h says. Of triangles there are none.
struct Shape {
  glm::vec4 a{0}, b{0};
  bool operator==(const Shape&) const = default;
};

/// What the vertices of shapes have: one entry a vertex, or none where the kind has no use for it.
struct ShapeVertices {
  std::span<const glm::vec3> positions;
  std::span<const float> radii = {};
  std::span<const glm::vec3> normals = {};
};

/// Returns the shapes that `corners` number by their vertices, or without corners vertices 0, 1, ... Boxes have their
/// corners in order, normals have length 1.
/// Throws Error(Arguments), which begins with `where`, for a radius that is negative or not finite, and for a normal
/// that is zero or not finite. Vertices are checked (check_vertices()).
std::vector<Shape> make_shapes(ShapeKind kind, std::span<const std::uint32_t> corners, const ShapeVertices& vertices,
                               const std::string& where);

/// Returns a box that holds a shape, rounded outwards.
Bounds bounds_of(ShapeKind kind, const Shape& shape);
/// Returns true if nothing meets the shape: it has no radius, or is a box that is flat along two axes.
bool is_nothing(ShapeKind kind, const Shape& shape);

/// Returns a triangle with the bounds of a box: lo, hi, and lo with hi's number along the longest side. The box is
/// widened where that triangle has no area.
Triangle stand_in(const Bounds& box);
/// Returns the triangles that stand in for shapes in trees; one without area for what nothing meets.
UnsetVector<Triangle> stand_ins(ShapeKind kind, std::span<const Shape> shapes);

/// Returns the normal that u and v of a shape's hit tell, where a transform moves it: outward, of length 1, by sums and
/// products of double alone, which devices follow to the last bit. Zeros have no sign.
glm::vec3 normal_of_shape(float u, float v, const Transform& transform);

}  // namespace ballot
