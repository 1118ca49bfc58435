#include "engine/files/gltf_triangles.h"

#include <algorithm>
#include <optional>

#include "engine/core/memory.h"
#include "engine/files/gltf_instances.h"
#include "engine/files/gltf_keep.h"
#include "engine/files/loaders.h"
#include "engine/model/instances.h"
#include "engine/model/placing.h"

namespace ballot {
namespace {

const std::vector<OpenPrimitive>* mesh_of(const GltfFile& file, const OpenMeshes& meshes, const PlacedNode& placed) {
  const int mesh = file.model.nodes[placed.node].mesh;
  return mesh == -1 ? nullptr : &meshes.at(static_cast<std::size_t>(mesh));
}

/// The instances of nodes that have some, by the node.
using OpenInstances = std::map<std::size_t, NodeInstances>;

OpenInstances instances_of(const GltfFile& file, const std::vector<PlacedNode>& placed) {
  OpenInstances all;
  for (const PlacedNode& p : placed)
    if (auto instances = open_instances(file, p.node)) all.emplace(p.node, std::move(*instances));
  return all;
}

std::uint64_t triangles_of(const std::vector<OpenPrimitive>& mesh) {
  std::uint64_t count = 0;
  for (const OpenPrimitive& primitive : mesh) count += primitive.triangle_count;
  return count;
}

bool has(ShapeKind kind, const std::vector<OpenPrimitive>& mesh) {
  return std::ranges::any_of(mesh, [&](const OpenPrimitive& p) { return p.shapes == kind && p.triangle_count > 0; });
}

bool has_shapes(const std::vector<OpenPrimitive>& mesh) {
  return has(ShapeKind::Spheres, mesh) || has(ShapeKind::Capsules, mesh);
}

/// The uses of meshes by the nodes of a file.
struct Uses {
  explicit Uses(const TriangleSource& given) : source(given), instances(instances_of(given.file, given.placed)) {}

  const TriangleSource& source;
  const OpenInstances instances;

