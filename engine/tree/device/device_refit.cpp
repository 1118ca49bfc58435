// Refits of the tree that the builder `device` has made.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "engine/tree/device/build_memory.h"

namespace ballot {

namespace {

/// The inverse of ordered() in shaders/lib/build/order.glsl.
float unordered(std::uint32_t x) { return std::bit_cast<float>(x >= 0x80000000u ? x & 0x7FFFFFFFu : ~x); }

/// Returns 1 over a length, as unit_of() of shaders/lib/build/area.glsl.
float unit_of(float longest) { return std::min(1.0f / std::max(longest, 1e-37f), 1e37f); }

}  // namespace

void DeviceBuilder::read_bounds(const BuildState& s) {
  for (int axis = 0; axis < 3; ++axis) {
    built_.bounds.lo[axis] = unordered(s.lo[axis]);
    built_.bounds.hi[axis] = unordered(s.hi[axis]);
  }
  built_.origin = s.origin;
  const glm::dvec3 sides = (glm::dvec3(built_.bounds.hi) - glm::dvec3(built_.bounds.lo)) / double(s.longest);
  const double area = sides.x * sides.y + sides.y * sides.z + sides.z * sides.x;
  built_.sah = area > 0 ? double(s.cost) / area : double(settings_.intersection_cost) * built_.proper;
  // Costs left the range of float32: the tree is as bad as it can be.
  if (!std::isfinite(built_.sah)) built_.sah = std::numeric_limits<double>::infinity();
}

void DeviceBuilder::bind_refit(const RawBuffer& triangles) {
  if (!refit_kernels_) refit_kernels_ = std::make_unique<RefitKernels>(gpu_, over_);
  Memory& m = *memory_;
  RefitKernels& k = *refit_kernels_;
  for (Kernel* kernel : {&k.parents, &k.refit, &k.end}) {
    kernel->bind(BIND_BUILD_STATE, m.state);
    kernel->bind(BIND_BUILD_TRIANGLES, triangles);
    kernel->bind(BIND_BUILD_PRIMS, m.prims[sorted_]);
    kernel->bind(BIND_BUILD_NODES, m.nodes);
  }
  for (Kernel* kernel : {&k.parents, &k.refit}) kernel->bind(BIND_BUILD_CLUSTERS, m.clusters);
  k.refit.bind(BIND_BUILD_ARRIVALS, m.arrivals);
}

void DeviceBuilder::begin_refit(const RawBuffer& triangles, float longest) {
  refit_ms_.clear();
  write_ms_.clear();
  if (built_.triangles == 0) return;
  triangles_ = &triangles;
  bind_refit(triangles);
  gpu_.pass("beginning a refit", [&](Commands& cmd) {
    cmd.fill(memory_->state, offsetof(BuildState, changed), sizeof(std::uint32_t), 0);
    // Every refit leaves the arrivals zero.
    if (!has_parents_) cmd.fill(memory_->arrivals, 0);
  });
  const std::uint32_t group = gpu_.info().subgroup_size * kBuildSubgroups;
  const std::uint32_t groups = std::min(groups_of(built_.triangles, group), gpu_.info().max_group_count_x);
  if (!has_parents_)
    record_build(gpu_, refit_kernels_->parents, groups, WritePush{built_.triangles}, "parents", refit_ms_);
  has_parents_ = true;
  const RefitPush push{built_.triangles, unit_of(longest), settings_.traversal_cost, settings_.intersection_cost};
  record_build(gpu_, refit_kernels_->refit, groups, push, "refit", refit_ms_);
  record_build(gpu_, refit_kernels_->end, 1, push, "refit", refit_ms_);
}

bool DeviceBuilder::end_refit() {
  if (built_.triangles == 0) return true;
  BuildState s;
  memory_->state.download(std::span(&s, 1));
  refused_ = s.refused;
  if (s.changed) return false;
  if (built_.proper > 0) read_bounds(s);
  return true;
}

}  // namespace ballot
