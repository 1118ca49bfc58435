#include "engine/model/scene_edits.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/model/instances.h"

namespace ballot {
namespace {

constexpr std::uint32_t kLastNumber = 0xFFFFFFFE;

/// Returns the index of the label with a number; none if there is none.
template <class Label>
std::optional<std::uint32_t> index_of(const std::vector<Label>& labels, std::uint32_t number) {
  const auto found = std::ranges::lower_bound(labels, number, {}, &Label::number);
  if (found == labels.end() || found->number != number) return {};
  return static_cast<std::uint32_t>(found - labels.begin());
}

[[noreturn]] void refuse_mesh(std::uint32_t mesh) {
  fail(Failure::Arguments, "mesh {}: the scene has no mesh of this number, or it is removed", mesh);
}
[[noreturn]] void refuse_placement(std::uint32_t placement) {
  fail(Failure::Arguments, "instance {}: the scene has no instance of this number, or it is removed", placement);
}

/// Copies what one array of a scene has of a mesh; where it has nothing, `fill` makes it.
template <class T, class Fill>
void copy_part(std::span<const T> from, std::vector<T>& to, std::size_t first, std::size_t count, const Fill& fill) {
  if (to.empty()) return;
  for (std::size_t i = 0; i < count; ++i) to[first + i] = from.empty() ? fill(i) : from[i];
}

template <class T>
std::span<const T> part_of(const std::vector<T>& all, std::size_t first, std::size_t count) {
  return all.empty() ? std::span<const T>() : std::span(all).subspan(first, count);
}

}  // namespace

void SceneStructure::exchange(Scene& scene) {
  std::swap(scene.instances, instances);
  if (!replaces_arrays) return;
  scene.triangles.swap(triangles);
  scene.normals.swap(normals);
  scene.material_of.swap(material_of);
  scene.materials.swap(materials);
  scene.uvs.swap(uvs);
  scene.colors.swap(colors);
  scene.shapes.swap(shapes);
}

/// Takes the scene's meshes and placements one by one, for other ones.
void SceneEdits::open() {
  if (opened_) return;
  const SceneInstances& all = scene_.instances;
  const auto at_end = [](auto& map, std::uint32_t number, auto value) {
    map.emplace_hint(map.end(), number, std::move(value));
  };
  for (std::uint32_t m = 0; m < all.meshes(); ++m)
    at_end(meshes_, all.mesh_labels[m].number, Mesh{all.mesh_labels[m], m});
  const std::span<const Transform> moved = transforms();
  for (std::size_t p = 0; p < all.placements.size(); ++p) {
    Place place{all.placements[p], all.placement_labels[p]};
    if (!moved.empty()) place.placement.transform = moved[p];
    place.placement.mesh = all.mesh_labels[place.placement.mesh].number;
    at_end(places_, place.label.number, place);
  }
  names_ = all.names;
  opened_ = true;
}

SceneEdits::Mesh& SceneEdits::mesh_at(std::uint32_t mesh) {
  mesh_index(mesh);
  open();
  return meshes_.at(mesh);
}

SceneEdits::Place& SceneEdits::place_at(std::uint32_t placement) {
  check_placement(placement);
  open();
  return places_.at(placement);
}

std::uint32_t SceneEdits::add_mesh(MeshGeometry mesh, std::optional<std::uint32_t> id,
                                   std::optional<std::string> name) {
  open();
  if (next_.mesh > kLastNumber)
    fail(Failure::Arguments, "mesh: the scene has had {} meshes; make a new one", next_.mesh);
  const std::uint32_t number = next_.mesh++;
  MeshLabel label{.name = static_cast<std::uint32_t>(names_.size()), .id = id.value_or(number), .number = number};
  names_.push_back(name ? std::move(*name) : fmt::format("mesh {}", number));
  label.kind = mesh.kind, label.columns = mesh.columns;
  meshes_.emplace(number, Mesh{label, {}, std::move(mesh)});
  return number;
}

void SceneEdits::replace_mesh(std::uint32_t mesh, MeshGeometry with) {
  Mesh& m = mesh_at(mesh);
  m.label.kind = with.kind, m.label.columns = with.columns;
  m.made = std::move(with);
  m.moved = false;
}

void SceneEdits::move_mesh(std::uint32_t mesh, MeshGeometry to) {
  Mesh& m = mesh_at(mesh);
  m.moved = m.moved || !m.made;
  if (!m.made) m.made.emplace();
  m.made->triangles = std::move(to.triangles);
  m.made->shapes = std::move(to.shapes);
  m.made->elsewhere = to.elsewhere;
}

void SceneEdits::remove_mesh(std::uint32_t mesh) {
  mesh_at(mesh);
  meshes_.erase(mesh);
  std::erase_if(places_, [&](const auto& item) { return item.second.placement.mesh == mesh; });
}

void SceneEdits::separate_mesh(std::uint32_t mesh) { mesh_at(mesh).label.in_world = false; }

std::uint32_t SceneEdits::add_placement(const Placement& given) {
  const MeshLabel label = mesh_at(given.mesh).label;
  if (next_.placement > kLastNumber)
    fail(Failure::Arguments, "instance: the scene has had {} instances; make a new one", next_.placement);
  mesh_at(given.mesh).label.in_world = false;
  const std::uint32_t number = next_.placement++;
  places_.emplace(number, Place{given, {.name = label.name, .node = number, .number = number}});
  return number;
}

void SceneEdits::remove_placement(std::uint32_t placement) {
  mesh_at(place_at(placement).placement.mesh).label.in_world = false;
  places_.erase(placement);
}

void SceneEdits::set_mask(std::uint32_t placement, std::uint32_t mask) { place_at(placement).placement.mask = mask; }

void SceneEdits::set_group(std::uint32_t placement, std::uint32_t group) {
  place_at(placement).placement.group = group;
}

void SceneEdits::set_masks(std::span<const std::uint32_t> masks) {
  open();
  for (std::size_t i = 0; auto& [number, place] : places_) place.placement.mask = masks[i++];
}

bool SceneEdits::hides_or_shows(std::span<const std::uint32_t> masks) const {
  const auto differs = [](const Placement& p, std::uint32_t mask) { return (p.mask == 0) != (mask == 0); };
  return opened_ || !std::ranges::equal(scene_.instances.placements, masks, std::not_fn(differs));
}

void SceneEdits::set_transform(std::uint32_t placement, const Transform& transform) {
  check_placement(placement);
  if (opened_)
    places_.at(placement).placement.transform = transform;
  else
    some_.insert_or_assign(placement, transform);
}

void SceneEdits::set_transforms(std::span<const Transform> transforms) {
  if (transforms.size() != placement_count())
    fail(Failure::Arguments, "{} transforms, but the scene has {} instances; expected one for each", transforms.size(),
         placement_count());
  some_.clear();
  if (!opened_) {
    all_ = transforms;
    return;
  }
  for (std::size_t i = 0; auto& [number, place] : places_) place.placement.transform = transforms[i++];
}

std::optional<std::uint32_t> SceneEdits::mesh_index(std::uint32_t mesh) const {
  if (!opened_) {
    const auto found = index_of(scene_.instances.mesh_labels, mesh);
    if (!found) refuse_mesh(mesh);
    return found;
  }
  const auto found = meshes_.find(mesh);
  if (found == meshes_.end()) refuse_mesh(mesh);
  return found->second.made && !found->second.moved ? std::nullopt : found->second.before;
}

bool SceneEdits::has_mesh(std::uint32_t mesh) const {
  return opened_ ? meshes_.contains(mesh) : index_of(scene_.instances.mesh_labels, mesh).has_value();
}

void SceneEdits::check_placement(std::uint32_t placement) const {
  if (opened_ ? !places_.contains(placement) : !index_of(scene_.instances.placement_labels, placement))
    refuse_placement(placement);
}

std::size_t SceneEdits::placement_count() const {
  return opened_ ? places_.size() : scene_.instances.placements.size();
}

std::map<std::uint32_t, std::uint32_t> SceneEdits::meshes_of_placements() const {
  std::map<std::uint32_t, std::uint32_t> meshes;
  for (const auto& [number, place] : places_) meshes.emplace_hint(meshes.end(), number, place.placement.mesh);
  const SceneInstances& all = scene_.instances;
  for (std::size_t p = 0; !opened_ && p < all.placements.size(); ++p)
    meshes.emplace_hint(meshes.end(), all.placement_labels[p].number, all.mesh_labels[all.placements[p].mesh].number);
  return meshes;
}

std::span<const Transform> SceneEdits::transforms() {
  if (some_.empty()) return all_;
  const SceneInstances& all = scene_.instances;
  own_.clear();
  for (std::size_t p = 0; p < all.placements.size(); ++p)
    own_.push_back(all_.empty() ? all.placements[p].transform : all_[p]);
  for (const auto& [number, transform] : some_) own_[*index_of(all.placement_labels, number)] = transform;
  return own_;
}

/// Gives meshes that share a tree in the world one of their own if they leave their place.
void SceneEdits::separate_turned() {
  const SceneInstances& all = scene_.instances;
  const std::span<const Transform> moved = opened_ ? std::span<const Transform>() : transforms();
  const auto leaves = [&](std::size_t p) {
    return all.mesh_labels[all.placements[p].mesh].in_world && !is_identity(moved[p]);
  };
  for (std::size_t p = 0; p < moved.size() && !opened_; ++p)
    if (leaves(p)) open();
  if (!opened_) return;
  for (auto& [number, place] : places_)
    if (MeshLabel& label = meshes_.at(place.placement.mesh).label; !is_identity(place.placement.transform))
      label.in_world = false;
}

bool SceneEdits::changes_structure() {
  separate_turned();
  return opened_;
}

/// Returns meshes and placements by their indices. Names are those that are in use.
SceneInstances SceneEdits::instances() {
  SceneInstances to;
  to.layout = scene_.instances.layout;
  to.placed = to.numbered = true;
  std::map<std::uint32_t, std::uint32_t> index, names;
  const auto name = [&](std::uint32_t old) {
    const auto [item, fresh] = names.emplace(old, static_cast<std::uint32_t>(to.names.size()));
    if (fresh) to.names.push_back(names_[old]);
    return item->second;
  };
  for (auto& [number, mesh] : meshes_) {
    index.emplace_hint(index.end(), number, static_cast<std::uint32_t>(to.mesh_labels.size()));
    to.mesh_labels.push_back(mesh.label);
    to.mesh_labels.back().name = name(mesh.label.name);
    to.first.push_back(to.first.empty() ? 0 : to.first.back());
  }
  for (const auto& [number, place] : places_) {
    to.placements.push_back(place.placement);
    to.placements.back().mesh = index.at(place.placement.mesh);
    to.placement_labels.push_back(place.label);
    to.placement_labels.back().name = name(place.label.name);
  }
  return to;
}

bool SceneEdits::has_normals() const {
  return !scene_.normals.empty() ||
         std::ranges::any_of(meshes_, [](const auto& m) { return m.second.made && !m.second.made->normals.empty(); });
}

/// Writes the arrays of all meshes one behind the other.
void SceneEdits::gather(SceneStructure& to) const {
  const SceneInstances& old = scene_.instances;
  const std::size_t count = to.instances.first.back();
  const bool fresh = std::ranges::any_of(meshes_, [](const auto& m) { return !m.second.before; });
  to.materials = scene_.materials;
  const Material plain_material{.name = "default"};
  if (fresh && to.materials.back() != plain_material) to.materials.push_back(plain_material);
  const auto plain = static_cast<std::uint32_t>(to.materials.size() - 1);  // of meshes that are added
  to.triangles.resize(count);
  to.material_of.resize(to.materials.size() == 1 ? 0 : count);
  to.normals.resize(has_normals() ? count : 0);
  to.colors.resize(scene_.colors.empty() ? 0 : count);
  for (std::size_t set = 0; set < kUvSets; ++set) to.uvs[set].resize(scene_.uvs[set].empty() ? 0 : count);
  const auto has_shapes = [](const auto& m) { return m.second.label.kind != ShapeKind::Triangles; };
  to.shapes.resize(std::ranges::any_of(meshes_, has_shapes) ? count : 0);
  std::size_t m = 0;
  for (const auto& [number, mesh] : meshes_) {
    const std::size_t first = to.instances.first[m], size = to.instances.first[m + 1] - first;
    const bool keeps = mesh.before && (!mesh.made || mesh.moved);  // all but perhaps the vertices
    const std::size_t begin = mesh.before ? old.first[*mesh.before] : 0, had = keeps ? size : 0;
    const std::span<const Triangle> triangles =
        mesh.made ? std::span<const Triangle>(mesh.made->triangles) : std::span(scene_.triangles).subspan(begin, size);
    if (!to.elsewhere[m]) copy_parallel(triangles, std::span(to.triangles).subspan(first, size));
    const auto flat = [&](std::size_t i) {
      const bool is_shape = mesh.label.kind != ShapeKind::Triangles;  // which has none
      const glm::vec3 n = is_shape ? glm::vec3(0) : geometric_normal(triangles[i]);
      return std::array{n, n, n};
    };
    const auto given = mesh.made && !mesh.moved ? std::span<const std::array<glm::vec3, 3>>(mesh.made->normals)
                                                : part_of(scene_.normals, begin, had);
    copy_part(given, to.normals, first, size, flat);
    const std::uint32_t material = !mesh.before ? plain : old.triangles_of(*mesh.before) ? scene_.material(begin) : 0;
    copy_part(part_of(scene_.material_of, begin, had), to.material_of, first, size,
              [&](std::size_t) { return material; });
    copy_part(part_of(scene_.colors, begin, had), to.colors, first, size, [](std::size_t) {
      return std::array{glm::vec4(1), glm::vec4(1), glm::vec4(1)};
    });
    for (std::size_t set = 0; set < kUvSets; ++set)
      copy_part(part_of(scene_.uvs[set], begin, had), to.uvs[set], first, size,
                [](std::size_t) { return std::array<glm::vec2, 3>{}; });
    const auto shapes = mesh.made ? std::span<const Shape>(mesh.made->shapes) : part_of(scene_.shapes, begin, had);
    copy_part(shapes, to.shapes, first, size, [](std::size_t) { return Shape(); });
    ++m;
  }
}

SceneStructure SceneEdits::structure(const std::vector<bool>& elsewhere) {
  open();
  separate_turned();
  SceneStructure to;
  to.instances = instances();
  to.replaces_arrays = meshes_.size() != scene_.instances.meshes();
  std::size_t end = 0;
  for (std::size_t m = 0; const auto& [number, mesh] : meshes_) {
    to.instances.first[m++] = end;
    end += mesh.made ? mesh.made->size() : scene_.instances.triangles_of(*mesh.before);
    to.replaces_arrays |= mesh.made.has_value();
    to.same_as.push_back(mesh.made ? std::nullopt : mesh.before);
    to.elsewhere.push_back(mesh.made ? mesh.made->elsewhere > 0 : !elsewhere.empty() && elsewhere[*mesh.before]);
  }
  to.instances.first.push_back(end);
  if (to.replaces_arrays) gather(to);
  return to;
}

}  // namespace ballot
