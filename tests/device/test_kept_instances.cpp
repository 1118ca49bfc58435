// Scenes that keep their meshes once: pictures, rays and hits are those of moved copies but for rounding, and hold to
// the oracles.
#include <cmath>

#include "engine/answer/point_queries.h"
#include "engine/scene/device_scene.h"
#include "tests/cpu/animated.h"
#include "tests/cpu/shapes.h"
#include "tests/device/crossing_test.h"

namespace ballot {
namespace {

using namespace test;

constexpr std::uint32_t kPictureSide = 40;

int vec2(GltfBuilder& b, const std::vector<float>& values) {
  return b.accessor(b.view(values), 5126, values.size() / 2, "VEC2");
}

/// Adds a sphere of triangles with normals and texture coordinates, and a material.
void add_ball(GltfBuilder& b, nlohmann::json material) {
  std::vector<float> positions, normals, uvs;
  for (const Triangle& t : shapes::sphere(2))
    for (const glm::vec3& v : t) {
      for (int axis = 0; axis < 3; ++axis) positions.push_back(v[axis] / 2), normals.push_back(v[axis]);
      uvs.insert(uvs.end(), {v.x + 1, v.y});
    }
  const int mesh = b.mesh(b.vec3(positions));
  auto& attributes = b.primitive(mesh)["attributes"];
  attributes["NORMAL"] = b.vec3(normals);
  attributes["TEXCOORD_0"] = vec2(b, uvs);
  b.json["materials"].push_back(std::move(material));
  b.primitive(mesh)["material"] = b.json["materials"].size() - 1;
}

/// Returns a file of balls above a floor: painted, glowing, of glass and half transparent, each used several times,
/// mirrored, sheared, turned and stretched. A clip moves one of them, and turns another.
AnimatedBuilder balls(bool with_alpha = false) {
  AnimatedBuilder b;
  b.json["materials"] = nlohmann::json::array();
  add_ball(b, {{"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.3, 0.2, 1}}, {"metallicFactor", 0}}}});
  add_ball(b, {{"emissiveFactor", {1, 0.9, 0.7}}, {"pbrMetallicRoughness", {{"metallicFactor", 0}}}});
  add_ball(b, {{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 1}}}}},
               {"pbrMetallicRoughness", {{"roughnessFactor", 0}, {"metallicFactor", 0}}}});
  if (with_alpha) {
    b.json["materials"][0]["alphaMode"] = "BLEND";
    b.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][3] = 0.6;
  }
  b.json["extensionsUsed"] = {"KHR_materials_transmission"};
  const int floor = b.mesh(b.vec3({-4, -1, -4, -4, -1, 4, 4, -1, 4, -4, -1, -4, 4, -1, 4, 4, -1, -4}));
  b.node({{"mesh", 0}, {"translation", {-1, 0, 0}}});
  b.node({{"mesh", 0}, {"translation", {0.2, -0.2, 0.4}}, {"scale", {-1.2, 0.8, 0.6}}, {"rotation", {0, 0, 0.6, 0.8}}});
  b.node({{"mesh", 0}, {"matrix", {1, 0.4, 0, 0, 0, 1, 0.3, 0, 0.5, 0, 1, 0, 1.1, 0.1, -0.5, 1}}});
  b.node({{"mesh", floor}});
  b.node({{"mesh", 1}, {"translation", {-0.6, 1.3, 0.2}}, {"scale", {0.5, -0.2, 0.5}}});
  b.node({{"mesh", 1}, {"translation", {1, 1.2, 0.4}}, {"rotation", {0.6, 0, 0, 0.8}}, {"scale", {0.3, 0.3, 0.8}}});
  b.node({{"mesh", 2}, {"translation", {-0.3, -0.5, 1}}, {"scale", {0.7, 0.7, 0.7}}});
  b.node({{"mesh", 2}, {"translation", {0.9, -0.5, 0.9}}, {"scale", {-0.8, 0.8, 0.8}}});
  const int moves = b.vec3({-1, 0, 0, -1, 0.8f, 0.3f}), turns = b.vec4({0, 0, 0.6f, 0.8f, 0.6f, 0, 0, 0.8f});
  b.channel(0, "translation", {0, 1}, moves);
  b.channel(1, "rotation", {0, 1}, turns);
  return b;
}

