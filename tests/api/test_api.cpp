// The installed library as a program sees it: results, errors, threads, fork. Runs on the default device.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "api.h"

#ifdef __SANITIZE_ADDRESS__
// Keeps libraries loaded: leak reports can name a driver's module (tests/lsan.supp) only while it is loaded.
extern "C" int dlclose(void*) { return 0; }
#endif

namespace {

TEST_F(Api, EveryResultOfEveryMesh) {
  const Grid upper(8, 1), lower(4, 0);
  const ballot::Scene scene(*device_, {upper.mesh(11), lower.mesh(5)});
  auto rays = rays_down(5000);
  for (std::size_t i = 0; i < rays.size(); i += 2) rays[i].origin[2] = 0.5f;  // below the upper mesh
  std::vector<ballot::Hit> hits(rays.size());
  std::vector<float> t(rays.size()), uvs(2 * rays.size()), normals(3 * rays.size());
  std::vector<std::uint32_t> prims(rays.size()), ids(rays.size());
  std::vector<std::uint8_t> occluded(rays.size());
  const ballot::Times times = scene.trace(rays, {.hits = hits.data(),
                                                 .t = t.data(),
                                                 .prims = prims.data(),
                                                 .mesh_ids = ids.data(),
                                                 .uvs = uvs.data(),
                                                 .normals = normals.data(),
                                                 .occluded = occluded.data()});
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    SCOPED_TRACE(i);
    const bool hit = inside(rays[i]);
    count += hit;
    ASSERT_EQ(occluded[i], hit);
    ASSERT_EQ(ids[i], !hit ? ballot::kMiss : i % 2 ? 11u : 5u);
    ASSERT_EQ(t[i], hit ? (i % 2 ? 1 : 0.5f) : std::numeric_limits<float>::infinity());
    ASSERT_EQ(hits[i].t, t[i]);
    ASSERT_EQ(prims[i], !hit ? ballot::kMiss : i % 2 ? hits[i].prim : hits[i].prim - 128);
    ASSERT_EQ(normals[3 * i + 2], hit ? 1 : 0);
    ASSERT_EQ(uvs[2 * i], hits[i].u);
  }
  EXPECT_EQ(times.hits, count);
}

TEST_F(Api, RaysOfSixFloatsAndStrides) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const float rows[3][7] = {{0.5f, 0.5f, 2, 0, 0, -1, 99}, {0.5f, 0.5f, 2, 0, 0, 1, 99}, {0.1f, 0.1f, 1, 0, 0, -2, 99}};
  const ballot::Column::Strides apart{sizeof rows[0]};
  const ballot::RayView rays{.origins = {rows[0], apart}, .directions = {rows[0] + 3, apart}, .shape = {3}};
  float t[3];
  scene.trace(rays, {.t = t});
  EXPECT_EQ(t[0], 2);
  EXPECT_EQ(t[1], std::numeric_limits<float>::infinity());
  EXPECT_EQ(t[2], 0.5f);
  std::vector<ballot::Ray> infinite{{{0.5f, 0.5f, 2}, 0, {0, 0, -1}, std::numeric_limits<float>::infinity()}};
  std::vector<ballot::Hit> hits(1);
  scene.trace(infinite, hits);
  EXPECT_EQ(hits[0].t, 2);
}

TEST_F(Api, IndicesOf16BitsStridesAndNone) {
  const std::vector<float> padded{0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0, 9};  // a number between vertices
  const std::vector<std::uint16_t> indices{0, 1, 2};
  std::vector<ballot::Hit> hits(1);
  const std::vector<ballot::Ray> ray{{{0.2f, 0.2f, 1}, 0, {0, 0, -1}, 9}};
  ballot::Scene(*device_, {ballot::mesh(padded, std::span<const std::uint16_t>(indices), 16)}).trace(ray, hits);
  EXPECT_EQ(hits[0].t, 1);
  ballot::Scene(*device_, {ballot::mesh(padded, std::span<const std::uint32_t>(), 16)}).trace(ray, hits);
  EXPECT_EQ(hits[0].t, 1);
}

