#include "engine/model/pose.h"

#include <cmath>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/model/instances.h"
#include "engine/model/placing.h"

namespace ballot {
namespace {

constexpr std::size_t kChunk = 1 << 12;

bool is_finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

PoseMatrix rows_of(const glm::dmat4& m) {
  PoseMatrix rows{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      rows[static_cast<std::size_t>(4 * row + column)] = static_cast<float>(m[column][row]);
  return rows;
}

/// Returns the sum of the joints' matrices by their weights.
PoseMatrix blended(const PoseMatrix* matrices, std::span<const Influence> influences) {
  if (influences.empty()) return matrices[0];
  PoseMatrix m{};
  for (std::size_t e = 0; e < m.size(); ++e) m[e] = influences[0].weight * matrices[influences[0].joint][e];
  for (const Influence& i : influences.subspan(1))
    for (std::size_t e = 0; e < m.size(); ++e) m[e] = m[e] + i.weight * matrices[i.joint][e];
  return m;
}

glm::vec3 moved_point(const PoseMatrix& m, const glm::vec3& p) {
  return {((m[0] * p.x + m[1] * p.y) + m[2] * p.z) + m[3], ((m[4] * p.x + m[5] * p.y) + m[6] * p.z) + m[7],
          ((m[8] * p.x + m[9] * p.y) + m[10] * p.z) + m[11]};
}

glm::vec3 cross(const glm::vec3& a, const glm::vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

float dot(const glm::vec3& a, const glm::vec3& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }

/// Moves a normal by the cofactors of a matrix, with the sign of its determinant.
glm::vec3 moved_normal(const PoseMatrix& m, const glm::vec3& n) {
  const glm::vec3 x{m[0], m[1], m[2]}, y{m[4], m[5], m[6]}, z{m[8], m[9], m[10]};
  const glm::vec3 cx = cross(y, z), cy = cross(z, x), cz = cross(x, y);
  const glm::vec3 moved{dot(cx, n), dot(cy, n), dot(cz, n)};
  return dot(x, cx) < 0 ? -moved : moved;
}

void pose_part(const Animation& animation, const MovingPart& part, const PoseInput& input,
               std::span<PosedVertex> posed) {
  const MovingVertices& all = animation.vertices;
  const MovingMesh& mesh = all.meshes[part.mesh];
  const std::uint32_t influences = part.skin ? mesh.influences : 0;
  for_chunks(mesh.vertices, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      glm::vec3 p = all.positions[mesh.first_vertex + v], n = all.normals[mesh.first_vertex + v];
      for (std::uint32_t k = 0; k < mesh.targets; ++k) {
        const float weight = input.weights[part.first_weight + k];
        const MorphDelta& d = all.deltas[mesh.first_delta + std::size_t{k} * mesh.vertices + v];
        p = p + weight * d.position;
        n = n + weight * d.normal;
      }
      const PoseMatrix m =
          blended(&input.matrices[part.first_matrix],
                  std::span(all.influences).subspan(mesh.first_influence + v * influences, influences));
      posed[part.first_posed + v] = {moved_point(m, p), moved_normal(m, n)};
    }
  });
}

/// Places the vertices of a part that moves as a whole.
std::vector<PosedVertex> place_part(const Animation& animation, const MovingPart& part, const NodePose& nodes) {
  const MovingVertices& all = animation.vertices;
  const MovingMesh& mesh = all.meshes[part.mesh];
  const glm::dmat4 world = world_from_mesh(animation, part, nodes, 0);
  const glm::dmat3 turn = normal_matrix(world);
  std::vector<PosedVertex> placed(mesh.vertices);
  for_chunks(mesh.vertices, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v)
      placed[v] = {transform_point(world, glm::dvec3{all.positions[mesh.first_vertex + v]}),
                   unit_or_zero(turn * glm::dvec3{all.normals[mesh.first_vertex + v]})};
  });
  return placed;
}

