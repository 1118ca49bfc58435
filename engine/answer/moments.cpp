#include "engine/answer/moments.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include "engine/core/interruption.h"

namespace ballot {

namespace {

/// The components of a symmetric tensor of third order, and their numbers.
constexpr int kTriples[10][3] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {0, 0, 1}, {0, 0, 2},
                                 {1, 1, 0}, {1, 1, 2}, {2, 2, 0}, {2, 2, 1}, {0, 1, 2}};
enum { T000, T111, T222, T001, T002, T110, T112, T220, T221, T012 };

/// Sums over the triangles below a node, in scene units: of areas times normals, and the symmetric parts of the
/// integrals of these times the way from the centre, once and twice.
struct NodeMoments {
  glm::dvec3 centre{0}, dipole{0};
  glm::dmat3 second{0};
  double third[10] = {};
  double area = 0, radius = 0;

  /// Adds those of a child, or of a triangle. `centre` is final.
  void add(const NodeMoments& of) {
    const glm::dvec3 to = of.centre - centre, n = of.dipole;
    const glm::dmat3& q = of.second;
    for (int c = 0; c < 10; ++c) {
      const auto [i, j, k] = kTriples[c];
      third[c] += of.third[c] + (2 * (q[i][j] * to[k] + q[i][k] * to[j] + q[j][k] * to[i]) + n[i] * to[j] * to[k] +
                                 n[j] * to[i] * to[k] + n[k] * to[i] * to[j]) /
                                    3;
    }
    second += q + 0.5 * (glm::outerProduct(n, to) + glm::outerProduct(to, n));
    dipole += n;
    radius = std::max(radius, glm::length(to) + of.radius);
  }
};

NodeMoments moments_of(const Triangle& t) {
  const glm::dvec3 a = t[0], b = t[1], c = t[2];
  NodeMoments m;
  m.centre = (a + b + c) / 3.0;
  m.dipole = 0.5 * glm::cross(b - a, c - a);
  m.area = glm::length(m.dipole);
  glm::dmat3 spread(0);  // of the triangle's area, divided by the area
  for (const glm::dvec3& corner : {a - m.centre, b - m.centre, c - m.centre}) {
    m.radius = std::max(m.radius, glm::length(corner));
    spread += glm::outerProduct(corner, corner) / 12.0;
  }
  const glm::dvec3& n = m.dipole;
  for (int at = 0; at < 10; ++at) {
    const auto [i, j, k] = kTriples[at];
    m.third[at] = (n[i] * spread[j][k] + n[j] * spread[i][k] + n[k] * spread[i][j]) / 3;
  }
  return m;
}

/// Returns the sums of a node that has these parts.
NodeMoments joined(std::span<const NodeMoments> parts, const BvhNode& node) {
  NodeMoments m;
  for (const NodeMoments& part : parts) m.area += part.area, m.centre += part.area * part.centre;
  m.centre = m.area > 0 ? m.centre / m.area : 0.5 * (glm::dvec3(node.lo) + glm::dvec3(node.hi));
  for (const NodeMoments& part : parts) m.add(part);
  const glm::dvec3 far = glm::max(glm::abs(glm::dvec3(node.lo) - m.centre), glm::abs(glm::dvec3(node.hi) - m.centre));
  m.radius = std::min(m.radius, glm::length(far));
  return m;
}

/// Sums up from the leaves.
class Summing {
 public:
  Summing(const Bvh& bvh, std::span<const Triangle> triangles, std::vector<glm::vec4>& to)
      : bvh_(bvh), triangles_(triangles), to_(to) {}

  NodeMoments sum(std::size_t number) {
    const BvhNode& node = bvh_.nodes[number];
    NodeMoments parts[MAX_LEAF_TRIANGLES];
    const std::uint32_t count = node.count ? node.count : 2;
    for (std::uint32_t i = 0; i < count; ++i)
      parts[i] = node.count ? moments_of(triangles_[bvh_.references[node.first + i]]) : sum(node.first + i);
    const NodeMoments m = joined({parts, count}, node);
    if (number >= 2) write(m, &to_[1 + (number - 2) * MOMENT_TEXELS]);
    return m;
  }

 private:
  /// What a far node adds has no use for traces: without them fewer numbers do.
  static void write(const NodeMoments& m, glm::vec4* to) {
    const double r = std::max(m.radius, 1e-30) * (1 + 0x1p-20);
    const glm::dvec3 d = m.dipole / (r * r);
    const double trace = (m.second[0][0] + m.second[1][1] + m.second[2][2]) / 3;
    const glm::dmat3 q = (-3 / (r * r * r)) * (m.second - glm::dmat3(trace));
    const double* t = m.third;
    const double x = (t[T000] + t[T110] + t[T220]) / 5, y = (t[T001] + t[T111] + t[T221]) / 5,
                 z = (t[T002] + t[T112] + t[T222]) / 5, f = 7.5 / (r * r * r * r);
    to[0] = glm::vec4(glm::vec3(m.centre), float(r));
    to[1] = glm::dvec4(d, f * t[T012]);
    to[2] = glm::dvec4(q[0][0], q[1][1], q[2][2], f * (t[T001] - y));
    to[3] = glm::dvec4(q[1][2], q[0][2], q[0][1], f * (t[T002] - z));
    to[4] = f * glm::dvec4(t[T110] - x, t[T112] - z, t[T220] - x, t[T221] - y);
  }

  const Bvh& bvh_;
  std::span<const Triangle> triangles_;
  std::vector<glm::vec4>& to_;
};

}  // namespace

std::vector<glm::vec4> moments_of(const Bvh& bvh, std::span<const Triangle> triangles) {
  const std::size_t nodes = std::max<std::size_t>(bvh.nodes.size(), 2) - 2;
  std::vector<glm::vec4> texels(1 + nodes * MOMENT_TEXELS, glm::vec4(0));
  if (!bvh.nodes.empty()) Summing(bvh, triangles, texels).sum(0);
  return texels;
}

const RawBuffer& Moments::update(DeviceTree& tree, float beta) {
  if (!device_ || generation_ != tree.generation()) {
    ask_interruption();
    device_.reset();
    tree.bring_triangles();
    const std::vector<glm::vec4> texels = moments_of(tree.whole_bvh(), tree.triangles());
    device_ = std::make_unique<Buffer<glm::vec4>>(gpu_, texels.size(), Access::Storage, "moments of nodes");
    device_->upload(texels);
    generation_ = tree.generation(), beta_ = 0;
  }
  if (beta_ != beta) device_->upload(std::vector{glm::vec4(beta * beta, 0, 0, 0)});
  beta_ = beta;
  return *device_;
}

}  // namespace ballot