TEST_F(Api, UpdateMovesAMeshAndKeepsTheHandle) {
  ballot::Scene scene(*device_, {grid_.mesh(), Grid(2, -5).mesh()});
  const auto rays = rays_down(1000);
  std::vector<ballot::Hit> hits(rays.size());
  for (const float z : {1.0f, -3.0f, 0.0f}) {
    move(scene, 0, Grid(16, z).positions);
    scene.trace(rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i)
      if (inside(rays[i])) {
        EXPECT_EQ(hits[i].t, 2 - z);
      }
  }
  std::vector<float> wrong = grid_.positions;
  wrong[7] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(code_of([&] { move(scene, 0, wrong); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { move(scene, 0, Grid(3).positions); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { move(scene, 2, grid_.positions); }), BALLOT_ERROR_ARGUMENT);
  std::vector<ballot::Hit> after(rays.size());
  scene.trace(rays, after);
  EXPECT_EQ(std::memcmp(after.data(), hits.data(), hits.size() * sizeof hits[0]), 0);
}

// Rows of rays are traced in tiles; each result still belongs to its ray. Some widths are no multiple of a tile's, and
// the last row is incomplete.
TEST_F(Api, RaysInRowsKeepTheirPlaces) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  for (const std::size_t width : {16, 37, 64, 1001}) {
    std::vector<ballot::Ray> rays;
    for (std::size_t y = 0; y < 43; ++y)
      for (std::size_t x = 0; x < width; ++x)
        rays.push_back({{0.5f, 0.5f, 2}, 0, {float(x) / float(width) - 0.5f, float(y) / 43 - 0.5f, -1}, 10});
    rays.resize(rays.size() - 5);
    std::vector<ballot::Ray> shuffled = rays;
    std::vector<std::size_t> places(rays.size());
    for (std::size_t i = 0; i < places.size(); ++i) places[i] = i;
    std::shuffle(places.begin(), places.end(), std::mt19937(3));
    for (std::size_t i = 0; i < places.size(); ++i) shuffled[i] = rays[places[i]];
    std::vector<ballot::Hit> hits(rays.size()), others(rays.size());
    std::vector<float> t(rays.size());
    scene.trace(rays, {.hits = hits.data(), .t = t.data()});
    scene.trace(shuffled, others);
    for (std::size_t i = 0; i < places.size(); ++i) {
      ASSERT_EQ(std::memcmp(&others[i], &hits[places[i]], sizeof(ballot::Hit)), 0) << width << " " << places[i];
      ASSERT_EQ(t[i], hits[i].prim == ballot::kMiss ? std::numeric_limits<float>::infinity() : hits[i].t);
    }
  }
}

// CPU devices read large arrays of records where they lie, and copy others. The hits are the same.
TEST_F(Api, LargeArraysAreTracedWhereTheyLie) {
  ballot::Scene scene(*device_, {grid_.mesh()});
  constexpr std::size_t kCount = 600'000;  // two parts that are traced in place, and a rest
  std::vector<ballot::Ray> rays = rays_down(kCount);
  rays[kCount / 2].t_max = std::numeric_limits<float>::infinity();  // the second part is copied for it
  std::vector<ballot::Hit> hits(kCount), copied(kCount);
  scene.trace(rays, hits, {.method = "bvh4"});
  std::vector<float> apart(9 * kCount);
  for (std::size_t i = 0; i < kCount; ++i) std::memcpy(&apart[9 * i], &rays[i], sizeof rays[i]);
  const float* first = apart.data();
  const ballot::Column::Strides stride{9 * sizeof(float)};
  scene.trace({.origins = {first, stride},
               .directions = {first + 4, stride},
               .t_min = {first + 3, stride},
               .t_max = {first + 7, stride},
               .shape = {kCount}},
              {.hits = copied.data()}, {.method = "bvh4"});
  EXPECT_EQ(std::memcmp(hits.data(), copied.data(), kCount * sizeof hits[0]), 0);
  std::vector<float> t(kCount);
  const ballot::Times times = scene.trace(rays, {.hits = copied.data(), .t = t.data()}, {.method = "bvh4"});
  EXPECT_EQ(std::memcmp(hits.data(), copied.data(), kCount * sizeof hits[0]), 0);
  const auto found = std::ranges::count_if(hits, [](const ballot::Hit& h) { return h.prim != ballot::kMiss; });
  EXPECT_EQ(times.hits, std::uint64_t(found));
  for (std::size_t i = 0; i < kCount; ++i) ASSERT_EQ(hits[i].prim != ballot::kMiss, inside(rays[i])) << i;
}

TEST_F(Api, ArraysOnTheDeviceAndJobs) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const auto rays = rays_down(70000);
  std::vector<ballot::Hit> expected(rays.size()), hits(rays.size());
  scene.trace(rays, expected);
  ballot::Array<ballot::Ray> in(*device_, rays.size());
  ballot::Array<ballot::Hit> out(*device_, rays.size());
  in.write(rays);
  scene.trace(in, out, rays.size());
  out.read(hits);
  EXPECT_EQ(std::memcmp(hits.data(), expected.data(), hits.size() * sizeof hits[0]), 0);
  std::vector<std::vector<ballot::Hit>> results(5, std::vector<ballot::Hit>(rays.size()));
  std::vector<ballot::Job> jobs;
  for (auto& result : results) jobs.push_back(scene.submit(rays, {.hits = result.data()}));
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    jobs[i].wait();
    EXPECT_TRUE(jobs[i].poll());
    EXPECT_EQ(std::memcmp(results[i].data(), expected.data(), hits.size() * sizeof hits[0]), 0);
  }
  EXPECT_EQ(code_of([&] { scene.trace(in, out, rays.size() + 1); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { in.write(rays, 1); }), BALLOT_ERROR_ARGUMENT);
  const ballot::Device other;
  ballot::Array<ballot::Ray> elsewhere(other, 10);
  EXPECT_EQ(code_of([&] { scene.trace(elsewhere, out, 10); }), BALLOT_ERROR_ARGUMENT);
}

