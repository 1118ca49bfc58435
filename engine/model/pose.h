// Poses: where the vertices, lights and views of a scene lie at a time of its animation. No Vulkan.
#pragma once

#include <functional>

#include "engine/model/animation.h"
#include "engine/model/scene.h"

namespace ballot {

/// A 3 x 4 matrix in float32, row by row.
using PoseMatrix = std::array<float, 12>;

/// What the vertices of deformed parts are posed by.
struct PoseInput {
  std::vector<PoseMatrix> matrices;  // world_from_mesh of each joint of a part; of the part itself without a skin
  std::vector<float> weights;        // of the morph targets of each part
};
PoseInput pose_input(const Animation& animation, const NodePose& nodes);

/// Returns the matrix from the mesh to the world of a part, or of a joint of its skin.
glm::dmat4 world_from_mesh(const Animation& animation, const MovingPart& part, const NodePose& nodes,
                           std::size_t joint);

/// Returns for each part whether its triangles are mirrored: by the matrix of its node, or by joints of its skin that
/// have more than half of the weight. Corners 1 and 2 of its triangles have changed places then (glTF 2.0, 3.7.4).
std::vector<bool> turned_parts(const Animation& animation, const NodePose& nodes);

/// Makes texture coordinates and colours of a scene follow its triangles, whose parts are `turned` now, and exchanges
/// that with what the scene has. Returns true if any have changed.
bool turn_corners(Scene& scene, std::vector<bool>& turned);

/// A vertex of a part in world space. The normal is of any length; zero: there is none.
struct PosedVertex {
  glm::vec3 position{0}, normal{0};
};

/// Poses the vertices of all deformed parts in float32, on all cores. shaders/pose/ follows this definition: the result
/// has the same bits there, unless some number is denormal. With the matrices M_j and weights w_j of the vertex's
/// joints, and the deltas d_k and weights v_k of the morph targets:
///
///   p = (..(p + v_0 d_0) + v_1 d_1 ..),  M = (..(w_0 M_0 + w_1 M_1) + w_2 M_2 ..) entry by entry,
///   position = ((M_x p.x + M_y p.y) + M_z p.z) + M_t
///
/// where each product and sum is rounded by itself. The normal, n + v_0 e_0 + .., is multiplied likewise by the
/// cofactors of M, with the sign of its determinant.
void pose_vertices(const Animation& animation, const PoseInput& input, std::span<PosedVertex> posed);

/// A function that does the same as pose_vertices(), here or on a device.
using VertexPoser = std::function<void(const PoseInput& input, std::span<PosedVertex> posed)>;

/// The parts of a scene that a pose changes.
struct Pose {
  UnsetVector<Triangle> triangles = {};
  std::vector<std::array<glm::vec3, 3>> normals = {};
  std::vector<Light> lights;
  std::vector<View> views;
  bool moves_triangles = false, moves_lights = false;  // false: they are as before
  std::vector<bool> turned = {};                       // turned_parts()
  /// The instances that moved, and where they lie.
  struct Moved {
    std::uint32_t placement;
    Placement to;
  };
  std::vector<Moved> moved = {};
};

/// Lights and views of a scene in a pose of its nodes.
struct PosedCarried {
  std::vector<Light> lights;
  std::vector<View> views;
  bool moves_lights = false;  // false: they are as before
};
/// Throws Error(Work) if no place is left for a light or a camera.
PosedCarried pose_carried(const Scene& scene, const NodePose& nodes);

/// Returns the scene at a time of a clip; null: at rest. Meshes that move as a whole are transformed in double and
/// rounded once, as load_scene() does, so that they lie where a file without the animation puts them. The scene must
/// have an animation. `room` is a pose whose memory serves again. Throws Error(Work) if a vertex is not finite or no
/// place is left for a camera.
Pose pose_at(const Scene& scene, const AnimationClip* clip, double seconds, const VertexPoser& poser = {},
             Pose room = {});

/// Moves the scene to a time of a clip, before there is a tree of it. Throws as pose_at() does.
void set_pose(Scene& scene, const AnimationClip* clip, double seconds);

}  // namespace ballot
