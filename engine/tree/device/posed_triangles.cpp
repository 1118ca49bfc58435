#include "engine/tree/device/posed_triangles.h"

#include <algorithm>

#include "engine/model/placing.h"
#include "engine/tree/device/indexed_triangles.h"
#include "shaders/shared/pose.h"

namespace ballot {

namespace {

KernelSource moving_source(const char* name, Defines defines = {}) {
  return {.name = fmt::format("pose.{}", name),
          .file = fmt::format("pose/{}.comp", name),
          .defines = std::move(defines),
          .group_size = POSE_GROUP};
}

KernelSource surfaces_source(bool normals) {
  KernelSource source = moving_source("surfaces", {{"BALLOT_POSE_NORMALS", normals}});
  if (normals) source.name += "+normals";
  return source;
}

/// The tables of what moves.
struct Tables {
  std::vector<MovedPart> parts;
  std::vector<std::uint32_t> part_of;  // of each vertex that is placed
  std::uint32_t triangles = 0;
};

Tables tables_of(const Animation& animation) {
  Tables tables;
  for (const MovingPart& part : animation.parts) {
    const MovingMesh& mesh = animation.vertices.meshes[part.mesh];
    const std::uint32_t first = part.deforms ? part.first_posed : std::uint32_t(tables.part_of.size());
    if (!part.deforms) tables.part_of.insert(tables.part_of.end(), mesh.vertices, std::uint32_t(tables.parts.size()));
    tables.parts.push_back({std::uint32_t(part.first_triangle), tables.triangles, mesh.first_corner, first,
                            mesh.first_vertex, !part.deforms, 0});
    tables.triangles += mesh.triangles;
  }
  return tables;
}

/// Returns the bounds of the triangles that no part moves; nothing if there are none.
std::optional<Bounds> bounds_of_still(const Scene& scene) {
  std::vector<bool> moves(scene.triangles.size());
  for (const MovingPart& part : scene.animation->parts) {
    const auto first = moves.begin() + std::ptrdiff_t(part.first_triangle);
    std::fill(first, first + scene.animation->vertices.meshes[part.mesh].triangles, true);
  }
  std::optional<Bounds> box;
  for (std::size_t i = 0; i < moves.size(); ++i) {
    if (moves[i]) continue;
    for (const glm::vec3& v : scene.triangles[i])
      box = box ? Bounds{glm::min(box->lo, v), glm::max(box->hi, v)} : Bounds{v, v};
  }
  return box;
}

}  // namespace

struct PosedTriangles::Memory {
  std::vector<MovedPart> moved;
  Buffer<MovedPart> parts;
  Buffer<PartPlace> places;
  Buffer<std::uint32_t> part_of, corners;
  Buffer<PosedVertex> placed;
  Buffer<PoseState> state;

  Memory(Context& gpu, const Animation& a, const Tables& t)
      : moved(t.parts),
        parts(gpu, t.parts.size(), Access::Storage, "parts that move"),
        places(gpu, t.parts.size(), Access::Storage, "places of parts"),
        part_of(gpu, t.part_of.size(), Access::Storage, "parts of placed vertices"),
        corners(gpu, a.vertices.corners.size(), Access::Storage, "corners of triangles that move"),
        placed(gpu, t.part_of.size(), Access::Storage, "placed vertices"),
        state(gpu, 1, Access::Storage, "state of a pose") {
    part_of.upload(t.part_of);
    corners.upload(a.vertices.corners);
  }
};

struct PosedTriangles::Kernels {
  std::unique_ptr<Kernel> place, triangles, surfaces[2];  // surfaces: without and with normals
};

std::vector<KernelSource> posed_triangle_sources() {
  return {moving_source("place"), moving_source("triangles"), surfaces_source(false), surfaces_source(true)};
}

PosedTriangles::PosedTriangles(Context& gpu, const Scene& scene, DevicePoser& poser, const Buffer<Triangle>& now)
    : gpu_(gpu), animation_(*scene.animation), poser_(poser), still_(bounds_of_still(scene)) {
  const Tables tables = tables_of(animation_);
  parts_ = std::uint32_t(tables.parts.size());
  placed_ = std::uint32_t(tables.part_of.size());
  moving_ = tables.triangles;
  memory_ = std::make_unique<Memory>(gpu, animation_, tables);
  kernels_ = std::make_unique<Kernels>();
  triangles_.emplace(gpu, now.size(), Access::Storage, "triangles of the tree build");
  triangles_->copy_from(now, 0, 0, now.size());
}

PosedTriangles::~PosedTriangles() = default;

void PosedTriangles::upload_places(const NodePose& nodes) {
  std::vector<PartPlace> places(parts_);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const glm::dmat4 world = world_from_mesh(animation_, animation_.parts[i], nodes, 0);
    const glm::dmat3 turn = normal_matrix(world);
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column) places[i].world[4 * row + column] = world[column][row];
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) places[i].normal[3 * row + column] = turn[column][row];
  }
  memory_->places.upload(places);
  const std::vector<bool> turned = turned_parts(animation_, nodes);
  for (std::size_t i = 0; i < turned.size(); ++i) memory_->moved[i].turned = turned[i];
  memory_->parts.upload(memory_->moved);
}