// Batches that wait to be sent are not lost when a call after them fails.
TEST_F(Api, AFailedCallDropsNoBatch) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const auto rays = rays_down(40000);
  std::vector<ballot::Hit> expected(rays.size()), found(rays.size());
  scene.trace(rays, expected);
  ballot::Array<ballot::Ray> in(*device_, rays.size());
  in.write(rays);
  std::vector<ballot::Array<ballot::Hit>> out;
  for (int i = 0; i < 6; ++i) out.emplace_back(*device_, rays.size());
  std::vector<ballot::Job> jobs;
  for (auto& hits : out) jobs.push_back(scene.submit(in, hits, rays.size(), {.ray_class = "down"}));
  const ballot::View view{.eye = {0.5, 0.5, 2}, .target = {0.5, 0.5, 0}};
  const auto stops = [](double) { return false; };
  EXPECT_EQ(code_of([&] { scene.render(view, {.width = 8, .height = 8}, {.progress = stops}); }),
            BALLOT_ERROR_INTERRUPTED);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    jobs[i].wait();
    out[i].read(found);
    EXPECT_EQ(std::memcmp(found.data(), expected.data(), found.size() * sizeof found[0]), 0) << i;
  }
}

TEST_F(Api, WrongMeshesAreNamed) {
  std::string text;
  const auto refused = [&](ballot::Mesh mesh, const char* part) {
    EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {grid_.mesh(), mesh}); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find("mesh 1"), std::string::npos) << text;
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  std::vector<std::uint32_t> far = grid_.indices, odd = grid_.indices;
  far[4] = 100000;
  odd.pop_back();
  std::vector<float> infinite = grid_.positions;
  infinite[31] = std::numeric_limits<float>::infinity();
  refused(ballot::mesh(grid_.positions, far), "index 4 is 100000");
  refused(ballot::mesh(grid_.positions, odd), "multiple of 3");
  refused(ballot::mesh(infinite, grid_.indices), "vertex 10");
  refused({}, "positions is NULL or vertex_count is 0");
  refused(ballot::mesh(grid_.positions, grid_.indices, 10), "stride");
  const std::vector<float> huge{0, 0, 0, 1e20f, 0, 0, 0, 1, 0};
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {ballot::mesh(huge)}); }), BALLOT_ERROR_ARGUMENT);
  auto many = BALLOT_INIT(BallotMesh);
  many.positions = grid_.positions.data();
  many.vertex_count = std::size_t{3} << 31;  // 2^31 triangles, refused before they are read
  BallotScene* none = nullptr;
  EXPECT_EQ(ballot_scene_create(device_->handle(), &many, 1, nullptr, nullptr, &none), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(none, nullptr);
}

