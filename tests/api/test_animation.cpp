// Scenes of files that move: their animations, and the time that is set.
#include <cmath>
#include <cstring>
#include <filesystem>

#include "api.h"

namespace {

ballot::Scene dance_on(const ballot::Device& device, const std::string& update = "auto") {
  const auto file = std::filesystem::path(BALLOT_SOURCE_DIR) / "scenes" / "dance.gltf";
  return ballot::Scene::load(device, file.string(), {.updates = update});
}

TEST_F(Api, AnimationsOfAFile) {
  const ballot::Scene scene = dance_on(*device_);
  const auto all = scene.animations();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_STREQ(all[0].name, "dance");
  EXPECT_EQ(all[0].seconds, 4);
  EXPECT_STREQ(all[1].name, "nod");
  EXPECT_EQ(all[1].channels, 1u);
  EXPECT_TRUE(ballot::Scene(*device_, {grid_.mesh()}).animations().empty());
}

TEST_F(Api, ATimeMovesTheScene) {
  ballot::Scene refits = dance_on(*device_, "refit"), builds = dance_on(*device_, "rebuild");
  const std::vector<float> rest = refits.triangles();
  auto rays = rays_down(2000);
  for (ballot::Ray& r : rays) r.origin[1] += 1, r.origin[2] = 4;
  std::vector<ballot::Hit> a(rays.size()), b(rays.size()), before(rays.size());
  refits.trace(rays, before);
  for (const double seconds : {1.0, 2.5, 50.0}) {
    refits.set_time(0, seconds);
    builds.set_time(0, seconds);
    refits.trace(rays, a);
    builds.trace(rays, b);
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]), 0) << seconds;
    EXPECT_EQ(refits.triangles(), builds.triangles());
    EXPECT_EQ(builds.info().refits, 0u);
    EXPECT_NE(refits.triangles(), rest);
  }
  EXPECT_GT(refits.info().update_seconds, 0);
}

TEST_F(Api, TimesThatAreRefused) {
  ballot::Scene scene = dance_on(*device_), still(*device_, {grid_.mesh()});
  const std::vector<float> rest = scene.triangles();
  std::string text;
  EXPECT_EQ(code_of([&] { scene.set_time(2, 0); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("animation 2 of a scene that has 2"), std::string::npos) << text;
  EXPECT_EQ(code_of([&] { still.set_time(0, 0); }, &text), BALLOT_ERROR_ARGUMENT);
  for (const double seconds : {std::nan(""), HUGE_VAL})
    EXPECT_EQ(code_of([&] { scene.set_time(0, seconds); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(scene.triangles(), rest);
}

}  // namespace
