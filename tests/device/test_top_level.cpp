// The top-level tree on the device: instances that are placed, and a tree that is built and refitted there. Records and
// hits are compared, bit for bit, with those of the host.
#include <algorithm>
#include <bit>
#include <set>

#include "engine/oracle/errors.h"
#include "tests/device/fixture.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace harness;
using namespace forests;

class TopLevel : public DeviceTest {
 protected:
  void SetUp() override {
    if (!TopBuilder::runs_on(gpu_->info())) GTEST_SKIP() << gpu_->info().name << " cannot place instances";
  }

  /// A tracer whose top-level tree follows on the device.
  static std::unique_ptr<Tracer> tracer_of(Forest& forest) {
    auto tracer = std::make_unique<Tracer>(*gpu_, forest);
    tracer->prefill = kPattern;
    tracer->tree().set_moves_on_device(true);
    return tracer;
  }

  static std::vector<Hit> trace(Tracer& tracer, std::span<const Ray> rays, const Query& q) {
    std::vector<Hit> hits(rays.size());
    tracer.trace(rays, hits, q);
    EXPECT_EQ(count_untouched(hits), 0u) << tracer.variant(q).name();
    return hits;
  }
};

/// `count` instances of the meshes, of all kinds: turned, mirrored, sheared, tiny, huge, and on top of each other.
std::vector<Transform> random_transforms(std::size_t count, std::uint32_t seed) {
  shapes::Random random(seed);
  std::vector<Transform> all;
  for (std::size_t i = 0; i < count; ++i) {
    const float size = std::pow(10.f, random.in(-6, 1));
    const glm::vec3 scale = size * glm::vec3(random.in(0.3f, 1), random.in(-1, -0.3f), random.in(0.3f, 1));
    Transform t = turned(random.in(0, 6), random.in(0, 6), scale, random.point(i % 7 ? 10 : 1e4f));
    if (i % 5 == 0) t.m[0][1] += size * random.in(-3, 3);
    if (i % 11 == 1) t = all.back();
    all.push_back(t);
  }
  return all;
}

std::vector<Placement> placements_of(std::span<const Transform> transforms, std::size_t meshes) {
  std::vector<Placement> all;
  for (const Transform& t : transforms) all.push_back({std::uint32_t(all.size() % meshes), t});
  return all;
}

glm::vec3 vector_of(const glm::uvec4& t) {
  return {std::bit_cast<float>(t.x), std::bit_cast<float>(t.y), std::bit_cast<float>(t.z)};
}

/// Returns what is wrong with a top-level tree: a node's box must be that of what lies below it, slacks must grow
/// upwards, each instance that can be hit must lie in one leaf, and the facts must be those of the tree.
std::vector<std::string> faults_of(const TopTree& tree, const Forest& forest) {
  std::vector<std::string> faults;
  std::multiset<std::uint32_t> leaves, expected;
  for (std::uint32_t i = 0; i < forest.size(); ++i)
    if (!forest.meshes()[forest.mesh_of(i)].extents.empty) expected.insert(i);
  struct Below {
    glm::vec3 lo, hi;
    float slack;
    std::uint32_t depth;
  };
  const std::function<Below(std::uint32_t)> walk = [&](std::uint32_t ref) -> Below {
    if (ref & LEAF_BIT) {
      leaves.insert(ref & ~LEAF_BIT);
      const Instance& i = forest.instances()[ref & ~LEAF_BIT];
      return {i.box.lo, i.box.hi, i.slack, 0};
    }
    Below all{glm::vec3(INFINITY), glm::vec3(-INFINITY), 0, 0};
    for (const std::uint32_t at : {ref, ref + 2}) {
      const Below child = walk(tree.texels[at].w);
      const float slack = std::bit_cast<float>(tree.texels[at + 1].w);
      if (vector_of(tree.texels[at]) != child.lo || vector_of(tree.texels[at + 1]) != child.hi)
        faults.push_back(fmt::format("texel {}: the box is not that of what lies below", at));
      if (slack < child.slack || slack > child.slack * 1.01f)
        faults.push_back(fmt::format("texel {}: slack {}, below it is {}", at, slack, child.slack));
      all = {glm::min(all.lo, child.lo), glm::max(all.hi, child.hi), std::max(all.slack, slack),
             std::max(all.depth, child.depth + 1)};
    }
    return all;
  };
  if (tree.root == END_OF_TREE) {
    if (!expected.empty()) faults.push_back("there is no root");
    return faults;
  }
  const Below root = walk(tree.root);
  if (leaves != expected) faults.push_back(fmt::format("{} leaves, expected {}", leaves.size(), expected.size()));
  if (root.lo != tree.bounds.lo || root.hi != tree.bounds.hi) faults.push_back("bounds");
  if (root.depth != tree.depth) faults.push_back(fmt::format("depth {}, found {}", tree.depth, root.depth));
  return faults;
}

