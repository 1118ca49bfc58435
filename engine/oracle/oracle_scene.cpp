#include "engine/oracle/oracle_scene.h"

#include <algorithm>
#include <cmath>

namespace ballot {

namespace {

std::vector<PairTree> trees_of(const Forest& forest) {
  std::vector<PairTree> trees;
  for (const MeshTree& mesh : forest.meshes())
    trees.push_back(encode_pairs(mesh.bvh, mesh.triangles, NodeLayout::Interleaved));
  return trees;
}

}  // namespace

OracleScene::OracleScene(const Forest& forest)
    : forest_(&forest), made_(std::make_shared<const std::vector<PairTree>>(trees_of(forest))), trees_(*made_) {}

bool OracleScene::surely_misses(const Instance& instance, const Ray& ray) const {
  if (forest_->meshes()[instance.mesh].extents.empty) return true;
  const Bounds& b = instance.box;
  double far = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    const double o = ray.origin[k];
    far = std::max({far, std::abs(double(b.lo[k]) - o), std::abs(double(b.hi[k]) - o)});
    size = std::max(size, double(b.hi[k]) - double(b.lo[k]));
  }
  const double pad = 16 * double(instance.slack) * far + size / 1024;
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

PlacedMesh OracleScene::placed(const Instance& i, const Ray& ray) const {
  return {trees_[i.mesh],
          forest_->meshes()[i.mesh].triangles,
          object_ray(ray, i.map),
          double(direction_scale(ray)),
          i.first,
          i.mirrors};
}

PlacedMesh OracleScene::mesh_of(const Ray& ray, std::uint32_t prim) const {
  if (!forest_) return {trees_[0], triangles_, ray};
  return placed(forest_->instances()[forest_->place_of(prim).instance], ray);
}

}  // namespace ballot