TEST_F(Api, WrongQueriesAndRays) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const auto rays = rays_down(10);
  std::vector<ballot::Hit> hits(rays.size());
  EXPECT_EQ(code_of([&] { scene.trace(rays, hits, {.method = "bogus"}); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { scene.trace(rays, hits, {.numeric = "bogus"}); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { scene.trace(rays, hits, {.knobs = "bogus=1"}); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { scene.trace(std::span(rays).first(9), std::span(hits)); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { ballot::Scene::load(*device_, "/nonexistent.glb"); }), BALLOT_ERROR_WORK);
  EXPECT_EQ(code_of([&] { ballot::Device("no such device"); }), BALLOT_ERROR_ARGUMENT);
  auto in = BALLOT_INIT(BallotRays);
  auto out = BALLOT_INIT(BallotHits);
  in.shape[0] = 3;
  EXPECT_EQ(ballot_trace(scene.handle(), &in, &out, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  in = ballot_rays(rays.data(), 3);
  in.direction.type = 2;
  EXPECT_EQ(ballot_trace(scene.handle(), &in, &out, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(std::string(ballot_scene_error(scene.handle())).find("the type of direction is 2"), std::string::npos);
  BallotRays unset{.size = 0};
  EXPECT_EQ(ballot_trace(scene.handle(), &unset, &out, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(ballot_trace(nullptr, &in, &out, nullptr, nullptr), BALLOT_ERROR_CLOSED);
}

TEST_F(Api, AnInterruptedTraceEnds) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const auto rays = rays_down(10000);
  std::vector<ballot::Hit> hits(rays.size());
  const auto stops = [](double) { return false; };
  EXPECT_EQ(code_of([&] { scene.trace(rays, hits, {.progress = stops}); }), BALLOT_ERROR_INTERRUPTED);
  double last = 0;
  const auto follows = [&](double done) { return last = done, true; };
  scene.trace(rays, hits, {.progress = follows});
  EXPECT_EQ(last, 1);
}

TEST_F(Api, ClosedHandlesAreRefused) {
  BallotDevice* device = nullptr;
  ASSERT_EQ(ballot_device_open(nullptr, &device), BALLOT_OK);
  BallotScene* scene = nullptr;
  ASSERT_EQ(ballot_scene_create(device, nullptr, 0, nullptr, nullptr, &scene), BALLOT_OK);
  ballot_device_close(device);
  auto info = BALLOT_INIT(BallotSceneInfo);
  EXPECT_EQ(ballot_scene_info(scene, &info), BALLOT_OK);  // the scene keeps the device
  ballot_scene_destroy(scene);
  ballot_scene_destroy(scene);
  EXPECT_EQ(ballot_scene_info(scene, &info), BALLOT_ERROR_CLOSED);
  EXPECT_EQ(ballot_scene_create(device, nullptr, 0, nullptr, nullptr, &scene), BALLOT_ERROR_CLOSED);
}

TEST_F(Api, AChildOfForkIsRefused) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const pid_t child = fork();
  if (child == 0) {
    auto info = BALLOT_INIT(BallotSceneInfo);
    const bool refused = ballot_scene_info(scene.handle(), &info) == BALLOT_ERROR_FORKED;
    ballot_scene_destroy(scene.handle());
    _exit(refused ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST_F(Api, OlderStructsAreTaken) {
  // A program that was compiled when BallotMesh ended before `normals`, and BallotTimes after `seconds`.
  auto mesh = BALLOT_INIT(BallotMesh);
  mesh.size = offsetof(BallotMesh, normals);
  mesh.positions = grid_.positions.data(), mesh.vertex_count = grid_.positions.size() / 3;
  mesh.indices = grid_.indices.data(), mesh.index_count = grid_.indices.size(), mesh.index_type = BALLOT_INDEX_U32;
  mesh.normals = reinterpret_cast<const float*>(1);  // must not be read
  BallotScene* scene = nullptr;
  ASSERT_EQ(ballot_scene_create(device_->handle(), &mesh, 1, nullptr, nullptr, &scene), BALLOT_OK);
  const auto rays = rays_down(5);
  std::vector<ballot::Hit> hits(5);
  const BallotRays in = ballot_rays(rays.data(), rays.size());
  const BallotHits out{.hits = hits.data()};
  auto times = BALLOT_INIT(BallotTimes);
  times.size = offsetof(BallotTimes, device_ms);
  times.device_ms = -1;
  EXPECT_EQ(ballot_trace(scene, &in, &out, nullptr, &times), BALLOT_OK);
  EXPECT_GT(times.seconds, 0);
  EXPECT_EQ(times.device_ms, -1);
  ballot_scene_destroy(scene);
}

TEST_F(Api, FourThreadsOnOneDevice) {
  const auto rays = rays_down(3000);
  std::atomic<int> wrong{0};
  const auto work = [&](unsigned seed) {
    for (unsigned round = 0; round < 6; ++round) {
      const float z = float((seed + round) % 2);  // t needs no rounding, as the grids are powers of two
      ballot::Scene scene(*device_, {Grid(8 << seed % 3, 0).mesh(seed)});
      move(scene, 0, Grid(8 << seed % 3, z).positions);
      std::vector<ballot::Hit> hits(rays.size());
      if (round % 2)
        scene.trace(rays, hits);
      else
        scene.submit(rays, {.hits = hits.data()}).wait();
      for (std::size_t i = 0; i < rays.size(); ++i)
        wrong += inside(rays[i]) ? hits[i].t != 2 - z : hits[i].prim != ballot::kMiss;
    }
  };
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < 4; ++i) threads.emplace_back(work, i);
  }
  EXPECT_EQ(wrong, 0);
}

TEST_F(Api, PicturesAndRaysOfAView) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const ballot::View view{.eye = {0.5, 0.5, 2}, .target = {0.5, 0.5, 0}};
  const auto rays = scene.make_rays(view, "primary", 32, 16);
  EXPECT_EQ(rays.size(), 512u);
  const auto picture = scene.render(view, {.width = 32, .height = 16, .shading = "normals"});
  const std::size_t middle = 4 * (8 * 32 + 16);
  EXPECT_NEAR(picture[middle + 2], 1, 1e-3);  // the normal (0, 0, 1) as a colour
  EXPECT_EQ(picture[middle + 3], 1);
  EXPECT_EQ(picture[3], 0);  // beside the square
  EXPECT_EQ(code_of([&] { scene.render(view, {.width = 20000}); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { scene.render(view, {.width = 1u << 31, .height = 1u << 31}); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { scene.make_rays(view, "primary", 1u << 31, 9); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { scene.make_rays(view, "bogus", 8, 8); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { scene.render({.name = "no such view"}, {}); }), BALLOT_ERROR_ARGUMENT);
}

TEST_F(Api, ASkyIsThatOfOnePicture) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const ballot::View view{.eye = {0.5, 0.5, 2}, .target = {0.5, 0.5, 0}};
  const auto render = [&](const char* sky) {
    return scene.render(view, {.width = 16, .height = 16, .shading = "path", .sky = sky});
  };
  const auto own = render(""), red = render("1,0,0");
  EXPECT_NE(red, own);
  EXPECT_EQ(code_of([&] { render("bogus"); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(render("1,0,0"), red);
  EXPECT_EQ(render(""), own);
}

TEST_F(Api, VersionsAgree) {
  EXPECT_EQ(ballot::version(), std::to_string(BALLOT_VERSION_MAJOR) + "." + std::to_string(BALLOT_VERSION_MINOR) + "." +
                                   std::to_string(BALLOT_VERSION_PATCH));
  EXPECT_EQ(ballot::version(), PROJECT_VERSION);
}

TEST_F(Api, NamesAreTaken) {
  const auto holds = [](BallotNames which, const char* name) {
    return std::ranges::count(ballot::names(which), name) == 1;
  };
  EXPECT_TRUE(holds(BALLOT_NAMES_METHODS, "auto") && holds(BALLOT_NAMES_NUMERIC, "exact"));
  EXPECT_TRUE(holds(BALLOT_NAMES_BUILDERS, "device") && holds(BALLOT_NAMES_RAY_KINDS, "ao"));
  EXPECT_TRUE(holds(BALLOT_NAMES_SHADINGS, "normals") && holds(BALLOT_NAMES_SHADINGS, "path"));
  EXPECT_EQ(ballot_name(BALLOT_NAMES_METHODS, 99), nullptr);
}

}  // namespace
