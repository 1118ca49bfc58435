// One tree over boxes of instances serves rays and points. A box holds both the instance's box by which the device
// culls rays, and one that follows from the transform and the mesh's tree alone.
//
// The latter holds the float32 corners of moved_corner(). With m the matrix, t the translation, P the point, V_j the
// largest |v_j| of the mesh and S_k = sum_j |m_kj| V_j + |t_k|, a corner is off by at most 4 * 2^-24 S_k from where the
// exact map puts its vertex, besides numbers below 2^-126. A node's box of centre c and half extents h lies within
// m c + t and |m| h, in double precision up to 2^-50 (S_k + |P_k|). Boxes are widened by 5 * 2^-24 S_k, 2^-48 |P_k| and
// 2^-120. The box of an instance is that of its tree's bounds for P = 0, rounded outwards to float32.
#include "engine/oracle/oracle_scene.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <mutex>
#include <optional>

#include "engine/oracle/filter.h"
#include "engine/oracle/walker.h"
#include "engine/tree/host/build.h"

namespace ballot {

namespace {

std::vector<PairTree> trees_of(const Forest& forest) {
  std::vector<PairTree> trees;
  for (const MeshTree& mesh : forest.meshes())
    trees.push_back(encode_pairs(*mesh.bvh, mesh.triangles, NodeLayout::Interleaved));
  return trees;
}

/// A ray as the boxes of instances see it.
struct WorldRay : FilterRay {
  WorldRay(const Ray& ray, double most) : FilterRay(ray), slack(most) {}
  double slack;
};

/// Widens a box 16 times as far as the proof of the instances' boxes asks, and by a 1000th of its size: the oracles
/// shall find the errors of that proof, should there be some. A box that holds another one is missed by no ray that
/// meets that one.
std::optional<double> enter(const WorldRay& ray, const Bounds& b, double t_far) {
  double reach = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    reach = std::max({reach, std::abs(double(b.lo[k]) - ray.o[k]), std::abs(double(b.hi[k]) - ray.o[k])});
    size = std::max(size, double(b.hi[k]) - double(b.lo[k]));
  }
  const double pad = 16 * ray.slack * reach + size / 1024;
  double near = ray.t_min, far = t_far;
  return cut_to_box(ray, b, {pad, pad, pad}, near, far) && near <= far ? std::optional(near) : std::nullopt;
}

/// Returns a lower bound of the square of the distance of a box that lies `outside` of a point along each axis, or
/// inside where that is negative; nothing if it is above `far`. A square of a distance is off by 6 * 2^-53 of itself.
std::optional<double> square_within(const glm::dvec3& outside, double far) {
  const glm::dvec3 out = glm::max(outside, 0.0);
  const double square = glm::dot(out, out) * (1 - 0x1p-49);
  return square <= far ? std::optional(square) : std::nullopt;
}

/// A point as boxes of the world see it. Squares of distances stand for t.
struct Probe {
  glm::dvec3 at;
  double t_min = 0;
};

std::optional<double> enter(const Probe& p, const Bounds& box, double far) {
  return square_within(glm::max(glm::dvec3(box.lo) - p.at, p.at - glm::dvec3(box.hi)), far);
}

/// The same for boxes in the space of a mesh that an instance moves.
class MovedProbe {
 public:
  MovedProbe(const glm::dvec3& point, const Transform& transform, const Bounds& mesh) {
    for (int k = 0; k < 3; ++k) {
      double sum = std::abs(double(transform.m[k][3]));
      for (int j = 0; j < 3; ++j) {
        m_[k][j] = transform.m[k][j];
        sum += std::abs(m_[k][j]) * std::max(std::abs(double(mesh.lo[j])), std::abs(double(mesh.hi[j])));
      }
      from_[k] = double(transform.m[k][3]) - point[k];
      room_[k] = 5 * 0x1p-24 * sum + 0x1p-48 * std::abs(point[k]) + 0x1p-120;
    }
  }
  /// Returns the centre, relative to the point, and the half extents of a box that holds what it holds in the world.
  std::pair<glm::dvec3, glm::dvec3> moved(const Bounds& box) const {
    const glm::dvec3 centre = 0.5 * (glm::dvec3(box.lo) + glm::dvec3(box.hi)), half = glm::dvec3(box.hi) - centre;
    glm::dvec3 to = from_, reach = room_;
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 3; ++j) to[k] += m_[k][j] * centre[j], reach[k] += std::abs(m_[k][j]) * half[j];
    return {to, reach};
  }

  double t_min = 0;

 private:
  double m_[3][3];
  glm::dvec3 from_, room_;
};

std::optional<double> enter(const MovedProbe& p, const Bounds& box, double far) {
  const auto [to, reach] = p.moved(box);
  return square_within(glm::abs(to) - reach, far);
}

/// Returns the box of an instance whose mesh has these bounds.
Bounds box_of(const Instance& instance, const Transform& transform, const Bounds& mesh) {
  const auto [at, reach] = MovedProbe(glm::dvec3(0), transform, mesh).moved(mesh);
  const Bounds own = rounded_outwards(at - reach, at + reach);
  return {glm::min(own.lo, instance.box.lo), glm::max(own.hi, instance.box.hi)};
}

