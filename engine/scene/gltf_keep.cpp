#include "engine/scene/gltf_keep.h"

namespace ballot {

void choose_kept(UsesOfMeshes& meshes, std::uint64_t triangles, bool fit, InstancePolicy policy) {
  std::uint64_t saved = 0;
  std::erase_if(meshes, [&](const auto& entry) {
    const MeshUses& m = entry.second;
    if (policy == InstancePolicy::Keep) return m.uses < 2 && !m.moves;
    const std::uint64_t kept = m.triangles + kTrianglesAnInstance * m.uses;
    const bool small = m.triangles * m.uses >= (fit ? 2 * kept : kept + 1);
    if (small) saved += m.triangles * m.uses - kept;
    return !small && !m.moves;
  });
  const bool worth = saved >= kWorthTriangles && triangles >= 2 * (triangles - saved);
  if (policy == InstancePolicy::Copy || (policy == InstancePolicy::Auto && !worth && (fit || saved == 0)))
    meshes.clear();
}

void InstanceWriter::end_run() {
  if (scene_.triangles.size() == run_) return;
  to().placements.push_back({static_cast<std::uint32_t>(to().first.size()), {}});
  to().first.push_back(run_);
  run_ = scene_.triangles.size();
}

std::uint32_t InstanceWriter::place(std::uint32_t mesh, const Transform& transform) {
  to().placements.push_back({mesh, transform});
  return static_cast<std::uint32_t>(to().placements.size() - 1);
}

void InstanceWriter::finish() {
  if (numbers_.empty()) return;
  end_run();
  to().first.push_back(scene_.triangles.size());
}

}  // namespace ballot