Scene loaded(const GltfBuilder& b, InstancePolicy policy) {
  Scene scene = b.load({.instances = policy});
  View view{.name = "front", .world_from_camera = glm::dmat4(1), .yfov = 0.9};
  view.world_from_camera[3] = {0.1, 0.2, 4, 1};
  scene.views = {view};
  return scene;
}

class KeptInstances : public DeviceTest {
 protected:
  static std::unique_ptr<DeviceScene> world_of(Scene scene) {
    DeviceSceneOptions options;
    options.context = gpu_;
    options.use_cache = false;
    return std::make_unique<DeviceScene>(std::move(scene), options);
  }
  /// Two engines with the same scene: with its meshes kept, and with copies.
  struct Both {
    std::unique_ptr<DeviceScene> kept, copied;
  };
  static Both both(const GltfBuilder& b) {
    return {world_of(loaded(b, InstancePolicy::Keep)), world_of(loaded(b, InstancePolicy::Copy))};
  }
  static Image picture(DeviceScene& world, const std::string& shading) {
    RenderOptions o{
        .width = kPictureSide, .height = kPictureSide, .spp = 4, .shading = shading, .bounces = 4, .ao_radius = 0.2f};
    o.query.method = "while-while";
    return world.render(world.scene().views[0], o);
  }
};

/// Compares two pictures. Where rounding changes what a ray hits, a pixel may differ: at the rims of triangles, and
/// where a path meets a rim.
void expect_alike(const Image& a, const Image& b, const std::string& what, double most_share) {
  const std::size_t pixels = std::size_t(kPictureSide) * kPictureSide;
  std::size_t others = 0;
  double sum_a = 0, sum_b = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    bool same = a.channel("prim").uints[i] == b.channel("prim").uints[i];
    for (const char* name : {"R", "G", "B", "Z", "N.X", "N.Y", "N.Z"}) {
      const float x = a.channel(name).floats[i], y = b.channel(name).floats[i];
      same = same && std::abs(x - y) <= 2e-3f * (1 + std::abs(y));
      if (*name == 'G') sum_a += x, sum_b += y;
    }
    others += same ? 0 : 1;
  }
  EXPECT_LE(double(others), most_share * double(pixels)) << what;
  EXPECT_NEAR(sum_a, sum_b, 0.01 * sum_b) << what;
  EXPECT_GT(sum_b, 0) << what;
}

// Their queries of points are those of copies but for rounding, and so is what is known of their edges.
TEST_F(KeptInstances, PointsAndEdgesAreThoseOfCopies) {
  const Both e = both(balls());
  const Topology &kept = e.kept->topology(), &copied = e.copied->topology();
  EXPECT_EQ(kept.triangles, copied.triangles);
  EXPECT_EQ(kept.edges, copied.edges);
  EXPECT_EQ(kept.open, copied.open);
  EXPECT_EQ(kept.flipped, 0u);
  ASSERT_EQ(kept.first_boundary.size(), copied.first_boundary.size());
  for (std::size_t i = 0; i < kept.first_boundary.size(); ++i)
    EXPECT_EQ(kept.first_boundary[i].prim, copied.first_boundary[i].prim);
  shapes::Random random(8);
  for (const double time : {-1.0, 0.7}) {
    if (time >= 0)
      for (DeviceScene* world : {e.kept.get(), e.copied.get()}) world->set_time(0, time);
    std::vector<ProbePoint> points;
    for (int i = 0; i < 1000; ++i) points.push_back({random.point(2), std::numeric_limits<float>::infinity()});
    std::vector<Nearest> a(points.size()), b(points.size());
    std::vector<std::uint32_t> in_a(points.size()), in_b(points.size());
    std::size_t others = 0;
    for (const auto& [world, near, inside] : {std::tuple(e.kept.get(), &a, &in_a), {e.copied.get(), &b, &in_b}}) {
      world->points().nearest(points, *near, {.sides = true});
      world->points().inside(points, *inside);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(a[i].distance, b[i].distance, 4e-6f) << i;
      others += a[i].prim != b[i].prim || a[i].behind != b[i].behind || in_a[i] != in_b[i];
    }
    EXPECT_LE(others, 5u);
  }
}

