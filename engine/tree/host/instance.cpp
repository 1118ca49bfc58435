// The box and the slack of an instance. shaders/build/instances.comp does the same on the device, every operation in
// the same order.
//
// Let M be the matrix, T the translation, A the inverse of M as the device has it (rounded to float32), o and d the
// ray's origin and direction in the world, w = 2^-24; all errors are to first order. The object-space ray (o', d') is
// computed from o - T and d:
//   |o' - M^-1 (o - T)|_i <= 5 w sum_j |A_ij| |o_j - T_j|     (entry, subtraction, product, two sums)
//   |d' - M^-1 d|_i       <= 4 w sum_j |A_ij| |d_j|
// The inverse, computed in double precision, adds less than w / 16 to the entries' rounding where the condition below
// is at most 2^20. The triangle test finds t such that the point o' + t d' lies, along axis i, within
//   31 w D_i + 18 w E_i + 31 w E
// of a point q' of some leaf's box (shaders/lib/numeric/box_widened.glsl): D_i is the distance of q' from o' along i,
// E_i the largest extent of a triangle along i, E the largest of these. An exact hit lies at q' itself.
//
// Let q = M q' + T, which lies in the box B that holds the moved mesh, R the largest distance along an axis between o
// and a point of B, K = |M| |A| (products of magnitudes, at least 1 on the diagonal), and g_j how far T lies outside of
// B along j. Then |o_j - T_j| <= R + g_j, |t d_j| <= R, and D_i <= sum_j |A_ij| R, so that along axis k the point
// o + t d lies within
//   w sum_j K_kj (5.1 (R + g_j) + 4.1 R + 31 R) + w sum_i |M_ki| (18 E_i + 31 E)
// of q. What grows with R is at most 40.2 w R times the row's sum of K; the box test adds 8 w R. The slack is 50 w
// times that sum, which is at least 1, and 8 w: room for terms of second order is left. The rest widens B. A stands
// unrounded in what is computed of K: that moves it by w, for which there is room too.
//
// The largest row sum of K is a condition number of M (Robert D. Skeel. Scaling for Numerical Stability in Gaussian
// Elimination. JACM 26, 1979) that scales of the mesh's axes do not change: 1 for these, at most 3 for rotations.
#include "engine/tree/host/instance.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/tree/host/build.h"

namespace ballot {

namespace {

constexpr double kUlp = 0x1p-24;
constexpr double kLargestCoordinate = 1e12;
constexpr double kLargestCondition = 0x1p+20;
constexpr double kLargestScale = 0x1p+60;

using Matrix = std::array<std::array<double, 3>, 3>;  // row by row

Matrix matrix_of(const Transform& t) {
  Matrix m;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) m[r][c] = t.m[r][c];
  return m;
}

/// Returns 1 / x by Newton's method, which devices can follow to the last bit: they need not round divisions as the
/// host does. The seed is off by an eighth at most, and each step squares the error. Infinite or NaN for a zero.
double reciprocal(double x) {
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(x), sign = bits >> 63;
  const std::uint64_t seed = 0x7FDE6238u - (bits >> 32 & 0x7FFFFFFFu);
  double y = std::bit_cast<double>(sign << 63 | (seed & 0x7FFFFFFFu) << 32);
  for (int step = 0; step < 6; ++step) y = y + y * (1 - x * y);
  return y;
}

double cofactor(const Matrix& m, int r, int c) {
  const int a = (r + 1) % 3, b = (r + 2) % 3, d = (c + 1) % 3, e = (c + 2) % 3;
  return m[a][d] * m[b][e] - m[a][e] * m[b][d];
}

double determinant(const Matrix& m) {
  return m[0][0] * cofactor(m, 0, 0) + m[0][1] * cofactor(m, 0, 1) + m[0][2] * cofactor(m, 0, 2);
}

/// Returns the inverse by cofactors. Entries may be infinite or NaN.
Matrix inverse_of(const Matrix& m) {
  Matrix out;
  const double over = reciprocal(determinant(m));
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out[r][c] = cofactor(m, c, r) * over;
  return out;
}

std::string text_of(const Transform& t) {
  std::string text;
  for (const auto& row : t.m)
    text += fmt::format("{}({}, {}, {}, {})", text.empty() ? "" : " ", row[0], row[1], row[2], row[3]);
  return text;
}

void check_numbers(const Transform& t, std::size_t number) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c)
      if (!std::isfinite(t.m[r][c]))
        fail(Failure::Arguments, "instance {}: entry [{}][{}] of the transform is {}; expected a finite number", number,
             r, c, t.m[r][c]);
  for (int c = 0; c < 3; ++c) {
    const float most = std::max({std::abs(t.m[0][c]), std::abs(t.m[1][c]), std::abs(t.m[2][c])});
    if (most < 1 / kLargestScale || most > kLargestScale)
      fail(Failure::Arguments,
           "instance {}: column {} of the transform has {} as its largest magnitude; expected {:.3g} to {:.3g}; scale "
           "the mesh",
           number, c, most, 1 / kLargestScale, kLargestScale);
  }
}

