// Meshes of arrays on the device.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/api/api.h"

namespace {

class ApiDeviceMeshes : public Api {
 protected:
  /// A grid with hills, on the host and on the device.
  struct Both {
    Both(const ballot::Device& device, std::uint32_t n, float z = 0)
        : here(n, z), vertices(device, here.positions.size() / 3), indices(device, here.indices.size()) {
      for (std::size_t i = 0; i < here.positions.size(); i += 3) here.positions[i + 2] += hill(i, 0.1f);
      write();
      indices.write(here.indices);
    }
    static float hill(std::size_t i, float height) { return height * float(std::sin(double(i) * 0.37)); }
    void write() {
      vertices.write({reinterpret_cast<const ballot::Vertex*>(here.positions.data()), here.positions.size() / 3});
    }
    ballot::Mesh there(std::uint32_t id = 0) const {
      ballot::Mesh mesh = ballot::mesh(vertices, indices);
      mesh.id = id;
      return mesh;
    }
    Grid here;
    ballot::Array<ballot::Vertex> vertices;
    ballot::Array<std::uint32_t> indices;
  };

  /// Returns the side of a grid whose tree lies on the device by itself, if that builds it, else of a smaller one.
  static std::uint32_t size_for(const ballot::SceneOptions& options) {
    return std::string(options.builder) == "device" && std::string(options.layout) == "separate" ? 190 : 40;
  }

  static ballot::SceneOptions built_by(const char* builder, const char* layout = nullptr) {
    return {.builder = builder, .layout = layout};
  }