TEST_F(TopLevel, RecordsHaveTheBitsOfTheHost) {
  const std::vector<Transform> first = random_transforms(3000, 1), then = random_transforms(3000, 2);
  Forest forest = make_forest(three_meshes(), placements_of(first, 5));
  const auto tracer = tracer_of(forest);
  tracer->move_instances(then);
  const TopTree on_device = tracer->tree().top_tree();
  const std::vector<Instance>& instances = forest.instances();  // placed here, from the transforms
  std::size_t different = 0;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const glm::uvec4* record = &on_device.texels[on_device.records + i * INSTANCE_TEXELS];
    const Instance& of = instances[i];
    bool same = record[3].w == of.mesh && record[5].x == of.first;
    for (int r = 0; r < 3; ++r)
      same =
          same && vector_of(record[r]) == of.map.row[r] && std::bit_cast<float>(record[r].w) == of.map.translation[r];
    if (!forest.meshes()[of.mesh].extents.empty)
      same = same && vector_of(record[3]) == of.box.lo && vector_of(record[4]) == of.box.hi &&
             std::bit_cast<float>(record[4].w) == of.slack;
    different += same ? 0 : 1;
  }
  EXPECT_EQ(different, 0u);
}

// Transforms on the device move instances as those of the host do, and reach the host when it asks for them.
TEST_F(TopLevel, TransformsOnTheDeviceAreThoseOfTheHost) {
  const std::vector<Transform> first = random_transforms(2000, 1), then = random_transforms(2000, 2);
  Forest forest = make_forest(three_meshes(), placements_of(first, 5));
  Forest other = make_forest(three_meshes(), placements_of(first, 5));
  const auto tracer = tracer_of(forest), by_host = tracer_of(other);
  const auto there = std::make_shared<Buffer<Transform>>(*gpu_, then.size(), Access::Storage, "transforms there");
  const auto rays = rays_for(forest, 3000);
  const auto expect_same = [&](std::span<const Transform> transforms) {
    const TopTree a = tracer->tree().top_tree(), b = by_host->tree().top_tree();
    EXPECT_TRUE(std::ranges::equal(std::span(a.texels).subspan(a.records), std::span(b.texels).subspan(b.records)));
    EXPECT_EQ(count_different(trace(*by_host, rays, {}), trace(*tracer, rays, {})), 0u);
    EXPECT_EQ(std::memcmp(forest.transforms().data(), transforms.data(), transforms.size_bytes()), 0);
    EXPECT_EQ(faults_of(tracer->tree().top_tree(), forest), std::vector<std::string>{});
  };
  for (const auto& transforms : {then, first}) {
    there->upload(transforms);
    tracer->move_instances(MovedTransforms(there));
    by_host->move_instances(transforms);
    expect_same(transforms);
  }
  there->upload(then);
  tracer->move_instances(MovedTransforms(there));
  tracer->move_instances({});  // they stay, and nobody has read them
  by_host->move_instances(then);
  by_host->move_instances({});
  expect_same(then);
  std::vector<Transform> wrong = first;
  wrong[1234].m[1][2] = NAN;
  there->upload(wrong);
  try {
    tracer->move_instances(MovedTransforms(there));
    ADD_FAILURE() << "a transform that is not finite was taken";
  } catch (const Error& e) {
    EXPECT_NE(std::string_view(e.what()).find("instance 1234"), std::string_view::npos) << e.what();
  }
  expect_same(then);
}

