// Values where rays hit, against the geometry that the test made: positions, sides, attributes.
#include <algorithm>
#include <cmath>

#include "tests/api/values.h"

namespace {

using namespace values;

class ApiValues : public Api {
 protected:
  /// Compares the columns on the device with those of the host, one by one and all together.
  static void compare(const ballot::Scene& scene, const std::vector<ballot::Ray>& rays, HostValues& found,
                      const ballot::Query& query = {}) {
    const std::size_t n = found.t.size();
    scene.trace(rays, found.results(), query);
    ballot::Array<ballot::Ray> in(*device_, rays.size());
    in.write(rays);
    const auto check = [&](DeviceValues& there) {
      expect_bits(found.heat, there.heat, "heat");
      expect_bits(found.label, there.label, "label");
      expect_bits(found.pair, there.pair, "pair");
      expect_bits(found.positions, there.positions, "positions");
      expect_bits(found.whole, there.whole, "whole");
      expect_bits(found.shading, there.shading, "shading_normals");
      expect_bits(found.paint, there.paint, "paint");
      expect_bits(found.colors, there.colors, "colors");
      expect_bits(found.materials, there.materials, "materials");
      expect_bits(found.front, there.front, "front");
    };
    DeviceValues all(*device_, n), each(*device_, n);
    scene.trace(in, all.outputs(), rays.size(), query);
    check(all);
    for (const ballot::Output& one : each.outputs()) {
      if (query.first)
        scene.trace(in, {one}, rays.size(), query);
      else
        scene.submit(in, {one}, rays.size(), query).wait();
    }
    check(each);
    scene.trace(in, {{"front", all.front_words}}, rays.size(), query);
    const std::vector<std::uint32_t> words = records_of(all.front_words);
    EXPECT_TRUE(std::equal(words.begin(), words.end(), found.front.begin()));
  }

  /// Compares values with those of the soup of each instance's mesh.
  static void expect_values(const HostValues& f, const std::vector<const Soup*>& of_instance) {
    std::size_t hits = 0;
    for (std::size_t i = 0; i < f.t.size(); ++i) {
      if (f.prims[i] == ballot::kMiss) {
        EXPECT_TRUE(std::isnan(f.heat[i]) && std::isnan(f.paint[4 * i + 3]) && std::isnan(f.whole[3 * i])) << i;
        continue;
      }
      const Soup& soup = *of_instance[f.instances[i]];
      const float* uv = &f.uvs[2 * i];
      ++hits;
      ASSERT_EQ(f.heat[i], soup.between(soup.heat, 1, 0, f.prims[i], uv)) << i;
      for (std::uint32_t k = 0; k < 4; ++k)
        ASSERT_EQ(f.paint[4 * i + k], soup.between(soup.paint, 4, k, f.prims[i], uv)) << i;
      ASSERT_EQ(f.label[i], float(soup.near_vertex(f.prims[i], uv))) << i;
      for (std::uint32_t k = 0; k < 2; ++k) ASSERT_EQ(f.pair[2 * i + k], soup.pair[2 * f.prims[i] + k]) << i;
      for (std::uint32_t k = 0; k < 3; ++k) ASSERT_EQ(f.whole[3 * i + k], soup.whole[k]) << i;
    }
    EXPECT_GT(hits, f.t.size() / 20);
  }

  /// Compares positions, sides and normals with the rays.
  static void expect_geometry(const HostValues& f, const std::vector<ballot::Ray>& rays, std::size_t row = 1) {
    std::size_t fronts = 0;
    for (std::size_t i = 0; i < f.t.size(); ++i) {
      const ballot::Ray& r = rays[i / row];
      if (f.prims[i] == ballot::kMiss) {
        EXPECT_TRUE(f.positions[3 * i] == 0 && f.front[i] == 0 && f.materials[i] == ballot::kMiss &&
                    f.colors[4 * i + 3] == 0 && f.shading[3 * i] == 0)
            << i;
        continue;
      }
      double side = 0;
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(f.positions[3 * i + k], r.origin[k] + double(f.t[i]) * r.dir[k], 2e-5) << i;
        side += double(f.normals[3 * i + k]) * r.dir[k];
      }
      if (std::abs(side) > 1e-5) {
        EXPECT_EQ(f.front[i], side < 0) << i;
      }
      fronts += f.front[i];
      EXPECT_EQ(f.materials[i], 0u);
      EXPECT_TRUE(std::equal(&f.colors[4 * i], &f.colors[4 * i] + 4, Four{1, 1, 1, 1}.begin()));
    }
    EXPECT_GT(fronts, f.t.size() / 40);
  }
};

