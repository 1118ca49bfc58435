// Random numbers, meshes, rays and points for the generators of hard cases; the same on every machine.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "tools/hard/hard.h"

namespace ballot::hard {

using Triangles = UnsetVector<Triangle>;

constexpr float kFar = 1e30f;  // a t_max beyond every scene
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// The random number generator SplitMix64: Steele, Lea, Flood. Fast Splittable Pseudorandom Number Generators. OOPSLA
/// 2014. It is not one of std, whose distributions differ between libraries.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint32_t bits();
  float in(float lo, float hi) { return lo + (hi - lo) * (static_cast<float>(bits() >> 8) * 0x1p-24f); }
  glm::vec3 point(float half);  // in the cube of this half width about the origin
  glm::vec3 direction();        // of a length between 0.5 and 1
  std::size_t below(std::size_t n) { return bits() % n; }
  bool flip() { return (bits() & 1) != 0; }
  float sign() { return flip() ? 1.f : -1.f; }

 private:
  std::uint64_t state_;
};

/// Returns the number of rays or points of a set. It is odd, so the last subgroup is never full.
constexpr std::size_t many(bool quick) { return quick ? 1001 : 50021; }

/// Returns x itself or its float32 neighbour above or below; of a point, each coordinate so.
float beside(float x, Random& random);
glm::vec3 beside(const glm::vec3& p, Random& random);
/// Returns 2^exponent, for exponent in [-149, 127].
float power_of_two(int exponent);

/// Returns a finished scene of these triangles.
Scene scene_of(std::string name, Triangles triangles);
Bounds bounds_of(const Triangles& triangles);

/// Returns a height field of n x n cells whose heights are multiples of 1/8, and boxes over it; x east, y up, z south.
Triangles city(int n, float cell, const glm::vec3& corner, std::size_t buildings);

// Meshes.
Triangles octasphere(int levels);  // closed, vertices near the unit sphere, exactly symmetric in every axis
Triangles icosphere(int levels);   // closed, vertices near the unit sphere
/// Returns the closed cube [-half, half]^3. Each face has n x n squares of two triangles. Exact if half / n is exact.
Triangles cube_grid(int n, float half);
/// Returns the square [-half, half]^2 at height y, of n x n squares of two right triangles, facing up; y is up.
Triangles plane_grid(int n, float half, float y);
Triangles soup(std::size_t count, float size, std::uint64_t seed);  // random triangles in the cube of half width 1
Triangles moved(Triangles triangles, float scale, const glm::vec3& offset);
void append(Triangles& to, const Triangles& more);

/// Returns smooth noise in [-1, 1] at a point; the noise grid has unit cells.
float noise(const glm::vec3& p, std::uint32_t seed);

// Rays.
Ray towards(const glm::vec3& from, const glm::vec3& to, float t_max = kFar);
glm::vec3 point_of(const Triangle& t, float u, float v);
/// Returns a point of a random triangle: a vertex, a point on an edge, or a point inside, each as often.
glm::vec3 target(const Triangles& triangles, Random& random);
/// Returns rays at targets, from points at most `spread` away from `centre`; half of them, at random, start at
/// `centre`.
std::vector<Ray> at_targets(const Triangles& triangles, std::size_t count, const glm::vec3& centre, float spread,
                            std::uint64_t seed);
/// Returns rays along the axes, with 0 and -0 as the other components, from inside at the vertices of a convex mesh.
/// The mesh must be symmetric about the axis-parallel planes through `centre`.
std::vector<Ray> axes_from_within(const Triangles& triangles, std::size_t count, const glm::vec3& centre, float radius,
                                  std::uint64_t seed);
/// Returns rays through the scene in all directions, which start around it.
std::vector<Ray> around(const Bounds& bounds, std::size_t count, std::uint64_t seed);
/// Returns the answers of a set in which every ray has the same answer, such as NO_HIT.
std::vector<std::uint32_t> all(std::size_t count, std::uint32_t answer);

// The generators, grouped by what makes them hard. cases.cpp describes each.
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

HardScene touching_shells(bool quick);
HardScene far_shells(bool quick);
HardScene sliver_shells(bool quick);

HardScene tiny_spheres(bool quick);
HardScene tiny_in_huge(bool quick);
HardScene huge_sphere(bool quick);
HardScene huge_planes(bool quick);
HardScene far_offsets(bool quick);
HardScene utm_terrain(bool quick);
HardScene narrow_view(bool quick);

HardScene needles(bool quick);
HardScene hairs(bool quick);
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

HardPointScene coplanar_points(bool quick);
HardPointScene obtuse_triangles(bool quick);
HardPointScene acute_edges(bool quick);
HardPointScene middles(bool quick);
HardPointScene shared_corner(bool quick);
HardPointScene near_shells(bool quick);
HardPointScene shell_lattice(bool quick);
HardPointScene far_shell_lattice(bool quick);
HardPointScene points_at_collinear(bool quick);
HardPointScene far_points(bool quick);
HardPointScene limits_at_distances(bool quick);

HardDoubleScene utm_in_double(bool quick);
HardDoubleScene earth_centred(bool quick);
HardDoubleScene satellites(bool quick);
HardDoubleScene reactor(bool quick);
HardDoubleScene long_rays(bool quick);
HardDoubleScene tiny_beside_large(bool quick);

HardScene ray_counts(bool quick);
HardScene dead_rays(bool quick);

}  // namespace ballot::hard