TEST_F(TopLevel, TreesAreSoundOfAnyNumberOfInstances) {
  for (const std::size_t count : {1, 2, 3, 4, 7, 8, 33, 64, 257, 1500}) {
    std::vector<Transform> transforms = random_transforms(count, std::uint32_t(count));
    Forest forest = make_forest(three_meshes(), placements_of(transforms, 5));
    const auto tracer = tracer_of(forest);
    for (int step = 0; step < 4; ++step) {  // built; the same; refitted; built anew
      if (step == 2)
        for (Transform& t : transforms) t.m[1][3] *= 1.01f;
      if (step == 3) transforms = random_transforms(count, std::uint32_t(count) + 1);
      tracer->move_instances(transforms);
      EXPECT_EQ(faults_of(tracer->tree().top_tree(), forest), std::vector<std::string>{}) << count << ", " << step;
      const TopFacts& facts = forest.top_facts();
      EXPECT_LE(facts.cost, kMostTopDecay * facts.built_cost * 1.001) << count << ", " << step;
      EXPECT_EQ(forest.top().bounds.lo, facts.bounds.lo);
      EXPECT_EQ(forest.top().bounds.hi, facts.bounds.hi);
    }
  }
}

// Places where codes or areas are equal, or leave the range of float32: the builder ends, and its tree is sound.
TEST_F(TopLevel, TreesAreSoundOfDegenerateInstances) {
  const std::vector<std::function<Transform(std::size_t)>> kinds{
      [](std::size_t) {
        return moved({1, 2, 3});
      },  // all in one place
      [](std::size_t i) {
        return moved({float(i), 0, 0});
      },  // in a row
      [](std::size_t i) {
        return moved({0, i % 2 ? 9e11f : -9e11f, 0});
      },  // far apart
      [](std::size_t i) {
        return turned(1, 2, glm::vec3(std::pow(10.f, float(i % 24) - 12)), {0, 0, 0});
      },
      [](std::size_t i) {
        return turned(0, 0, {1e-17f, 1, 1}, {0, 0, float(i / 10)});
      }};  // flat
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    std::vector<Transform> transforms;
    for (std::size_t i = 0; i < 600; ++i) transforms.push_back(kinds[k](i));
    Forest forest = make_forest(three_meshes(), placements_of(transforms, 5));
    const auto tracer = tracer_of(forest);
    for (int step = 0; step < 2; ++step) {
      tracer->move_instances(transforms);
      EXPECT_EQ(faults_of(tracer->tree().top_tree(), forest), std::vector<std::string>{}) << k << ", " << step;
    }
  }
}

TEST_F(TopLevel, ScenesThatHoldNothingAreMissed) {
  const auto rays = shapes::random_rays(100);
  for (const std::vector<Placement>& placements :
       {std::vector<Placement>{}, std::vector<Placement>{{2, {}}, {2, {}}}, std::vector<Placement>{{2, {}}, {0, {}}}}) {
    Forest forest = make_forest(three_meshes(), placements);
    const auto tracer = tracer_of(forest);
    for (int step = 0; step < 2; ++step) {
      tracer->move_instances(std::vector<Transform>(placements.size(), moved({0, float(step), 0})));
      const auto hits = trace(*tracer, rays, {.method = "while-while"});
      const bool has_sphere = placements.size() == 2 && placements[1].mesh == 0;
      EXPECT_EQ(std::ranges::any_of(hits, [](const Hit& h) { return h.prim != NO_HIT; }), has_sphere);
    }
  }
}

