// What tests of values share: a mesh with attributes of every kind, and the columns that tell them.
#pragma once

#include <array>
#include <cstring>

#include "tests/api/api.h"

namespace values {

using Four = std::array<float, 4>;

template <class T>
std::vector<T> records_of(const ballot::Array<T>& array) {
  std::vector<T> all(array.size());
  array.read(all);
  return all;
}

inline std::vector<ballot::Ray> rays_inwards(std::size_t n, float reach = 1.2f) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> at(-reach, reach);
  std::vector<ballot::Ray> rays(n);
  for (ballot::Ray& r : rays) {
    const float from[3]{at(random), at(random), at(random)};
    r = {{3 * at(random), 3 * at(random), 3 * at(random)}, 0, {}, 100};
    for (int k = 0; k < 3; ++k) r.dir[k] = from[k] - r.origin[k];
  }
  return rays;
}

/// A mesh of triangles in a cube, with an attribute of every kind.
struct Soup {
  explicit Soup(std::uint32_t n, unsigned seed, bool indexed = true) : triangles(n), has_indices(indexed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> at(-1, 1);
    const std::uint32_t vertices = indexed ? 2 * n : 3 * n;
    for (std::uint32_t i = 0; i < 3 * vertices; ++i) positions.push_back(at(random));
    for (std::uint32_t i = 0; indexed && i < 3 * n; ++i) indices.push_back(std::uint32_t(random() % vertices));
    for (std::uint32_t i = 0; i < vertices; ++i) heat.push_back(at(random));
    for (std::uint32_t i = 0; i < 4 * vertices; ++i) paint.push_back(at(random));
    for (std::uint32_t i = 0; i < vertices; ++i) label.push_back(float(i));
    for (std::uint32_t i = 0; i < 2 * n; ++i) pair.push_back(at(random));
    whole = {at(random), at(random), at(random)};
  }
  std::vector<ballot::Attribute> attributes() const {
    std::vector<ballot::Attribute> all{
        ballot::attribute("heat", heat), ballot::attribute("paint", paint, 4), ballot::attribute("label", label),
        ballot::attribute("pair", pair, 2, BALLOT_OF_PRIMS), ballot::attribute("whole", whole, 3, BALLOT_OF_MESH)};
    all[2].nearest = 1;
    return all;
  }
  /// Refers to `with`.
  ballot::Mesh mesh(const std::vector<ballot::Attribute>& with) const {
    ballot::Mesh m = ballot::mesh(positions, indices);
    m.attributes = with.data(), m.attribute_count = with.size();
    return m;
  }
  std::uint32_t vertex(std::uint32_t triangle, std::uint32_t corner) const {
    return has_indices ? indices[3 * triangle + corner] : 3 * triangle + corner;
  }
  /// Returns number `k` of an attribute of vertices where a hit is.
  float between(const std::vector<float>& of, std::uint32_t width, std::uint32_t k, std::uint32_t triangle,
                const float* uv) const {
    const auto number = [&](std::uint32_t corner) { return of[width * vertex(triangle, corner) + k]; };
    const float a = number(0), p = number(1) - a, q = number(2) - a;
    const float x = uv[0] * p, y = uv[1] * q, sum = x + y;
    return a + sum;
  }
  std::uint32_t near_vertex(std::uint32_t triangle, const float* uv) const {
    const float w = 1.0f - uv[0] - uv[1];
    return vertex(triangle, w >= uv[0] && w >= uv[1] ? 0 : uv[0] >= uv[1] ? 1 : 2);
  }

  std::uint32_t triangles;
  bool has_indices;
  std::vector<float> positions, heat, paint, label, pair, whole;
  std::vector<std::uint32_t> indices;
};

/// Columns of n hits in the host's memory.
struct HostValues {
  explicit HostValues(std::size_t n)
      : t(n),
        uvs(2 * n),
        normals(3 * n),
        positions(3 * n),
        heat(n),
        paint(4 * n),
        label(n),
        pair(2 * n),
        whole(3 * n),
        prims(n),
        instances(n),
        materials(n),
        front(n),
        colors(4 * n),
        shading(3 * n) {
    values = {{"heat", heat.data()},
              {"paint", paint.data()},
              {"label", label.data()},
              {"pair", pair.data()},
              {"whole", whole.data()}};
  }
  ballot::Results results() {
    ballot::Results r{.t = t.data(),
                      .prims = prims.data(),
                      .uvs = uvs.data(),
                      .normals = normals.data(),
                      .instances = instances.data()};
    r.positions = positions.data(), r.front = front.data(), r.materials = materials.data(), r.colors = colors.data();
    r.shading_normals = shading.data();
    r.values = values.data(), r.value_count = values.size();
    return r;
  }
  std::vector<float> t, uvs, normals, positions, heat, paint, label, pair, whole;
  std::vector<std::uint32_t> prims, instances, materials;
  std::vector<std::uint8_t> front;
  std::vector<float> colors, shading;
  std::vector<ballot::Values> values;
};

/// The same on the device.
struct DeviceValues {
  DeviceValues(const ballot::Device& d, std::size_t n)
      : t(d, n),
        heat(d, n),
        label(d, n),
        pair(d, n),
        positions(d, n),
        whole(d, n),
        shading(d, n),
        paint(d, n),
        colors(d, n),
        materials(d, n),
        front_words(d, n),
        front(d, n) {}
  std::vector<ballot::Output> outputs() {
    return {{"t", t},
            {"heat", heat},
            {"label", label},
            {"pair", pair},
            {"positions", positions},
            {"whole", whole},
            {"shading_normals", shading},
            {"paint", paint},
            {"colors", colors},
            {"materials", materials},
            {"front", front}};
  }
  ballot::Array<float> t, heat, label;
  ballot::Array<std::array<float, 2>> pair;
  ballot::Array<std::array<float, 3>> positions, whole, shading;
  ballot::Array<Four> paint, colors;
  ballot::Array<std::uint32_t> materials, front_words;
  ballot::Array<std::uint8_t> front;
};

template <class A, class B>
void expect_bits(const std::vector<A>& here, const ballot::Array<B>& there, const char* what) {
  const std::vector<B> found = records_of(there);
  ASSERT_EQ(here.size() * sizeof(A), found.size() * sizeof(B)) << what;
  EXPECT_EQ(std::memcmp(here.data(), found.data(), found.size() * sizeof(B)), 0) << what;
}

}  // namespace values
