// Queries of points and of all crossings, as a program sees them. Runs on the default device.
#include <algorithm>
#include <cmath>
#include <limits>

#include "api.h"

namespace {

/// A closed box from -1 to 1.
struct Box {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices{0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                     2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  explicit Box(float x = 0) {
    for (int i = 0; i < 8; ++i)
      positions.insert(positions.end(), {x + (i & 1 ? 1.f : -1.f), i & 2 ? 1.f : -1.f, i & 4 ? 1.f : -1.f});
  }
  ballot::Mesh mesh(std::uint32_t id = 0) const {
    ballot::Mesh made = ballot::mesh(positions, indices);
    made.id = id;
    return made;
  }
};

constexpr float kFar = std::numeric_limits<float>::infinity();

class Points : public Api {
 protected:
  Box left_{}, right_{4};
};

TEST_F(Points, EveryResult) {
  const ballot::Scene scene(*device_, {left_.mesh(7), right_.mesh(9)});
  const float points[] = {0, 0, 3, 4.5f, 0, 0, 4, 2, 2, NAN, 0, 0};
  float distances[4], near[12], uvs[8], normals[12], signs[4];
  std::uint32_t prims[4], ids[4];
  std::uint8_t inside[4];
  const ballot::Times times = scene.nearest(points, {.distances = distances,
                                                     .points = near,
                                                     .prims = prims,
                                                     .mesh_ids = ids,
                                                     .uvs = uvs,
                                                     .normals = normals,
                                                     .signed_distances = signs,
                                                     .inside = inside});
  EXPECT_EQ(times.hits, 3u);
  EXPECT_GT(times.device_ms, 0);
  EXPECT_EQ(distances[0], 2);
  EXPECT_EQ(signs[0], 2);
  EXPECT_EQ(ids[0], 7u);
  EXPECT_TRUE(near[0] == 0 && near[1] == 0 && near[2] == 1);
  EXPECT_TRUE(normals[0] == 0 && normals[1] == 0 && normals[2] == 1);
  EXPECT_EQ(prims[0], 2u);
  EXPECT_EQ(signs[1], -0.5f);
  EXPECT_EQ(ids[1], 9u);
  EXPECT_FLOAT_EQ(distances[2], std::sqrt(2.f));
  EXPECT_EQ(distances[3], kFar);
  EXPECT_EQ(prims[3], ballot::kMiss);
  EXPECT_EQ(ids[3], ballot::kMiss);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(inside[i], i == 1);
}

TEST_F(Points, WindingNumbers) {
  std::vector<std::uint32_t> open_indices(left_.indices.begin(), left_.indices.end() - 6);
  const ballot::Scene scene(*device_, {ballot::mesh(left_.positions, open_indices)});  // without a side
  const std::vector<float> points{0, 0, 0, -0.9f, 0, 0, -3, 0, 0, 3, 0, 0, NAN, 0, 0};
  float windings[5], signs[5];
  std::uint8_t inside[5];
  scene.nearest(points, {.signed_distances = signs, .inside = inside, .windings = windings},
                {.sign = "winding", .beta = 8});
  EXPECT_NEAR(windings[0], 5.0 / 6, 1e-4);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(inside[i], i < 2) << i;
  EXPECT_EQ(signs[0], -1);
  EXPECT_NEAR(signs[2], 2, 1e-6);
  std::vector<ballot::Point> asked;
  for (std::size_t i = 0; i < 5; ++i) asked.push_back({{points[3 * i], points[3 * i + 1], points[3 * i + 2]}, kFar});
  ballot::Array<ballot::Point> in(*device_, 5);
  ballot::Array<float> windings_there(*device_, 5), signs_there(*device_, 5);
  in.write(asked);
  scene.nearest(in, {{"windings", windings_there}, {"signed_distances", signs_there}}, 5,
                {.sign = "winding", .beta = 8});
  std::vector<float> read(5);
  windings_there.read(read);
  EXPECT_TRUE(std::equal(read.begin(), read.end(), windings));
  signs_there.read(read);
  EXPECT_TRUE(std::equal(read.begin(), read.end(), signs));
  EXPECT_EQ(code_of([&] { scene.nearest(points, {.windings = windings}, {.beta = 0.5f}); }), BALLOT_ERROR_ARGUMENT);
}

TEST_F(Points, LimitsAndStrides) {
  const ballot::Scene scene(*device_, {left_.mesh()});
  const float points[] = {0, 0, 2, 99, 0, 0, 4, 99};
  float distances[2];
  auto from = ballot_points(points, 2);
  float limit = 1.5f;
  from.at.stride[0] = 16, from.limit.data = &limit;
  auto to = BALLOT_INIT(BallotNearest);
  to.distances = distances;
  ballot::check(ballot_query_points(scene.handle(), &from, &to, nullptr, nullptr));
  EXPECT_EQ(distances[0], 1);
  EXPECT_EQ(distances[1], kFar);
  for (const float wrong : {-1.f, 0.f, float(NAN)}) {
    limit = wrong;
    EXPECT_EQ(ballot_query_points(scene.handle(), &from, &to, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  }
  from.limit.data = nullptr, from.at.data = nullptr;
  EXPECT_EQ(ballot_query_points(scene.handle(), &from, &to, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(ballot_query_points(scene.handle(), nullptr, &to, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  EXPECT_THROW(scene.nearest(std::span(points).first(4), {.distances = distances}), ballot::Error);
}

TEST_F(Points, OpenMeshesAreRefused) {
  left_.indices.resize(33);
  const ballot::Scene scene(*device_, {left_.mesh()});
  const float point[] = {0, 0, 0};
  float distance;
  std::uint8_t inside = 7;
  scene.nearest(point, {.distances = &distance});
  EXPECT_EQ(distance, 1);
  try {
    scene.nearest(point, {.inside = &inside});
    FAIL();
  } catch (const ballot::Error& error) {
    EXPECT_EQ(error.code(), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(std::string(error.what()).find("3 of its 18 edges"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("assume_closed"), std::string::npos) << error.what();
  }
  EXPECT_EQ(inside, 7);
  scene.nearest(point, {.inside = &inside}, {.assume_closed = true});
  EXPECT_LE(inside, 1);
}

TEST_F(Points, SignsByPseudonormals) {
  left_.indices.resize(33);
  const float points[] = {0, 0, 0, 0, 0, 3, 3, 0, 0, NAN, 0, 0};
  float signs[4];
  std::uint8_t inside[4];
  for (const char* numeric : {"watertight", "exact"}) {
    const ballot::Scene scene(*device_, {left_.mesh()});
    const ballot::Query query{.numeric = numeric, .sign = "pseudonormal"};
    scene.nearest(points, {.signed_distances = signs, .inside = inside}, query);
    EXPECT_EQ(signs[0], -1);
    EXPECT_EQ(signs[1], 2);
    EXPECT_GT(signs[2], 0);
    EXPECT_EQ(signs[3], kFar);
    EXPECT_TRUE(inside[0] && !inside[1] && !inside[2] && !inside[3]);
    std::ranges::fill(inside, std::uint8_t(7));
    scene.nearest(points, {.inside = inside}, query);
    EXPECT_TRUE(inside[0] && !inside[1] && !inside[2] && !inside[3]);
  }
  std::swap(left_.indices[0], left_.indices[1]);
  const ballot::Scene turned(*device_, {left_.mesh()});
  const auto refused = [&](const char* sign) {
    try {
      turned.nearest(points, {.signed_distances = signs}, {.sign = sign});
    } catch (const ballot::Error& error) {
      EXPECT_EQ(error.code(), BALLOT_ERROR_ARGUMENT);
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refused("pseudonormal").find("at 3 of the 18 edges both run in the same direction"), std::string::npos)
      << refused("pseudonormal");
  EXPECT_NE(refused("odd").find("sign is 'odd'; expected parity, pseudonormal or winding"), std::string::npos);
  turned.nearest(points, {.signed_distances = signs}, {.sign = "pseudonormal", .assume_closed = true});
}

/// Answers on the device are those for arrays of the host.
TEST_F(Points, ArraysOnTheDevice) {
  const ballot::Scene scene(*device_, {left_.mesh(7), right_.mesh(9)});
  std::vector<ballot::Point> points;
  std::vector<float> given;
  for (int i = 0; i < 3000; ++i) {
    const float x = -2 + 0.0021f * float(i), y = 1.5f * std::sin(0.1f * float(i)),
                z = 1.5f * std::cos(0.07f * float(i));
    points.push_back({{x, y, z}, kFar});
    given.insert(given.end(), {x, y, z});
  }
  const std::size_t n = points.size();
  std::vector<float> distances(n), signs(n), near(3 * n), uvs(2 * n), found_signs(n);
  std::vector<std::uint8_t> inside(n);
  std::vector<ballot::NearestPoint> found(n);
  std::vector<std::uint32_t> found_inside(n);
  ballot::Array<ballot::Point> in(*device_, n);
  ballot::Array<ballot::NearestPoint> nearest(*device_, n);
  ballot::Array<float> signed_there(*device_, n);
  ballot::Array<std::uint32_t> inside_there(*device_, n);
  in.write(points);
  for (const char* numeric : {"watertight", "exact"})
    for (const char* sign : {"parity", "pseudonormal"}) {
      const ballot::Query query{.numeric = numeric, .sign = sign};
      scene.nearest(given,
                    {.distances = distances.data(),
                     .points = near.data(),
                     .uvs = uvs.data(),
                     .signed_distances = signs.data(),
                     .inside = inside.data()},
                    query);
      signed_there.write(std::vector<float>(n, 77));
      EXPECT_GT(scene.nearest(in, {{"nearest", nearest}}, n, query).device_ms, 0);
      scene.nearest(in, {{"signed_distances", signed_there}}, n - 10, query);
      scene.nearest(in, {{"inside", inside_there}}, n, query);
      nearest.read(found), signed_there.read(found_signs), inside_there.read(found_inside);
      for (std::size_t i = 0; i < n; ++i) {
        ASSERT_EQ(found[i].distance, distances[i]) << i;
        ASSERT_TRUE(found[i].at[0] == near[3 * i] && found[i].u == uvs[2 * i] && found[i].v == uvs[2 * i + 1]) << i;
        ASSERT_EQ(found_signs[i], i < n - 10 ? signs[i] : 77) << i;
        ASSERT_EQ(found_inside[i], inside[i]) << i;
      }
    }
  const auto code_of = [&](const auto& call) {
    try {
      call();
    } catch (const ballot::Error& error) {
      return error.code();
    }
    return ballot::Code(0);
  };
  EXPECT_EQ(code_of([&] { scene.nearest(in, {{"signed_distances", signed_there}}, n + 1); }), BALLOT_ERROR_ARGUMENT);
  const BallotOutput wrong[] = {{"inside", in}, {"inside", signed_there}, {"t", signed_there}, {"inside", {}}};
  for (const BallotOutput& output : wrong)
    EXPECT_NE(ballot_query_point_buffers(scene.handle(), in.handle(), 1, &output, 1, nullptr, nullptr), BALLOT_OK);
  EXPECT_EQ(ballot_query_point_buffers(scene.handle(), signed_there.handle(), 1, wrong, 1, nullptr, nullptr),
            BALLOT_ERROR_ARGUMENT);
  const ballot::Device other;
  ballot::Array<ballot::Point> elsewhere(other, n);
  EXPECT_EQ(code_of([&] { scene.nearest(elsewhere, {{"signed_distances", signed_there}}, n); }), BALLOT_ERROR_ARGUMENT);
  right_.indices.resize(33);
  const ballot::Scene open(*device_, {right_.mesh()});
  EXPECT_EQ(code_of([&] { open.nearest(in, {{"signed_distances", signed_there}}, n); }), BALLOT_ERROR_ARGUMENT);
  open.nearest(in, {{"nearest", nearest}}, n);
  open.nearest(in, {{"signed_distances", signed_there}}, n, {.sign = "pseudonormal"});
}

TEST_F(Points, AScenesAnswersFollowItsVertices) {
  ballot::Scene scene(*device_, {left_.mesh()});
  const float point[] = {4.25f, 0, 0};
  float distance;
  scene.nearest(point, {.signed_distances = &distance});
  EXPECT_EQ(distance, 3.25f);
  move(scene, 0, right_.positions);
  scene.nearest(point, {.signed_distances = &distance});
  EXPECT_EQ(distance, -0.75f);
  const ballot::Ray ray{{9, 0.25f, 0.5f}, 0, {-1, 0, 0}, 100};
  EXPECT_EQ(scene.count_crossings({&ray, 1})[0], 2);
}

// Of instances everything is asked as of moved copies. Results name the mesh and the triangle in it.
TEST_F(Points, Instances) {
  const std::vector<float> places{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 2, 9};
  const std::vector<std::uint32_t> meshes{0, 1};
  ballot::Scene scene(*device_, {left_.mesh(7), right_.mesh(9)}, ballot::instances(places, meshes));
  const float points[] = {0, 0, 3, 4.5f, 0, 8, 0.5f, 0, 0};
  float distances[3], signs[3], normals[9];
  std::uint32_t prims[3], ids[3];
  std::uint8_t inside[3];
  scene.nearest(points, {.distances = distances,
                         .prims = prims,
                         .mesh_ids = ids,
                         .normals = normals,
                         .signed_distances = signs,
                         .inside = inside});
  EXPECT_EQ(distances[0], 2);
  EXPECT_EQ(ids[0], 7u);
  EXPECT_EQ(prims[0], 2u);
  EXPECT_EQ(normals[2], 1);
  EXPECT_EQ(ids[1], 9u);
  EXPECT_LT(prims[1], 12u);
  EXPECT_EQ(inside[0], 0u);
  EXPECT_EQ(inside[1], 1u);
  EXPECT_EQ(signs[1], -0.5f);
  EXPECT_EQ(inside[2], 1u);
  const ballot::Ray ray{{0.25f, 0.5f, 20}, 0, {0, 0, -1}, 100};
  EXPECT_EQ(scene.count_crossings({&ray, 1})[0], 2);
  const ballot::Lists all = scene.crossings({&ray, 1});
  EXPECT_EQ(all.hits.size(), 2u);
}

TEST_F(Points, Crossings) {
  const ballot::Scene scene(*device_, {left_.mesh(7), right_.mesh(9)});
  const ballot::Ray rays[] = {{{-9, 0, 0}, 0, {1, 0, 0}, 100},          // through the diagonal of four sides
                              {{-9, 0.25f, 0.5f}, 0, {1, 0, 0}, 9},     // up to the middle of the first
                              {{-9, 5, 0}, 0, {1, 0, 0}, 100},          // beside
                              {{-9, 0, 0}, 0, {1, 0, 0}, float(NAN)}};  // dead
  EXPECT_EQ(scene.count_crossings(rays), (std::vector<std::int64_t>{4, 1, 0, 0}));
  const ballot::Lists all = scene.crossings(rays), two = scene.crossings(rays, {.first = 2});
  EXPECT_EQ(all.counts, (std::vector<std::int64_t>{4, 1, 0, 0}));
  ASSERT_EQ(all.hits.size(), 5u);
  const float t[] = {8, 10, 12, 14, 8};
  for (int i = 0; i < 5; ++i) EXPECT_FLOAT_EQ(all.hits[std::size_t(i)].t, t[i]);
  EXPECT_GE(all.hits[2].prim, 12u);
  EXPECT_EQ(two.counts, (std::vector<std::int64_t>{2, 1, 0, 0}));
  EXPECT_EQ(two.hits.size(), 3u);
  EXPECT_TRUE(scene.crossings(std::span<const ballot::Ray>()).hits.empty());
  const BallotRays r = ballot_rays(rays, 4);
  auto lists = BALLOT_INIT(BallotLists);
  lists.take = [](void*, std::uint64_t, std::size_t, const std::uint32_t*, const BallotHit*) { return 1; };
  EXPECT_EQ(ballot_list_crossings(scene.handle(), &r, &lists, nullptr, nullptr), BALLOT_ERROR_INTERRUPTED);
}

/// Nearest, any and first hits with filters are the first crossings with them.
TEST_F(Points, FiltersOfHits) {
  const ballot::Scene scene(*device_, {left_.mesh(7), right_.mesh(9)});
  const ballot::Ray rays[] = {{{-9, 0, 0}, 0, {1, 0, 0}, 100}, {{-9, 9, 0}, 0, {1, 0, 0}, 100}};
  for (const char* numeric : {"watertight", "exact"}) {
    const ballot::Lists all = scene.crossings(rays, {.numeric = numeric, .cull = "front"});
    EXPECT_EQ(all.offsets, (std::vector<std::int64_t>{0, 2, 2}));
    ballot::Hit hit[2], first[6];
    std::uint8_t blocked[2];
    scene.trace(rays, {.hits = hit}, {.numeric = numeric, .cull = "front"});
    scene.trace(rays, {.hits = first}, {.first = 3, .numeric = numeric, .cull = "front"});
    scene.trace(rays, {.occluded = blocked}, {.any = true, .numeric = numeric, .cull = "front"});
    EXPECT_EQ(hit[0].t, all.hits[0].t);
    EXPECT_EQ(first[1].prim, all.hits[1].prim);
    EXPECT_TRUE(blocked[0] && !blocked[1]);
    for (const ballot::Hit& miss : {hit[1], first[2], first[3]}) {
      EXPECT_EQ(miss.prim, ballot::kMiss);
      EXPECT_EQ(miss.t, kFar);
    }
  }
  EXPECT_THROW(scene.trace(rays, ballot::Results{}, {.sign = "parity"}), ballot::Error);
  EXPECT_THROW(scene.crossings(rays, {.method = "packet"}), ballot::Error);
}

TEST_F(Points, Within) {
  const ballot::Scene scene(*device_, {left_.mesh(7), right_.mesh(9)});
  const std::vector<float> points{0, 0, 0, 0, 0, 3, NAN, 0, 0};
  const ballot::Lists near = scene.within({.at = points, .limit = 2});
  EXPECT_EQ(near.counts, (std::vector<std::int64_t>{12, 2, 0}));
  EXPECT_EQ(near.offsets, (std::vector<std::int64_t>{0, 12, 14, 14}));
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(near.hits[i].t, 1);
  EXPECT_EQ(near.hits[12].t, 2);
  EXPECT_EQ(scene.within({.at = points, .limit = 0}).hits.size(), 0u);
  EXPECT_THROW(scene.within({.at = points, .limit = -1}), ballot::Error);
  EXPECT_THROW(scene.within({.at = points}), ballot::Error);
  EXPECT_THROW(scene.within({.at = points, .limit = 1}, {.numeric = "exact"}), ballot::Error);
}

TEST_F(Points, FiltersOfCrossings) {
  ballot::Scene scene(*device_, {left_.mesh(7), right_.mesh(9)});
  const ballot::Ray rays[] = {{{-9, 0, 0}, 0, {1, 0, 0}, 100}, {{-9, 0.25f, 0.5f}, 0, {1, 0, 0}, 100}};
  const std::uint32_t parts[] = {0, 1}, masks[] = {1, 2}, of_rays[] = {2, 3};
  ballot::RayView masked = ballot::rays(rays);
  masked.masks = of_rays;
  scene.set_masks(parts, masks);
  scene.commit();
  for (const char* numeric : {"watertight", "exact"}) {
    EXPECT_EQ(scene.count_crossings(rays, {.numeric = numeric}), (std::vector<std::int64_t>{4, 4}));
    EXPECT_EQ(scene.count_crossings(rays, {.numeric = numeric, .cull = "back"}), (std::vector<std::int64_t>{2, 2}));
    EXPECT_EQ(scene.count_crossings(masked, {.numeric = numeric}), (std::vector<std::int64_t>{2, 4}));
    const ballot::Lists backs = scene.crossings(masked, {.first = 1, .numeric = numeric, .cull = "front"});
    ASSERT_EQ(backs.counts, (std::vector<std::int64_t>{1, 1}));
    EXPECT_EQ(backs.hits[0].t, 14);
    EXPECT_EQ(backs.hits[1].t, 10);
  }
  const auto expect_refused = [&](const ballot::Query& query, const char* what) {
    try {
      scene.count_crossings(rays, query);
      ADD_FAILURE() << what;
    } catch (const ballot::Error& error) {
      EXPECT_EQ(error.code(), BALLOT_ERROR_ARGUMENT);
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  expect_refused({.numeric = "plain"}, "numeric is 'plain'; expected watertight or exact");
  expect_refused({.cull = "sideways"}, "cull is 'sideways'; expected none, back or front");
  // Arrays have no materials: every surface is opaque.
  EXPECT_EQ(scene.count_crossings(rays, {.alpha = true}), (std::vector<std::int64_t>{4, 4}));
  expect_refused({.numeric = "exact", .alpha = true}, "alpha is 1 and numeric is 'exact'");
}

TEST_F(Points, ExactPoints) {
  const ballot::Scene scene(*device_, {left_.mesh(7), right_.mesh(9)});
  const float points[] = {2, 0, 0, 0, 0, 0, 1e30f, 0, 0, NAN, 0, 0};
  float distances[4];
  std::uint32_t ids[4];
  std::uint8_t inside[4];
  scene.nearest(points, {.distances = distances, .mesh_ids = ids, .inside = inside}, {.numeric = "exact"});
  EXPECT_EQ(distances[0], 1);
  EXPECT_EQ(ids[0], 7u);  // both boxes are as near
  EXPECT_FLOAT_EQ(distances[2], 1e30f);
  EXPECT_EQ(distances[3], kFar);
  EXPECT_TRUE(!inside[0] && inside[1] && !inside[2] && !inside[3]);
  EXPECT_THROW(scene.nearest(points, {.distances = distances}, {.numeric = "fast"}), ballot::Error);
}

}  // namespace