// After a build, a refit and another build on the device each method finds, bit for bit, what it finds in a forest that
// is new.
TEST_F(TopLevel, EveryMethodHitsAsInANewScene) {
  std::vector<Placement> placements = twelve_instances();
  Forest forest = make_forest(three_meshes(), placements);
  const auto tracer = tracer_of(forest);
  const std::vector<Ray> rays = rays_for(forest, 500);
  std::vector<Transform> transforms = forest.transforms();
  std::size_t dealt = 0;
  for (int step = 0; step < 3; ++step) {
    if (step == 1)
      for (Transform& t : transforms) t.m[1][3] += 0.01f;
    if (step == 2) std::rotate(transforms.begin(), transforms.begin() + 3, transforms.end());
    tracer->move_instances(transforms);
    for (std::size_t i = 0; i < placements.size(); ++i) placements[i].transform = transforms[i];
    Forest fresh = make_forest(three_meshes(), placements);
    Tracer other(*gpu_, fresh);
    const auto expected = trace(other, rays, {.method = "while-while"});
    EXPECT_GT(std::ranges::count_if(expected, [](const Hit& h) { return h.prim != NO_HIT; }), 300);
    for (const Query& q : every_instance_method(Want::Nearest, kDefaultNumeric)) {
      if (q.method != kPlainestMethod && !is_dealt(gpu_->info(), dealt++ / 3)) continue;
      EXPECT_EQ(count_different(expected, trace(*tracer, rays, q)), 0u) << q.method << ", " << step;
    }
  }
}

// Every ray from inside a closed mesh hits it, whatever its transform, after a build and a refit.
TEST_F(TopLevel, ClosedMeshesDoNotLeak) {
  std::vector<Transform> transforms = random_transforms(300, 3);
  Forest forest = make_forest({shapes::sphere(3)}, placements_of(transforms, 1));
  const auto tracer = tracer_of(forest);
  shapes::Random random(4);
  for (int step = 0; step < 2; ++step) {
    for (Transform& t : transforms) t.m[2][3] += 0.01f;
    tracer->move_instances(transforms);
    std::vector<Ray> rays;
    for (const Transform& t : transforms)
      for (int i = 0; i < 20; ++i) rays.push_back({{t.m[0][3], t.m[1][3], t.m[2][3]}, 0, random.point(1), 3e38f});
    const auto hits = trace(*tracer, rays, {.method = "while-while"});
    EXPECT_EQ(std::ranges::count(hits, NO_HIT, &Hit::prim), 0) << step;
  }
}

// The exact oracle places instances on the host.
TEST_F(TopLevel, ExactModeHasNoWrongAnswerAfterARefit) {
  if (!is_first(gpu_->info())) return;
  Forest forest = make_forest(three_meshes(), twelve_instances());
  const auto tracer = tracer_of(forest);
  std::vector<Transform> transforms = forest.transforms();
  tracer->move_instances(transforms);
  for (Transform& t : transforms) t.m[0][3] += 0.02f;
  tracer->move_instances(transforms);
  const std::vector<Ray> rays = rays_for(forest, 500);
  const ExactOracle exact(forest);
  const Oracle bound(forest);
  const auto hits = trace(*tracer, rays, {.method = "while-while", .numeric = "exact"});
  const ErrorFigures figures =
      error_figures(exact, bound, rays, hits, exact.nearest(rays), Want::Nearest, Arithmetic::Exact, 3);
  EXPECT_EQ(figures.errors(), 0u);
}