/// Records the placing of vertices.
void PosedTriangles::place() {
  Memory& m = *memory_;
  if (refresh(gpu_, kernels_->place, moving_source("place"))) {
    Kernel& k = *kernels_->place;
    k.bind(BIND_POSE_MOVED, m.parts);
    k.bind(BIND_POSE_PART_OF, m.part_of);
    k.bind(BIND_POSE_PLACES, m.places);
    k.bind(BIND_POSE_POSITIONS, poser_.positions());
    k.bind(BIND_POSE_NORMALS, poser_.normals());
    k.bind(BIND_POSE_PLACED, m.placed);
  }
  run_pose(gpu_, *kernels_->place, placed_, MovePush{placed_, parts_});
}

std::optional<Bounds> PosedTriangles::pose(const NodePose& nodes) {
  const PassScope scope(gpu_);
  Memory& m = *memory_;
  poser_.record(pose_input(animation_, nodes));
  upload_places(nodes);
  place();
  if (refresh(gpu_, kernels_->triangles, moving_source("triangles"))) {
    Kernel& k = *kernels_->triangles;
    k.bind(BIND_POSE_MOVED, m.parts);
    k.bind(BIND_POSE_CORNERS, m.corners);
    k.bind(BIND_POSE_POSED, poser_.posed());
    k.bind(BIND_POSE_PLACED, m.placed);
    k.bind(BIND_POSE_STATE, m.state);
  }
  kernels_->triangles->bind(BIND_POSE_TRIANGLES, *triangles_);
  const PoseState empty = empty_pose_state();
  gpu_.pass("beginning a pose", [&](Commands& cmd) { cmd.write(m.state, empty); });
  if (moving_ == 0) return still_.value_or(Bounds{});
  run_pose(gpu_, *kernels_->triangles, moving_, MovePush{moving_, parts_});
  PoseState state;
  m.state.download(std::span(&state, 1));
  const std::optional<Bounds> box = bounds_of(state);
  if (!box || !still_) return box;
  return Bounds{glm::min(box->lo, still_->lo), glm::max(box->hi, still_->hi)};
}

void PosedTriangles::write(Buffer<glm::uvec4>& triangles, Buffer<glm::uvec4>* normals) {
  Memory& m = *memory_;
  std::unique_ptr<Kernel>& kernel = kernels_->surfaces[normals != nullptr];
  if (refresh(gpu_, kernel, surfaces_source(normals != nullptr))) {
    Kernel& k = *kernel;
    k.bind(BIND_POSE_MOVED, m.parts);
    k.bind(BIND_POSE_CORNERS, m.corners);
    k.bind(BIND_POSE_POSED, poser_.posed());
    k.bind(BIND_POSE_PLACED, m.placed);
  }
  kernel->bind(BIND_POSE_TRIANGLE_TEXELS, triangles);
  if (normals) kernel->bind(BIND_POSE_NORMAL_TEXELS, *normals);
  run_pose(gpu_, *kernel, moving_, MovePush{moving_, parts_});
}

}  // namespace ballot
