#include "engine/answer/moments.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "engine/core/interruption.h"

namespace ballot {

namespace {

/// Sums over the triangles below a node, in scene units.
struct NodeMoments {
  glm::dvec3 centre{0}, dipole{0}, diagonal{0}, mixed{0};  // dipole: of areas times normals
  double area = 0, radius = 0;

  /// Adds those of a child, or of a triangle. `centre` is final.
  void add(const NodeMoments& of) {
    const glm::dvec3 to = of.centre - centre, n = of.dipole;
    diagonal += of.diagonal + n * to;
    mixed += of.mixed + 0.5 * glm::dvec3(n.y * to.z + n.z * to.y, n.z * to.x + n.x * to.z, n.x * to.y + n.y * to.x);
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
  m.radius = std::max({glm::length(a - m.centre), glm::length(b - m.centre), glm::length(c - m.centre)});
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
  static void write(const NodeMoments& m, glm::vec4* to) {
    const double r = std::max(m.radius, 1e-30) * (1 + 0x1p-20);
    to[0] = glm::vec4(glm::vec3(m.centre), float(r));
    to[1] = glm::vec4(glm::vec3(m.dipole / (r * r)), 0);
    to[2] = glm::vec4(glm::vec3(m.diagonal / (r * r * r)), 0);
    to[3] = glm::vec4(glm::vec3(m.mixed / (r * r * r)), 0);
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
