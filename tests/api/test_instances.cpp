// Scenes of instances through the installed library: results, moves, errors.
#include <cstring>
#include <limits>

#include "api.h"

namespace {

/// Rays down on points of [0, 1]^2.
std::vector<ballot::Ray> rays_onto(std::size_t n) {
  std::vector<ballot::Ray> rays;
  for (std::size_t i = 0; i < n; ++i)
    rays.push_back({{float(i) / float(n), 1 - float(i) / float(n), 2}, 0, {0, 0, -1}, 10});
  return rays;
}

class ApiInstances : public Api {};

/// Returns the text of the Error(Argument) that `call` throws.
template <class Call>
std::string text_of(const Call& call) {
  try {
    call();
  } catch (const ballot::Error& error) {
    EXPECT_EQ(error.code(), BALLOT_ERROR_ARGUMENT) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return {};
}

// One mesh in three places: moved, enlarged and mirrored, and of another mesh besides.
TEST_F(ApiInstances, InstancesNameInstanceAndPrimitive) {
  const Grid small(2);
  const std::vector<float> transforms{1,  0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.5f,    // over [0, 1]^2, at z = 0.5
                                      -1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0,       // over [-1, 0] x [0, 2], mirrored
                                      1,  0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1.5f};  // below the first
  const std::vector<std::uint32_t> meshes{1, 0, 1};
  ballot::Scene scene(*device_, {grid_.mesh(7), small.mesh(9)}, ballot::instances(transforms, meshes));
  EXPECT_EQ(scene.info().instances, 3u);
  EXPECT_EQ(scene.info().instance_triangles, 512u + 2 * 8);
  EXPECT_EQ(scene.info().triangles, 512u + 8);
  const std::vector<ballot::Ray> rays{{{0.25f, 0.25f, 2}, 0, {0, 0, -1}, 10},
                                      {{-0.5f, 1.5f, 2}, 0, {0, 0, -2}, 10},
                                      {{0.25f, 0.25f, 0}, 0, {0, 0, -1}, 10},
                                      {{5, 5, 2}, 0, {0, 0, -1}, 10}};
  std::vector<ballot::Hit> hits(4);
  std::vector<float> t(4), normals(12);
  std::vector<std::uint32_t> prims(4), ids(4), instances(4);
  const ballot::Results out{.hits = hits.data(),
                            .t = t.data(),
                            .prims = prims.data(),
                            .mesh_ids = ids.data(),
                            .normals = normals.data(),
                            .instances = instances.data()};
  EXPECT_EQ(scene.trace(rays, out).hits, 3u);
  EXPECT_EQ(instances, (std::vector<std::uint32_t>{0, 1, 2, ballot::kMiss}));
  EXPECT_EQ(ids, (std::vector<std::uint32_t>{9, 7, 9, ballot::kMiss}));
  EXPECT_EQ(t, (std::vector<float>{1.5f, 1, 1.5f, std::numeric_limits<float>::infinity()}));
  const std::uint64_t firsts[] = {0, 8, 520};
  for (std::size_t i = 0; i < 3; ++i) {
    auto info = BALLOT_INIT(BallotInstanceInfo);
    ASSERT_EQ(ballot_scene_instance(scene.handle(), i, &info), BALLOT_OK);
    EXPECT_EQ(info.first, firsts[i]);
    EXPECT_EQ(info.mesh, meshes[i]);
    EXPECT_EQ(prims[i], hits[i].prim - firsts[i]);
    EXPECT_EQ(normals[3 * i + 2], i == 1 ? -1 : 1);  // a mirror turns the vertices round
    EXPECT_EQ(std::memcmp(info.transform, &transforms[12 * i], sizeof info.transform), 0);
  }
  std::vector<float> lifted = transforms;
  lifted[11] = 1;
  place(scene, lifted);
  scene.trace(rays, out);
  EXPECT_EQ(t[0], 1);
  EXPECT_EQ(t[1], 1);
  std::vector<float> apart;  // the same, each matrix in 64 bytes
  for (std::size_t i = 0; i < 3; ++i) {
    apart.insert(apart.end(), &transforms[12 * i], &transforms[12 * i] + 12);
    apart.insert(apart.end(), 4, -7.f);
  }
  place(scene, apart, 64);
  scene.trace(rays, out);
  EXPECT_EQ(t[0], 1.5f);
  place(scene, lifted);
  scene.trace(rays, out);
  EXPECT_EQ(t[0], 1);
  ballot::Array<ballot::Ray> in(*device_, 4);
  ballot::Array<ballot::Hit> there(*device_, 4);
  in.write(rays);
  scene.submit(in, there, 4).wait();
  std::vector<ballot::Hit> read(4);
  there.read(read);
  EXPECT_EQ(std::memcmp(read.data(), hits.data(), sizeof(ballot::Hit) * 4), 0);
}

// A mirrored instance is what a flat scene of the moved vertices is: it shows the other side of its triangles.
TEST_F(ApiInstances, MirrorsAreThoseOfMovedVertices) {
  Grid moved(2);
  for (std::size_t i = 0; i < moved.positions.size(); i += 3) moved.positions[i] *= -1, moved.positions[i + 1] *= 2;
  const std::vector<float> mirror{-1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0}, whole{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  ballot::Scene flat(*device_, {moved.mesh()}), placed(*device_, {Grid(2).mesh()}, ballot::instances(mirror));
  ballot::Scene turned(*device_, {Grid(2).mesh()}, ballot::instances(whole));
  place(turned, mirror);
  const std::vector<ballot::Ray> rays{{{-0.4f, 1.5f, 2}, 0, {0, 0, -1}, 10}, {{-0.8f, 0.3f, -2}, 0, {0, 0, 1}, 10}};
  std::vector<ballot::Hit> hits[3];
  std::vector<float> normals[3];
  int number = 0;
  for (ballot::Scene* scene : {&flat, &placed, &turned}) {
    hits[number].resize(2), normals[number].resize(6);
    EXPECT_EQ(scene->trace(rays, {.hits = hits[number].data(), .normals = normals[number].data()}).hits, 2u);
    EXPECT_EQ(normals[number], (std::vector<float>{0, 0, -1, 0, 0, -1}));
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(hits[number][i].prim, hits[0][i].prim);
      EXPECT_NEAR(hits[number][i].u, hits[0][i].u, 1e-6f);
      EXPECT_NEAR(hits[number][i].v, hits[0][i].v, 1e-6f);
    }
    ++number;
  }
}

// A mesh moves by itself: hits are those of a new scene, bit for bit, after refits and builds. What is refused leaves
// the scene as it was.
TEST_F(ApiInstances, VerticesOfAMeshMove) {
  Grid wavy(16);
  for (std::size_t i = 2; i < wavy.positions.size(); i += 3) wavy.positions[i] = float((7 * i) % 13) * 0.05f;
  const std::vector<float> places{1,    0, 0, 0,    0, 1,    0, 0,    0, 0, 1, 0,
                                  0.5f, 0, 0, 0.2f, 0, 0.5f, 0, 0.1f, 0, 0, 1, 0.7f};
  const Grid small(2);
  const std::vector<std::uint32_t> meshes{0, 1};
  const ballot::Instances instances = ballot::instances(places, meshes);
  const auto rays = rays_onto(3000);
  std::vector<ballot::Hit> before(rays.size()), expected(rays.size()), hits(rays.size());
  ballot::Scene(*device_, {wavy.mesh(), small.mesh()}, instances).trace(rays, expected);
  for (const std::string mode : {"refit", "rebuild", "auto"}) {
    ballot::Scene scene(*device_, {grid_.mesh(), small.mesh()}, instances, {.updates = mode});
    scene.trace(rays, before);
    std::vector<float> wrong = wavy.positions;
    wrong[7] = std::numeric_limits<float>::quiet_NaN();
    move(scene, 0, wavy.positions);
    scene.trace(rays, hits);
    EXPECT_EQ(std::memcmp(hits.data(), expected.data(), hits.size() * sizeof hits[0]), 0) << mode;
    EXPECT_EQ(scene.info().refits, mode == "rebuild" ? 0u : 1u);
    EXPECT_EQ(scene.info().hi[2], 0.7f);
    EXPECT_NE(text_of([&] { move(scene, 0, wrong); }).find("vertex 2 is"), std::string::npos);
    scene.trace(rays, hits);
    EXPECT_EQ(std::memcmp(hits.data(), expected.data(), hits.size() * sizeof hits[0]), 0) << mode;
    move(scene, 0, grid_.positions);
    scene.trace(rays, hits);
    EXPECT_EQ(std::memcmp(hits.data(), before.data(), hits.size() * sizeof hits[0]), 0) << mode;
  }
}

// Every kind of answer follows a mesh that moves, also where its tree has spatial splits, which queries of crossings do
// without, and where it is so large that its tree stays on the device.
TEST_F(ApiInstances, EveryAnswerFollowsAMesh) {
  const std::vector<float> places{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  const std::pair<const char*, std::uint32_t> cases[] = {
      {"best", 16}, {"balanced", 16}, {"device", 16}, {"device", 182}};
  for (const auto& [builder, side] : cases) {
    const Grid low(side), high(side, 1);
    ballot::Scene scene(*device_, {low.mesh()}, ballot::instances(places), {.builder = builder, .split_budget = 4});
    const float point[] = {0.5f, 0.5f, 3};
    const ballot::Ray ray{{0.3f, 0.4f, 3}, 0, {0, 0, -1}, 100};
    float distance;
    for (const float z : {0.f, 1.f, 0.f}) {
      move(scene, 0, z > 0 ? high.positions : low.positions);
      scene.nearest(point, {.distances = &distance});
      EXPECT_NEAR(distance, 3 - z, side > 16 ? 1e-6 : 0) << builder;  // points on small triangles are rounded
      EXPECT_EQ(scene.meshes()[0].hi[2], z);
      const ballot::Lists crossings = scene.crossings({&ray, 1});
      ASSERT_EQ(crossings.hits.size(), 1u) << builder;
      EXPECT_NEAR(crossings.hits[0].t, 3 - z, side > 16 ? 1e-6 : 0) << builder;  // small triangles round
    }
  }
}

// A mesh may grow so that one of its instances leaves the range of coordinates, or vanish.
TEST_F(ApiInstances, MeshesThatCannotBePlacedStay) {
  const std::vector<float> places{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 4, 0, 0, 0, 0, 4, 0, 0, 0, 0, 4, 3};
  const auto rays = rays_onto(500);
  std::vector<ballot::Hit> before(rays.size()), hits(rays.size());
  ballot::Scene scene(*device_, {grid_.mesh()}, ballot::instances(places));
  scene.trace(rays, before);
  std::vector<float> large = grid_.positions;
  for (float& x : large) x *= 9e11f;
  EXPECT_NE(text_of([&] { move(scene, 0, large); }).find("instance 1: the transform moves the mesh"),
            std::string::npos);
  scene.trace(rays, hits);
  EXPECT_EQ(std::memcmp(hits.data(), before.data(), hits.size() * sizeof hits[0]), 0);
  move(scene, 0, std::vector<float>(grid_.positions.size(), 0));  // no triangle has an area
  EXPECT_EQ(scene.trace(rays, hits).hits, 0u);
  move(scene, 0, grid_.positions);
  scene.trace(rays, hits);
  EXPECT_EQ(std::memcmp(hits.data(), before.data(), hits.size() * sizeof hits[0]), 0);
}

// Pictures and rays of a view are those of a scene of moved copies.
TEST_F(ApiInstances, PicturesAreThoseOfCopies) {
  const std::vector<float> places{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -0.5f};
  Grid low(16);
  for (std::size_t i = 2; i < low.positions.size(); i += 3) low.positions[i] -= 0.5f;
  ballot::Scene placed(*device_, {grid_.mesh()}, ballot::instances(places));
  ballot::Scene copied(*device_, {grid_.mesh(), low.mesh()});
  const ballot::View view;
  const ballot::Picture picture{.width = 32, .height = 32, .samples = 2};
  EXPECT_EQ(placed.render(view, picture), copied.render(view, picture));
  const auto rays = placed.make_rays(view, "primary", 32, 32), same = copied.make_rays(view, "primary", 32, 32);
  ASSERT_EQ(rays.size(), same.size());
  EXPECT_EQ(std::memcmp(rays.data(), same.data(), rays.size() * sizeof rays[0]), 0);
  EXPECT_EQ(placed.make_rays(view, "ao", 32, 32).size(), copied.make_rays(view, "ao", 32, 32).size());
}

TEST_F(ApiInstances, WrongInstancesAreNamed) {
  const std::vector<float> good{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  std::vector<float> two = good;
  two.insert(two.end(), good.begin(), good.end());
  ballot::Scene scene(*device_, {grid_.mesh()}, ballot::instances(two));
  two[12] = two[17] = two[22] = 0;
  EXPECT_NE(text_of([&] { place(scene, two); }).find("instance 1: column 0 of the transform has 0"), std::string::npos);
  two[17] = std::numeric_limits<float>::infinity();
  EXPECT_NE(text_of([&] { place(scene, two); }).find("instance 1: entry [1][1] of the transform is inf"),
            std::string::npos);
  EXPECT_NE(text_of([&] { place(scene, good); }).find("1 transforms, but the scene has 2 instances"),
            std::string::npos);
  EXPECT_NE(text_of([&] { move(scene, 1, grid_.positions); }).find("mesh 1: the scene has no mesh of this number"),
            std::string::npos);
  EXPECT_NE(text_of([&] {
              ballot::Scene(*device_, {grid_.mesh()}, ballot::instances(good, std::vector<std::uint32_t>{3}));
            }).find("instance 0: its mesh is number 3, but there are 1 meshes"),
            std::string::npos);
  ballot::Scene plain(*device_, {grid_.mesh()});
  EXPECT_NE(text_of([&] { place(plain, two); }).find("2 transforms, but the scene has 1 instances"), std::string::npos);
  std::vector<ballot::Hit> hits(10);
  EXPECT_EQ(scene.trace(rays_onto(10), {.hits = hits.data()}).hits > 0, true);
}

TEST_F(ApiInstances, NoInstancesAreMissed) {
  const ballot::Scene scene(*device_, {grid_.mesh()}, ballot::Instances{});
  std::vector<ballot::Hit> hits(10);
  EXPECT_EQ(scene.trace(rays_onto(10), {.hits = hits.data()}).hits, 0u);
  EXPECT_EQ(scene.info().instance_triangles, 0u);
}

}  // namespace
