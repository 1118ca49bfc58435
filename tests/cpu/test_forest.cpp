// Instances without a device: transforms that are refused, the boxes and numbers of instances, the oracle.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <glm/common.hpp>

#include "engine/core/error.h"
#include "engine/oracle/errors.h"
#include "engine/oracle/in_double.h"
#include "engine/tree/host/forest.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

Forest forest_of(std::vector<UnsetVector<Triangle>> meshes, std::span<const Placement> placements) {
  return Forest(std::move(meshes), placements,
                [](std::span<const Triangle> t) { return build_bvh(t, {.builder = BuilderId::Balanced}); });
}

Transform diagonal(float x, float y, float z) {
  Transform t;
  t.m[0][0] = x, t.m[1][1] = y, t.m[2][2] = z;
  return t;
}

std::string refusal_of(const Transform& t) {
  const std::vector<Placement> placements{{0, {}}, {0, t}};
  try {
    forest_of({shapes::sphere(1)}, placements);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(Forest, RefusesTransformsItCannotInvert) {
  Transform t;
  t.m[1][3] = NAN;
  EXPECT_EQ(refusal_of(t), "instance 1: entry [1][3] of the transform is nan; expected a finite number");
  t.m[1][3] = INFINITY;
  EXPECT_EQ(refusal_of(t), "instance 1: entry [1][3] of the transform is inf; expected a finite number");
  EXPECT_NE(refusal_of(diagonal(1, 0, 1))
                .find("instance 1: column 1 of the transform has 0 as its largest magnitude; "
                      "expected 8.67e-19 to 1.15e+18"),
            std::string::npos);
  EXPECT_NE(refusal_of(diagonal(1e30f, 1, 1)).find("column 0 of the transform has 1e+30"), std::string::npos);
  Transform singular;
  for (auto& row : singular.m) row[0] = row[1] = row[2] = 1;
  EXPECT_NE(refusal_of(singular).find("instance 1: the matrix of the transform is singular in float32"),
            std::string::npos);
  EXPECT_NE(
      refusal_of(diagonal(1e13f, 1, 1)).find("instance 1: the transform moves the mesh to -1e+13 to 1e+13 along x"),
      std::string::npos);
  Transform far;
  far.m[2][3] = 1e30f;
  EXPECT_NE(refusal_of(far).find("along z, by a translation of 1e+30; expected all within +-1e+12"), std::string::npos);
}

TEST(Forest, TakesMirrorsAndUnequalScales) {
  EXPECT_EQ(refusal_of(diagonal(-1, 1, 1)), "");
  EXPECT_EQ(refusal_of(diagonal(1e-6f, 1e6f, -1)), "");
  Transform t = diagonal(1e-6f, 1, 1);
  t.m[1][0] = 1e-6f;  // a thin mesh, turned
  EXPECT_EQ(refusal_of(t), "");
}

TEST(Forest, RefusesMeshesThatAreNotThere) {
  const std::vector<Placement> placements{{0, {}}, {7, {}}};
  try {
    forest_of({shapes::sphere(1)}, placements);
    FAIL();
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "instance 1: its mesh is number 7, but there are 1 meshes");
  }
}

TEST(Forest, NumbersTrianglesThroughInstances) {
  const std::vector<Placement> placements{{0, {}}, {2, {}}, {1, {}}, {2, {}}, {0, {}}, {2, {}}};
  const Forest forest = forest_of({shapes::sphere(0), shapes::soup(3, 1), {}}, placements);
  EXPECT_EQ(forest.triangle_count(), 19u);
  for (const auto& [prim, instance, triangle] :
       {std::array{0u, 0u, 0u}, {7, 0, 7}, {8, 2, 0}, {10, 2, 2}, {11, 4, 0}, {18, 4, 7}}) {
    EXPECT_EQ(forest.place_of(prim).instance, instance);
    EXPECT_EQ(forest.place_of(prim).triangle, triangle);
  }
}

TEST(Forest, RefusesMoreTrianglesThanCanBeNumbered) {
  const std::vector<Placement> placements(1u << 20);
  try {
    forest_of({shapes::sphere(5)}, placements);
    FAIL();
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(),
                 "instance 524287: with it the scene has 4294967296 triangles, counted through its instances; at "
                 "most 4294967293 can be numbered");
  }
}