  const GltfFile& file() const { return source.file; }
  std::size_t mesh_number(const PlacedNode& p) const {
    return static_cast<std::size_t>(file().model.nodes[p.node].mesh);
  }
  bool moves(const PlacedNode& p) const { return !source.moves.empty() && source.moves[p.node]; }
  /// Returns true if a kept mesh is needed as in the file, or turned, where a node places it by this matrix.
  bool needs(const PlacedNode& p, const glm::dmat4& world, bool turned) const {
    return mirrors(world) == turned || (!source.turns.empty() && source.turns[p.node]);
  }
  /// Returns true if a skin or morph targets deform the mesh of a node.
  bool deforms(const PlacedNode& p) const {
    return file().model.nodes[p.node].skin != -1 ||
           std::ranges::any_of(file().model.meshes[mesh_number(p)].primitives,
                               [](const tinygltf::Primitive& primitive) { return !primitive.targets.empty(); });
  }
  std::uint64_t count(const PlacedNode& p) const {
    const auto found = instances.find(p.node);
    return found == instances.end() ? 1 : found->second.size();
  }
  /// Calls visit(node, mesh) for each node that has a mesh with triangles.
  template <class Visit>
  void for_each_node(const Visit& visit) const {
    for (const PlacedNode& p : source.placed)
      if (const auto* mesh = mesh_of(file(), source.meshes, p); mesh && triangles_of(*mesh) > 0) visit(p, *mesh);
  }
  /// Calls visit(world_from_mesh, node_from_mesh, instanced) for each use by a node.
  template <class Visit>
  void for_each_use(const PlacedNode& p, const Visit& visit) const {
    const auto found = instances.find(p.node);
    if (found == instances.end()) return visit(p.world_from_node, glm::dmat4{1}, false);
    for (std::size_t i = 0; i < found->second.size(); ++i) {
      const glm::dmat4 node_from_mesh = found->second.matrix(i);
      visit(p.world_from_node * node_from_mesh, node_from_mesh, true);
    }
  }
};

/// The sizes of a scene.
struct SceneSizes {
  std::uint64_t triangles = 0;  // if every use of a mesh is a copy
  std::uint64_t held = 0;       // in the arrays of the scene
  Carried carried = {};
  UsesOfMeshes kept = {};  // the meshes that are kept once
};

constexpr std::uint64_t kMostInstances = 1 << 22;     // a small file can ask for any number
constexpr std::uint64_t kBytesWithTree = 300;         // of a triangle: the scene's arrays, the tree and what builds it
constexpr std::uint64_t kSurelyFit = 1 << 18;         // triangles; memory is not asked for
constexpr std::uint64_t kBytesAnInstance = 60 + 232;  // of the scene; of its trees: engine/README.md, Memory

void add_carried(const std::vector<OpenPrimitive>& mesh, const Scene& scene, Carried& carried) {
  for (const OpenPrimitive& primitive : mesh) {
    if (primitive.triangle_count == 0) continue;
    carried.normals |= primitive.normals && primitive.shapes == ShapeKind::Triangles;
    carried.colors |= primitive.colors.has_value();
    if (primitive.material >= scene.materials.size()) continue;
    for (const TextureUse* use : scene.materials[primitive.material].uses())
      if (*use) carried.uvs[use->set] = true;
  }
}

/// Counts the triangles of copies, and chooses the meshes that are kept once.
SceneSizes chosen_sizes(const Uses& uses, const Scene& scene) {
  SceneSizes sizes;
  const InstancePolicy policy = uses.file().options.instances;
  const std::uint64_t most = policy == InstancePolicy::Copy ? kMaxTriangles : kMostPrims;
  bool deforming = false;
  uses.for_each_node([&](const PlacedNode& p, const std::vector<OpenPrimitive>& mesh) {
    add_carried(mesh, scene, sizes.carried);
    const std::uint64_t count = uses.count(p), triangles = triangles_of(mesh);
    if (count > most || (sizes.triangles += count * triangles) > most)
      refuse("its nodes place more than {} triangles; use a smaller scene", most);
    const bool deforms = uses.deforms(p);
    deforming |= deforms && !uses.file().model.animations.empty();
    if (deforms || has_shapes(mesh)) return;
    MeshUses& m = sizes.kept[uses.mesh_number(p)];
    m.triangles = triangles;
    m.uses += count;
    m.moves |= uses.moves(p);
  });
  // The trees of deformed meshes are built anew for each pose, so moving copies are as good there.
  if (policy == InstancePolicy::Auto && deforming) sizes.kept.clear();
  const bool fit = sizes.triangles <= kMaxTriangles &&
                   (sizes.triangles < kSurelyFit || sizes.triangles * kBytesWithTree <= memory_left());
  choose_kept(sizes.kept, sizes.triangles, fit, policy);
  return sizes;
}

SceneSizes sizes_of(const Uses& uses, const Scene& scene) {
  SceneSizes sizes = chosen_sizes(uses, scene);
  sizes.held = sizes.triangles;
  if (sizes.kept.empty()) return sizes;
  std::uint64_t instances = 0;
  for (const auto& [number, m] : sizes.kept) instances += m.uses;
  if (instances > kMostInstances) refuse("its nodes place more than {} instances; use a smaller scene", kMostInstances);
  need_memory_for(instances * kBytesAnInstance, fmt::format("the scene of {} instances", instances));
  uses.for_each_node([&](const PlacedNode& p, const std::vector<OpenPrimitive>&) {
    const auto found = sizes.kept.find(uses.mesh_number(p));
    if (found == sizes.kept.end() || uses.deforms(p)) return;
    uses.for_each_use(p, [&](const glm::dmat4& world, const glm::dmat4&, bool) {
      if (!is_placeable(transform_of(world))) return;
      ++found->second.placeable;
      for (const bool turned : {false, true}) found->second.made[turned] |= uses.needs(p, world, turned);
    });
  });
  for (const auto& [number, m] : sizes.kept)
    sizes.held = sizes.held + m.triangles * (m.made[0] + m.made[1]) - m.triangles * m.placeable;
  return sizes;
}

/// Makes room for the arrays of a scene. Throws Error(Work) if there is none.
void reserve(const SceneSizes& sizes, Scene& scene) {
  if (sizes.held > kMaxTriangles) refuse("its nodes place more than {} triangles; use a smaller scene", kMaxTriangles);
  const Carried& carried = sizes.carried;
  const std::size_t sets = static_cast<std::size_t>(std::ranges::count(carried.uvs, true));
  need_memory_for(sizes.held * (sizeof(Triangle) + sizeof(std::uint32_t) + (carried.normals ? sizeof(Triangle) : 0) +
                                (carried.colors ? 3 * sizeof(glm::vec4) : 0) + sets * 3 * sizeof(glm::vec2)),
                  fmt::format("the scene of {} triangles", sizes.held));
  scene.triangles.reserve(sizes.held);
  scene.material_of.reserve(sizes.held);
  if (carried.normals) scene.normals.reserve(sizes.held);
  if (carried.colors) scene.colors.reserve(sizes.held);
  for (std::size_t set = 0; set < kUvSets; ++set)
    if (carried.uvs[set]) scene.uvs[set].reserve(sizes.held);
}

/// Appends the points and lines of a node, in the world: a mesh of spheres and one of capsules.
void append_shapes(const Uses& uses, const PlacedNode& p, const std::vector<OpenPrimitive>& mesh,
                   const Carried& carried, InstanceWriter& writer, Scene& scene) {
  for (const ShapeKind kind : {ShapeKind::Spheres, ShapeKind::Capsules}) {
    if (!has(kind, mesh)) continue;
    writer.begin_in_world(p.node, kind);
    uses.for_each_use(p, [&](const glm::dmat4& world, const glm::dmat4&, bool) {
      for (const OpenPrimitive& primitive : mesh)
        if (primitive.shapes == kind)
          append_primitive_shapes(primitive, world, uses.file().options.radius, carried, scene);
    });
  }
}

}  // namespace

OpenMeshes open_meshes(GltfFile& file, const std::vector<PlacedNode>& placed) {
  OpenMeshes meshes;
  for (const PlacedNode& p : placed) {
    const tinygltf::Node& node = file.model.nodes[p.node];
    if (node.mesh == -1) continue;
    if (node.mesh < 0 || static_cast<std::size_t>(node.mesh) >= file.model.meshes.size())
      refuse("{} names mesh {}, but the file has {}", label("node", p.node, node.name), node.mesh,
             file.model.meshes.size());
    const auto mesh = static_cast<std::size_t>(node.mesh);
    const auto [entry, fresh] = meshes.try_emplace(mesh);
    if (!fresh) continue;
    for (std::size_t i = 0; i < file.model.meshes[mesh].primitives.size(); ++i)
      if (auto primitive = open_primitive(file, mesh, i)) entry->second.push_back(std::move(*primitive));
  }
  return meshes;
}

void read_triangles(const TriangleSource& source, Scene& scene, MovingPlaces* where) {
  const Uses uses{source};
  const SceneSizes sizes = sizes_of(uses, scene);
  reserve(sizes, scene);
  InstanceWriter writer(source.file, scene);
  std::uint64_t copied = 0, resting = 0;
  uses.for_each_node([&](const PlacedNode& p, const std::vector<OpenPrimitive>& mesh) {
    const auto append_use = [&](const glm::dmat4& world, const glm::dmat4& node_from_mesh, bool instanced) {
      const auto append = [&](const glm::dmat4& matrix, bool turned, std::vector<PlacedPrimitive>* to) {
        for (const OpenPrimitive& primitive : mesh) {
          if (primitive.shapes != ShapeKind::Triangles) continue;
          if (to && primitive.triangle_count > 0)
            to->push_back({&primitive, p.node, node_from_mesh, instanced, turned, scene.triangles.size()});
          append_primitive(primitive, matrix, turned, sizes.carried, scene);
        }
      };
      const bool keep = sizes.kept.contains(uses.mesh_number(p)) && !uses.deforms(p);
      const Transform transform = transform_of(world);
      if (!keep || !is_placeable(transform)) {
        writer.begin_copy(p.node);
        append(world, mirrors(world), where ? &where->primitives : nullptr);
        copied += keep ? 1 : 0;
        return;
      }
      MovingPlacement moving{.node = static_cast<std::uint32_t>(p.node), .node_from_mesh = node_from_mesh};
      const auto once = [&](bool turned) { append(glm::dmat4{1}, turned, nullptr); };
      for (const bool turned : {mirrors(world), !mirrors(world)})
        moving.meshes[turned] =
            uses.needs(p, world, turned) ? writer.number_of(uses.mesh_number(p), turned, once) : moving.meshes[!turned];
      moving.placement = writer.place(p.node, moving.meshes[mirrors(world)], transform);
      if (where && uses.moves(p)) where->instances.push_back(moving);
    };
    if (has(ShapeKind::Triangles, mesh)) uses.for_each_use(p, append_use);
    append_shapes(uses, p, mesh, sizes.carried, writer, scene);
    resting += has_shapes(mesh) && (uses.moves(p) || uses.deforms(p)) ? 1 : 0;
  });
  writer.finish();
  if (!scene.shapes.empty()) scene.shapes.resize(scene.triangles.size());
  if (copied > 0)
    scene.notes.push_back(fmt::format(
        "{} instances were copied: their matrices are singular or stretch too much to be kept as instances.", copied));
  if (resting > 0)
    scene.notes.push_back(fmt::format(
        "The points and lines of {} nodes stay at rest, which animations, skins or morph targets move.", resting));
}

}  // namespace ballot
