// Edits of a scene that wait for a commit.
#pragma once

#include <functional>

#include "engine/api/origins.h"

namespace ballot::api {

/// Returns the edits of a scene, to which a call adds some. `needs_scene`: they look at the scene, which is brought up
/// to date then. `beside`: transforms on the device may be among them. Throws Refused if the scene cannot be edited.
PendingEdits& edits_of(SceneState& scene, const char* call, bool needs_scene = true, bool beside = false);

/// Returns what is known of a mesh, as the edits leave it. Throws Error(Arguments) if there is no such mesh.
const MeshState& mesh_of(const SceneState& scene, std::uint32_t mesh);

/// Has edits move the vertices of a mesh to what make(its state) returns, which runs while the device is held.
BallotStatus move_mesh(BallotScene* scene, std::uint32_t mesh, const char* doing,
                       const std::function<PendingEdits::Vertices(const MeshState&)>& make);

/// Throws Error(Arguments) unless there is an instance for each number, and each is named once.
void check_numbers(const SceneEdits& edits, std::span<const std::uint32_t> instances);

/// Throws Refused unless as many vertices move as the mesh has.
void check_vertex_count(const MeshState& mesh, std::size_t count, std::uint32_t number);

/// Returns vertices that move, counted from the origin of their mesh: in float32, or in double.
PendingEdits::Vertices vertices_about(const MeshState& mesh, const float* positions, const double* in_double,
                                      std::size_t count, std::size_t stride, std::uint32_t number);

/// Returns true if the scene or one of its meshes has an origin.
bool has_origins(const SceneState& scene);

/// Adds to the edits that instances move: those of these numbers, or without numbers all. matrix(i) returns the matrix
/// of each, which is counted from the origins. Throws Error(Arguments) as SceneEdits does.
void set_transforms_about(SceneState& scene, const std::uint32_t* instances, std::size_t count,
                          const std::function<MatrixInDouble(std::size_t)>& matrix);

/// Makes `edits` true, which were the scene's: they are gone, whatever follows. The device is held. Throws as
/// DeviceScene::commit() does; the scene is then as it was.
void commit(SceneState& scene, PendingEdits& edits);

}  // namespace ballot::api