  /// Every kind of answer has the same bits, and the scenes tell the same of themselves.
  static void expect_same(const ballot::Scene& a, const ballot::Scene& b) {
    const std::vector<ballot::Ray> rays = rays_down(500);
    std::vector<ballot::Hit> hits(rays.size()), truth(rays.size());
    std::vector<std::uint32_t> ids(rays.size()), true_ids(rays.size());
    std::vector<float> normals(3 * rays.size()), true_normals(3 * rays.size());
    a.trace(rays, {.hits = hits.data(), .mesh_ids = ids.data(), .normals = normals.data()});
    b.trace(rays, {.hits = truth.data(), .mesh_ids = true_ids.data(), .normals = true_normals.data()});
    EXPECT_EQ(std::memcmp(hits.data(), truth.data(), hits.size() * sizeof hits[0]), 0);
    EXPECT_EQ(ids, true_ids);
    EXPECT_EQ(normals, true_normals);
    EXPECT_GT(std::ranges::count_if(hits, [](const ballot::Hit& h) { return h.prim != ballot::kMiss; }), 50);
    std::vector<std::uint8_t> any(rays.size()), true_any(rays.size());
    a.trace(rays, {.occluded = any.data()}, {.any = true});
    b.trace(rays, {.occluded = true_any.data()}, {.any = true});
    EXPECT_EQ(any, true_any);
    EXPECT_EQ(a.count_crossings(rays), b.count_crossings(rays));
    std::vector<float> points, distances(100), expected(100);
    for (std::size_t i = 0; i < 300; ++i) points.push_back(0.5f + Both::hill(i, 1.0f));
    a.nearest(points, {.distances = distances.data()});
    b.nearest(points, {.distances = expected.data()});
    EXPECT_EQ(distances, expected);
    const ballot::SceneInfo of_a = a.info(), of_b = b.info();
    EXPECT_EQ(std::memcmp(of_a.lo, of_b.lo, sizeof of_a.lo + sizeof of_a.hi), 0);
    EXPECT_EQ(a.triangles(), b.triangles());
    EXPECT_EQ(a.indices(0), b.indices(0));
    for (std::size_t m = 0; m < of_a.meshes; ++m)
      EXPECT_EQ(std::memcmp(a.meshes()[m].lo, b.meshes()[m].lo, 6 * sizeof(float)), 0);
  }
};

TEST_F(ApiDeviceMeshes, AnswersAreThoseOfTheHostsArrays) {
  for (const char* builder : {"device", "balanced"})
    for (const char* layout : {"merge", "separate"}) {
      SCOPED_TRACE(std::string(builder) + " " + layout);
      const ballot::SceneOptions options = built_by(builder, layout);
      const Both small(*device_, 12), large(*device_, size_for(options), 0.5f);
      const std::vector<ballot::Mesh> here{small.here.mesh(3), large.here.mesh(5)};
      const std::vector<ballot::Mesh> there{small.there(3), large.there(5)}, mixed{small.here.mesh(3), large.there(5)};
      const ballot::Scene truth(*device_, here, options);
      expect_same({*device_, there, options}, truth);
      expect_same({*device_, mixed, options}, truth);
    }
}

TEST_F(ApiDeviceMeshes, PlacedNormalsAndSoups) {
  const Both large(*device_, 190), some(*device_, 30);
  const std::vector<float> turned{0, -1, 0, 1, 1, 0, 0, 0, 0, 0, 1, 0.25f}, normals(some.here.positions.size(), 1.0f);
  const ballot::Instances placed = ballot::instances(turned);
  const ballot::SceneOptions device = built_by("device");
  expect_same({*device_, {large.there()}, placed, device}, {*device_, {large.here.mesh()}, placed, device});
  ballot::Mesh smooth = some.there(), truth = some.here.mesh();
  smooth.normals = truth.normals = normals.data();
  const Both flat(*device_, 3, 0.5f);
  expect_same({*device_, {smooth, flat.there()}, device}, {*device_, {truth, flat.here.mesh()}, device});
  std::vector<float> corners;
  for (const std::uint32_t i : some.here.indices)
    corners.insert(corners.end(), some.here.positions.data() + 3 * i, some.here.positions.data() + 3 * i + 3);
  ballot::Array<ballot::Vertex> soup(*device_, corners.size() / 3);
  soup.write({reinterpret_cast<const ballot::Vertex*>(corners.data()), soup.size()});
  expect_same({*device_, {ballot::mesh(soup)}, device}, {*device_, {ballot::mesh(corners)}, device});
  ballot::Mesh vertices_here = some.here.mesh(), indices_here = vertices_here;
  vertices_here.indices = nullptr, vertices_here.index_type = BALLOT_INDEX_NONE;
  vertices_here.index_buffer = some.indices.handle();
  indices_here.positions = nullptr, indices_here.vertex_buffer = some.vertices.handle();
  const ballot::Scene whole(*device_, {some.here.mesh()}, device);
  expect_same({*device_, {vertices_here}, device}, whole);
  expect_same({*device_, {indices_here}, device}, whole);
}

TEST_F(ApiDeviceMeshes, EditsFollow) {
  for (const char* builder : {"device", "balanced"})
    for (const char* layout : {"merge", "separate"}) {
      SCOPED_TRACE(std::string(builder) + " " + layout);
      const ballot::SceneOptions options = built_by(builder, layout);
      Both a(*device_, size_for(options)), b(*device_, 10, 0.5f);
      ballot::Scene there(*device_, {a.there(), b.there()}, options);
      ballot::Scene here(*device_, {a.here.mesh(), b.here.mesh()}, options);
      const auto commit_both = [&](const auto& edit) {
        edit(there), edit(here);
        there.commit(), here.commit();
        expect_same(there, here);
      };
      for (std::size_t i = 2; i < a.here.positions.size(); i += 3) a.here.positions[i] = Both::hill(i, 0.2f);
      a.write();
      there.set_vertices(0, a.vertices);
      here.set_vertices(0, a.here.positions);
      commit_both([](ballot::Scene&) {});
      for (float& x : a.here.positions) x *= 0.875f;
      commit_both([&](ballot::Scene& s) { s.set_vertices(0, a.here.positions); });
      const Both c(*device_, 7, 0.25f);
      there.replace_mesh(1, c.there());
      here.replace_mesh(1, c.here.mesh());
      const std::vector<std::uint32_t> added{there.add_mesh(b.there(9))};
      EXPECT_EQ(here.add_mesh(b.here.mesh(9)), added[0]);
      const std::vector<float> place{1, 0, 0, 0.25f, 0, 1, 0, 0, 0, 0, 1, 1};
      commit_both([&](ballot::Scene& s) {
        s.set_vertices(1, c.here.positions);
        s.add_instances(ballot::instances(place, added));
      });
      commit_both([&](ballot::Scene& s) { s.remove_mesh(1); });
    }
}

/// Large meshes, whose triangles stay on the device while others come, go, move or join their tree.
TEST_F(ApiDeviceMeshes, StructuresChangeAroundThem) {
  for (const char* layout : {"merge", "separate"}) {
    SCOPED_TRACE(layout);
    const ballot::SceneOptions options = built_by("device", layout);
    Both a(*device_, 190), b(*device_, 200, 0.5f), c(*device_, 185, 0.25f);
    ballot::Scene there(*device_, {a.there()}, options), here(*device_, {a.here.mesh()}, options);
    const auto commit_both = [&](const auto& edit) {
      edit(there), edit(here);
      there.commit(), here.commit();
      expect_same(there, here);
    };
    const auto move = [&](Both& grid, std::uint32_t mesh, float by) {
      for (float& x : grid.here.positions) x *= by;
      grid.write();
      there.set_vertices(mesh, grid.vertices), here.set_vertices(mesh, grid.here.positions);
    };
    there.replace_mesh(0, b.there()), here.replace_mesh(0, b.here.mesh());
    commit_both([](ballot::Scene&) {});
    move(b, 0, 0.875f);
    commit_both([](ballot::Scene&) {});
    const std::uint32_t second = there.add_mesh(c.there(3));
    EXPECT_EQ(here.add_mesh(c.here.mesh(3)), second);
    const std::vector<float> two{1, 0, 0, 0.25f, 0, 1, 0, 0, 0, 0, 1, 1, 0, 1, 0, 0.5f, 1, 0, 0, 0, 0, 0, 1, 1.5f};
    const std::vector<std::uint32_t> meshes{second, 0}, first{1}, mask{2};
    commit_both([&](ballot::Scene& s) { s.add_instances(ballot::instances(two, meshes)); });
    move(b, 0, 1.125f), move(c, second, 0.75f);
    commit_both([&](ballot::Scene& s) { s.set_masks(first, mask); });
    std::string text;
    const std::vector<float> bad{NAN, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const std::vector<std::uint32_t> of_second{second};
    for (ballot::Scene* s : {&there, &here}) {
      s->remove_mesh(0);
      s->add_instances(ballot::instances(bad, of_second));
      EXPECT_EQ(code_of([&] { s->commit(); }, &text), BALLOT_ERROR_ARGUMENT) << text;
    }
    expect_same(there, here);
    there.replace_mesh(0, a.there()), here.replace_mesh(0, a.here.mesh());
    move(a, 0, 0.9375f);
    commit_both([](ballot::Scene&) {});
    commit_both([&](ballot::Scene& s) { s.remove_mesh(second); });
  }
}

/// A mesh goes that parted others which lie in the world: these share a tree from then on.
TEST_F(ApiDeviceMeshes, TreesJoin) {
  const ballot::SceneOptions options = built_by("device", "merge");
  const Both a(*device_, 190), b(*device_, 200, 0.5f), c(*device_, 185, 0.25f);
  ballot::Scene there(*device_, {a.there(), b.there(), c.there()}, options);
  ballot::Scene here(*device_, {a.here.mesh(), b.here.mesh(), c.here.mesh()}, options);
  const std::vector<float> place{1, 0, 0, 0.25f, 0, 1, 0, 0, 0, 0, 1, 1};
  const std::vector<std::uint32_t> middle{1};
  for (ballot::Scene* s : {&there, &here}) s->add_instances(ballot::instances(place, middle)), s->commit();
  expect_same(there, here);
  for (ballot::Scene* s : {&there, &here}) s->remove_mesh(1), s->commit();
  expect_same(there, here);
}

TEST_F(ApiDeviceMeshes, WhatCannotBeIsNamedAndChangesNothing) {
  Both grid(*device_, 12);
  const ballot::SceneOptions options = built_by("device");
  ballot::Scene scene(*device_, {grid.here.mesh()}, options);
  const auto expect_refused = [&](const ballot::Mesh& mesh, const std::string& what) {
    std::string text;
    EXPECT_EQ(code_of(
                  [&] {
                    ballot::Scene(*device_, {grid.here.mesh(), mesh}, options);
                  },
                  &text),
              BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find("mesh 1: " + what), std::string::npos) << text;
    EXPECT_EQ(code_of([&] { scene.add_mesh(mesh); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find("mesh: " + what), std::string::npos) << text;
    EXPECT_EQ(code_of([&] { scene.replace_mesh(0, mesh); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find("mesh 0: " + what), std::string::npos) << text;
  };
  const auto vertices_of = [&](std::size_t i, float x) {
    ballot::Array<ballot::Vertex> array(*device_, grid.vertices.size());
    std::vector<float> wrong = grid.here.positions;
    wrong[3 * i] = x, wrong[3 * 150 + 2] = INFINITY;
    array.write({reinterpret_cast<const ballot::Vertex*>(wrong.data()), array.size()});
    return array;
  };
  const ballot::Array<ballot::Vertex> nan = vertices_of(77, NAN), far = vertices_of(6, 2e12f);
  expect_refused(ballot::mesh(nan, grid.indices), "vertex 77 is (nan, ");
  expect_refused(ballot::mesh(far, grid.indices), "vertex 6 is (2000000000000, ");
  std::vector<std::uint32_t> indices = grid.here.indices;
  indices[100] = 169, indices[200] = 0xFFFFFFFF;
  ballot::Array<std::uint32_t> outside(*device_, indices.size());
  outside.write(indices);
  expect_refused(ballot::mesh(grid.vertices, outside), "index 100 is 169, but there are 169 vertices");
  expect_refused(ballot::mesh(nan, outside), "index 100 is 169, but there are 169 vertices");
  ballot::Mesh few = grid.there();
  few.vertex_count = 170;
  expect_refused(few, "the buffer of vertices has 169 records; expected 170");
  few = grid.there(), few.index_count = 0;
  expect_refused(few, "0 indices; expected a multiple of 3, at least 3");
  few = grid.there(), few.vertex_count = 0;
  expect_refused(few, "positions is NULL or vertex_count is 0");
  ballot::Mesh wrong = grid.there();
  wrong.index_buffer = grid.vertices.handle();
  expect_refused(wrong, "the buffer of indices holds other records");
  wrong = grid.there(), wrong.vertex_buffer = grid.indices.handle();
  expect_refused(wrong, "the buffer of vertices holds other records");
  wrong = grid.there(), wrong.positions = grid.here.positions.data();
  expect_refused(wrong, "both positions and vertex_buffer are set");
  wrong = grid.there(), wrong.index_type = BALLOT_INDEX_U16;
  expect_refused(wrong, "index_type is BALLOT_INDEX_U16");
  const ballot::Device other;
  const Both elsewhere(other, 12);
  expect_refused(elsewhere.there(), "the buffer of indices is on another device than the scene");
  scene.discard();
  expect_same(scene, {*device_, {grid.here.mesh()}, options});
}

TEST_F(ApiDeviceMeshes, ArraysMayGoOnceASceneIsMade) {
  const ballot::SceneOptions options = built_by("device");
  auto grid = std::make_unique<Both>(*device_, 20);
  const Grid kept = grid->here;
  ballot::Scene scene(*device_, {grid->there()}, options);
  grid->indices.write(std::vector<std::uint32_t>(kept.indices.size(), 0));
  const ballot::Mesh closed = grid->there();
  grid.reset();
  expect_same(scene, {*device_, {kept.mesh()}, options});
  std::vector<float> moved = kept.positions;
  for (float& x : moved) x *= 0.75f;
  scene.set_vertices(0, moved);
  scene.commit();
  Grid truth = kept;
  truth.positions = moved;
  expect_same(scene, {*device_, {truth.mesh()}, options});
  EXPECT_EQ(code_of([&] { scene.add_mesh(closed); }), BALLOT_ERROR_CLOSED);
}

}  // namespace
