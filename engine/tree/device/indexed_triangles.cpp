#include "engine/tree/device/indexed_triangles.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/core/error.h"
#include "engine/model/mesh_vertices.h"
#include "engine/tree/device/device_poser.h"

namespace ballot {

namespace {

/// The inverse of ordered() in shaders/lib/build/order.glsl.
float from_ordered(std::uint32_t x) { return std::bit_cast<float>(x >= 0x80000000u ? x & 0x7FFFFFFFu : ~x); }

constexpr std::uint64_t rounded_up(std::uint64_t bytes, std::uint64_t to) { return (bytes + to - 1) / to * to; }

KernelSource indexed_source(bool indices) {
  return {.name = indices ? "pose.indexed" : "pose.in_turn",
          .file = "pose/indexed.comp",
          .defines = {{"BALLOT_INDICES", indices}},
          .group_size = POSE_GROUP};
}

}  // namespace

PoseState empty_pose_state() { return {{~0u, ~0u, ~0u}, {0, 0, 0}, POSE_NONE, {0, 0, 0}, POSE_NONE}; }

std::optional<Bounds> bounds_of(const PoseState& state) {
  if (state.first_bad != POSE_NONE) return {};
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
      state_bytes_(rounded_up(sizeof(PoseState), gpu.info().buffer_alignment)) {}

void IndexedTriangles::make_room(std::size_t meshes) {
  meshes_ = meshes;
  const std::uint64_t bytes = meshes * state_bytes_;
  if (states_ && states_->size() >= bytes) return;
  states_.emplace(gpu_, bytes, Access::Storage, "state of moved vertices");
  if (!states_->mapped())
    told_.emplace(gpu_, bytes, Access::Storage | Access::Host, "state of moved vertices on the host");
}

/// Uploads the vertices of a mesh that the host has, and its indices at first.
void IndexedTriangles::upload(const MovedVertices& mesh) {
  const bool sends_corners = !mesh.corners_there && !mesh.corners.empty();
  if (mesh.there && !sends_corners) return;
  Kept& kept = kept_[mesh.first];
  if (!kept.corners && sends_corners)
    kept.corners.emplace(gpu_, mesh.corners.size(), Access::Storage, "corners of triangles that move")
        .upload(mesh.corners);
  if (mesh.there) return;
  if (!kept.positions || kept.positions->size() != mesh.positions.size())
    kept.positions.emplace(gpu_, mesh.positions.size(), Access::Storage, "vertices that move");
  kept.positions->upload(mesh.positions);
}

void IndexedTriangles::dispatch(Commands& cmd, const MovedVertices& mesh, std::size_t number) {
  const bool indices = mesh.indexed();
  Kernel& kernel = *kernels_[indices];
  const auto triangles = std::uint32_t(mesh.triangles);
  IndexedPush push{triangles, std::uint32_t(mesh.vertex_count()), std::uint32_t(mesh.first), 0, 3};
  if (indices) {
    const RawBuffer& corners = mesh.corners_there ? *mesh.corners_there : *kept_.at(mesh.first).corners;
    kernel.bind(BIND_POSE_CORNERS, corners);
  }
  if (mesh.there) {
    const DeviceVertices& v = *mesh.there;
    const std::uint64_t begin = v.offset / gpu_.info().buffer_alignment * gpu_.info().buffer_alignment;
    push.first_word = std::uint32_t((v.offset - begin) / 4);
    push.stride_words = std::uint32_t(v.stride / 4);
    kernel.bind(BIND_POSE_POSITIONS, {*v.buffer, begin, v.end() - begin});
  } else {
    kernel.bind(BIND_POSE_POSITIONS, *kept_.at(mesh.first).positions);
  }
  kernel.bind(BIND_POSE_TRIANGLES, triangles_);
  kernel.bind(BIND_POSE_STATE, {*states_, number * state_bytes_, sizeof(PoseState)});
  kernel.dispatch(cmd, pose_groups(gpu_.info(), std::max(triangles, 1u)), push);
}

void IndexedTriangles::record(std::span<const MovedVertices> meshes, const Buffer<Triangle>& now) {
  make_room(meshes.size());
  for (const bool indices : {false, true}) refresh(gpu_, kernels_[indices], indexed_source(indices));
  std::size_t written = 0;
  for (const MovedVertices& mesh : meshes) upload(mesh), written += mesh.triangles;
  const PoseState empty = empty_pose_state();
  gpu_.pass("beginning to move vertices", [&](Commands& cmd) {
    for (std::size_t i = 0; i < meshes.size(); ++i) cmd.write(*states_, i * state_bytes_, &empty, sizeof empty);
    if (written < triangles_.size()) cmd.copy(now, triangles_, now.bytes());
  });
  constexpr std::size_t kTogether = 128;  // each takes a descriptor set until it has ended
  for (std::size_t first = 0; first < meshes.size(); first += kTogether) {
    if (first > 0) gpu_.flush();
    gpu_.pass("moving vertices", [&](Commands& cmd) {
      for (std::size_t i = first; i < std::min(first + kTogether, meshes.size()); ++i) dispatch(cmd, meshes[i], i);
    });
  }
  if (told_)
    gpu_.pass("telling of moved vertices",
              [&](Commands& cmd) { cmd.copy(*states_, *told_, meshes.size() * state_bytes_); });
}

std::vector<IndexedTriangles::Found> IndexedTriangles::found() {
  gpu_.finish();
  std::vector<Found> all(meshes_);
  for (std::size_t i = 0; i < all.size(); ++i) {
    PoseState state;
    std::memcpy(&state, (told_ ? *told_ : *states_).mapped() + i * state_bytes_, sizeof state);
    if (state.first_bad_corner != POSE_NONE) all[i].first_bad_corner = state.first_bad_corner;
    if (state.first_bad != POSE_NONE) all[i].first_bad = state.first_bad;
    if (all[i].first_bad) continue;
    MeshExtents& extents = all[i].extents;
    extents = {*bounds_of(state), glm::vec3(0), state.lo[0] > state.hi[0]};
    for (int axis = 0; axis < 3 && !extents.empty; ++axis)  // the device's difference is off by less than one step
      extents.largest_triangle[axis] =
          std::nextafter(std::bit_cast<float>(state.largest[axis]), std::numeric_limits<float>::infinity());
  }
  return all;
}

void check_found(const MovedVertices& mesh, const IndexedTriangles::Found& found, const std::string& where,
                 const DeviceInfo& device) {
  constexpr const char* kDiffers = "that the host takes; the driver may be broken, or the array has changed";
  if (found.first_bad_corner) {
    const std::uint32_t place = *found.first_bad_corner;
    std::uint32_t index = 0;
    if (mesh.corners_there)
      mesh.corners_there->download(place * sizeof index, &index, sizeof index);
    else
      index = mesh.corners[place];
    check_indices(std::span<const std::uint32_t>(&index, 1), mesh.vertex_count(), where, place);
    fail(Failure::Work, "{}: {} refuses index {}, {}, {}", where, device.name, place, index, kDiffers);
  }
  if (!found.first_bad) return;
  const std::uint32_t vertex = *found.first_bad;
  const glm::vec3 at = mesh.there ? read_vertices(*mesh.there, vertex, 1)[0] : mesh.positions[vertex];
  check_vertices(std::span(&at, 1), where, vertex);
  fail(Failure::Work, "{}: {} refuses vertex {}, ({}, {}, {}), {}", where, device.name, vertex, at.x, at.y, at.z,
       kDiffers);
}

}  // namespace ballot