TEST_F(ApiValues, OfFlatScenesAndTheirEdits) {
  const Soup a(40, 1), b(30, 2, false), c(25, 3);
  const auto of_a = a.attributes(), of_b = b.attributes(), of_c = c.attributes();
  const auto rays = rays_inwards(1501);
  for (const char* builder : {"balanced", "device"}) {
    SCOPED_TRACE(builder);
    ballot::Scene scene(*device_, {a.mesh(of_a), b.mesh(of_b)}, {.builder = builder});
    HostValues found(rays.size());
    compare(scene, rays, found);
    expect_values(found, {&a, &b});
    expect_geometry(found, rays);
    EXPECT_EQ(found.shading, found.normals);
    std::vector<float> moved = a.positions;
    for (float& x : moved) x *= 0.875f;
    move(scene, 0, moved);
    compare(scene, rays, found);
    expect_values(found, {&a, &b});
    expect_geometry(found, rays);
    Soup d = a;
    for (float& x : d.heat) x += 1;
    for (float& x : d.pair) x -= 2;
    scene.set_attribute(0, ballot::attribute("heat", d.heat));
    scene.set_attribute(0, ballot::attribute("pair", d.pair, 2, BALLOT_OF_PRIMS));
    scene.trace(rays, found.results());
    expect_values(found, {&a, &b});  // as it was committed last
    scene.commit();
    compare(scene, rays, found);
    expect_values(found, {&d, &b});
    scene.replace_mesh(1, c.mesh(of_c));
    scene.set_attribute(1, ballot::attribute("heat", c.heat));
    scene.commit();
    compare(scene, rays, found);
    expect_values(found, {&d, &c});
    scene.remove_mesh(0);
    scene.commit();
    compare(scene, rays, found);
    expect_values(found, {nullptr, &c});
  }
}

TEST_F(ApiValues, OfInstancesAndSeveralHits) {
  const Soup a(40, 1), b(30, 2, false);
  const auto of_a = a.attributes(), of_b = b.attributes();
  const std::vector<float> places{1,    0,    0.2f, -0.3f, 0,     1, 0, 0,     0, 0, 1, 0,     // of a
                                  0.9f, 0.3f, 0,    0.2f,  -0.3f, 1, 0, 0.4f,  0, 0, 1, 0.1f,  // of b
                                  -1,   0,    0,    0.2f,  0,     1, 0, -0.3f, 0, 0, 1, 0};    // of a, a mirror
  const std::vector<std::uint32_t> meshes{0, 1, 0}, masks{0xFFFFFFFF, 0, 0xFFFFFFFF};
  const auto rays = rays_inwards(1002);
  for (const char* builder : {"balanced", "device"}) {
    SCOPED_TRACE(builder);
    ballot::Scene scene(*device_, {a.mesh(of_a), b.mesh(of_b)}, ballot::instances(places, meshes, {}),
                        {.builder = builder});
    HostValues found(rays.size()), several(3 * rays.size());
    compare(scene, rays, found);
    expect_values(found, {&a, &b, &a});
    expect_geometry(found, rays);
    compare(scene, rays, several, {.first = 3});
    expect_values(several, {&a, &b, &a});
    expect_geometry(several, rays, 3);
    scene.set_masks(std::vector<std::uint32_t>{0, 1, 2}, masks);  // a hidden one keeps its numbers
    scene.commit();
    compare(scene, rays, found);
    expect_values(found, {&a, &b, &a});
    EXPECT_EQ(std::ranges::count(found.instances, 1u), 0);
  }
}

