#include "engine/oracle/oracle_scene.h"

#include <algorithm>
#include <cmath>

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

/// Returns true if a ray misses a box of instances, widened 16 times as far as the proof of their boxes asks, and by a
/// 1000th of its size: the oracles shall find the errors of that proof, should there be some. A box that holds another
/// one is missed by no ray that meets that one.
bool surely_misses(const Bounds& b, double slack, const Ray& ray) {
  double far = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    const double o = ray.origin[k];
    far = std::max({far, std::abs(double(b.lo[k]) - o), std::abs(double(b.hi[k]) - o)});
    size = std::max(size, double(b.hi[k]) - double(b.lo[k]));
  }
  const double pad = 16 * slack * far + size / 1024;
  double near = -INFINITY, beyond = INFINITY;
  for (int k = 0; k < 3; ++k) {
    const double lo = double(b.lo[k]) - ray.origin[k] - pad, hi = double(b.hi[k]) - ray.origin[k] + pad;
    const double d = ray.dir[k];
    if (std::abs(d) < 1e-200) {
      if (lo > 0 || hi < 0) return true;
      continue;
    }
    near = std::max(near, std::min(lo / d, hi / d));
    beyond = std::min(beyond, std::max(lo / d, hi / d));
  }
  return near > beyond || beyond < ray.t_min || near > ray.t_max;
}

}  // namespace

LeafIndex::LeafIndex(const PairTree& tree) {
  for_all_triangles(tree, [&](std::uint32_t texel) {
    const std::size_t prim = decode_prim(tree, texel);
    if (prim >= texels_.size()) texels_.resize(prim + 1, NO_HIT);
    texels_[prim] = texel;
  });
}

/// A tree over the boxes of instances, and the largest of their slacks.
struct OracleScene::Boxes {
  explicit Boxes(const Forest& forest) {
    const std::vector<Instance>& instances = forest.instances();
    std::vector<Bounds> boxes;
    for (std::uint32_t i = 0; i < instances.size(); ++i) {
      if (forest.meshes()[instances[i].mesh].extents.empty) continue;
      used.push_back(i);
      boxes.push_back(instances[i].box);
      slack = std::max(slack, double(instances[i].slack));
    }
    tree = build_box_bvh(boxes);
  }
  std::vector<std::uint32_t> used;  // instances that can be hit
  Bvh tree;
  double slack = 0;
};

OracleScene::OracleScene(const Forest& forest, std::vector<const PairTree*> trees)
    : forest_(&forest), boxes_(std::make_shared<const Boxes>(forest)), trees_(std::move(trees)) {}

OracleScene::OracleScene(const Forest& forest) : OracleScene(forest, {}) {
  made_ = std::make_shared<const std::vector<PairTree>>(trees_of(forest));
  for (const PairTree& tree : *made_) trees_.push_back(&tree);
}

std::vector<std::uint32_t> OracleScene::met(const Ray& ray) const {
  std::vector<std::uint32_t> found, open;
  const std::vector<BvhNode>& nodes = boxes_->tree.nodes;
  if (!nodes.empty()) open.push_back(0);
  while (!open.empty()) {
    const BvhNode& node = nodes[open.back()];
    open.pop_back();
    if (surely_misses({node.lo, node.hi}, boxes_->slack, ray)) continue;
    for (std::uint32_t i = 0; i < node.count; ++i)
      found.push_back(boxes_->used[boxes_->tree.references[node.first + i]]);
    if (node.count == 0) open.insert(open.end(), {node.first, node.first + 1});
  }
  std::ranges::sort(found);
  return found;
}

PlacedMesh OracleScene::placed(const Instance& i, const Ray& ray) const {
  return {*trees_[i.mesh],
          forest_->meshes()[i.mesh].triangles,
          object_ray(ray, i.map),
          double(direction_scale(ray)),
          i.mesh,
          i.first,
          i.mirrors};
}

OracleScene::Place OracleScene::place_of(std::uint32_t prim) const {
  if (!forest_) return {};
  const std::uint32_t instance = forest_->place_of(prim).instance;
  return {forest_->mesh_of(instance), forest_->first_of(instance)};
}

PlacedMesh OracleScene::mesh_of(const Ray& ray, std::uint32_t prim) const {
  if (!forest_) return {*trees_[0], triangles_, ray};
  return placed(forest_->instances()[forest_->place_of(prim).instance], ray);
}

}  // namespace ballot
