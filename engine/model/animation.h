// Animations of a scene: nodes, key frames, and the vertices, lights and views that follow the nodes. A scene that does
// not move has none. No Vulkan.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ballot {

/// The transform of a node to its parent: translation * rotation * scale, or a matrix.
struct NodeTransform {
  glm::dvec3 translation{0};
  glm::dvec4 rotation{0, 0, 0, 1};  // quaternion x, y, z, w, of any length; of length zero: none
  glm::dvec3 scale{1};
  std::optional<glm::dmat4> matrix = {};  // in place of the three
};
glm::dmat4 matrix_of(const NodeTransform& transform);

/// A node of the scene file.
struct MovingNode {
  int parent = -1;  // -1: none
  NodeTransform rest = {};
  std::vector<float> weights = {};  // of the morph targets of its mesh, at rest
};

enum class Interpolation : std::uint8_t { Linear, Step, CubicSpline };

/// Key frames. At least one.
struct Keys {
  Interpolation interpolation = Interpolation::Linear;
  std::size_t width = 0;           // numbers of a value
  std::vector<float> times = {};   // seconds, strictly increasing
  std::vector<float> values = {};  // width for each key; CubicSpline: in-tangents, values, out-tangents for each key

  /// Writes the value at a time to `out`, `width` numbers. Before the first and behind the last key the value is
  /// theirs. Linear rotations turn by the shorter way at constant speed (slerp). Formulas: glTF 2.0, appendix C.
  void sample(double seconds, bool rotation, std::span<double> out) const;
};

enum class ChannelPath : std::uint8_t { Translation, Rotation, Scale, Weights };

/// What key frames move. If two channels of a clip move the same, the later one does.
struct AnimationChannel {
  std::uint32_t node = 0, sampler = 0;
  ChannelPath path = ChannelPath::Translation;
};

/// An animation of a scene file. Time runs from 0.
struct AnimationClip {
  std::string name;
  std::vector<Keys> samplers = {};
  std::vector<AnimationChannel> channels = {};
  double seconds = 0;  // of the last key
};

/// The joints that move the vertices of a skinned mesh.
struct Skin {
  std::vector<std::uint32_t> joints;        // nodes
  std::vector<glm::dmat4> joint_from_mesh;  // the inverse bind matrices
};

/// The weight of a joint for a vertex. The weights of a vertex add up to 1.
struct Influence {
  std::uint32_t joint = 0;
  float weight = 0;
};

/// What a morph target adds to a vertex at weight 1.
struct MorphDelta {
  glm::vec3 position{0}, normal{0};
};

/// A mesh that moves. The numbers are places in the arrays of MovingVertices.
struct MovingMesh {
  std::uint32_t first_vertex = 0, vertices = 0;
  std::uint32_t first_corner = 0, triangles = 0;
  std::uint32_t first_influence = 0, influences = 0;  // of each vertex; 0: not skinned
  std::uint32_t first_delta = 0, targets = 0;         // deltas lie target by target
};

/// The vertices of all meshes that move, in the space of their mesh.
struct MovingVertices {
  std::vector<MovingMesh> meshes;
  std::vector<glm::vec3> positions, normals;  // of each vertex; a normal is of unit length, or zero: there is none
  std::vector<std::uint32_t> corners;         // three for each triangle, vertices of the mesh counted from 0
  std::vector<Influence> influences;
  std::vector<MorphDelta> deltas;
};

/// A mesh that a node places, whose triangles follow it.
struct MovingPart {
  std::uint32_t mesh = 0, node = 0;
  std::optional<std::uint32_t> skin = {};
  glm::dmat4 node_from_mesh{1};    // of an instance
  std::size_t first_triangle = 0;  // of the scene
  std::vector<float> pull = {};    // of each joint of the skin: the sum of its weights
  /// Deformed parts, which have a skin or morph targets, are posed vertex by vertex in float32. These are their places
  /// in the arrays of PoseInput and in the posed vertices.
  bool deforms = false;
  std::uint32_t first_posed = 0, first_matrix = 0, first_weight = 0;
};

/// An instance of a scene that follows a node.
struct MovingPlacement {
  std::uint32_t placement = 0, node = 0;
  glm::dmat4 node_from_mesh{1};              // of an instance of the node
  std::array<std::uint32_t, 2> meshes = {};  // of the scene: as in the file, and turned for matrices that mirror
};

/// All that moves in a scene.
struct Animation {
  std::vector<AnimationClip> clips;
  std::vector<MovingNode> nodes;     // as in the file
  std::vector<std::uint32_t> order;  // of the nodes: parents before their children
  std::vector<Skin> skins;
  MovingVertices vertices;
  std::vector<MovingPart> parts;
  std::vector<MovingPlacement> placements;
  std::uint32_t posed_vertices = 0, matrices = 0, weights = 0;  // of all deformed parts
};

/// The state of all nodes at a time.
struct NodePose {
  std::vector<glm::dmat4> world_from_node;
  std::vector<std::vector<float>> weights;  // of morph targets
};

/// Returns the state of the nodes at a time of a clip. Times outside [0, seconds] mean the nearest inside. Null: at
/// rest, as the file gives the nodes.
NodePose pose_nodes(const Animation& animation, const AnimationClip* clip, double seconds);

/// Returns the index of the clip of this name, or of this number if no clip has it as its name. Throws
/// Error(Arguments) that lists the clips. `scene` is named in errors. Null is an animation without clips.
std::size_t find_clip(const Animation* animation, std::string_view name, std::string_view scene);

/// Returns the time in [0, clip.seconds] that is nearest. Throws Error(Arguments) if the time is not finite.
double clamped_time(const AnimationClip& clip, double seconds);

}  // namespace ballot
