// Scenes that move: the modes of update(), vertices that are refused, and those that leave nothing to hit.
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "api.h"

namespace {

// The modes of update() give the same hits, bit for bit, as a scene that is made of the moved vertices.
TEST_F(Api, UpdateModesGiveTheHitsOfANewScene) {
  Grid wavy(16);
  for (std::size_t i = 2; i < wavy.positions.size(); i += 3) wavy.positions[i] = float((7 * i) % 13) * 0.05f;
  const auto rays = rays_down(3000);
  std::vector<ballot::Hit> expected(rays.size()), hits(rays.size());
  for (const char* builder : {"best", "balanced", "fast", "device", "auto"}) {
    ballot::Scene(*device_, {wavy.mesh()}, {.builder = builder}).trace(rays, expected);
    for (const std::string mode : {"refit", "rebuild", "auto"}) {
      ballot::Scene scene(*device_, {grid_.mesh()}, {.builder = builder, .updates = mode});
      scene.trace(rays, hits);
      EXPECT_EQ(scene.info().decay, 1);
      EXPECT_EQ(scene.info().update_seconds, 0);
      for (std::uint64_t update = 1; update < 3; ++update) {
        move(scene, 0, wavy.positions);
        scene.trace(rays, hits);
        EXPECT_EQ(std::memcmp(hits.data(), expected.data(), hits.size() * sizeof hits[0]), 0) << builder << mode;
        const ballot::SceneInfo info = scene.info();
        if (mode != "auto") {
          EXPECT_EQ(info.refits, mode == "refit" ? update : 0);
        }
        EXPECT_GT(info.update_seconds, 0);
        EXPECT_EQ(info.hi[2], 0.6f);
      }
    }
  }
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {grid_.mesh()}, {.updates = "never"}); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {grid_.mesh()}, {.expected_rays = -1}); }), BALLOT_ERROR_ARGUMENT);
}

// Vertices may fall together, onto a line, or out of every range; what is refused leaves the scene as it was.
TEST_F(Api, UpdatesOfAnyVertices) {
  const auto rays = rays_down(500);
  for (const char* builder : {"balanced", "device"})
    for (const char* mode : {"refit", "auto"}) {
      ballot::Scene scene(*device_, {grid_.mesh()}, {.builder = builder, .updates = mode});
      std::vector<ballot::Hit> before(rays.size()), hits(rays.size());
      scene.trace(rays, before);
      const auto with = [&](std::size_t at, float x) {
        std::vector<float> positions = grid_.positions;
        positions[at] = x;
        return positions;
      };
      for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                              -std::numeric_limits<float>::infinity(), 1e30f, -2e12f}) {
        EXPECT_EQ(code_of([&] { move(scene, 0, with(100, bad)); }), BALLOT_ERROR_ARGUMENT) << bad;
        scene.trace(rays, hits);
        EXPECT_EQ(std::memcmp(hits.data(), before.data(), hits.size() * sizeof hits[0]), 0) << bad;
      }
      for (const std::size_t floats : {std::size_t{0}, std::size_t{9}, grid_.positions.size() + 3}) {
        std::vector<float> others(floats, 0.25f);
        const std::string counts = std::to_string(floats / 3) + " vertices, but the mesh was made with " +
                                   std::to_string(grid_.positions.size() / 3);
        try {
          move(scene, 0, others);
          ADD_FAILURE() << counts;
        } catch (const ballot::Error& e) {
          EXPECT_NE(std::string(e.what()).find(counts), std::string::npos) << e.what();
        }
      }
      std::vector<float> line = grid_.positions, point(line.size(), 0.5f);
      for (std::size_t i = 0; i < line.size(); ++i) line[i] = i % 3 ? 0 : line[i];
      for (const auto& flat : {line, point}) {  // no triangle has area: every ray misses
        move(scene, 0, flat);
        EXPECT_EQ(scene.info().degenerate, scene.info().triangles);
        scene.trace(rays, hits);
        for (const ballot::Hit& hit : hits) EXPECT_EQ(hit.prim, ballot::kMiss);
      }
      move(scene, 0, with(2, 1e12f));  // as far as a vertex may be
      move(scene, 0, grid_.positions);
      scene.trace(rays, hits);
      EXPECT_EQ(std::memcmp(hits.data(), before.data(), hits.size() * sizeof hits[0]), 0);
    }
}

// Meshes of one tree move by themselves, one after the other, on the device and on the host. A vertex of no triangle is
// checked too.
TEST_F(Api, MeshesOfOneTreeMoveInTurn) {
  const auto rays = rays_down(2000);
  std::vector<ballot::Hit> expected(rays.size()), hits(rays.size());
  Grid first(9), second(7, 0.5f), low(9, -1), high(7, 1);
  for (Grid* grid : {&first, &second, &low, &high}) grid->positions.insert(grid->positions.end(), {5, 5, 5});
  for (const char* builder : {"balanced", "device"})
    for (const char* mode : {"refit", "rebuild", "auto"}) {
      ballot::Scene scene(*device_, {first.mesh(), second.mesh()}, {.builder = builder, .updates = mode});
      const auto expect = [&](const Grid& a, const Grid& b) {
        ballot::Scene(*device_, {a.mesh(), b.mesh()}).trace(rays, expected);
        scene.trace(rays, hits);
        EXPECT_EQ(std::memcmp(hits.data(), expected.data(), hits.size() * sizeof hits[0]), 0) << builder << mode;
        EXPECT_EQ(scene.info().lo[2], std::min(a.positions[2], b.positions[2]));
        EXPECT_EQ(scene.triangles(), ballot::Scene(*device_, {a.mesh(), b.mesh()}).triangles());
      };
      move(scene, 1, high.positions);
      expect(first, high);
      move(scene, 0, low.positions);
      expect(low, high);
      std::vector<float> wrong = second.positions;
      wrong.back() = std::numeric_limits<float>::quiet_NaN();
      EXPECT_EQ(code_of([&] { move(scene, 1, wrong); }), BALLOT_ERROR_ARGUMENT);
      expect(low, high);
      move(scene, 1, second.positions);
      expect(low, second);
    }
}