/// Writes the triangles of a part, whose normals are of unit length or zero, and their normals if the scene has some.
void write_triangles(const Animation& animation, const MovingPart& part, bool turned,
                     std::span<const PosedVertex> vertices, Pose& pose) {
  const MovingMesh& mesh = animation.vertices.meshes[part.mesh];
  for_chunks(mesh.triangles, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t* given = &animation.vertices.corners[mesh.first_corner + 3 * i];
      const std::array<std::uint32_t, 3> corners{given[0], given[turned ? 2 : 1], given[turned ? 1 : 2]};
      Triangle& triangle = pose.triangles[part.first_triangle + i];
      for (std::size_t k = 0; k < 3; ++k) {
        triangle[k] = vertices[corners[k]].position;
        if (!is_finite(triangle[k]))
          fail(Failure::Work, "the pose puts triangle {}, of node {}, at ({}, {}, {}); expected finite numbers",
               part.first_triangle + i, part.node, triangle[k].x, triangle[k].y, triangle[k].z);
      }
      if (pose.normals.empty()) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        glm::vec3 normal = vertices[corners[k]].normal;
        if (normal == glm::vec3{0}) normal = geometric_normal(triangle);
        pose.normals[part.first_triangle + i][k] = normal;
      }
    }
  });
}

void pose_triangles(const Animation& animation, const NodePose& nodes, const VertexPoser& poser, Pose& pose) {
  std::vector<PosedVertex> posed(animation.posed_vertices);
  if (!posed.empty()) {
    const PoseInput input = pose_input(animation, nodes);
    if (poser)
      poser(input, posed);
    else
      pose_vertices(animation, input, posed);
    for_chunks(posed.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) posed[v].normal = unit_or_zero(glm::dvec3{posed[v].normal});
    });
  }
  for (std::size_t i = 0; i < animation.parts.size(); ++i) {
    const MovingPart& part = animation.parts[i];
    if (part.deforms)
      write_triangles(animation, part, pose.turned[i], std::span(posed).subspan(part.first_posed), pose);
    else
      write_triangles(animation, part, pose.turned[i], place_part(animation, part, nodes), pose);
  }
}

/// Exchanges corners 1 and 2 of what triangles have. Returns false if they have none.
template <class Item>
bool turn(std::vector<std::array<Item, 3>>& of, std::size_t first, std::size_t count) {
  for (std::size_t i = first; i < first + count && !of.empty(); ++i) std::swap(of[i][1], of[i][2]);
  return !of.empty();
}

}  // namespace

glm::dmat4 world_from_mesh(const Animation& animation, const MovingPart& part, const NodePose& nodes,
                           std::size_t joint) {
  if (!part.skin) return nodes.world_from_node[part.node] * part.node_from_mesh;
  const Skin& skin = animation.skins[*part.skin];
  return nodes.world_from_node[skin.joints[joint]] * skin.joint_from_mesh[joint];
}

std::vector<bool> turned_parts(const Animation& animation, const NodePose& nodes) {
  std::vector<bool> turned;
  for (const MovingPart& part : animation.parts) {
    const std::size_t joints = part.skin ? animation.skins[*part.skin].joints.size() : 1;
    double pull = 0;  // of joints that do not mirror, less that of those that do
    for (std::size_t j = 0; j < joints; ++j)
      pull += (mirrors(world_from_mesh(animation, part, nodes, j)) ? -1.0 : 1.0) * (part.skin ? part.pull[j] : 1);
    turned.push_back(pull < 0);
  }
  return turned;
}

bool turn_corners(Scene& scene, std::vector<bool>& turned) {
  bool changed = false;
  for (std::size_t p = 0; p < turned.size(); ++p) {
    if (turned[p] == scene.turned[p]) continue;
    const MovingPart& part = scene.animation->parts[p];
    const std::size_t count = scene.animation->vertices.meshes[part.mesh].triangles;
    for (auto& uvs : scene.uvs) changed |= turn(uvs, part.first_triangle, count);
    changed |= turn(scene.colors, part.first_triangle, count);
  }
  scene.turned.swap(turned);
  return changed;
}