/// Returns sums over the rows of |m| |a|.
std::array<double, 3> conditions(const Matrix& m, const Matrix& a) {
  std::array<double, 3> sums{};
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) sums[k] += std::abs(m[k][i] * a[i][j]);
  return sums;
}

/// The moved mesh's box, without padding.
struct Moved {
  std::array<double, 3> lo, hi;
};

Moved moved_box(const Bounds& b, const Matrix& m, const Transform& t) {
  Moved moved;
  for (int k = 0; k < 3; ++k) {
    moved.lo[k] = moved.hi[k] = t.m[k][3];
    for (int i = 0; i < 3; ++i) {
      const double x = m[k][i] * double(b.lo[i]), y = m[k][i] * double(b.hi[i]);
      moved.lo[k] += std::min(x, y);
      moved.hi[k] += std::max(x, y);
    }
  }
  return moved;
}

/// Widens a box by the errors that no ray adds to, and rounds it outwards.
Bounds widened(const Moved& moved, const MeshExtents& mesh, const Matrix& m, const Matrix& a, const Transform& t) {
  constexpr double kRoom = 1.05;
  const glm::vec3& e = mesh.largest_triangle;
  const double longest = std::max({e.x, e.y, e.z});
  Bounds box;
  for (int k = 0; k < 3; ++k) {
    double pad = 0;
    for (int i = 0; i < 3; ++i) {
      pad += std::abs(m[k][i]) * (18 * double(e[i]) + 31 * longest);
      for (int j = 0; j < 3; ++j) {
        const double outside = std::max({moved.lo[j] - double(t.m[j][3]), double(t.m[j][3]) - moved.hi[j], 0.0});
        pad += std::abs(m[k][i] * a[i][j]) * 5.1 * outside;
      }
    }
    pad *= kRoom * kUlp;
    // Double precision rounds the box itself by less than 2^-50 of its numbers.
    const double own = 0x1p-50 * (std::abs(moved.lo[k]) + std::abs(moved.hi[k]) + std::abs(double(t.m[k][3])));
    constexpr float infinity = std::numeric_limits<float>::infinity();
    box.lo[k] = std::nextafter(float(moved.lo[k] - pad - own), -infinity);
    box.hi[k] = std::nextafter(float(moved.hi[k] + pad + own), infinity);
  }
  return box;
}

std::uint32_t direction_exponent(const glm::vec3& dir) {
  const float most = std::max({std::abs(dir.x), std::abs(dir.y), std::abs(dir.z)});
  return std::min(std::bit_cast<std::uint32_t>(most) >> 23, 253u);
}

template <class Vec>
Vec moved_by(const ObjectMap& map, const Vec& v) {
  Vec moved;
  for (int i = 0; i < 3; ++i) {
    const Vec row(map.row[i]);
    const auto x = row.x * v.x, y = row.y * v.y, z = row.z * v.z;
    const auto sum = x + y;
    moved[i] = sum + z;
  }
  return moved;
}

}  // namespace

