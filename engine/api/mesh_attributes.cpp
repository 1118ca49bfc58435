#include "engine/api/mesh_attributes.h"

#include <algorithm>
#include <cstring>
#include <set>

#include "engine/core/registry.h"
#include "generated/door_rows.h"

namespace ballot::api {

namespace {

constexpr std::size_t kMostAttributes = 1 << 16;  // of a mesh
constexpr std::size_t kMostName = 255;            // bytes: BallotAttributeInfo::name

void check_name(BallotText given, const std::string& where) {
  if (!given) refuse(fmt::format("{}: the name of an attribute is NULL", where));
  const std::string_view name = given.text;
  if (name.empty() || name.size() > kMostName)
    refuse(fmt::format("{}: the name of an attribute has {} bytes; expected 1 to {}", where, name.size(), kMostName));
  if (find_row(door::kHitRows, name) || find_row(door::kNearestRows, name))
    refuse(fmt::format("{}: an attribute is called '{}', as a column of answers; expected another name", where, name));
}

/// Returns what values are of, and writes how many there have to be.
ValuesOf values_of(const BallotAttribute& a, const MeshState& mesh, const std::string& where, std::size_t& count) {
  if (a.nearest && a.of != BALLOT_OF_VERTICES)
    refuse(fmt::format("{}: nearest is 1, but its values are not of vertices; expected 0", where));
  switch (a.of) {
    case BALLOT_OF_VERTICES:
      if (mesh.kind != ShapeKind::Triangles)
        refuse(
            fmt::format("{}: its values are of vertices, but the mesh has {}; expected values of these, or one of "
                        "the mesh",
                        where, info_of(mesh.kind).name));
      count = mesh.vertices;
      return a.nearest ? ValuesOf::NearVertex : ValuesOf::Vertices;
    case BALLOT_OF_PRIMS:
      count = mesh.triangles;
      return ValuesOf::Prims;
    case BALLOT_OF_MESH:
      count = 1;
      return ValuesOf::Mesh;
  }
  refuse(fmt::format("{}: of is {}; expected BALLOT_OF_VERTICES, BALLOT_OF_PRIMS or BALLOT_OF_MESH", where, int(a.of)));
}

const char* name_of(BallotValuesOf of) {
  return of == BALLOT_OF_VERTICES ? "vertices" : of == BALLOT_OF_PRIMS ? "triangles or shapes" : "mesh";
}

/// Returns the values side by side.
std::vector<float> read_numbers(const BallotAttribute& a, std::size_t components, const std::string& where) {
  const std::size_t bytes = components * sizeof(float);
  const std::size_t stride = stride_of(a.stride, bytes, a.count, where + ": stride");
  std::vector<float> numbers(a.count * components);
  const char* from = reinterpret_cast<const char*>(a.data);
  for (std::size_t i = 0; i < a.count; ++i) std::memcpy(&numbers[i * components], from + i * stride, bytes);
  return numbers;
}

/// Returns the caller's array of values.
RawBuffer& array_of_values(BufferState& from, const SceneState& scene, std::size_t components, std::size_t count,
                           const std::string& where) {
  switch (components) {
    case 1:
      return array_of<float>(from, scene, count, where.c_str(), "values");
    case 2:
      return array_of<glm::vec2>(from, scene, count, where.c_str(), "values");
    case 3:
      return array_of<glm::vec3>(from, scene, count, where.c_str(), "values");
    default:
      return array_of<glm::vec4>(from, scene, count, where.c_str(), "values");
  }
}

}  // namespace

void check_attribute_count(const BallotMesh& m, const std::string& where) {
  if (m.attribute_count && !m.attributes)
    refuse(fmt::format("{}: attributes is NULL, but attribute_count is {}", where, m.attribute_count));
  if (m.attribute_count > kMostAttributes)
    refuse(
        fmt::format("{}: attribute_count is {}; at most {} are possible", where, m.attribute_count, kMostAttributes));
  if (m.attribute_count) attribute_struct(m, 0);  // whose size tells where the others are
}

BallotAttribute attribute_struct(const BallotMesh& m, std::size_t i) {
  const char* first = reinterpret_cast<const char*>(m.attributes);
  return read_struct(reinterpret_cast<const BallotAttribute*>(first + i * m.attributes[0].size), "BallotAttribute");
}

MeshAttribute read_attribute(const BallotAttribute& a, BufferState* from, const MeshState& mesh,
                             const SceneState& scene, const std::string& of_mesh) {
  check_name(a.name, of_mesh);
  const std::string where = fmt::format("{}, attribute '{}'", of_mesh, a.name.text);
  MeshAttribute made{.name = a.name.text, .components = a.components ? a.components : 1, .count = a.count};
  if (made.components > 4) refuse(fmt::format("{}: it has {} components; expected 1 to 4", where, made.components));
  std::size_t expected = 0;
  made.of = values_of(a, mesh, where, expected);
  if (a.count != expected)
    refuse(fmt::format("{}: {} values, of {} {}; expected one for each", where, a.count, expected, name_of(a.of)));
  if ((a.data != nullptr) == (from != nullptr))
    refuse(fmt::format("{}: {} of data and buffer {} set; expected one of them", where, from ? "both" : "none",
                       from ? "are" : "is"));
  if (from && a.stride) refuse(fmt::format("{}: stride is {}; expected 0 beside buffer", where, a.stride));
  Context& gpu = *scene.device->gpu;
  const std::vector<float> here = from ? std::vector<float>() : read_numbers(a, made.components, where);
  const RawBuffer* there = from ? &array_of_values(*from, scene, made.components, a.count, where) : nullptr;
  made.values = std::make_shared<Buffer<float>>(gpu, made.numbers(), Access::Storage, where);
  if (there)
    made.values->RawBuffer::copy_from(*there, 0, 0, made.numbers() * sizeof(float));
  else
    made.values->upload(here);
  return made;
}

std::vector<MeshAttribute> read_attributes(const BallotMesh& m, std::span<const std::shared_ptr<BufferState>> from,
                                           const MeshState& mesh, const SceneState& scene, const std::string& where) {
  std::vector<MeshAttribute> all;
  for (std::size_t i = 0; i < m.attribute_count; ++i) {
    MeshAttribute made = read_attribute(attribute_struct(m, i), from[i].get(), mesh, scene, where);
    if (std::ranges::count(all, made.name, &MeshAttribute::name))
      refuse(fmt::format("{}: two attributes are called '{}'; expected another name for each", where, made.name));
    all.push_back(std::move(made));
  }
  return all;
}

bool put_attribute(std::vector<MeshAttribute>& to, MeshAttribute attribute) {
  const auto found = std::ranges::find(to, attribute.name, &MeshAttribute::name);
  if (found == to.end()) {
    to.push_back(std::move(attribute));
    return true;
  }
  const bool fits = found->is_like(attribute);
  if (fits)
    found->values->copy_from(*attribute.values, 0, found->first, attribute.numbers());
  else
    *found = std::move(attribute);
  return !fits;
}

void take_attributes(SceneState& scene, PendingEdits& edits) {
  bool others = false;
  for (auto& [number, all] : edits.attributes)
    for (MeshAttribute& a : all) others |= put_attribute(scene.meshes.at(number).attributes, std::move(a));
  if (others && scene.there) scene.there->values.reset();
}

/// Returns the attributes that a mesh of the scene has once edits are made.
static std::vector<MeshAttribute> attributes_then(const MeshState& mesh, std::uint32_t number,
                                                  const PendingEdits* edits) {
  std::vector<MeshAttribute> all = mesh.attributes;
  const auto given = edits ? edits->attributes.find(number) : decltype(edits->attributes.end())();
  if (!edits || given == edits->attributes.end()) return all;
  for (const MeshAttribute& a : given->second) {
    std::erase_if(all, [&](const MeshAttribute& old) { return old.name == a.name; });
    all.push_back(a);
  }
  return all;
}

void check_components(const SceneState& scene, std::uint32_t mesh, std::span<const MeshAttribute> attributes,
                      const std::string& where) {
  if (attributes.empty()) return;
  const auto check = [&](std::uint32_t number, const std::vector<MeshAttribute>& all) {
    for (const MeshAttribute& a : attributes) {
      const auto other = std::ranges::find(all, a.name, &MeshAttribute::name);
      if (number != mesh && other != all.end() && other->components != a.components)
        refuse(fmt::format("{}, attribute '{}': it has {} components, but {} in mesh {}; expected as many", where,
                           a.name, a.components, other->components, number));
    }
  };
  const PendingEdits* edits = scene.pending.get();
  for (const auto& [number, state] : scene.meshes)
    if (!edits || (edits->edits.has_mesh(number) && !edits->meshes.contains(number)))
      check(number, attributes_then(state, number, edits));
  if (!edits) return;
  for (const auto& [number, state] : edits->meshes) check(number, state.attributes);
}

const MeshAttribute* find_attribute(const SceneState& scene, std::string_view name) {
  for (const auto& [number, mesh] : scene.meshes) {
    const auto found = std::ranges::find(mesh.attributes, name, &MeshAttribute::name);
    if (found != mesh.attributes.end()) return &*found;
  }
  return nullptr;
}

std::string attribute_names(const SceneState& scene) {
  std::set<std::string> names;
  for (const auto& [number, mesh] : scene.meshes)
    for (const MeshAttribute& a : mesh.attributes) names.insert(a.name);
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

ToldValuesOf told_of(ValuesOf of) {
  switch (of) {
    case ValuesOf::Prims:
      return {BALLOT_OF_PRIMS, false};
    case ValuesOf::Mesh:
      return {BALLOT_OF_MESH, false};
    default:
      return {BALLOT_OF_VERTICES, of == ValuesOf::NearVertex};
  }
}

}  // namespace ballot::api