TEST_F(TopLevel, RefusedTransformsLeaveTheSceneAsItWas) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  const auto tracer = tracer_of(forest);
  const std::vector<Ray> rays = rays_for(forest, 300);
  const std::vector<Transform> good = forest.transforms();
  const auto refuse = [&](std::size_t instance, const Transform& with, const char* text) {
    std::vector<Transform> bad = good;
    bad[instance] = with;
    bad[11].m[0][0] = NAN;  // the first one is named
    const auto before = trace(*tracer, rays, {.method = "while-while"});
    try {
      tracer->move_instances(bad);
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(text), std::string::npos) << e.what();
    }
    EXPECT_EQ(count_different(before, trace(*tracer, rays, {.method = "while-while"})), 0u) << text;
  };
  Transform nan, infinite, huge, tiny, singular, far;
  nan.m[2][1] = NAN;
  infinite.m[1][3] = -INFINITY;
  huge.m[1][1] = 1e30f;
  tiny.m[0][0] = tiny.m[1][0] = tiny.m[2][0] = 0;
  for (auto& row : singular.m) row[0] = row[1] = row[2] = 1;
  far.m[0][3] = 2e12f;
  const auto refuse_all = [&] {
    refuse(3, nan, "instance 3: entry [2][1] of the transform is nan");
    refuse(0, infinite, "instance 0: entry [1][3] of the transform is -inf");
    refuse(1, huge, "instance 1: column 1 of the transform has 1e+30");
    refuse(2, tiny, "instance 2: column 0 of the transform has 0");
    refuse(4, singular, "instance 4: the matrix of the transform is singular in float32");
    refuse(5, singular, "instance 5: the matrix of the transform is singular in float32");  // its mesh is empty
    refuse(6, far, "instance 6: the transform moves the mesh to");
  };
  refuse_all();  // the tree is the host's
  EXPECT_EQ(tracer->tree().top_builder(), nullptr);
  tracer->move_instances(good);
  refuse_all();
  EXPECT_EQ(faults_of(tracer->tree().top_tree(), forest), std::vector<std::string>{});
  EXPECT_THROW(tracer->move_instances(std::span(good).first(3)), Error);
  Transform mirrored;
  mirrored.m[0][0] = -1;
  std::vector<Transform> turned_over = good;
  turned_over[0] = mirrored;
  tracer->move_instances(turned_over);
  EXPECT_EQ(faults_of(tracer->tree().top_tree(), forest), std::vector<std::string>{});
}

// As in Instances.WalksThatADriverCutsShortAreFinished, in pieces of a tree whose nodes lie in another order.
TEST_F(TopLevel, WalksThatADriverCutsShortAreFinished) {
  if (!harness::at_default_size(gpu_->info())) return;
  const std::vector<Placement> placements{{0, {}}, {0, turned(0.2f, 0, glm::vec3(1), {0, 0, 0.1f})}, {1, {}}};
  const auto make = [&] {
    return Forest({shapes::identical(40000), shapes::sphere(2)}, placements,
                  [](std::span<const Triangle> t) { return build_bvh(t, {.max_leaf = 2, .split_budget = 0}); });
  };
  Forest forest = make(), other = make();
  const auto rays = shapes::random_rays(40);
  const auto tracer = tracer_of(forest);
  tracer->move_instances(forest.transforms());
  Tracer on_host(*gpu_, other);
  EXPECT_EQ(count_different(trace(on_host, rays, {.method = "packet"}), trace(*tracer, rays, {.method = "packet"})),
            0u);
}

// Scenes on a GPU take the device from some number of instances on, those on CPU devices never.
TEST_F(TopLevel, TheHostKeepsSmallScenesAndThoseOfCpuDevices) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  Tracer small(*gpu_, forest);
  EXPECT_FALSE(small.tree().moves_on_device());
  std::vector<Transform> transforms;
  for (int i = 0; i < 10000; ++i) transforms.push_back(moved({float(4 * (i % 100)), 0, float(4 * (i / 100))}));
  Forest many = make_forest(three_meshes(), placements_of(transforms, 5));
  Tracer large(*gpu_, many);
  EXPECT_EQ(large.tree().moves_on_device(), !gpu_->info().is_cpu());
  large.move_instances(transforms);
  EXPECT_EQ(large.tree().top_builder() != nullptr, !gpu_->info().is_cpu());
  // The tree may go from one to the other.
  const auto rays = shapes::random_rays(50);
  const auto expected = trace(large, rays, {.method = "while-while"});
  for (const bool on_device : {true, false}) {
    large.tree().set_moves_on_device(on_device);
    large.move_instances(transforms);
    EXPECT_EQ(large.tree().top_builder() != nullptr, on_device);
    EXPECT_EQ(count_different(expected, trace(large, rays, {.method = "while-while"})), 0u) << on_device;
  }
}

}  // namespace
}  // namespace ballot
