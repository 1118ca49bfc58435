#include "engine/files/gltf_keep.h"

#include <fmt/format.h>

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

std::uint32_t InstanceWriter::add_name(std::string name) {
  to().names.push_back(std::move(name));
  return static_cast<std::uint32_t>(to().names.size() - 1);
}

std::uint32_t InstanceWriter::name_of(std::size_t node) {
  if (named_ && named_->first == node) return named_->second;
  const tinygltf::Node& from = file_.model.nodes[node];
  const std::string& of_mesh = file_.model.meshes[static_cast<std::size_t>(from.mesh)].name;
  std::string name = !from.name.empty() ? from.name : !of_mesh.empty() ? of_mesh : fmt::format("node {}", node);
  named_ = {node, add_name(std::move(name))};
  return named_->second;
}

void InstanceWriter::begin_in_world(std::size_t node, ShapeKind kind) {
  const std::uint32_t name = name_of(node), mesh = static_cast<std::uint32_t>(to().first.size());
  to().first.push_back(scene_.triangles.size());
  to().mesh_labels.push_back(
      {.name = name, .id = static_cast<std::uint32_t>(file_.model.nodes[node].mesh), .in_world = true, .kind = kind});
  place(node, mesh, {});
}

void InstanceWriter::begin_copy(std::size_t node) {
  if (copied_ == node) return;
  begin_in_world(node, ShapeKind::Triangles);
  copied_ = node;
}

void InstanceWriter::begin_kept(std::size_t mesh) {
  const std::string& name = file_.model.meshes[mesh].name;
  to().first.push_back(scene_.triangles.size());
  to().mesh_labels.push_back(
      {.name = add_name(name.empty() ? fmt::format("mesh {}", mesh) : name), .id = static_cast<std::uint32_t>(mesh)});
  ++to().kept;
}

std::uint32_t InstanceWriter::place(std::size_t node, std::uint32_t mesh, const Transform& transform) {
  to().placements.push_back({mesh, transform});
  to().placement_labels.push_back({name_of(node), static_cast<std::uint32_t>(node)});
  copied_.reset();
  return static_cast<std::uint32_t>(to().placements.size() - 1);
}

void InstanceWriter::finish() {
  if (!to().first.empty()) to().first.push_back(scene_.triangles.size());
}

}  // namespace ballot