/// Small triangles over the unit square, and the same in another order: a tree of the first serves the second badly.
struct Dealt {
  std::vector<float> positions, moved;
  Dealt() {
    constexpr std::size_t kSide = 40;
    for (std::size_t i = 0; i < kSide * kSide; ++i) {
      const float x = float(i % kSide) / kSide, y = float(i / kSide) / kSide, z = 0.1f * float(i % 7);
      positions.insert(positions.end(), {x, y, z, x + 0.02f, y, z, x, y + 0.02f, z});
    }
    for (std::size_t i = 0; i < kSide * kSide; ++i) {
      const auto from = positions.begin() + std::ptrdiff_t(9 * (i * 1001 % (kSide * kSide)));
      moved.insert(moved.end(), from, from + 9);
    }
  }
};

/// A query of any kind, and how it is called.
struct KindOfQuery {
  const char* name;
  std::function<void(ballot::Scene&)> ask;
};

// Whatever is asked of a tree that has decayed, it is built anew once that has taken more time than a build, though no
// triangle moves again.
TEST_F(Api, EveryKindOfQueryHasADecayedTreeBuilt) {
  const Dealt dealt;
  const auto rays = rays_down(2000);
  const std::size_t n = rays.size();
  std::vector<ballot::Hit> hits(n);
  std::vector<float> points, distances(n);
  std::vector<std::uint8_t> bytes(n);
  for (const ballot::Ray& r : rays) points.insert(points.end(), {r.origin[0], r.origin[1], 0.3f});
  ballot::Array<ballot::Ray> rays_there(*device_, n);
  ballot::Array<ballot::Hit> hits_there(*device_, n);
  ballot::Array<ballot::Point> points_there(*device_, n);
  ballot::Array<float> signs_there(*device_, n);
  rays_there.write(rays);
  std::vector<ballot::Point> probes;
  for (std::size_t i = 0; i < n; ++i) probes.push_back({{points[3 * i], points[3 * i + 1], 0.3f}, INFINITY});
  points_there.write(probes);
  const auto sign = "pseudonormal";
  const KindOfQuery kinds[] = {
      {"nearest hits", [&](auto& s) { s.trace(rays, hits); }},
      {"any hit", [&](auto& s) { s.trace(rays, {.occluded = bytes.data()}, {.any = true}); }},
      {"in the background", [&](auto& s) { s.submit(rays, {.hits = hits.data()}).wait(); }},
      {"on the device", [&](auto& s) { s.trace(rays_there, hits_there, n); }},
      {"submitted on the device", [&](auto& s) { s.submit(rays_there, hits_there, n).wait(); }},
      {"closest points", [&](auto& s) { s.nearest(points, {.distances = distances.data()}); }},
      {"exact", [&](auto& s) { s.nearest(points, {.distances = distances.data()}, {.numeric = "exact"}); }},
      {"inside", [&](auto& s) { s.nearest(points, {.inside = bytes.data()}, {.assume_closed = true}); }},
      {"sides",
       [&](auto& s) {
         s.nearest(points, {.signed_distances = distances.data()}, {.sign = sign, .assume_closed = true});
       }},
      {"points on the device",
       [&](auto& s) {
         s.nearest(points_there, {{"signed_distances", signs_there}}, n, {.sign = sign, .assume_closed = true});
       }},
      {"counts", [&](auto& s) { s.count_crossings(rays); }},
      {"exact counts", [&](auto& s) { s.count_crossings(rays, {.numeric = "exact"}); }},
      {"lists", [&](auto& s) { s.crossings(rays); }},
      {"first crossings", [&](auto& s) { s.crossings(rays, {.first = 2}); }},
      {"picture", [&](auto& s) { s.render({}, {.width = 32, .height = 32}); }},
      {"paths", [&](auto& s) { s.render({}, {.width = 32, .height = 32, .shading = "path"}); }},
      {"rays of a view", [&](auto& s) { s.make_rays({}, "ao", 32, 32); }}};
  for (const KindOfQuery& kind : kinds) {
    ballot::Scene scene(*device_, {ballot::mesh(dealt.positions)}, {.builder = "balanced"});
    move(scene, 0, dealt.moved);
    ASSERT_GT(scene.info().decay, 5) << kind.name;
    int calls = 0;
    while (scene.info().decay > 1 && ++calls < 3000) kind.ask(scene);
    EXPECT_EQ(scene.info().decay, 1) << kind.name << ", after " << calls << " calls";
    EXPECT_EQ(scene.info().refits, 0u) << kind.name;
  }
}

}  // namespace
