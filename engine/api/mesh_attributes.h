// Attributes of a caller's meshes: checked, and put on the device.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/api/state.h"

namespace ballot::api {

/// Throws Refused, which begins with `where`, unless there can be so many structs one after the other.
void check_attribute_count(const BallotMesh& m, const std::string& where);
/// Returns attribute number i of a mesh. Field `size` of the first tells how large each is.
BallotAttribute attribute_struct(const BallotMesh& m, std::size_t i);

/// Checks an attribute of a mesh and puts its values on the device, which is held. `from`: its array there; null: it
/// names none. Throws Refused, which begins with `where`.
MeshAttribute read_attribute(const BallotAttribute& a, BufferState* from, const MeshState& mesh,
                             const SceneState& scene, const std::string& where);
/// The same for all of a mesh. Throws Refused, too, if two have one name.
std::vector<MeshAttribute> read_attributes(const BallotMesh& m, std::span<const std::shared_ptr<BufferState>> from,
                                           const MeshState& mesh, const SceneState& scene, const std::string& where);

/// Adds an attribute, in the place of one of its name. Values that fit are copied over those of before: returns false
/// then.
bool put_attribute(std::vector<MeshAttribute>& to, MeshAttribute attribute);
/// Gives meshes of the scene those that edits have for them.
void take_attributes(SceneState& scene, PendingEdits& edits);

/// Throws Refused, which begins with `where`, unless the attributes that a mesh gets have as many components as those
/// of their names that the scene's other meshes will have once its edits are made.
void check_components(const SceneState& scene, std::uint32_t mesh, std::span<const MeshAttribute> attributes,
                      const std::string& where);

/// Returns an attribute of this name, of some mesh; null if none has it. The device is held.
const MeshAttribute* find_attribute(const SceneState& scene, std::string_view name);
/// Returns the names of all, separated by commas; "none" if there is none.
std::string attribute_names(const SceneState& scene);

/// What a caller is told that the values of an attribute are of.
struct ToldValuesOf {
  BallotValuesOf of;
  bool nearest;
};
ToldValuesOf told_of(ValuesOf of);

}  // namespace ballot::api
