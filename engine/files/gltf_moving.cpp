#include "engine/files/gltf_moving.h"

#include <algorithm>
#include <cmath>

#include "engine/files/gltf_animation.h"
#include "engine/files/gltf_convert.h"
#include "engine/files/loaders.h"
#include "engine/model/placing.h"

namespace ballot {
namespace {

constexpr std::size_t kMostRecords = std::size_t{1}
                                     << 28;  // of all moving vertices; as kMaxTriangles, a bound on memory

/// Returns the weights of a node's morph targets at rest.
std::vector<float> rest_weights(const GltfFile& file, std::size_t index) {
  const tinygltf::Node& node = file.model.nodes[index];
  if (node.mesh < 0 || static_cast<std::size_t>(node.mesh) >= file.model.meshes.size()) return {};
  const tinygltf::Mesh& mesh = file.model.meshes[static_cast<std::size_t>(node.mesh)];
  const std::string place = label("mesh", static_cast<std::size_t>(node.mesh), mesh.name);
  std::size_t targets = 0;
  for (const tinygltf::Primitive& p : mesh.primitives) targets = std::max(targets, p.targets.size());
  for (std::size_t i = 0; i < mesh.primitives.size(); ++i)
    if (mesh.primitives[i].targets.size() != targets)
      refuse("{} primitive {} has {} morph targets, but another has {}; expected as many", place, i,
             mesh.primitives[i].targets.size(), targets);
  const std::vector<double>& given = node.weights.empty() ? mesh.weights : node.weights;
  if (!given.empty() && given.size() != targets)
    refuse("{} has {} weights for the {} morph targets of {}; expected as many", label("node", index, node.name),
           given.size(), targets, place);
  std::vector<float> weights(targets);
  std::ranges::transform(given, weights.begin(), [](double w) { return static_cast<float>(w); });
  return weights;
}

std::vector<std::uint32_t> parents_first(const GltfFile& file, const std::vector<int>& parents) {
  std::vector<std::uint32_t> order;
  for (std::size_t i = 0; i < parents.size(); ++i)
    if (parents[i] == -1) order.push_back(static_cast<std::uint32_t>(i));
  for (std::size_t i = 0; i < order.size(); ++i)
    for (const int child : file.model.nodes[order[i]].children) order.push_back(static_cast<std::uint32_t>(child));
  return order;
}

Skin read_skin(const GltfFile& file, std::size_t index) {
  const tinygltf::Skin& from = file.model.skins[index];
  const std::string place = label("skin", index, from.name);
  if (from.joints.empty()) refuse("{} has no joints; expected one at least", place);
  Skin to;
  for (const int joint : from.joints) to.joints.push_back(static_cast<std::uint32_t>(checked_node(file, joint, place)));
  to.joint_from_mesh.assign(to.joints.size(), glm::dmat4{1});
  if (from.inverseBindMatrices == -1) return to;
  const AccessorView view = open_matrices(file, from.inverseBindMatrices, place + " inverseBindMatrices");
  if (view.size() < to.joints.size())
    refuse("{} has {} joints, but {} inverse bind matrices; expected as many", place, to.joints.size(), view.size());
  for (std::size_t j = 0; j < to.joints.size(); ++j)
    for (std::size_t e = 0; e < 16; ++e) {
      const double value = view.component(j, e);
      if (!std::isfinite(value))
        refuse("{} has {} in the inverse bind matrix of joint {}; expected finite numbers", place, value, j);
      to.joint_from_mesh[j][static_cast<int>(e / 4)][static_cast<int>(e % 4)] = value;
    }
  return to;
}

/// Reads the vertices of primitives into the arrays of an animation, each once.
class MovingReader {
 public:
  MovingReader(const GltfFile& file, Animation& to) : file_(file), to_(to), all_(to.vertices) {}

  /// Returns the number of the primitive's mesh in `all`. `with_joints`: JOINTS and WEIGHTS are read too.
  std::uint32_t mesh_of(const OpenPrimitive& primitive, bool with_joints) {
    const auto [entry, fresh] = meshes_.try_emplace({&primitive, with_joints}, all_.meshes.size());
    if (fresh) {
      MovingMesh mesh;
      read_vertices(primitive, mesh);
      if (with_joints) read_influences(primitive, mesh);
      read_targets(primitive, mesh);
      all_.meshes.push_back(mesh);
    }
    return static_cast<std::uint32_t>(entry->second);
  }

  /// Checks the joints of a mesh against a skin that it is used with. Returns MovingPart::pull.
  std::vector<float> checked_pull(const OpenPrimitive& primitive, const MovingMesh& mesh, std::size_t skin) const {
    std::vector<float> pull(to_.skins[skin].joints.size());
    for (std::size_t i = 0; i < std::size_t{mesh.vertices} * mesh.influences; ++i) {
      const Influence& influence = all_.influences[mesh.first_influence + i];
      if (influence.joint >= pull.size())
        refuse("{} vertex {} names joint {}, but {} has {}", primitive.place, i / mesh.influences, influence.joint,
               label("skin", skin, file_.model.skins[skin].name), pull.size());
      pull[influence.joint] += influence.weight;
    }
    return pull;
  }

