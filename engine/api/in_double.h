// Numeric mode "double" of a scene's handle: its vertices in double, and what the host answers by them.
#pragma once

#include "engine/api/arrays.h"
#include "engine/oracle/in_double.h"

namespace ballot::api {

/// Returns true if a query asks for numeric mode double.
bool is_double(const BallotQuery& query);

/// Returns true if float32 rounds a triangle of a mesh flat that has an area by its vertices in double. Null: false.
bool rounds_flat(MeshState& mesh, const VerticesInDouble& vertices);

/// Gives the tree of a scene its vertices in double, if it has some that float32 does not hold.
void take_doubles(SceneState& scene);
/// To be called before triangles change.
void forget_doubles(SceneState& scene);

/// Returns the corners of a triangle in double, where its instance places it, about the scene's origin.
CornersInDouble corners_of(const SceneState& scene, std::uint32_t prim);

/// Find crossings in double, by the host's cores: of each ray all or the first `query.most`, which are passed on as
/// lists, or as rows of `most`, filled up with misses. Throw Refused for scenes with instances or shapes, and for
/// alpha.
TraceTimes list_in_double(SceneState& scene, const RayArray& rays, const RowOrder& order, const CrossingQuery& query,
                          Watch& watch, const TakeLists& take);
TraceTimes first_in_double(SceneState& scene, const RayArray& rays, const CrossingQuery& query, Watch& watch,
                           const TakeFirst& take);

/// Find the nearest points, and what is inside, in double by the host's cores. Throw as list_in_double().
TraceTimes nearest_in_double(SceneState& scene, const PointArray& points, Watch& watch,
                             const std::function<void(std::uint64_t first, std::span<const Nearest>)>& take);
TraceTimes inside_in_double(SceneState& scene, const PointArray& points, Watch& watch,
                            const std::function<void(std::uint64_t first, std::span<const std::uint32_t>)>& take);

}  // namespace ballot::api