TEST_F(ApiValues, OfShapesAmongTriangles) {
  const Soup soup(30, 5);
  std::vector<ballot::Attribute> of_soup = soup.attributes();
  const std::vector<float> centers{0.5f, 0.2f, 0.1f, -0.6f, -0.4f, 0.3f}, radii{0.3f, 0.4f}, heat{3, 4};
  const std::vector<float> up{0, 0, 1, 0.6f, 0.8f, 0};
  const ballot::Attribute warm[]{ballot::attribute("heat", heat, 1, BALLOT_OF_PRIMS)};
  ballot::Mesh balls = ballot::shapes("spheres", centers, radii);
  const std::vector<float> middles{-0.2f, 0.7f, 0.1f, 0.4f, -0.7f, -0.3f};
  const ballot::Mesh discs = ballot::shapes("discs", middles, radii, {}, up);
  balls.attributes = warm, balls.attribute_count = 1;
  const std::vector<float> normals = [&] {
    std::vector<float> all;
    for (std::size_t i = 0; i < soup.positions.size() / 3; ++i) all.insert(all.end(), {0, 0.6f, 0.8f});
    return all;
  }();
  ballot::Mesh triangles = soup.mesh(of_soup);
  triangles.normals = normals.data();
  const ballot::Scene scene(*device_, {triangles, balls, discs});
  const auto rays = rays_inwards(1501);
  HostValues found(rays.size());
  compare(scene, rays, found);
  std::array<std::size_t, 3> met{};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (found.prims[i] == ballot::kMiss) continue;
    const std::uint32_t of = found.instances[i];
    ++met[of];
    double side = 0, along = 0;
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(found.positions[3 * i + k], rays[i].origin[k] + double(found.t[i]) * rays[i].dir[k], 2e-5) << i;
      side += double(found.normals[3 * i + k]) * rays[i].dir[k];
      along += double(found.normals[3 * i + k]) * found.shading[3 * i + k];
    }
    if (std::abs(side) > 1e-5) {
      EXPECT_EQ(found.front[i], side < 0) << i;
    }
    EXPECT_GE(along, 0) << i;  // on its side
    if (of == 0) {
      EXPECT_NEAR(std::abs(found.shading[3 * i + 2]), 0.8f, 1e-6) << i;
      EXPECT_EQ(found.heat[i], soup.between(soup.heat, 1, 0, found.prims[i], &found.uvs[2 * i])) << i;
    } else {
      EXPECT_TRUE(std::equal(&found.shading[3 * i], &found.shading[3 * i] + 3, &found.normals[3 * i])) << i;
      EXPECT_TRUE(std::isnan(found.pair[2 * i])) << i;  // the mesh lacks it
      EXPECT_TRUE(of == 1 ? found.heat[i] == heat[found.prims[i]] : std::isnan(found.heat[i])) << i;
    }
  }
  EXPECT_GT(*std::ranges::min_element(met), 20u);
}

TEST_F(ApiValues, OfNearestPoints) {
  const Soup soup(30, 5);
  const auto of_soup = soup.attributes();
  const ballot::Scene scene(*device_, {soup.mesh(of_soup)});
  std::vector<float> points;
  std::vector<ballot::Point> asked;
  for (const ballot::Ray& r : rays_inwards(500)) {
    points.insert(points.end(), r.origin, r.origin + 3);
    asked.push_back({{r.origin[0], r.origin[1], r.origin[2]}, INFINITY});
  }
  const std::size_t n = asked.size();
  HostValues found(n);
  ballot::NearestResults to{.prims = found.prims.data(), .uvs = found.uvs.data(), .normals = found.normals.data()};
  to.materials = found.materials.data(), to.colors = found.colors.data(), to.shading_normals = found.shading.data();
  to.values = found.values.data(), to.value_count = found.values.size();
  scene.nearest(points, to);
  std::ranges::fill(found.instances, 0u);
  expect_values(found, {&soup});
  EXPECT_EQ(found.shading, found.normals);
  DeviceValues there(*device_, n);
  ballot::Array<ballot::Point> in(*device_, n);
  in.write(asked);
  scene.nearest(in,
                {{"heat", there.heat},
                 {"paint", there.paint},
                 {"whole", there.whole},
                 {"colors", there.colors},
                 {"materials", there.materials},
                 {"shading_normals", there.shading}},
                n);
  expect_bits(found.heat, there.heat, "heat");
  expect_bits(found.paint, there.paint, "paint");
  expect_bits(found.whole, there.whole, "whole");
  expect_bits(found.colors, there.colors, "colors");
  expect_bits(found.materials, there.materials, "materials");
  expect_bits(found.shading, there.shading, "shading_normals");
}