// Points of moved triangles, in double precision, lie in the box. The ray of an instance passes them where the ray
// does.
TEST(Forest, BoxesHoldMovedMeshes) {
  shapes::Random random(3);
  for (int k = 0; k < 200; ++k) {
    Placement p;
    for (auto& row : p.transform.m)
      for (float& x : row) x = random.in(-2, 2);
    try {
      const Forest forest = forest_of({shapes::soup(20, 1)}, {{p}});
      const Instance& i = forest.instances()[0];
      for (std::uint32_t t = 0; t < 20; ++t)
        for (const glm::vec3& v : forest.triangle({0, t}))
          for (int axis = 0; axis < 3; ++axis) {
            EXPECT_LE(i.box.lo[axis], v[axis]);
            EXPECT_GE(i.box.hi[axis], v[axis]);
          }
      EXPECT_GE(i.slack, 50 * 0x1p-24f);
    } catch (const Error&) {  // nearly singular
    }
  }
}

TEST(Forest, IdentityKeepsRaysAsTheyAre) {
  const ObjectMap identity;
  for (const Ray& ray : shapes::random_rays(100)) {
    const Ray moved = object_ray(ray, identity);
    EXPECT_EQ(moved.origin, ray.origin);
    EXPECT_EQ(moved.dir, ray.dir * direction_scale(ray));
    EXPECT_EQ(moved.t_max, std::min(ray.t_max / direction_scale(ray), 3.4e38f));
  }
}

TEST(Forest, OracleFindsWhatTheFlatSceneHolds) {
  Transform t = diagonal(1, 1, 1);
  t.m[0][3] = 2;
  const std::vector<Placement> placements{{0, t}, {0, {}}};
  const Forest forest = forest_of({shapes::sphere(3)}, placements);
  shapes::Triangles flat = shapes::moved(shapes::sphere(3), {2, 0, 0});
  for (const Triangle& s : shapes::sphere(3)) flat.push_back(s);
  const Bvh bvh = build_bvh(flat);
  const PairTree pairs = encode_pairs(bvh, flat, NodeLayout::Interleaved);
  const Oracle one(pairs);
  const Oracle two(forest);
  int hits = 0;
  for (const Ray& ray : shapes::random_rays(2000)) {
    const OracleHit a = one.nearest(ray), b = two.nearest(ray);
    ASSERT_EQ(a.prim, b.prim);
    if (a.prim == NO_HIT) continue;
    ++hits;
    EXPECT_NEAR(a.t, b.t, 1e-5 * std::abs(a.t) + 1e-6);
    const Hit right{float(b.t), b.prim, float(b.u), float(b.v)};
    EXPECT_LE(int(two.judge(ray, right, b, Want::Nearest)), int(Verdict::Tie));
    Hit wrong = right;
    wrong.prim = (b.prim + 100) % std::uint32_t(forest.triangle_count());
    EXPECT_GT(int(two.judge(ray, wrong, b, Want::Nearest)), int(Verdict::Tie));
    EXPECT_EQ(two.judge(ray, {INFINITY, NO_HIT, 0, 0}, b, Want::Nearest), Verdict::FalseMiss);
  }
  EXPECT_GT(hits, 300);
}

// The exact hits of rays that instances move in double, as arithmetic in double has them.
TEST(Forest, OraclesMoveRaysInDoubleForModeDouble) {
  Transform t;
  t.m[0][0] = 0.6f, t.m[0][1] = -0.8f, t.m[1][0] = 0.8f, t.m[1][1] = 0.6f, t.m[2][2] = 0.7f, t.m[0][3] = 2;
  const std::vector<Placement> placements{{0, t}, {0, diagonal(0.9f, -1.1f, 1.3f)}};
  const Forest forest = forest_of({shapes::sphere(3)}, placements);
  const std::span<const Triangle> own = forest.meshes()[0].triangles;
  const PairTree tree = encode_pairs(*forest.meshes()[0].bvh, own, NodeLayout::Interleaved);
  const OracleInDouble mesh(tree, own, {});
  const Oracle bound(forest);
  const ExactOracle exact(bound.scene().in_double());
  const std::vector<Ray> rays = shapes::random_rays(3000);
  std::vector<Hit> answers, single;
  for (const Ray& ray : rays) {
    OracleHit best;
    for (const Instance& i : forest.instances()) {
      OracleHit hit = mesh.nearest(object_ray_in_double(ray, i.map));
      hit.t *= direction_scale(ray), hit.prim += hit.prim == NO_HIT ? 0 : i.first;
      if (hit.prim != NO_HIT && (best.prim == NO_HIT || hit.t < best.t)) best = hit;
    }
    const OracleHit rough = bound.nearest(ray);
    const auto written = [](const OracleHit& h) {
      return Hit{h.prim == NO_HIT ? INFINITY : float(h.t), h.prim, float(h.u), float(h.v)};
    };
    answers.push_back(written(best)), single.push_back(written(rough));
  }
  const std::vector<ExactHit> truth = exact.nearest(rays);
  const ErrorFigures right =
      error_figures(exact, bound, rays, answers, truth, Want::Nearest, Arithmetic::WoopInDouble, 1);
  EXPECT_EQ(right.errors(), 0u) << in_words(right.cases[0]);
  EXPECT_LE(right.t_ulp.max, 0.51);
  EXPECT_EQ(bound.judge(rays, answers, truth, Want::Nearest, Arithmetic::WoopInDouble).errors(), 0u);
  // The bound is that of float64: rays that were rounded to float32 on the way leave it.
  EXPECT_GT(bound.judge(rays, single, truth, Want::Nearest, Arithmetic::WoopInDouble).wrong_t, 100u);
  EXPECT_EQ(bound.judge(rays, single, truth, Want::Nearest, Arithmetic::Woop).errors(), 0u);
}

