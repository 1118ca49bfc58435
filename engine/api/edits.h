// Edits of a scene that wait for a commit.
#pragma once

#include "engine/api/state.h"

namespace ballot::api {

/// Returns the edits of a scene, to which a call adds some. `needs_scene`: they look at the scene, which is brought up
/// to date then. `beside`: transforms on the device may be among them. Throws Refused if the scene cannot be edited.
PendingEdits& edits_of(SceneState& scene, const char* call, bool needs_scene = true, bool beside = false);

/// Returns what is known of a mesh, as the edits leave it. Throws Error(Arguments) if there is no such mesh.
const MeshState& mesh_of(const SceneState& scene, std::uint32_t mesh);

/// Makes `edits` true, which were the scene's: they are gone, whatever follows. The device is held. Throws as
/// DeviceScene::commit() does; the scene is then as it was.
void commit(SceneState& scene, PendingEdits& edits);

}  // namespace ballot::api