TEST_F(ApiValues, OfArraysOnTheDevice) {
  const Soup a(40, 1), b(30, 2, false);
  const auto rays = rays_inwards(801);
  ballot::Array<float> heat(*device_, a.heat.size() + 3), label(*device_, a.label.size());
  ballot::Array<Four> paint(*device_, a.paint.size() / 4);
  ballot::Array<std::array<float, 2>> pair(*device_, a.triangles);
  ballot::Array<std::array<float, 3>> whole(*device_, 1);
  heat.write(a.heat), label.write(a.label);
  paint.write({reinterpret_cast<const Four*>(a.paint.data()), paint.size()});
  pair.write({reinterpret_cast<const std::array<float, 2>*>(a.pair.data()), pair.size()});
  whole.write({reinterpret_cast<const std::array<float, 3>*>(a.whole.data()), 1});
  std::vector<ballot::Attribute> of_a{
      ballot::attribute("heat", heat), ballot::attribute("paint", paint), ballot::attribute("label", label),
      ballot::attribute("pair", pair, BALLOT_OF_PRIMS), ballot::attribute("whole", whole, BALLOT_OF_MESH)};
  of_a[0].count = a.heat.size(), of_a[2].nearest = 1;
  const auto of_b = b.attributes();
  ballot::Scene scene(*device_, {a.mesh(of_a), b.mesh(of_b)});
  heat.write(std::vector<float>(a.heat.size(), -7));  // the scene has its own
  HostValues found(rays.size());
  compare(scene, rays, found);
  expect_values(found, {&a, &b});
  Soup c = a;
  for (float& x : c.heat) x *= 2;
  heat.write(c.heat);
  scene.set_attribute(0, of_a[0]);
  heat.write(a.heat);
  scene.commit();
  compare(scene, rays, found);
  expect_values(found, {&c, &b});
  const auto told = scene.attributes(0);
  ASSERT_EQ(told.size(), 5u);
  EXPECT_EQ(std::string(told[2].name), "label");
  EXPECT_TRUE(told[2].nearest && told[2].of == BALLOT_OF_VERTICES && told[2].count == a.label.size());
  EXPECT_TRUE(told[3].components == 2 && told[3].of == BALLOT_OF_PRIMS && told[4].of == BALLOT_OF_MESH);
  EXPECT_EQ(scene.attribute_values(0, 0), c.heat);
  EXPECT_EQ(scene.attribute_values(1, 1), b.paint);
}

TEST_F(ApiValues, StridesAndFilesMeshes) {
  const Soup soup(30, 4, false);
  std::vector<float> wide;
  for (const float x : soup.heat) wide.insert(wide.end(), {x, 100});
  ballot::Attribute heat = ballot::attribute("heat", wide, 2);
  heat.components = 1, heat.stride = 2 * sizeof(float);
  ballot::Mesh mesh = ballot::mesh(soup.positions);
  mesh.attributes = &heat, mesh.attribute_count = 1;
  const ballot::Scene scene(*device_, {mesh});
  EXPECT_EQ(scene.attribute_values(0, 0), soup.heat);
}

TEST_F(ApiValues, NamesOfMeshes) {
  ballot::Mesh a = grid_.mesh(), b = grid_.mesh(), c = grid_.mesh();
  a.name = "roof", c.name = "roof";
  ballot::Scene scene(*device_, {a, b, c});
  EXPECT_EQ(scene.find_meshes("roof"), (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(scene.find_meshes("mesh 1"), std::vector<std::uint32_t>{1});
  EXPECT_TRUE(scene.find_meshes("door").empty());
  b.name = "door";
  const std::uint32_t added = scene.add_mesh(b);
  EXPECT_TRUE(scene.find_meshes("door").empty());
  scene.replace_mesh(0, b);  // keeps its name
  scene.commit();
  EXPECT_EQ(scene.find_meshes("door"), std::vector<std::uint32_t>{added});
  EXPECT_EQ(scene.find_meshes("roof"), (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(std::string(scene.meshes()[0].name), "roof");
  EXPECT_EQ(std::string(scene.instances()[2].name), "roof");
}

}  // namespace
