#include "engine/tree/device/top_builder.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"
#include "engine/tree/device/build_memory.h"

namespace ballot {

namespace {

// Nodes and instances cost as much: the cost is the number of both that a ray is expected to meet (TopFacts::cost).
constexpr BuildSettings kTopSettings{.max_leaf = 1, .traversal_cost = 1, .intersection_cost = 1};

std::vector<glm::uvec2> parts_of(const Forest& forest) {
  std::vector<glm::uvec2> parts;
  for (std::size_t i = 0; i < forest.size(); ++i) parts.emplace_back(forest.mesh_of(i), forest.first_of(i));
  return parts;
}

MeshExtent extent_of(const MeshTree& mesh) {
  const MeshExtents& e = mesh.extents;
  return {e.bounds.lo, e.bounds.hi, e.largest_triangle, e.empty ? 1u : 0u};
}

double sum_of(const PassMs& passes) {
  double sum = 0;
  for (const auto& [name, ms] : passes) sum += ms;
  return sum;
}

}  // namespace

TopBuilder::TopBuilder(Context& gpu, const Forest& forest)
    : gpu_(gpu),
      forest_(forest),
      builder_(gpu, BuildOver::Instances),
      instances_(gpu, build_source("instances", gpu.info())),
      nodes_(gpu, build_source("top", gpu.info())),
      transforms_{Buffer<Transform>(gpu, forest.size(), Access::Storage, "transforms"),
                  Buffer<Transform>(gpu, forest.size(), Access::Storage, "transforms")},
      sent_(gpu, transforms_[0].mapped() ? 0 : forest.size(), Access::Storage | Access::Host, "transforms of the host"),
      parts_(gpu, forest.size(), Access::Storage, "parts of instances"),
      meshes_(gpu, forest.meshes().size(), Access::Storage, "extents of meshes") {
  parts_.upload(parts_of(forest));
  std::vector<MeshExtent> extents;
  for (const MeshTree& mesh : forest.meshes()) {
    extents.push_back(extent_of(mesh));
    empty_.push_back(mesh.extents.empty);
  }
  meshes_.upload(extents);
  find_first();
}

void TopBuilder::find_first() {
  for (only_ = 0; only_ < count() && empty_[forest_.mesh_of(only_)];) ++only_;
}

void TopBuilder::exchanged(std::size_t mesh) {
  const MeshTree& now = forest_.meshes()[mesh];
  const MeshExtent extent = extent_of(now);
  meshes_.record_upload(std::span(&extent, 1), mesh);
  if (empty_[mesh] == now.extents.empty) return;
  empty_[mesh] = now.extents.empty;
  built_ = false;
  find_first();
}

void TopBuilder::record_place(Texels& top) {
  instances_.bind(BIND_BUILD_STATE, builder_.memory_->state);
  instances_.bind(BIND_BUILD_TRANSFORMS, transforms_[now_]);
  instances_.bind(BIND_BUILD_PARTS, parts_);
  instances_.bind(BIND_BUILD_MESHES, meshes_);
  instances_.bind(BIND_BUILD_TOP, top);
  const std::uint32_t group = gpu_.info().subgroup_size * kBuildSubgroups;
  gpu_.pass("beginning to place instances", [&](Commands& cmd) {
    cmd.fill(builder_.memory_->state, offsetof(BuildState, refused), sizeof(std::uint32_t), BUILD_NONE);
  });
  record_build(gpu_, instances_, std::min(groups_of(count(), group), gpu_.info().max_group_count_x),
               InstancePush{count()}, "place", own_ms_);
}

void TopBuilder::record_nodes(Texels& top) {
  const DeviceBuilder::Memory& m = *builder_.memory_;
  nodes_.bind(BIND_BUILD_STATE, m.state);
  nodes_.bind(BIND_BUILD_TRIANGLES, top);
  nodes_.bind(BIND_BUILD_TOP, top);
  nodes_.bind(BIND_BUILD_PRIMS, m.prims[builder_.sorted_]);
  nodes_.bind(BIND_BUILD_NODES, m.nodes);
  const std::uint32_t group = gpu_.info().subgroup_size * kBuildSubgroups;
  record_build(gpu_, nodes_, std::min(groups_of(count(), group), gpu_.info().max_group_count_x), WritePush{count()},
               "nodes", own_ms_);
}

/// Has the other transforms be those that the instances are placed by from now on.
void TopBuilder::send(const MovedTransforms& transforms) {
  gpu_.finish();  // passes that read the transforms of the last move
  if (transforms.stay()) return;
  now_ = 1 - now_;
  const std::uint64_t bytes = count() * sizeof(Transform);
  Buffer<Transform>& to = transforms_[now_];
  if (!transforms.there) {
    void* const here = to.mapped() ? to.mapped() : sent_.mapped();
    copy_parallel(transforms.here, std::span(static_cast<Transform*>(here), count()));
    if (to.mapped()) return;
  }
  const RawBuffer& from = transforms.there ? *transforms.there : sent_;
  gpu_.pass("sending transforms", [&](Commands& cmd) { cmd.copy(from, to, bytes); });
}

void TopBuilder::build(Texels& top) {
  built_ = false;  // until it has succeeded: a tree that is not finished cannot be refitted
  builder_.build(top, count(), kTopSettings);
  built_cost_ = builder_.built().sah;
  built_ = builder_.refused_ == BUILD_NONE;
  record_nodes(top);
}

/// Places the instances and refits the tree. Returns false if an instance cannot be placed.
bool TopBuilder::refit(Texels& top) {
  record_place(top);
  const Bounds& b = builder_.built().bounds;
  builder_.begin_refit(top, std::max({b.hi.x - b.lo.x, b.hi.y - b.lo.y, b.hi.z - b.lo.z}));
  record_nodes(top);
  builder_.end_refit();
  return builder_.refused_ == BUILD_NONE;
}

TopFacts TopBuilder::move(const MovedTransforms& transforms, std::span<Texels* const> tops) {
  const Timer timer;
  own_ms_.clear();
  builder_.build_ms_.clear();
  builder_.refit_ms_.clear();
  if (count() == 0) return {};
  builder_.reserve(count());
  const std::size_t before = now_;
  send(transforms);
  const bool was_built = built_;
  if (!built_) {
    record_place(*tops[0]);
    build(*tops[0]);
  } else if (refit(*tops[0]) && builder_.built().sah > kMostTopDecay * built_cost_) {
    build(*tops[0]);
  }
  if (const std::uint32_t first = builder_.refused_; first != BUILD_NONE) {
    Transform wrong;
    transforms_[now_].download(std::span(&wrong, 1), first);
    now_ = before;
    if (was_built) refit(*tops[0]);
    refuse(wrong, first);
  }
  for (Texels* const top : tops.subspan(1)) write(*top);
  const BuiltTree& tree = builder_.built();
  TopFacts facts;
  facts.records = count() * TOP_NODE_TEXELS;
  facts.root = root();
  facts.depth = tree.depth;
  if (tree.proper > 0) {
    facts.bounds = tree.bounds;
    facts.cost = tree.proper > 1 ? tree.sah : 0;
    facts.built_cost = tree.proper > 1 ? built_cost_ : 0;
  }
  facts.build_s = timer.seconds();
  return facts;
}

std::uint32_t TopBuilder::root() const {
  const BuiltTree& tree = builder_.built();
  return tree.proper == 1 ? LEAF_BIT | only_ : tree.root;
}

void TopBuilder::refuse(const Transform& transform, std::uint32_t instance) const {
  place_instance(forest_.meshes()[forest_.mesh_of(instance)].extents, transform, forest_.name_of(instance));
  fail(Failure::Work, "instance {}: {} cannot place it, though the host can", forest_.name_of(instance),
       gpu_.info().name);
}

void TopBuilder::write(Texels& top) {
  if (count() == 0) return;
  record_place(top);
  record_nodes(top);
}

double TopBuilder::move_ms() const {
  return sum_of(own_ms_) + sum_of(builder_.build_ms()) + sum_of(builder_.refit_ms());
}

}  // namespace ballot