 private:
  const tinygltf::Primitive& source(const OpenPrimitive& p) const {
    return file_.model.meshes[p.mesh].primitives[p.primitive];
  }

  template <class T>
  std::uint32_t room(const std::vector<T>& array, std::size_t more) const {
    if (array.size() + more > kMostRecords)
      refuse("its moving meshes have more than {} vertices, joints or morph deltas; use a smaller scene", kMostRecords);
    return static_cast<std::uint32_t>(array.size());
  }

  void read_vertices(const OpenPrimitive& p, MovingMesh& mesh) {
    mesh.first_vertex = room(all_.positions, p.positions.size());
    mesh.vertices = static_cast<std::uint32_t>(p.positions.size());
    for (std::size_t i = 0; i < p.positions.size(); ++i) {
      all_.positions.push_back(glm::vec3(p.positions.vec3(i)));
      all_.normals.push_back(p.normals ? unit_or_zero(p.normals->vec3(i)) : glm::vec3{0});
    }
    mesh.first_corner = room(all_.corners, 3 * p.triangle_count);
    mesh.triangles = static_cast<std::uint32_t>(p.triangle_count);
    for (std::size_t i = 0; i < p.triangle_count; ++i)
      for (const std::size_t corner : primitive_corners(p, i))
        all_.corners.push_back(static_cast<std::uint32_t>(corner));
  }

  AccessorView open_set(const OpenPrimitive& p, const std::string& name, bool joints) const {
    const auto& attributes = source(p).attributes;
    const auto found = attributes.find(name);
    if (found == attributes.end())
      refuse("{} is used with a skin, but has no {}; expected JOINTS and WEIGHTS", p.place, name);
    const std::string place = p.place + " " + name;
    AccessorView view = joints ? open_joints(file_, found->second, place) : open_weights(file_, found->second, place);
    if (view.size() < mesh_vertices(p))
      refuse("{} has {} elements for {} vertices; expected as many", place, view.size(), mesh_vertices(p));
    return view;
  }
  static std::size_t mesh_vertices(const OpenPrimitive& p) { return p.positions.size(); }

  void read_influences(const OpenPrimitive& p, MovingMesh& mesh) {
    std::vector<AccessorView> joints, weights;
    for (std::size_t set = 0; set == 0 || source(p).attributes.contains(fmt::format("JOINTS_{}", set)); ++set) {
      joints.push_back(open_set(p, fmt::format("JOINTS_{}", set), true));
      weights.push_back(open_set(p, fmt::format("WEIGHTS_{}", set), false));
    }
    mesh.influences = static_cast<std::uint32_t>(4 * joints.size());
    mesh.first_influence = room(all_.influences, std::size_t{mesh.vertices} * mesh.influences);
    for (std::size_t v = 0; v < mesh.vertices; ++v) {
      double sum = 0;
      for (const AccessorView& w : weights)
        for (std::size_t c = 0; c < 4; ++c) {
          if (!(w.component(v, c) >= 0) || !std::isfinite(w.component(v, c)))
            refuse("{} vertex {} has the joint weight {}; expected a finite number, not below 0", p.place, v,
                   w.component(v, c));
          sum += w.component(v, c);
        }
      for (std::size_t set = 0; set < joints.size(); ++set)
        for (std::size_t c = 0; c < 4; ++c) {
          const double weight = weights[set].component(v, c);
          const bool alone = sum == 0 && set == 0 && c == 0;  // a vertex without weights follows its first joint
          const std::uint32_t joint = static_cast<std::uint32_t>(joints[set].component(v, c));
          all_.influences.push_back(weight > 0 ? Influence{joint, static_cast<float>(weight / sum)}
                                               : Influence{alone ? joint : 0, alone ? 1.0f : 0.0f});
        }
    }
  }

  std::optional<AccessorView> open_delta(const OpenPrimitive& p, std::size_t target, const char* name) const {
    const auto& attributes = source(p).targets[target];
    const auto found = attributes.find(name);
    if (found == attributes.end()) return std::nullopt;
    const std::string place = fmt::format("{} morph target {} {}", p.place, target, name);
    AccessorView view = open_positions(file_, found->second, place);
    if (view.size() < mesh_vertices(p))
      refuse("{} has {} elements for {} vertices; expected as many", place, view.size(), mesh_vertices(p));
    return view;
  }

  void read_targets(const OpenPrimitive& p, MovingMesh& mesh) {
    mesh.targets = static_cast<std::uint32_t>(source(p).targets.size());
    mesh.first_delta = room(all_.deltas, std::size_t{mesh.targets} * mesh.vertices);
    for (std::size_t k = 0; k < mesh.targets; ++k) {
      const auto positions = open_delta(p, k, "POSITION"), normals = open_delta(p, k, "NORMAL");
      for (std::size_t v = 0; v < mesh.vertices; ++v) {
        MorphDelta delta;
        if (positions) delta.position = glm::vec3(positions->vec3(v));
        if (normals && p.normals) delta.normal = glm::vec3(normals->vec3(v));
        for (int axis = 0; axis < 3; ++axis)
          if (!std::isfinite(delta.position[axis]) || !std::isfinite(delta.normal[axis]))
            refuse("{} morph target {} vertex {} is not finite; expected finite numbers", p.place, k, v);
        all_.deltas.push_back(delta);
      }
    }
  }