/// Expects that each box of a top-level tree is that of what lies below it, and that the slacks grow upwards.
void expect_tight(const Forest& forest) {
  const TopTree& top = forest.top();
  const auto vector = [&](std::size_t at) {
    return glm::vec3(std::bit_cast<float>(top.texels[at].x), std::bit_cast<float>(top.texels[at].y),
                     std::bit_cast<float>(top.texels[at].z));
  };
  std::size_t leaves = 0;
  for (std::size_t at = 0; at < top.records; at += 2) {
    const std::uint32_t reference = top.texels[at].w;
    const float slack = std::bit_cast<float>(top.texels[at + 1].w);
    if (reference & LEAF_BIT) {
      const Instance& i = forest.instances()[reference & ~LEAF_BIT];
      EXPECT_EQ(vector(at), i.box.lo);
      EXPECT_EQ(vector(at + 1), i.box.hi);
      EXPECT_EQ(slack, i.slack);
      ++leaves;
      continue;
    }
    EXPECT_EQ(vector(at), glm::min(vector(reference), vector(reference + 2)));
    EXPECT_EQ(vector(at + 1), glm::max(vector(reference + 1), vector(reference + 3)));
    for (const std::uint32_t below : {reference + 1, reference + 3})
      EXPECT_GE(slack, std::bit_cast<float>(top.texels[below].w));
  }
  EXPECT_EQ(leaves, forest.instances().size());
}

// Small moves keep the shape of the top-level tree, large ones build it anew.
TEST(Forest, MovesRefitTheTopLevelUntilItHasDecayed) {
  shapes::Random random(5);
  std::vector<Placement> placements(500, Placement{0, diagonal(0.1f, -0.1f, 0.2f)});
  for (Placement& p : placements)
    for (auto& row : p.transform.m) row[3] = random.in(-10, 10);
  Forest forest = forest_of({shapes::sphere(1)}, placements);
  expect_tight(forest);
  EXPECT_EQ(forest.top().cost, forest.top().built_cost);
  const auto references = [&] {
    std::vector<std::uint32_t> all;
    for (std::size_t at = 0; at < forest.top().records; at += 2) all.push_back(forest.top().texels[at].w);
    return all;
  };
  const auto first = references();
  const auto move = [&](float far) {
    std::vector<Transform> transforms = forest.transforms();
    for (Transform& t : transforms)
      for (auto& row : t.m) row[3] += random.in(-far, far);
    forest.move(transforms);
    expect_tight(forest);
    const Forest anew = forest_of({shapes::sphere(1)}, [&] {
      for (std::size_t i = 0; i < placements.size(); ++i) placements[i].transform = transforms[i];
      return std::span<const Placement>(placements);
    }());
    EXPECT_EQ(anew.top().bounds.lo, forest.top().bounds.lo);
    EXPECT_EQ(anew.top().bounds.hi, forest.top().bounds.hi);
    EXPECT_LE(forest.top().cost, kMostTopDecay * forest.top().built_cost);
  };
  move(0.01f);
  EXPECT_EQ(references(), first);
  EXPECT_NE(forest.top().cost, forest.top().built_cost);
  move(10);
  EXPECT_NE(references(), first);
  EXPECT_EQ(forest.top().cost, forest.top().built_cost);
  // Of one instance, and of none that can be hit, there is no node.
  for (UnsetVector<Triangle> mesh : {shapes::sphere(1), UnsetVector<Triangle>()}) {
    Forest one = forest_of({std::move(mesh)}, std::vector<Placement>(1));
    const std::vector<Transform> to{diagonal(2, 2, 2)};
    one.move(to);
    EXPECT_EQ(one.top().bounds.hi, one.instances()[0].box.hi);
    EXPECT_EQ(one.top().records, 0u);
  }
}

}  // namespace
}  // namespace ballot