PoseInput pose_input(const Animation& animation, const NodePose& nodes) {
  PoseInput input{std::vector<PoseMatrix>(animation.matrices), std::vector<float>(animation.weights)};
  for (const MovingPart& part : animation.parts) {
    if (!part.deforms) continue;
    const std::size_t joints = part.skin ? animation.skins[*part.skin].joints.size() : 1;
    for (std::size_t j = 0; j < joints; ++j)
      input.matrices[part.first_matrix + j] = rows_of(world_from_mesh(animation, part, nodes, j));
    const std::uint32_t targets = animation.vertices.meshes[part.mesh].targets;
    for (std::uint32_t k = 0; k < targets; ++k) input.weights[part.first_weight + k] = nodes.weights[part.node][k];
  }
  return input;
}

void pose_vertices(const Animation& animation, const PoseInput& input, std::span<PosedVertex> posed) {
  for (const MovingPart& part : animation.parts)
    if (part.deforms) pose_part(animation, part, input, posed);
}

PosedCarried pose_carried(const Scene& scene, const NodePose& nodes) {
  PosedCarried carried{.lights = scene.lights, .views = scene.views};
  for (Light& light : carried.lights) {
    if (light.node < 0) continue;
    place_light(light, nodes.world_from_node[static_cast<std::size_t>(light.node)]);
    carried.moves_lights = true;
    if (!is_finite(light.position)) fail(Failure::Work, "the pose puts light '{}' nowhere", light.name);
  }
  for (View& view : carried.views) {
    if (view.node < 0) continue;
    view.world_from_camera = without_scale(nodes.world_from_node[static_cast<std::size_t>(view.node)]);
    if (!is_finite(glm::vec3(view.world_from_camera[3])))
      fail(Failure::Work, "the pose puts camera '{}' nowhere", view.name);
  }
  return carried;
}

namespace {

/// Copies what of the scene's triangles or normals no part moves; into the memory at hand, if it suffices.
template <class Item, class Allocator>
void copy_still(std::span<const Item> from, bool all_move, std::vector<Item, Allocator>& to) {
  to.resize(from.size());
  if (!all_move) copy_parallel(from, std::span<Item>(to));
}

}  // namespace

Pose pose_at(const Scene& scene, const AnimationClip* clip, double seconds, const VertexPoser& poser, Pose room) {
  const Animation& animation = *scene.animation;
  const NodePose nodes = pose_nodes(animation, clip, seconds);
  PosedCarried carried = pose_carried(scene, nodes);
  Pose pose = std::move(room);
  pose.lights = std::move(carried.lights);
  pose.views = std::move(carried.views);
  pose.moves_triangles = !animation.parts.empty();
  pose.turned = turned_parts(animation, nodes);
  pose.moves_lights = carried.moves_lights;
  if (pose.moves_triangles) {
    std::size_t moving = 0;
    for (const MovingPart& part : animation.parts) moving += animation.vertices.meshes[part.mesh].triangles;
    const bool all_move = moving == scene.triangles.size();
    copy_still(std::span(scene.triangles), all_move, pose.triangles);
    copy_still(std::span(scene.normals), all_move, pose.normals);
    pose_triangles(animation, nodes, poser, pose);
  }
  pose.moved.clear();
  for (const MovingPlacement& p : animation.placements) {
    const glm::dmat4 world = nodes.world_from_node[p.node] * p.node_from_mesh;
    pose.moved.push_back({p.placement, {p.meshes[mirrors(world)], transform_of(not_quite_hidden(world))}});
  }
  return pose;
}

void set_pose(Scene& scene, const AnimationClip* clip, double seconds) {
  Pose pose = pose_at(scene, clip, seconds);
  if (pose.moves_triangles) {
    scene.triangles = std::move(pose.triangles);
    scene.normals = std::move(pose.normals);
    turn_corners(scene, pose.turned);
    scene.bounds = bounds_of_vertices(scene.triangles, scene.name);
  }
  for (const Pose::Moved& m : pose.moved) scene.instances.placements[m.placement] = m.to;
  if (scene.instanced()) {
    check_instances(scene);
    check_spreads(scene);
    scene.bounds = bounds_of_instances(scene);
  }
  scene.lights = std::move(pose.lights);
  scene.views = std::move(pose.views);
}

}  // namespace ballot