TEST_F(KeptInstances, PicturesAreThoseOfCopies) {
  const Both e = both(balls());
  ASSERT_TRUE(e.kept->forest());
  EXPECT_FALSE(e.copied->forest());
  EXPECT_EQ(e.kept->triangle_count(), e.copied->triangle_count());
  for (const auto& [shading, share] : {std::pair<const char*, double>("eyelight", 0.005),
                                       {"normals", 0.005},
                                       {"ao", 0.02},
                                       {"whitted", 0.03},
                                       {"path", 0.04}})
    expect_alike(picture(*e.kept, shading), picture(*e.copied, shading), shading, share);
  const RenderOptions o{.width = kPictureSide, .height = kPictureSide};
  EXPECT_NE(e.kept->made_of(e.kept->scene().views[0], o), e.copied->made_of(e.copied->scene().views[0], o));
}

// A mirrored ball of glass is one of glass, not a bubble of air in it: what is behind it looks as through its like.
TEST_F(KeptInstances, MirroredGlassIsGlass) {
  const auto seen = [](float sign, InstancePolicy policy) {
    GltfBuilder b;
    b.json["materials"] = nlohmann::json::array();
    add_ball(b, {{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 1}}}}},
                 {"pbrMetallicRoughness", {{"roughnessFactor", 0}, {"metallicFactor", 0}}}});
    b.json["materials"].push_back({{"emissiveFactor", {1, 1, 1}}});
    const int floor = b.mesh(b.vec3({-9, -1, -9, -9, -1, 9, 9, -1, 9, -9, -1, -9, 9, -1, 9, 9, -1, -9}));
    b.primitive(floor)["material"] = 1;
    b.json["extensionsUsed"] = {"KHR_materials_transmission"};
    b.node({{"mesh", 0}, {"scale", {sign * 2.5, 2.5, 2.5}}});
    b.node({{"mesh", 0}, {"translation", {0, 40, 0}}});
    b.node({{"mesh", floor}});
    return picture(*world_of(loaded(b, policy)), "whitted");
  };
  const Image plain = seen(1, InstancePolicy::Copy);
  double whole = 0;
  for (const float g : plain.channel("G").floats) whole += g;
  for (const InstancePolicy policy : {InstancePolicy::Copy, InstancePolicy::Keep}) {
    const Image mirrored = seen(-1, policy);
    double apart = 0;
    for (std::size_t i = 0; i < plain.channel("G").floats.size(); ++i)
      apart += std::abs(plain.channel("G").floats[i] - mirrored.channel("G").floats[i]);
    EXPECT_LT(apart, 0.02 * whole);
  }
}

// Instances that a clip mirrors take the mesh that is turned, and back.
TEST_F(KeptInstances, ClipsThatMirrorThem) {
  AnimatedBuilder b = balls();
  const int scales = b.vec3({1, 1, 1, 1, -1, 1});
  b.channel(0, "scale", {0, 1}, scales);
  const Both e = both(b);
  for (const double seconds : {0.75, 0.25, 1.0}) {
    e.kept->set_time(0, seconds);
    e.copied->set_time(0, seconds);
    for (const char* shading : {"normals", "whitted"})
      expect_alike(picture(*e.kept, shading), picture(*e.copied, shading), std::to_string(seconds), 0.03);
  }
}

TEST_F(KeptInstances, TransparentOnesToo) {
  const Both e = both(balls(true));
  // Whether a half transparent surface stops a ray hangs on the bits of the ray, which are the same at the camera.
  expect_alike(picture(*e.kept, "eyelight"), picture(*e.copied, "eyelight"), "alpha", 0.01);
}

