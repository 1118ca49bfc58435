// Scenes that move: the modes of update(), vertices that are refused, and those that leave nothing to hit.
#include <cstring>
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
      ballot::Scene scene(*device_, {grid_.mesh()}, {.builder = builder, .update = mode});
      scene.trace(rays, hits);
      EXPECT_EQ(scene.info().decay, 1);
      EXPECT_EQ(scene.info().update_seconds, 0);
      for (std::uint64_t update = 1; update < 3; ++update) {
        scene.update(0, wavy.positions);
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
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {grid_.mesh()}, {.update = "never"}); }), Code::Argument);
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {grid_.mesh()}, {.expected_rays = -1}); }), Code::Argument);
}

// Vertices may fall together, onto a line, or out of every range; what is refused leaves the scene as it was.
TEST_F(Api, UpdatesOfAnyVertices) {
  const auto rays = rays_down(500);
  for (const char* builder : {"balanced", "device"})
    for (const char* mode : {"refit", "auto"}) {
      ballot::Scene scene(*device_, {grid_.mesh()}, {.builder = builder, .update = mode});
      std::vector<ballot::Hit> before(rays.size()), hits(rays.size());
      scene.trace(rays, before);
      const auto with = [&](std::size_t at, float x) {
        std::vector<float> positions = grid_.positions;
        positions[at] = x;
        return positions;
      };
      for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                              -std::numeric_limits<float>::infinity(), 1e30f, -2e12f}) {
        EXPECT_EQ(code_of([&] { scene.update(0, with(100, bad)); }), Code::Argument) << bad;
        scene.trace(rays, hits);
        EXPECT_EQ(std::memcmp(hits.data(), before.data(), hits.size() * sizeof hits[0]), 0) << bad;
      }
      for (const std::size_t floats : {std::size_t{0}, std::size_t{9}, grid_.positions.size() + 3}) {
        std::vector<float> others(floats, 0.25f);
        const std::string counts = std::to_string(floats / 3) + " vertices, but the mesh was made with " +
                                   std::to_string(grid_.positions.size() / 3);
        try {
          scene.update(0, others);
          ADD_FAILURE() << counts;
        } catch (const ballot::Error& e) {
          EXPECT_NE(std::string(e.what()).find(counts), std::string::npos) << e.what();
        }
      }
      std::vector<float> line = grid_.positions, point(line.size(), 0.5f);
      for (std::size_t i = 0; i < line.size(); ++i) line[i] = i % 3 ? 0 : line[i];
      for (const auto& flat : {line, point}) {  // no triangle has area: every ray misses
        scene.update(0, flat);
        EXPECT_EQ(scene.info().degenerate, scene.info().triangles);
        scene.trace(rays, hits);
        for (const ballot::Hit& hit : hits) EXPECT_EQ(hit.prim, ballot::kMiss);
      }
      scene.update(0, with(2, 1e12f));  // as far as a vertex may be
      scene.update(0, grid_.positions);
      scene.trace(rays, hits);
      EXPECT_EQ(std::memcmp(hits.data(), before.data(), hits.size() * sizeof hits[0]), 0);
    }
}

}  // namespace
