// What the generators of hard cases share: random numbers, meshes and rays, the same on every machine.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "tools/hard/hard.h"

namespace ballot::hard {

using Triangles = std::vector<Triangle>;

constexpr float kFar = 1e30f;  // a t_max beyond every scene
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Steele, Lea, Flood. Fast Splittable Pseudorandom Number Generators. OOPSLA 2014. Not std::: its distributions differ
/// between libraries.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint32_t bits();
  float in(float lo, float hi) { return lo + (hi - lo) * (static_cast<float>(bits() >> 8) * 0x1p-24f); }
  glm::vec3 point(float half);  // in the cube of this half width
  glm::vec3 direction();        // not of unit length, between 0.5 and 1 long
  std::size_t below(std::size_t n) { return bits() % n; }
  bool flip() { return (bits() & 1) != 0; }
  float sign() { return flip() ? 1.f : -1.f; }

 private:
  std::uint64_t state_;
};

/// How many rays a set gets; odd, so that the last subgroup is never full.
constexpr std::size_t many(bool quick) { return quick ? 1001 : 50021; }

/// 2^exponent, for exponent in [-149, 127].
float power_of_two(int exponent);

/// A finished scene of these triangles.
Scene scene_of(std::string name, Triangles triangles);
Bounds bounds_of(const Triangles& triangles);

// Meshes.
Triangles octasphere(int levels);  // closed, vertices about on the unit sphere, exactly symmetric in every axis
Triangles icosphere(int levels);   // closed, vertices about on the unit sphere
/// A closed cube [-half, half]^3, each face n x n squares of two triangles; exact where half / n is.
Triangles cube_grid(int n, float half);
/// The square [-half, half]^2 at this height, n x n squares of two right triangles, facing up; y is up.
Triangles plane_grid(int n, float half, float y);
Triangles soup(std::size_t count, float size, std::uint64_t seed);  // in the cube of half width 1
Triangles moved(Triangles triangles, float scale, const glm::vec3& offset);
void append(Triangles& to, const Triangles& more);

/// Smooth noise in [-1, 1] at points of any size; its grid has unit cells.
float noise(const glm::vec3& p, std::uint32_t seed);

// Rays.
Ray towards(const glm::vec3& from, const glm::vec3& to, float t_max = kFar);
glm::vec3 point_of(const Triangle& t, float u, float v);
/// Of a random triangle: a vertex, a point of an edge, or a point inside, as often each.
glm::vec3 target(const Triangles& triangles, Random& random);
/// From points at most `spread` from `centre` at targets; every other ray starts at the centre itself.
std::vector<Ray> at_targets(const Triangles& triangles, std::size_t count, const glm::vec3& centre, float spread,
                            std::uint64_t seed);
/// Along the axes, with 0 and -0 as the other components, at vertices of a convex mesh that is symmetric about the
/// centre's planes, from within.
std::vector<Ray> axes_from_within(const Triangles& triangles, std::size_t count, const glm::vec3& centre, float radius,
                                  std::uint64_t seed);
/// From around the scene through it, in all directions.
std::vector<Ray> around(const Bounds& bounds, std::size_t count, std::uint64_t seed);
/// The answers of a set in which every ray hits something, or none does.
std::vector<std::uint32_t> all(std::size_t count, std::uint32_t answer);

// The generators, by what is hard about them; what each holds: cases.cpp.
HardScene axis_directions(bool quick);
HardScene box_faces(bool quick);
HardScene denormal_directions(bool quick);
HardScene direction_lengths(bool quick);
HardScene short_directions(bool quick);
HardScene long_directions(bool quick);

HardScene closed_icosphere(bool quick);
HardScene closed_cube(bool quick);
HardScene far_sphere_and_plane(bool quick);
HardScene quantised_statue(bool quick);
HardScene collapsed_statue(bool quick);
HardScene two_shells(bool quick);
HardScene rough_spheres(bool quick);

HardScene tiny_spheres(bool quick);
HardScene tiny_in_huge(bool quick);
HardScene huge_sphere(bool quick);
HardScene huge_planes(bool quick);
HardScene far_offsets(bool quick);
HardScene utm_terrain(bool quick);
HardScene narrow_view(bool quick);

HardScene needles(bool quick);
HardScene thin_triangle(bool quick);
HardScene grazing(bool quick);
HardScene duplicates(bool quick);
HardScene coplanar_overlaps(bool quick);
HardScene interpenetrating(bool quick);
HardScene flat_walls(bool quick);

HardScene chain(bool quick);
HardScene same_box(bool quick);
HardScene same_centroid(bool quick);
HardScene degenerate_among_proper(bool quick);
HardScene only_degenerate(bool quick);
HardScene single_triangle(bool quick);
HardScene no_triangle(bool quick);

HardScene on_surfaces(bool quick);
HardScene interval_ends(bool quick);
HardScene offset_origins(bool quick);
HardScene collinear_report(bool quick);

HardScene ray_counts(bool quick);
HardScene dead_rays(bool quick);

}  // namespace ballot::hard