TEST_F(KeptInstances, RaysOfEveryKindHoldToTheOracles) {
  const auto world = world_of(loaded(balls(), InstancePolicy::Keep));
  for (const RayKind& kind : kRayKinds) {
    if (kind.name == "secondary") continue;  // reflect and refract
    const auto batch = world->make_batch(world->scene().views[0], kind, kPictureSide, kPictureSide, {.ao_rays = 2});
    ASSERT_GT(batch->count(), 0u);
    const ExactTruth truth = world->checker().exact_truth(*batch);
    for (const char* numeric : {"watertight", "exact"}) {
      if (std::string_view(numeric) == "exact" && !gpu_->info().float64) continue;
      const ErrorFigures f = world->checker().verify(*batch, truth, {.method = "while-while", .numeric = numeric}, 2);
      EXPECT_EQ(f.beyond_bound + f.wrong_values + f.unwritten + f.self_hits, 0u) << kind.name << " " << numeric;
      EXPECT_EQ(std::string_view(numeric) == "exact" ? f.errors() : 0, 0u) << kind.name;
      for (const ErrorCase& error : f.cases) EXPECT_TRUE(error.within_bound) << in_words(error);
    }
    const HitCheck check = world->checker().check(*batch, world->checker().truth(*batch), {.method = "while-while"});
    EXPECT_EQ(check.judgement.errors() + check.unwritten, 0u) << kind.name;
  }
}

TEST_F(KeptInstances, EveryOffsetLeavesItsTriangle) {
  GltfBuilder b = balls();  // far from zero, where coordinates are coarse
  for (auto& node : b.json["nodes"]) {
    if (node.contains("matrix"))
      node["matrix"][12] = node["matrix"][12].get<double>() + 3000;
    else
      node["translation"] = {node.value("translation", std::vector<double>{0, 0, 0})[0] + 3000,
                             node.value("translation", std::vector<double>{0, 0, 0})[1],
                             node.value("translation", std::vector<double>{0, 0, 0})[2]};
  }
  b.json.erase("animations");
  Scene scene = loaded(b, InstancePolicy::Keep);
  scene.views[0].world_from_camera[3].x += 3000;
  const auto world = world_of(std::move(scene));
  for (const char* policy : {"proved", "bounded"})
    for (const char* kind : {"reflect", "refract", "diffuse"}) {
      const auto batch = world->make_batch(world->scene().views[0], find_ray_kind(kind), kPictureSide, kPictureSide,
                                           {.offset = policy});
      const ExactTruth truth = world->checker().exact_truth(*batch);
      EXPECT_EQ(world->checker().verify(*batch, truth, {.method = "while-while"}).self_hits, 0u)
          << policy << " " << kind;
    }
}

TEST_F(KeptInstances, ClosedMeshesDoNotLeak) {
  const auto world = world_of(loaded(balls(), InstancePolicy::Keep));
  std::vector<Ray> rays;
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  const Forest& forest = *world->forest();
  for (const Transform& t : forest.transforms())
    for (int i = 0; i < 400; ++i)
      rays.push_back({{t.m[0][3], t.m[1][3], t.m[2][3]}, 0, {normal(random), normal(random), normal(random)}, 1e30f});
  std::vector<Hit> hits(rays.size());
  world->trace(rays, hits, {.method = "while-while"});
  std::size_t first = 0, leaks = 0;
  for (const Instance& i : forest.instances()) {
    const bool closed = forest.meshes()[i.mesh].triangles.size() > 2;  // the floor is open
    for (std::size_t k = 0; k < 400; ++k) leaks += closed && hits[first + k].prim == NO_HIT;
    first += 400;
  }
  EXPECT_EQ(leaks, 0u);
}

TEST_F(KeptInstances, AnimationsMoveThem) {
  const Both e = both(balls());
  const std::uint64_t generation = e.kept->tracer().tree().generation();
  for (const double seconds : {1.0, 0.25}) {
    e.kept->set_time(0, seconds);
    e.copied->set_time(0, seconds);
    expect_alike(picture(*e.kept, "eyelight"), picture(*e.copied, "eyelight"), std::to_string(seconds), 0.01);
  }
  EXPECT_NE(e.kept->tracer().tree().generation(), generation);
  EXPECT_FALSE(e.kept->last_update().refitted);
}

