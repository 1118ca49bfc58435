#include "engine/tree/device/device_poser.h"

namespace ballot {

static_assert(sizeof(PosedVertex) == 24 && sizeof(MorphDelta) == 24 && sizeof(Influence) == 8);

struct DevicePoser::Memory {
  Buffer<PosePart> parts;
  Buffer<std::uint32_t> part_of;
  Buffer<glm::vec3> positions, normals;
  Buffer<Influence> influences;
  Buffer<MorphDelta> deltas;
  Buffer<PoseMatrix> matrices;
  Buffer<float> weights;
  Buffer<PosedVertex> posed;

  Memory(Context& gpu, const Animation& a, std::size_t count)
      : parts(gpu, count, Access::Storage, "parts that are posed"),
        part_of(gpu, a.posed_vertices, Access::Storage, "parts of posed vertices"),
        positions(gpu, a.vertices.positions.size(), Access::Storage, "positions before a pose"),
        normals(gpu, a.vertices.normals.size(), Access::Storage, "normals before a pose"),
        influences(gpu, a.vertices.influences.size(), Access::Storage, "weights of joints"),
        deltas(gpu, a.vertices.deltas.size(), Access::Storage, "morph targets"),
        matrices(gpu, a.matrices, Access::Storage, "matrices of joints"),
        weights(gpu, a.weights, Access::Storage, "weights of morph targets"),
        posed(gpu, a.posed_vertices, Access::Storage, "posed vertices") {}
};

namespace {

std::vector<PosePart> posed_parts(const Animation& animation) {
  std::vector<PosePart> parts;
  for (const MovingPart& p : animation.parts) {
    if (!p.deforms) continue;
    const MovingMesh& m = animation.vertices.meshes[p.mesh];
    parts.push_back({p.first_posed, m.first_vertex, m.vertices, m.first_influence, p.skin ? m.influences : 0,
                     m.first_delta, m.targets, p.first_matrix, p.first_weight});
  }
  return parts;
}

}  // namespace

KernelSource pose_source() { return {.name = "pose.vertices", .file = "pose/vertices.comp", .group_size = POSE_GROUP}; }

DevicePoser::DevicePoser(Context& gpu, const Animation& animation) : gpu_(gpu), vertices_(animation.posed_vertices) {
  const std::vector<PosePart> parts = posed_parts(animation);
  std::vector<std::uint32_t> part_of(vertices_);
  for (std::size_t i = 0; i < parts.size(); ++i)
    std::fill_n(part_of.begin() + parts[i].first_posed, parts[i].vertices, static_cast<std::uint32_t>(i));
  memory_ = std::make_unique<Memory>(gpu, animation, parts.size());
  Memory& m = *memory_;
  m.parts.upload(parts);
  m.part_of.upload(part_of);
  m.positions.upload(animation.vertices.positions);
  m.normals.upload(animation.vertices.normals);
  m.influences.upload(animation.vertices.influences);
  m.deltas.upload(animation.vertices.deltas);
}

DevicePoser::~DevicePoser() = default;

const Buffer<PosedVertex>& DevicePoser::posed() const { return memory_->posed; }
const Buffer<glm::vec3>& DevicePoser::positions() const { return memory_->positions; }
const Buffer<glm::vec3>& DevicePoser::normals() const { return memory_->normals; }

void DevicePoser::record(const PoseInput& input) {
  if (vertices_ == 0) return;
  Memory& m = *memory_;
  if (refresh(gpu_, kernel_, pose_source())) {
    kernel_->bind(BIND_POSE_PARTS, m.parts);
    kernel_->bind(BIND_POSE_PART_OF, m.part_of);
    kernel_->bind(BIND_POSE_POSITIONS, m.positions);
    kernel_->bind(BIND_POSE_NORMALS, m.normals);
    kernel_->bind(BIND_POSE_INFLUENCES, m.influences);
    kernel_->bind(BIND_POSE_DELTAS, m.deltas);
    kernel_->bind(BIND_POSE_MATRICES, m.matrices);
    kernel_->bind(BIND_POSE_WEIGHTS, m.weights);
    kernel_->bind(BIND_POSE_POSED, m.posed);
  }
  m.matrices.upload(input.matrices);
  m.weights.upload(input.weights);
  run_pose(gpu_, *kernel_, vertices_, PosePush{vertices_});
}

void DevicePoser::pose(const PoseInput& input, std::span<PosedVertex> posed) {
  if (vertices_ == 0) return;
  const PassScope scope(gpu_);
  record(input);
  memory_->posed.download(posed);
}

}  // namespace ballot
