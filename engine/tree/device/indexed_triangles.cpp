#include "engine/tree/device/indexed_triangles.h"

#include <bit>
#include <cmath>
#include <limits>

#include "engine/tree/device/device_poser.h"

namespace ballot {

namespace {

/// The inverse of ordered() in shaders/lib/build/order.glsl.
float from_ordered(std::uint32_t x) { return std::bit_cast<float>(x >= 0x80000000u ? x & 0x7FFFFFFFu : ~x); }

KernelSource indexed_source(bool indices) {
  return {.name = indices ? "pose.indexed" : "pose.in_turn",
          .file = "pose/indexed.comp",
          .defines = {{"BALLOT_INDICES", indices}},
          .group_size = POSE_GROUP};
}

}  // namespace

PoseState empty_pose_state() { return {{~0u, ~0u, ~0u}, {0, 0, 0}, 0, {0, 0, 0}}; }

std::optional<Bounds> bounds_of(const PoseState& state) {
  if (state.bad) return {};
  Bounds box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = from_ordered(state.lo[axis]);
    box.hi[axis] = from_ordered(state.hi[axis]);
  }
  return box;
}

std::vector<KernelSource> indexed_triangle_sources() { return {indexed_source(false), indexed_source(true)}; }

IndexedTriangles::IndexedTriangles(Context& gpu, std::size_t triangles)
    : gpu_(gpu),
      triangles_(gpu, triangles, Access::Storage, "triangles of the tree build"),
      state_(gpu, 1, Access::Storage, "state of moved vertices") {}

/// Returns what the device keeps of a mesh; uploads its indices at first.
IndexedTriangles::Mesh& IndexedTriangles::mesh_of(const MovedVertices& mesh) {
  if (const auto found = meshes_.find(mesh.first); found != meshes_.end()) return found->second;
  Mesh made{{gpu_, mesh.corners.size(), Access::Storage, "corners of triangles that move"},
            {gpu_, mesh.positions.size(), Access::Storage, "vertices that move"}};
  made.corners.upload(mesh.corners);
  return meshes_.emplace(mesh.first, std::move(made)).first->second;
}

std::optional<MeshExtents> IndexedTriangles::write(const MovedVertices& mesh, const Buffer<Triangle>* now) {
  const PassScope scope(gpu_);
  Mesh& kept = mesh_of(mesh);
  kept.positions.upload(mesh.positions);
  if (now && mesh.triangles < triangles_.size()) triangles_.copy_from(*now, 0, 0, now->size());
  const bool indices = !mesh.corners.empty();
  std::unique_ptr<Kernel>& kernel = kernels_[indices];
  refresh(gpu_, kernel, indexed_source(indices));
  if (indices) kernel->bind(BIND_POSE_CORNERS, kept.corners);
  kernel->bind(BIND_POSE_POSITIONS, kept.positions);
  kernel->bind(BIND_POSE_TRIANGLES, triangles_);
  kernel->bind(BIND_POSE_STATE, state_);
  const PoseState empty = empty_pose_state();
  state_.upload(std::span(&empty, 1));
  run_pose(gpu_, *kernel, std::uint32_t(mesh.triangles),
           IndexedPush{std::uint32_t(mesh.triangles), std::uint32_t(mesh.positions.size()), std::uint32_t(mesh.first)});
  PoseState state;
  state_.download(std::span(&state, 1));
  const std::optional<Bounds> bounds = bounds_of(state);
  if (!bounds) return {};
  MeshExtents extents{*bounds, glm::vec3(0), mesh.triangles == 0};
  for (int axis = 0; axis < 3 && !extents.empty; ++axis)  // the device's difference is off by less than one step
    extents.largest_triangle[axis] =
        std::nextafter(std::bit_cast<float>(state.largest[axis]), std::numeric_limits<float>::infinity());
  return extents;
}

}  // namespace ballot