// Crossings of kept meshes are those of copies but for rounding, also those that culling and alpha leave, while a clip
// moves and mirrors instances.
TEST_F(KeptInstances, CrossingsAreThoseOfCopies) {
  AnimatedBuilder b = balls();
  b.json["materials"][0]["alphaMode"] = "MASK";
  b.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][3] = 0.3;  // stops nothing
  const int scales = b.vec3({1, 1, 1, -1, 1, 1});
  b.channel(1, "scale", {0, 1}, scales);
  const Both e = both(b);
  std::vector<Ray> rays = e.kept->make_batch(e.kept->scene().views[0], find_ray_kind("primary"), 64, 64)->rays();
  for (const double seconds : {0.0, 0.75, 0.25}) {
    e.kept->set_time(0, seconds);
    e.copied->set_time(0, seconds);
    std::vector<std::vector<Hit>> whole;
    for (const CrossingQuery& query :
         {CrossingQuery{}, {.cull = Cull::Back}, {.alpha = true}, {.most = 2}, {.exact = true, .cull = Cull::Front}}) {
      const auto kept = CrossingTest::lists(e.kept->rays(), rays, query),
                 copied = CrossingTest::lists(e.copied->rays(), rays, query);
      std::size_t others = 0, crossings = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        others += CrossingTest::prims_of(kept[i]) != CrossingTest::prims_of(copied[i]);
        crossings += kept[i].size();
      }
      EXPECT_LE(others, rays.size() / 100);
      EXPECT_GT(crossings, rays.size() / 4);
      if (whole.empty()) whole = kept;
      for (std::size_t i = 0; query.alpha && i < rays.size(); ++i) {
        std::erase_if(whole[i], [&](const Hit& h) { return e.copied->scene().material(h.prim) == 0; });
        ASSERT_EQ(CrossingTest::prims_of(kept[i]), CrossingTest::prims_of(whole[i]));
      }
    }
  }
}

// A node that is scaled to nothing has no inverse. The scene stays as it was.
TEST_F(KeptInstances, PosesThatCannotBePlacedAreRefused) {
  AnimatedBuilder b = balls();
  const int scales = b.vec3({1, 1, 1, 1, 0, 1});
  b.channel(0, "scale", {0, 1}, scales);
  const auto world = world_of(loaded(b, InstancePolicy::Keep));
  const Image before = picture(*world, "normals");
  expect_error(Failure::Arguments, {"the matrix of instance 0", "moved copy"}, [&] { world->set_time(0, 1); });
  expect_alike(picture(*world, "normals"), before, "after a pose that was refused", 0);
  world->set_time(0, 0.5);
}

TEST_F(KeptInstances, DeformedMeshesBesideThem) {
  AnimatedBuilder b = skinned_triangle();
  b.mesh(b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0}));
  for (int i = 0; i < 2; ++i) b.node({{"mesh", 1}, {"translation", {-1, i - 1, 0}}});
  const Both e = both(b);
  ASSERT_TRUE(e.kept->forest());
  for (const double seconds : {0.5, 0.0, 1.0}) {
    e.kept->set_time(0, seconds);
    e.copied->set_time(0, seconds);
    expect_alike(picture(*e.kept, "eyelight"), picture(*e.copied, "eyelight"), std::to_string(seconds), 0.01);
  }
}

TEST_F(KeptInstances, WhatTakesNoInstancesSaysSo) {
  const auto world = world_of(loaded(balls(), InstancePolicy::Keep));
  const auto refuse = [](std::string_view what, const auto& call) {
    expect_error(Failure::Arguments, {"as instances", what, "'copy'"}, call);
  };
  refuse("an update of vertices", [&] { world->move(world->scene().triangles); });
  const auto batch = world->make_batch(world->scene().views[0], find_ray_kind("ao"), 8, 8);
  refuse("origin offsets", [&] { world->check_origins(*batch); });
}

// Far away a scene of instances is refused like one of copies.
TEST_F(KeptInstances, BeyondTheRangeOfCoordinates) {
  GltfBuilder b = balls();
  b.json.erase("animations");
  b.json["nodes"][0]["translation"] = {1e30, 0, 0};
  EXPECT_THROW(world_of(loaded(b, InstancePolicy::Keep)), Error);
  EXPECT_THROW(world_of(loaded(b, InstancePolicy::Copy)), Error);
}

}  // namespace
}  // namespace ballot
