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
    EXPECT_EQ(error.code(), ballot::Code::Argument) << error.what();
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
  ballot::Scene scene(*device_, {grid_.mesh(7), small.mesh(9)}, {.transforms = transforms, .meshes = meshes});
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
  scene.update_instances(lifted);
  scene.trace(rays, out);
  EXPECT_EQ(t[0], 1);
  EXPECT_EQ(t[1], 1);
  std::vector<float> apart;  // the same, each matrix in 64 bytes
  for (std::size_t i = 0; i < 3; ++i) {
    apart.insert(apart.end(), &transforms[12 * i], &transforms[12 * i] + 12);
    apart.insert(apart.end(), 4, -7.f);
  }
  scene.update_instances(apart, 64);
  scene.trace(rays, out);
  EXPECT_EQ(t[0], 1.5f);
  scene.update_instances(lifted);
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
  ballot::Scene flat(*device_, {moved.mesh()}), placed(*device_, {Grid(2).mesh()}, {.transforms = mirror});
  ballot::Scene turned(*device_, {Grid(2).mesh()}, {.transforms = whole});
  turned.update_instances(mirror);
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

TEST_F(ApiInstances, WrongInstancesAreNamed) {
  const std::vector<float> good{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  std::vector<float> two = good;
  two.insert(two.end(), good.begin(), good.end());
  ballot::Scene scene(*device_, {grid_.mesh()}, {.transforms = two});
  two[12] = two[17] = two[22] = 0;
  EXPECT_NE(text_of([&] { scene.update_instances(two); }).find("instance 1: column 0 of the transform has 0"),
            std::string::npos);
  two[17] = std::numeric_limits<float>::infinity();
  EXPECT_NE(text_of([&] { scene.update_instances(two); }).find("instance 1: entry [1][1] of the transform is inf"),
            std::string::npos);
  EXPECT_NE(text_of([&] { scene.update_instances(good); }).find("1 transforms, but the scene has 2 instances"),
            std::string::npos);
  EXPECT_NE(text_of([&] { scene.update(0, grid_.positions); }).find("the scene is one of instances"),
            std::string::npos);
  EXPECT_NE(text_of([&] { scene.render({}, {}); }).find("picture: the scene is one of instances"), std::string::npos);
  EXPECT_NE(text_of([&] {
              ballot::Scene(*device_, {grid_.mesh()}, {.transforms = good, .meshes = std::vector<std::uint32_t>{3}});
            }).find("instance 0: its mesh is number 3, but there are 1 meshes"),
            std::string::npos);
  ballot::Scene plain(*device_, {grid_.mesh()});
  EXPECT_NE(text_of([&] { plain.update_instances(good); }).find("the scene has no instances"), std::string::npos);
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
