#include "engine/render/data/light_data.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include "engine/model/instances.h"

namespace ballot {

namespace {

glm::uvec4 texel(float x, float y, float z, float w) {
  return {std::bit_cast<std::uint32_t>(x), std::bit_cast<std::uint32_t>(y), std::bit_cast<std::uint32_t>(z),
          std::bit_cast<std::uint32_t>(w)};
}

glm::uvec4 texel(const glm::vec3& c, std::uint32_t w) { return texel(c.r, c.g, c.b, std::bit_cast<float>(w)); }

/// Returns the cumulative distribution of the weights; the last entry is 1. If all weights are 0, the distribution is
/// uniform.
std::vector<float> shares_of(std::span<const double> weights) {
  double sum = 0;
  for (const double w : weights) sum += w;
  std::vector<float> shares;
  double part = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    part += sum > 0 ? weights[i] / sum : 1.0 / double(weights.size());
    shares.push_back(float(std::min(part, 1.0)));
  }
  if (!shares.empty()) shares.back() = 1;
  return shares;
}

}  // namespace

float luminance(const glm::vec3& c) { return 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b; }

EmitterTable emitter_table(const Scene& scene, std::span<const float> emitted) {
  EmitterTable table;
  double sum = 0;
  const auto is_shape = [](const Scene& s, std::size_t placement) {
    return s.instanced() &&
           s.instances.mesh_labels[s.instances.placements[placement].mesh].kind != ShapeKind::Triangles;
  };
  const auto emits = [&](std::uint32_t material) { return emitted[material] > 0; };
  if (scene.material_of.empty() ? !emits(0) : std::ranges::none_of(scene.material_of, emits)) return table;
  for_each_triangle(scene, [&](std::size_t placement, std::size_t i, std::uint32_t prim) {
    if (!emits(scene.material(i)) || is_shape(scene, placement)) return;
    const Triangle t = scene.instanced() ? moved(scene.triangles[i], scene.instances.placements[placement].transform)
                                         : scene.triangles[i];
    const glm::dvec3 a(t[0]);
    const double area = 0.5 * glm::length(glm::cross(glm::dvec3(t[1]) - a, glm::dvec3(t[2]) - a));
    if (!(area > 0)) return;
    sum += emitted[scene.material(i)] * area;
    table.texels.push_back({prim, std::bit_cast<std::uint32_t>(float(sum)), 0, 0});
  });
  table.total = float(sum);
  return table;
}

std::vector<GpuLight> gpu_lights(const Scene& scene) {
  std::vector<GpuLight> lights;
  for (const Light& l : scene.lights)
    lights.push_back({l.position, std::uint32_t(l.kind), l.direction, l.range, l.intensity, std::cos(l.inner_angle),
                      std::cos(l.outer_angle)});
  return lights;
}

std::vector<glm::uvec4> sky_texels(const Sky& sky) {
  if (sky.kind == Sky::Kind::None)
    return std::vector<glm::uvec4>(3, glm::uvec4(0));  // kernels with every feature read black
  std::vector<glm::uvec4> texels{texel(sky.zenith, sky.width), texel(sky.horizon, sky.height), texel(sky.ground, 0)};
  std::vector<double> rows;
  for (std::uint32_t y = 0; y < sky.height; ++y) {
    const std::span<const glm::vec3> row(sky.map.data() + std::size_t(y) * sky.width, sky.width);
    std::vector<double> weights;
    double sum = 0;
    for (const glm::vec3& c : row) sum += weights.emplace_back(luminance(c));
    const std::vector<float> shares = shares_of(weights);
    for (std::uint32_t x = 0; x < sky.width; ++x) texels.push_back(texel(row[x].r, row[x].g, row[x].b, shares[x]));
    const double pi = glm::pi<double>();
    rows.push_back(sum * (std::cos(pi * y / sky.height) - std::cos(pi * (y + 1) / sky.height)));
  }
  for (const float share : shares_of(rows)) texels.push_back(texel(share, 0, 0, 0));
  return texels;
}

}  // namespace ballot
