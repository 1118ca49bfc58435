#include "tools/info/mesh_table.h"

#include <algorithm>

#include "tools/bench/markdown.h"

namespace ballot::cli {

namespace {

constexpr std::size_t kShownRows = 20, kShownBytes = 40;  // of a table; of a name

/// Returns a name as a cell shows it. Names of files may be of any length and hold anything.
std::string short_name(std::string_view name) {
  std::string text = shown_in_line(name.substr(0, 4 * kShownBytes));
  if (text.size() <= kShownBytes && name.size() <= 4 * kShownBytes) return text;
  std::size_t end = std::min(text.size(), kShownBytes);
  while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

std::string bounds_text(const Bounds& b) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g})", b.lo.x, b.lo.y, b.lo.z, b.hi.x, b.hi.y,
                     b.hi.z);
}

nlohmann::json bounds_json(const Bounds& b) { return {{b.lo.x, b.lo.y, b.lo.z}, {b.hi.x, b.hi.y, b.hi.z}}; }

void print_table(const bench::Table& table, std::size_t rows, const char* what) {
  say("{}", table.text());
  if (rows > kShownRows) say("... and {} more {}; --json lists all\n", rows - kShownRows, what);
}

/// Returns the number of a mesh's triangles, or of its shapes with what they are, or of its heights.
std::string pieces_of(const SceneInstances& all, std::size_t mesh) {
  const MeshLabel& label = all.mesh_labels[mesh];
  if (label.columns) return fmt::format("{} {} x {}", kHeights, label.rows(all.triangles_of(mesh)), label.columns);
  const ShapeInfo& info = info_of(all.mesh_labels[mesh].kind);
  const std::size_t count = all.triangles_of(mesh);
  return info.kind == ShapeKind::Triangles ? std::to_string(count) : fmt::format("{} {}", count, info.name);
}

void print_mesh_table(const Scene& scene) {
  const SceneInstances& all = scene.instances;
  say("\n{} meshes{}:\n", all.meshes(), scene.instanced() ? "" : ", each placed once, where it lies");
  bench::Table table({"mesh", "name", "material", "id", "triangles", "bounds"}, 3);
  for (std::size_t m = 0; m < std::min(all.meshes(), kShownRows); ++m) {
    const MeshLabel& label = all.mesh_labels[m];
    const bool one = label.material != kSeveralMaterials, any = all.triangles_of(m) > 0;
    table.row({std::to_string(m), short_name(all.mesh_name(m)),
               one   ? short_name(scene.materials[label.material].name)
               : any ? "(several)"
                     : "(none)",
               std::to_string(label.id), pieces_of(all, m), any ? bounds_text(bounds_of_mesh(scene, m)) : "(none)"});
  }
  print_table(table, all.meshes(), "meshes");
}

void print_instance_table(const Scene& scene) {
  const SceneInstances& all = scene.instances;
  say("\n{} instances:\n", all.placements.size());
  bench::Table table({"instance", "name", "mesh", "node", "bounds"}, 2);
  for (std::size_t p = 0; p < std::min(all.placements.size(), kShownRows); ++p) {
    const Placement& placed = all.placements[p];
    const bool any = all.triangles_of(placed.mesh) > 0;
    table.row({std::to_string(p), short_name(all.placement_name(p)), std::to_string(placed.mesh),
               std::to_string(all.placement_labels[p].node),
               any ? bounds_text(moved(bounds_of_mesh(scene, placed.mesh), placed.transform)) : "(none)"});
  }
  print_table(table, all.placements.size(), "instances");
}

nlohmann::json meshes_json(const Scene& scene) {
  const SceneInstances& all = scene.instances;
  nlohmann::json materials = nlohmann::json::array(), meshes = materials, instances = materials;
  for (const Material& m : scene.materials) materials.push_back(m.name);
  std::vector<Bounds> boxes;
  for (std::size_t m = 0; m < all.meshes(); ++m) {
    const MeshLabel& label = all.mesh_labels[m];
    boxes.push_back(bounds_of_mesh(scene, m));
    meshes.push_back({{"name", all.mesh_name(m)},
                      {"id", label.id},
                      {"first", all.first[m]},
                      {"triangles", all.triangles_of(m)},
                      {"shapes", label.columns ? kHeights : info_of(label.kind).name},
                      {"material", nullptr},
                      {"bounds", bounds_json(boxes.back())}});
    if (label.material != kSeveralMaterials) meshes.back()["material"] = label.material;
    if (label.columns) meshes.back()["columns"] = label.columns;
  }
  for (std::size_t p = 0; p < all.placements.size(); ++p) {
    const Placement& placed = all.placements[p];
    const Bounds& box = boxes[placed.mesh];
    instances.push_back(
        {{"name", all.placement_name(p)},
         {"mesh", placed.mesh},
         {"node", all.placement_labels[p].node},
         {"bounds", bounds_json(all.triangles_of(placed.mesh) > 0 ? moved(box, placed.transform) : Bounds{})}});
  }
  return {{"materials", std::move(materials)}, {"meshes", std::move(meshes)}, {"instances", std::move(instances)}};
}

}  // namespace

nlohmann::json print_meshes(const Scene& scene, bool listed) {
  print_mesh_table(scene);
  if (scene.instanced()) print_instance_table(scene);
  return listed ? meshes_json(scene) : nlohmann::json::object();
}

}  // namespace ballot::cli
