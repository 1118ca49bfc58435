#include "engine/model/prim_ids.h"

#include <algorithm>

#include "engine/model/instances.h"

namespace ballot {

PrimIds::PrimIds(const Scene& scene, IdSource source) {
  const SceneInstances& all = scene.instances;
  if (source == IdSource::Mesh)
    for (std::size_t m = 0; m < all.meshes(); ++m) add(all.first[m], all.mesh_labels[m].id);
  if (source == IdSource::Material)
    for (std::size_t i = 0; i < scene.triangles.size(); ++i) add(i, scene.material(i));
  std::uint32_t prim = 0;
  for (std::size_t p = 0; p < all.placements.size(); ++p) {
    const std::uint32_t mesh = all.placements[p].mesh;
    const auto count = static_cast<std::uint32_t>(all.triangles_of(mesh));
    if (count == 0) continue;
    if (source == IdSource::Node)
      add(prim, all.placement_labels[p].node);
    else if (const std::uint32_t shift = static_cast<std::uint32_t>(all.first[mesh]) - prim;
             scene.instanced() && (placed_.empty() || placed_.back().value != shift))
      placed_.push_back({prim, shift});
    prim += count;
  }
}

/// Begins a range. An id that goes on needs none.
void PrimIds::add(std::size_t first, std::uint32_t id) {
  if (!ids_.empty() && ids_.back().value == id) return;
  if (!ids_.empty() && ids_.back().first == first) ids_.pop_back();  // of a mesh without triangles
  ids_.push_back({static_cast<std::uint32_t>(first), id});
}

std::uint32_t PrimIds::value_at(const std::vector<Range>& ranges, std::uint32_t number) {
  return std::prev(std::ranges::upper_bound(ranges, number, {}, &Range::first))->value;
}

std::uint32_t PrimIds::at(std::uint32_t prim) const { return value_at(ids_, prim + shift_of(prim)); }

std::vector<std::uint32_t> PrimIds::ranges() const {
  std::vector<std::uint32_t> words;
  for (const Range& range : ids_) words.push_back(range.first);
  for (const Range& range : ids_) words.push_back(range.value);
  return words;
}

}  // namespace ballot