float direction_scale(const Ray& ray) { return std::bit_cast<float>((254u - direction_exponent(ray.dir)) << 23); }

Ray object_ray(const Ray& ray, const ObjectMap& map) {
  const float scale = direction_scale(ray), inverse = std::bit_cast<float>(direction_exponent(ray.dir) << 23);
  const glm::vec3 from = ray.origin - map.translation, dir = ray.dir * scale;
  const auto limited = [&](float t) { return std::clamp(t * inverse, -3.4e38f, 3.4e38f); };
  return {moved_by(map, from), limited(ray.t_min), moved_by(map, dir), limited(ray.t_max)};
}

RayInDouble object_ray_in_double(const Ray& ray, const ObjectMap& map) {
  const double scale = direction_scale(ray), inverse = 1 / scale;
  const auto limited = [&](float t) { return std::clamp(t * inverse, -3.4e38, 3.4e38); };
  const glm::dvec3 from = glm::dvec3(ray.origin) - glm::dvec3(map.translation), dir = glm::dvec3(ray.dir) * scale;
  return {moved_by(map, from), limited(ray.t_min), moved_by(map, dir), limited(ray.t_max)};
}

MeshExtents extents_of(const Bvh& bvh, std::span<const Triangle> triangles) {
  const auto larger = [](const glm::vec3& a, const glm::vec3& b) { return glm::max(a, b); };
  const auto largest = [&](std::size_t begin, std::size_t end) {
    glm::vec3 most(0);
    for (const Triangle& t : triangles.subspan(begin, end - begin)) {
      const Bounds b = bounds_of(t);
      most = larger(most, b.hi - b.lo);
    }
    return most;
  };
  MeshExtents extents{bvh.bounds, joined_chunks(triangles.size(), 1 << 16, glm::vec3(0), largest, larger),
                      bvh.is_empty()};
  for (int axis = 0; axis < 3 && !triangles.empty(); ++axis)
    extents.largest_triangle[axis] =
        std::nextafter(extents.largest_triangle[axis], std::numeric_limits<float>::infinity());
  return extents;
}

Instance place_instance(const MeshExtents& mesh, const Transform& t, std::size_t number) {
  check_numbers(t, number);
  const Matrix m = matrix_of(t), inverse = inverse_of(m);
  Instance made;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) made.map.row[r][c] = float(inverse[r][c]);
  made.map.translation = {t.m[0][3], t.m[1][3], t.m[2][3]};
  made.mirrors = determinant(m) < 0;
  const std::array<double, 3> sums = conditions(m, inverse);
  const double condition = std::max({sums[0], sums[1], sums[2]});
  if (!(condition <= kLargestCondition))
    fail(Failure::Arguments,
         "instance {}: the matrix of the transform is singular in float32: it multiplies rounding errors by {:.3g}; "
         "expected at "
         "most {:.3g}; it is {}",
         number, condition, kLargestCondition, text_of(t));
  if (mesh.empty) return made;
  const Moved moved = moved_box(mesh.bounds, m, t);
  for (int k = 0; k < 3; ++k)
    if (!(std::max({std::abs(moved.lo[k]), std::abs(moved.hi[k]), std::abs(double(t.m[k][3]))}) <= kLargestCoordinate))
      fail(Failure::Arguments,
           "instance {}: the transform moves the mesh to {:.6g} to {:.6g} along {}, by a translation of {}; expected "
           "all within "
           "+-{:g}; scale the scene",
           number, moved.lo[k], moved.hi[k], "xyz"[k], t.m[k][3], kLargestCoordinate);
  made.box = widened(moved, mesh, m, inverse, t);
  made.slack = float(50 * kUlp * (1 + 1e-6) * condition + 8 * kUlp);
  return made;
}

}  // namespace ballot