/// Where the leaves of a tree hold each of its triangles.
std::vector<std::uint32_t> texels_of(const PairTree& tree) {
  std::vector<std::uint32_t> texels;
  for_all_triangles(tree, [&](std::uint32_t texel) {
    const std::size_t prim = decode_prim(tree, texel);
    if (prim >= texels.size()) texels.resize(prim + 1, NO_HIT);
    texels[prim] = texel;
  });
  return texels;
}

}  // namespace

/// A tree over the boxes of instances, and the largest of their slacks.
struct OracleScene::Boxes {
  Boxes(const Forest& forest, std::span<const PairTree* const> trees) {
    const std::vector<Instance>& instances = forest.instances();
    std::vector<Bounds> boxes;
    for (std::uint32_t i = 0; i < instances.size(); ++i) {
      const PairTree& mesh = *trees[instances[i].mesh];
      if (mesh.root == END_OF_TREE) continue;
      used.push_back(i);
      boxes.push_back(box_of(instances[i], forest.transforms()[i], mesh.bounds));
      slack = std::max(slack, double(instances[i].slack));
    }
    tree = build_box_bvh(boxes);
  }
  std::vector<std::uint32_t> used;  // instances that have triangles
  Bvh tree;
  double slack = 0;
};

/// The texels of the triangles of each mesh.
struct OracleScene::Leaves {
  std::once_flag found;
  std::vector<std::vector<std::uint32_t>> texels;
};

OracleScene::OracleScene(const PairTree& tree, std::span<const Triangle> triangles)
    : trees_{&tree}, triangles_(triangles), leaves_(std::make_shared<Leaves>()) {}

OracleScene::OracleScene(const Forest& forest, std::vector<const PairTree*> trees)
    : forest_(&forest),
      trees_(std::move(trees)),
      boxes_(std::make_shared<const Boxes>(forest, trees_)),
      leaves_(std::make_shared<Leaves>()) {}

OracleScene::OracleScene(const Forest& forest)
    : forest_(&forest),
      made_(std::make_shared<const std::vector<PairTree>>(trees_of(forest))),
      leaves_(std::make_shared<Leaves>()) {
  for (const PairTree& tree : *made_) trees_.push_back(&tree);
  boxes_ = std::make_shared<const Boxes>(forest, trees_);
}

OracleScene OracleScene::in_double() const {
  OracleScene same = *this;
  same.moves_in_double_ = true;
  return same;
}

std::vector<std::uint32_t> OracleScene::met(const Ray& ray) const {
  std::vector<std::uint32_t> found;
  const WorldRay world(ray, boxes_->slack);
  Walker(boxes_->tree).walk(world, world.t_max, [&](std::uint32_t number) {
    found.push_back(boxes_->used[number]);
    return true;
  });
  std::ranges::sort(found);
  return found;
}

void OracleScene::for_each_near(const glm::dvec3& point, const double& far, const VisitTriangle& visit) const {
  const Probe probe{point};
  if (!forest_) {
    const PairTree& tree = *trees_[0];
    Walker(tree).walk(probe, far, [&](std::uint32_t texel) {
      visit(decode_prim(tree, texel), decode_triangle(tree, texel));
      return true;
    });
    return;
  }
  Walker(boxes_->tree).walk(probe, far, [&](std::uint32_t number) {
    const std::uint32_t i = boxes_->used[number];
    const PairTree& tree = *trees_[forest_->mesh_of(i)];
    const Transform& transform = forest_->transforms()[i];
    Walker(tree).walk(MovedProbe(point, transform, tree.bounds), far, [&](std::uint32_t texel) {
      visit(forest_->first_of(i) + decode_prim(tree, texel), moved_corners(transform, decode_triangle(tree, texel)));
      return true;
    });
    return true;
  });
}

PlacedMesh OracleScene::placed(const Instance& i, const Ray& ray) const {
  const MeshTree& mesh = forest_->meshes()[i.mesh];
  return {*trees_[i.mesh],
          mesh.triangles,
          moves_in_double_ ? object_ray_in_double(ray, i.map) : ballot::in_double(object_ray(ray, i.map)),
          double(direction_scale(ray)),
          i.mesh,
          i.first,
          i.mirrors,
          mesh.kind,
          mesh.shapes};
}

OracleScene::Place OracleScene::place_of(std::uint32_t prim) const {
  if (!forest_) return {};
  const std::uint32_t instance = forest_->place_of(prim).instance;
  return {forest_->mesh_of(instance), forest_->first_of(instance)};
}

PlacedMesh OracleScene::mesh_of(const Ray& ray, std::uint32_t prim) const {
  if (!forest_) return {*trees_[0], triangles_, ballot::in_double(ray)};
  return placed(forest_->instances()[forest_->place_of(prim).instance], ray);
}

std::uint32_t OracleScene::leaf_texel_of(std::size_t mesh, std::uint32_t prim) const {
  std::call_once(leaves_->found, [&] {
    for (const PairTree* tree : trees_) leaves_->texels.push_back(texels_of(*tree));
  });
  const std::vector<std::uint32_t>& texels = leaves_->texels[mesh];
  return prim < texels.size() ? texels[prim] : NO_HIT;
}

}  // namespace ballot