  const GltfFile& file_;
  Animation& to_;
  MovingVertices& all_;
  std::map<std::pair<const OpenPrimitive*, bool>, std::size_t> meshes_;
};

/// Returns the skin of a node that places a primitive.
std::optional<std::uint32_t> skin_of(GltfFile& file, const PlacedPrimitive& p) {
  const tinygltf::Node& node = file.model.nodes[p.node];
  if (node.skin == -1) return std::nullopt;
  const std::string place = label("node", p.node, node.name);
  if (node.skin < 0 || static_cast<std::size_t>(node.skin) >= file.model.skins.size())
    refuse("{} names skin {}, but the file has {}", place, node.skin, file.model.skins.size());
  if (p.instanced) refuse("{} has a skin and EXT_mesh_gpu_instancing; expected one of them", place);
  return static_cast<std::uint32_t>(node.skin);
}

/// Returns true for each node, and those below it, of a channel for which is(clip, channel) is true.
template <class Is>
std::vector<bool> at_and_below(const Animation& animation, const Is& is) {
  std::vector<bool> marked(animation.nodes.size());
  for (const AnimationClip& clip : animation.clips)
    for (const AnimationChannel& c : clip.channels)
      if (is(clip, c)) marked[c.node] = true;
  for (const std::uint32_t i : animation.order)
    if (const int parent = animation.nodes[i].parent; parent >= 0 && marked[static_cast<std::size_t>(parent)])
      marked[i] = true;
  return marked;
}

}  // namespace

bool may_move(const GltfFile& file) {
  const tinygltf::Model& m = file.model;
  return !m.animations.empty() || !m.skins.empty() || std::ranges::any_of(m.meshes, [](const tinygltf::Mesh& mesh) {
    return std::ranges::any_of(mesh.primitives, [](const tinygltf::Primitive& p) { return !p.targets.empty(); });
  });
}

Animation read_animation(GltfFile& file, const std::vector<int>& parents) {
  Animation to;
  for (std::size_t i = 0; i < parents.size(); ++i)
    to.nodes.push_back({parents[i], node_transform(file, i), rest_weights(file, i)});
  to.order = parents_first(file, parents);
  read_clips(file, to);
  return to;
}

std::vector<bool> moving_nodes(const Animation& animation) {
  return at_and_below(animation,
                      [](const AnimationClip&, const AnimationChannel& c) { return c.path != ChannelPath::Weights; });
}

std::vector<bool> turning_nodes(const Animation& animation) {
  return at_and_below(animation, [&](const AnimationClip& clip, const AnimationChannel& c) {
    const glm::dvec3& rest = animation.nodes[c.node].rest.scale;
    const Keys& keys = clip.samplers[c.sampler];
    return c.path == ChannelPath::Scale &&
           (std::min({rest.x, rest.y, rest.z}) < 0 || std::ranges::min(keys.values) < 0 ||
            keys.interpolation == Interpolation::CubicSpline);  // which may overshoot
  });
}

std::vector<bool> read_moving(GltfFile& file, const std::vector<PlacedPrimitive>& placed, Animation& to) {
  for (std::size_t i = 0; i < file.model.skins.size(); ++i) to.skins.push_back(read_skin(file, i));
  const std::vector<bool> moves = moving_nodes(to);
  std::vector<bool> turned;
  MovingReader reader(file, to);
  for (const PlacedPrimitive& p : placed) {
    const auto skin = skin_of(file, p);
    const bool morphs = !to.nodes[p.node].weights.empty();
    if (!skin && !morphs && !moves[p.node]) continue;
    MovingPart part{.mesh = reader.mesh_of(*p.primitive, skin.has_value()),
                    .node = static_cast<std::uint32_t>(p.node),
                    .skin = skin,
                    .node_from_mesh = p.node_from_mesh,
                    .first_triangle = p.first_triangle,
                    .deforms = skin || morphs};
    const MovingMesh& mesh = to.vertices.meshes[part.mesh];
    if (skin) part.pull = reader.checked_pull(*p.primitive, mesh, *skin);
    if (part.deforms) {
      part.first_posed = to.posed_vertices;
      part.first_matrix = to.matrices;
      part.first_weight = to.weights;
      if (std::size_t{to.posed_vertices} + mesh.vertices > kMostRecords)
        refuse("its nodes place more than {} moving vertices; use a smaller scene", kMostRecords);
      to.posed_vertices += mesh.vertices;
      to.matrices += static_cast<std::uint32_t>(skin ? to.skins[*skin].joints.size() : 1);
      to.weights += mesh.targets;
    }
    to.parts.push_back(part);
    turned.push_back(p.turned);
  }
  return turned;
}

}  // namespace ballot
