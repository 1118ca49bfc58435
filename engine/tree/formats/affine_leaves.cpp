// Converts leaf blocks of vertices to leaf blocks of affine maps.
//
// Sven Woop. A Ray Tracing Hardware Architecture for Dynamic Scenes. Saarland University, 2004.
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "engine/core/error.h"
#include "engine/tree/formats/pair_decode.h"

namespace ballot {
namespace {

using Texel = glm::uvec4;

// Appends the functional p -> row . p + offset, rounded to float32. Returns false if a number is not finite in float32.
bool add_row(const glm::dvec3& row, double offset, std::vector<Texel>& out) {
  const double all[] = {row.x, row.y, row.z, offset};
  Texel texel;
  for (int i = 0; i < 4; ++i) {
    const float rounded = static_cast<float>(all[i]);
    if (!std::isfinite(rounded)) return false;
    texel[i] = std::bit_cast<std::uint32_t>(rounded);
  }
  out.push_back(texel);
  return true;
}

// Appends the rows z, x, y of the affine map that takes the triangle to (0,0,0), (1,0,0), (0,1,0). Appends zeros if
// there is no such map or it does not fit float32.
void add_map(const Triangle& triangle, std::vector<Texel>& out) {
  const glm::dvec3 v0(triangle[0]), e1 = glm::dvec3(triangle[1]) - v0, e2 = glm::dvec3(triangle[2]) - v0;
  const glm::dvec3 n = glm::cross(e1, e2);
  const double nn = glm::dot(n, n), length = std::sqrt(nn);
  const glm::dvec3 z = n / length, x = glm::cross(e2, n) / nn, y = glm::cross(n, e1) / nn;
  const std::size_t begin = out.size();
  const bool fits = nn > 0 && add_row(z, -glm::dot(z, v0), out) && add_row(x, -glm::dot(x, v0), out) &&
                    add_row(y, -glm::dot(y, v0), out);
  if (fits) return;
  out.resize(begin);
  out.resize(begin + TRIANGLE_TEXELS, Texel(0));
}

}  // namespace

std::vector<glm::uvec4> make_affine_leaves(const PairTree& bvh) {
  std::vector<Texel> out, prims;
  out.reserve(bvh.leaves.size() + bvh.leaves.size() / LEAF_HEADER_TEXELS);
  for (std::uint32_t block = 0; block < bvh.leaves.size();) {
    const std::uint32_t count = bvh.leaves[block].w;
    Texel hi = bvh.leaves[block + 1];
    hi.w = static_cast<std::uint32_t>(bvh.leaves.size() + prims.size());
    out.push_back(bvh.leaves[block]);
    out.push_back(hi);
    block += LEAF_HEADER_TEXELS;
    for (std::uint32_t i = 0; i < count; ++i, block += TRIANGLE_TEXELS) {
      add_map(decode_triangle(bvh, block), out);
      if (i % 4 == 0) prims.emplace_back(NO_HIT);
      prims.back()[static_cast<int>(i % 4)] = decode_prim(bvh, block);
    }
  }
  if (out.size() + prims.size() > std::numeric_limits<std::uint32_t>::max())
    fail(Failure::Work, "bvh: leaves with affine maps take {} texels, but an index reaches {}; use another --numeric",
         out.size() + prims.size(), std::numeric_limits<std::uint32_t>::max());
  out.insert(out.end(), prims.begin(), prims.end());
  return out;
}

}  // namespace ballot
