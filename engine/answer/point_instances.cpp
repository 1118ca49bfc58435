// The letters are those of shaders/lib/query/point_instances.glsl.
#include "engine/answer/point_instances.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/tree/device/tree_arrays.h"
#include "shaders/shared/query.h"

namespace ballot {

namespace {

constexpr double kCornerRoom = 5 * 0x1p-24, kNodeRoom = 24 * 0x1p-24;  // of S, as the proof has them
constexpr std::size_t kRecordsAtOnce = 1 << 10;

/// Returns the smallest float32 that is not below x.
float rounded_up(double x) {
  const auto f = float(x);
  return double(f) < x ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

/// A matrix M as Q and T = Q M: the rows of Q are orthonormal, and T is zero below its diagonal. By Gram and Schmidt's
/// method, twice for the second row (Luc Giraud et al. Rounding error analysis of the classical Gram-Schmidt
/// orthogonalization process. Numerische Mathematik 101, 2005).
struct Turned {
  explicit Turned(const std::array<glm::dvec3, 3>& columns) : m(columns) {
    q[0] = m[0] / glm::length(m[0]);
    glm::dvec3 second = m[1] - glm::dot(q[0], m[1]) * q[0];
    second -= glm::dot(q[0], second) * q[0];
    q[1] = second / glm::length(second);
    q[2] = glm::cross(q[0], q[1]);
  }
  float t(std::size_t row, std::size_t column) const { return float(glm::dot(q[row], m[column])); }

  std::array<glm::dvec3, 3> m, q;
};

/// Writes the record of an instance. Returns the largest S_k.
double write_record(const Transform& transform, const MeshExtents& mesh, glm::vec4* to) {
  std::array<glm::dvec3, 3> columns;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) columns[std::size_t(c)][r] = transform.m[r][c];
  const Turned turned(columns);
  const glm::dvec3 lo(mesh.bounds.lo), hi(mesh.bounds.hi), origin(box_origin(mesh.bounds));
  glm::dvec3 sums, base;
  for (int r = 0; r < 3; ++r) {
    sums[r] = std::abs(double(transform.m[r][3]));
    base[r] = transform.m[r][3];
    for (int c = 0; c < 3; ++c) {
      sums[r] += std::abs(columns[std::size_t(c)][r]) * std::max(std::abs(lo[c]), std::abs(hi[c]));
      base[r] += columns[std::size_t(c)][r] * origin[c];
    }
  }
  for (int r = 0; r < 3; ++r) {
    const float* row = transform.m[r];
    to[r] = {row[0], row[1], row[2], row[3]};
    to[3 + r] = glm::vec4(glm::vec3(turned.q[std::size_t(r)]), float(base[r]));
  }
  to[6] = {turned.t(0, 0), turned.t(0, 1), turned.t(0, 2), turned.t(1, 1)};
  to[7] = {turned.t(1, 2), turned.t(2, 2), rounded_up(kNodeRoom * glm::length(sums)), 0};
  return std::max({sums.x, sums.y, sums.z});
}

}  // namespace

/// Throws Error(Arguments) unless a matrix turns, mirrors and stretches alike along all axes, so that the nearest point
/// of a shape stays the nearest.
static void check_alike(const Transform& t, std::size_t number) {
  constexpr double kRoom = 1e-5;
  double dots[3][3];
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      dots[a][b] = double(t.m[0][a]) * t.m[0][b] + double(t.m[1][a]) * t.m[1][b] + double(t.m[2][a]) * t.m[2][b];
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      if (!(std::abs(dots[a][b] - (a == b ? dots[0][0] : 0)) <= kRoom * dots[0][0]))
        fail(Failure::Arguments,
             "closest points: the matrix of instance {} stretches its shapes unevenly (columns of lengths {:.6g}, "
             "{:.6g}, {:.6g}); expected one that turns and scales alike along all axes: make the mesh of other shapes",
             number, std::sqrt(dots[0][0]), std::sqrt(dots[1][1]), std::sqrt(dots[2][2]));
}

std::vector<glm::vec4> point_records(const Forest& forest) {
  std::vector<glm::vec4> texels(POINT_HEADER_TEXELS + forest.size() * POINT_TEXELS, glm::vec4(0));
  std::vector<double> most(forest.size());
  for_chunks(forest.size(), kRecordsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const MeshExtents& mesh = forest.meshes()[forest.mesh_of(i)].extents;
      if (mesh.empty) continue;
      if (forest.meshes()[forest.mesh_of(i)].kind != ShapeKind::Triangles)
        check_alike(forest.transforms()[i], forest.name_of(i));
      most[i] = write_record(forest.transforms()[i], mesh, &texels[POINT_HEADER_TEXELS + i * POINT_TEXELS]);
    }
  });
  if (!most.empty()) texels[0].x = rounded_up(kCornerRoom * *std::ranges::max_element(most));
  return texels;
}

void PointInstances::update(Context& gpu, const DeviceTree& tree, Fetch fetch) {
  if (device_ && generation_ == tree.generation() && fetch_ == fetch) return;
  const std::vector<glm::vec4> texels = point_records(*tree.forest());
  if (!device_ || device_->size() != texels.size() || fetch_ != fetch) {
    device_.reset();
    device_.emplace(gpu, texels.size(), fetch == Fetch::Texel ? Access::Texel : Access::Storage,
                    "instances of closest points");
    fetch_ = fetch;
  }
  device_->upload(texels);
  generation_ = tree.generation();
}

}  // namespace ballot
