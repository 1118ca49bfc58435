#include "tools/program/pieces.h"

#include <fmt/format.h>

namespace ballot::cli {

std::string pieces_text(const Scene& scene) {
  std::uint64_t counts[std::size(kShapes)]{};
  const SceneInstances& all = scene.instances;
  for (const Placement& p : all.placements)
    counts[std::size_t(all.mesh_labels[p.mesh].kind)] += all.triangles_of(p.mesh);
  std::string text;
  for (std::size_t k = 0; k < std::size(kShapes); ++k)
    if (counts[k]) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", counts[k], kShapes[k].name);
  return text.empty() ? "0 triangles" : text;
}

}  // namespace ballot::cli
