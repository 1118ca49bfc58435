// Attributes of the meshes of a scene in the C interface: given, told, read back.
#include "engine/api/edits.h"
#include "engine/api/mesh_attributes.h"

namespace ballot::api {
namespace {

/// Returns an attribute of a mesh by its place among those of the mesh.
const MeshAttribute& attribute_at(const SceneState& scene, std::uint32_t mesh, std::size_t place) {
  const auto found = scene.meshes.find(mesh);
  if (found == scene.meshes.end()) refuse(fmt::format("mesh {}: the scene has none of this number", mesh));
  const std::vector<MeshAttribute>& all = found->second.attributes;
  if (place >= all.size()) refuse(fmt::format("mesh {}: attribute at place {}: it has {}", mesh, place, all.size()));
  return all[place];
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_scene_set_attribute(BallotScene* scene, uint32_t mesh, const BallotAttribute* attribute) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(attribute, "ballot_scene_set_attribute", "attribute");
    const BallotAttribute a = read_struct(attribute, "BallotAttribute");
    const auto from = a.buffer ? ballot::api::use(a.buffer) : nullptr;
    const DeviceUse use(*state->device);
    PendingEdits& edits = edits_of(*state, "setting an attribute", false, true);
    const std::string where = fmt::format("mesh {}", mesh);
    ballot::MeshAttribute made = read_attribute(a, from.get(), mesh_of(*state, mesh), *state, where);
    check_components(*state, mesh, {&made, 1}, where);
    const auto fresh = edits.meshes.find(mesh);
    put_attribute(fresh != edits.meshes.end() ? fresh->second.attributes : edits.attributes[mesh], std::move(made));
  });
}

BallotStatus ballot_scene_attribute(BallotScene* scene, uint32_t mesh, size_t place, BallotAttributeInfo* info) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(info, "ballot_scene_attribute", "info");
    const DeviceHold hold(*state->device);
    const ballot::MeshAttribute& a = attribute_at(*state, mesh, place);
    BallotAttributeInfo i = BALLOT_INIT(BallotAttributeInfo);
    write_name(i.name, a.name);
    i.of = told_of(a.of).of, i.nearest = told_of(a.of).nearest;
    i.components = a.components, i.count = a.count;
    write_struct(info, i, "BallotAttributeInfo");
  });
}

BallotStatus ballot_scene_attribute_values(BallotScene* scene, uint32_t mesh, size_t place, float* values) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(values, "ballot_scene_attribute_values", "values");
    const DeviceHold hold(*state->device);
    const ballot::MeshAttribute& a = attribute_at(*state, mesh, place);
    a.values->download({values, a.numbers()}, a.first);
  });
}
