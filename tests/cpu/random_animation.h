// Skins and morph targets of random numbers, for tests that pose them.
#pragma once

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "engine/model/pose.h"

namespace ballot::test {

/// The sizes of a part. Without joints it has one matrix.
struct RandomPart {
  std::uint32_t vertices = 0, joints = 0, influences = 0, targets = 0;
};

/// Adds a deformed part with a mesh of its own. Numbers are in [-1, 1], weights of joints in [0, 1].
inline void add_random_part(std::mt19937& random, const RandomPart& sizes, Animation& to) {
  std::uniform_real_distribution<float> number(-1, 1);
  const auto vec3 = [&] { return glm::vec3(number(random), number(random), number(random)); };
  const auto place = [](const auto& array) { return static_cast<std::uint32_t>(array.size()); };
  MovingVertices& all = to.vertices;
  to.parts.push_back({.mesh = place(all.meshes),
                      .deforms = true,
                      .first_posed = to.posed_vertices,
                      .first_matrix = to.matrices,
                      .first_weight = to.weights});
  all.meshes.push_back({.first_vertex = place(all.positions),
                        .vertices = sizes.vertices,
                        .first_influence = place(all.influences),
                        .influences = sizes.influences,
                        .first_delta = place(all.deltas),
                        .targets = sizes.targets});
  for (std::uint32_t v = 0; v < sizes.vertices; ++v) {
    all.positions.push_back(vec3());
    all.normals.push_back(glm::normalize(vec3()));
    for (std::uint32_t i = 0; i < sizes.influences; ++i)
      all.influences.push_back({static_cast<std::uint32_t>(random() % sizes.joints), std::abs(number(random))});
  }
  for (std::uint32_t d = 0; d < sizes.vertices * sizes.targets; ++d) all.deltas.push_back({vec3(), 0.2f * vec3()});
  if (sizes.joints > 0) {
    to.parts.back().skin = place(to.skins);
    to.skins.push_back({.joints = std::vector<std::uint32_t>(sizes.joints), .joint_from_mesh = {}});
  }
  to.posed_vertices += sizes.vertices;
  to.matrices += std::max(sizes.joints, 1u);
  to.weights += sizes.targets;
}

/// Returns matrices and weights of numbers in [-1, 1].
inline PoseInput random_input(std::mt19937& random, const Animation& animation) {
  std::uniform_real_distribution<float> number(-1, 1);
  PoseInput input{std::vector<PoseMatrix>(animation.matrices), std::vector<float>(animation.weights)};
  for (PoseMatrix& m : input.matrices)
    for (float& e : m) e = number(random);
  for (float& w : input.weights) w = number(random);
  return input;
}

}  // namespace ballot::test
