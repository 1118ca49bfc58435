// Trees of meshes that the device built and keeps, in scenes of instances: kernels read them beside those of the host,
// they follow vertices where they lie, and hits have the bits of trees that the host built.
#include <cmath>

#include "engine/oracle/oracle.h"
#include "engine/scene/device_scene.h"
#include "engine/tree/device/device_build.h"
#include "engine/tree/host/build.h"
#include "tests/device/fixture.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace harness;
using namespace forests;
using shapes::Triangles;

class TreesThere : public DeviceTest {
 protected:
  static MeshTree built_there(std::span<const Triangle> triangles) {
    auto there = std::make_shared<DeviceBuild>(*gpu_, triangles, BuildSettings{});
    MeshTree made = make_mesh_tree(triangles, there->summary());
    made.there = std::move(there);
    return made;
  }

  /// Makes the trees of all meshes but the first on the device.
  static std::vector<MeshTree> built(std::span<const Triangles> meshes) {
    std::vector<MeshTree> all{make_mesh_tree(meshes[0], build_bvh(meshes[0], quick()))};
    for (const Triangles& triangles : meshes.subspan(1)) all.push_back(built_there(triangles));
    return all;
  }

  /// Expects the hits of a forest that the host has made.
  static void expect_hits(Tracer& there, const std::vector<Triangles>& meshes, const std::vector<Placement>& placements,
                          const char* what) {
    SCOPED_TRACE(what);
    Forest forest = make_forest(meshes, placements);
    Tracer here(*gpu_, forest);
    const std::vector<Ray> rays = rays_for(forest, 700);
    std::vector<Hit> expected(rays.size()), hits(rays.size());
    here.trace(rays, expected, {.method = "while-while"});
    std::vector<Query> queries = every_instance_method(Want::Nearest, kDefaultNumeric);
    for (const char* fetch : {"storage", "reference"})  // one reads the whole buffer, the other its address
      if (gpu_->info().buffer_address || fetch == std::string("storage"))
        queries.push_back({.method = "bvh8", .knobs = {{"fetch", fetch}}});
    for (const Query& q : queries) {
      there.trace(rays, hits, q);
      EXPECT_EQ(count_different(expected, hits), 0u) << there.variant(q).name();
    }
  }

  static void expect_region(DeviceTree& tree, std::size_t mesh, const TreeAccess& access) {
    const DeviceBuild& build = *tree.built(mesh);
    const auto texels_of = [&](const Buffer<glm::uvec4>& buffer) {
      std::vector<glm::uvec4> texels(buffer.size());
      buffer.download(texels);
      return texels;
    };
    Buffer<glm::uvec4> pairs(*gpu_, build.built().pairs * PAIR_TEXELS(std::uint32_t(access.layout)), Access::Storage,
                             "pairs"),
        leaves(*gpu_, build.built().leaf_texels, Access::Storage, "leaves");
    tree.built(mesh)->write(access.layout, access.padding, pairs, leaves);
    const auto all_pairs = texels_of(tree.nodes(access, Source::Device)),
               all_leaves = texels_of(tree.leaves(LeafFormat::Vertices, access.fetch, Source::Device)),
               table = texels_of(tree.mesh_table(TreeFormatId::Pair, access, LeafFormat::Vertices, Source::Device));
    const glm::uvec4 firsts = table[MESH_TEXELS * mesh + 3];
    EXPECT_EQ(firsts.x, build.built().root);
    const auto equal = [](std::span<const glm::uvec4> all, std::uint32_t first, const std::vector<glm::uvec4>& own) {
      return std::ranges::equal(all.subspan(first, own.size()), own);
    };
    if (build.built().root != END_OF_TREE) {
      EXPECT_TRUE(equal(all_pairs, firsts.y, texels_of(pairs)));
      EXPECT_TRUE(equal(all_leaves, firsts.z, texels_of(leaves)));
    }
  }
};

// Meshes of both kinds lie in one array; a mesh without triangles and one of a single leaf among them.
TEST_F(TreesThere, KernelsReadThemBesideThoseOfTheHost) {
  std::vector<Triangles> meshes = three_meshes();
  const std::vector<Placement> placements = twelve_instances();
  Forest forest(built(meshes), placements);
  Tracer tracer(*gpu_, forest);
  EXPECT_EQ(tracer.tree().source_of(TreeFormatId::Pair, LeafFormat::Vertices), Source::Device);
  expect_hits(tracer, meshes, placements, "built");
  for (const NodeLayout layout : {NodeLayout::Interleaved, NodeLayout::Paper})
    for (std::size_t mesh = 1; mesh < meshes.size(); ++mesh) expect_region(tracer.tree(), mesh, {.layout = layout});

  const Oracle oracle(tracer.tree().oracle_scene());  // reads nodes back
  const std::vector<Ray> rays = rays_for(forest, 300);
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits, {});
  const Judgement j = oracle.judge(rays, hits, oracle.nearest(rays), Want::Nearest);
  EXPECT_EQ(j.errors(), 0u) << (j.examples.empty() ? "" : j.examples[0]);
}

// A mesh is refitted in place, built in place, and exchanged for one of the host.
TEST_F(TreesThere, OneOfThemMoves) {
  std::vector<Triangles> meshes = three_meshes();
  const std::vector<Placement> placements = twelve_instances();
  Forest forest(built(meshes), placements);
  Tracer tracer(*gpu_, forest);
  expect_hits(tracer, meshes, placements, "before");
  tracer.tree().nodes({}, Source::Device);
  constexpr std::size_t kMoving = 3;
  const std::vector<Triangles> of_before = meshes;
  const auto exchange = [&](MeshTree with, bool refitted) {
    DeviceTree::MeshChange one{kMoving, std::move(with), refitted};
    tracer.tree().change_meshes(std::span(&one, 1), forest.transforms());
  };
  const auto change = [&](bool refits) {
    for (Triangle& t : meshes[kMoving])
      for (glm::vec3& v : t) v.y += 0.3f * std::sin(5 * v.x + (refits ? 1 : 2));
    const std::shared_ptr<DeviceBuild> build = tracer.tree().built(kMoving);
    build->upload(meshes[kMoving]);
    if (refits)
      ASSERT_TRUE(tracer.tree().refit(bounds_of_vertices(meshes[kMoving], "moved"), kMoving));
    else
      build->rebuild();
    MeshTree now = make_mesh_tree(meshes[kMoving], build->summary());
    now.there = build;
    exchange(std::move(now), refits);
    expect_region(tracer.tree(), kMoving, {});
    expect_hits(tracer, meshes, placements, refits ? "refitted" : "rebuilt");
  };
  change(true);
  change(false);
  change(true);
  exchange(make_mesh_tree(of_before[kMoving], build_bvh(of_before[kMoving], quick())), false);
  EXPECT_EQ(tracer.tree().built(kMoving), nullptr);
  expect_hits(tracer, of_before, placements, "of the host");
}

/// Two instances of a wavy grid, whose tree stays on the device, and a sphere, whose tree does not.
class LargeMesh : public TreesThere {
 protected:
  static constexpr float kFar = 1e3f;  // scale of the second instance

  static Triangles grid(float phase) {
    Triangles triangles = shapes::grid(182);
    for (Triangle& t : triangles)
      for (glm::vec3& v : t) v.y += 0.1f * std::sin(7 * v.x + phase) * std::cos(5 * v.z);
    return triangles;
  }

  static Scene scene_of(const Triangles& large) {
    Scene scene;
    scene.name = "large";
    scene.triangles = large;
    const Triangles ball = shapes::sphere(3);
    scene.triangles.insert(scene.triangles.end(), ball.begin(), ball.end());
    scene.instances.first = {0, large.size(), scene.triangles.size()};
    scene.instances.placements = {{0, {}}, {1, moved({0, 1, 0})}, {0, turned(0, 0, glm::vec3(kFar), {0, -9, 0})}};
    scene.instances.placed = true;
    finish_scene(scene);
    return scene;
  }

  static DeviceSceneOptions options_for(BuilderId builder) {
    DeviceSceneOptions options;
    options.context = gpu_;
    options.build.builder = builder;
    options.use_cache = false;
    return options;
  }

  static std::vector<Hit> hits_of(DeviceScene& world) {
    std::vector<Ray> rays = shapes::random_rays(600);
    for (std::size_t i = 0; i < rays.size(); i += 2)
      rays[i] = {{rays[i].origin.x, 5, rays[i].origin.z}, 0, {0, -1, 0}, 99};
    std::vector<Hit> hits(rays.size());
    world.trace(rays, hits, {});
    return hits;
  }

  static void move(DeviceScene& world, const MovedVertices& mesh, UpdateMode mode) {
    SceneChange change{.vertices = std::span(&mesh, 1)};
    world.commit(change, mode);
  }

  static std::vector<glm::vec3> vertices_of(const Triangles& triangles) {
    std::vector<glm::vec3> all;
    for (const Triangle& t : triangles) all.insert(all.end(), t.begin(), t.end());
    return all;
  }
};

TEST_F(LargeMesh, FollowsItsVerticesOnTheDevice) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  DeviceScene world(scene_of(grid(0)), options_for(BuilderId::Device));
  ASSERT_TRUE(world.tracer().tree().built(0));
  EXPECT_FALSE(world.tracer().tree().built(1));
  const std::vector<Hit> at_first = hits_of(world);
  std::vector<std::uint32_t> turned_round(3 * grid(0).size());
  for (std::size_t i = 0; i < turned_round.size(); ++i) turned_round[i] = std::uint32_t(turned_round.size() - 1 - i);
  for (const UpdateMode mode : {UpdateMode::Refit, UpdateMode::Rebuild}) {
    SCOPED_TRACE(int(mode));
    const Triangles moved = grid(mode == UpdateMode::Refit ? 1 : 2);
    std::vector<glm::vec3> positions = vertices_of(moved);
    std::ranges::reverse(positions);
    move(world, {0, moved.size(), turned_round, positions}, mode);
    EXPECT_EQ(world.last_update().refitted, mode == UpdateMode::Refit);
    DeviceScene fresh(scene_of(moved), options_for(BuilderId::Balanced));
    EXPECT_EQ(count_different(hits_of(fresh), hits_of(world)), 0u);
    EXPECT_EQ(world.forest()->meshes()[0].extents.largest_triangle,
              fresh.forest()->meshes()[0].extents.largest_triangle);
    EXPECT_EQ(world.triangle(17), moved[17]);
    const auto batch = world.make_batch("rays", shapes::random_rays(200), Want::Nearest);
    const ExactTruth truth = world.checker().exact_truth(*batch);  // of nodes that are read back
    EXPECT_EQ(count_different(hits_of(fresh), hits_of(world)), 0u);
    EXPECT_EQ(world.checker().verify(*batch, truth, {.method = "while-while"}).beyond_bound, 0u);
    EXPECT_GT(std::ranges::count_if(truth.hits, [](const ExactHit& hit) { return hit.prim != NO_HIT; }), 20);
    SceneChange places{.transforms = world.forest()->transforms()};
    world.commit(places);
    EXPECT_EQ(world.scene().triangles, fresh.scene().triangles);
    EXPECT_EQ(world.scene().bounds.lo, fresh.scene().bounds.lo);
  }
  move(world, {0, grid(0).size(), {}, vertices_of(grid(0))}, UpdateMode::Auto);
  EXPECT_EQ(count_different(at_first, hits_of(world)), 0u);
}

TEST_F(LargeMesh, StaysAsItWasAfterAnError) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  const Triangles start = grid(0);
  DeviceScene world(scene_of(start), options_for(BuilderId::Device));
  std::vector<glm::vec3> positions = vertices_of(start);
  const std::vector<Hit> before = hits_of(world);
  for (const float bad : {NAN, INFINITY, -2e12f}) {
    positions[5].z = bad;
    EXPECT_THROW(move(world, {0, start.size(), {}, positions}, UpdateMode::Refit), Error) << bad;
    EXPECT_EQ(count_different(before, hits_of(world)), 0u) << bad;
  }
  positions[5].z = 5e9f;  // an instance that is scaled leaves the range
  for (const bool top_there : {false, true})
    for (const UpdateMode mode : {UpdateMode::Refit, UpdateMode::Rebuild}) {
      world.tracer().tree().set_moves_on_device(top_there);
      EXPECT_THROW(move(world, {0, start.size(), {}, positions}, mode), Error);
      EXPECT_EQ(count_different(before, hits_of(world)), 0u) << int(mode);
      EXPECT_EQ(world.scene().triangles[1], start[1]);
    }
  const Triangles moved = grid(3);
  move(world, {0, moved.size(), {}, vertices_of(moved)}, UpdateMode::Refit);
  DeviceScene fresh(scene_of(moved), options_for(BuilderId::Balanced));
  EXPECT_EQ(count_different(hits_of(fresh), hits_of(world)), 0u);
}

// One mesh of a tree that holds several, beside instances.
TEST_F(LargeMesh, MayShareItsTree) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  const auto shared_scene = [](const Triangles& large) {
    Scene scene = scene_of(large);
    const std::size_t end = scene.triangles.size();
    scene.instances = {};
    scene.instances.first = {0, large.size() / 3, large.size(), end};
    scene.instances.mesh_labels = {{.id = 0, .in_world = true}, {.id = 1, .in_world = true}, {.id = 2}};
    scene.instances.placements = {{0, {}}, {1, {}}, {2, moved({0, 1, 0})}, {2, moved({1, 1, 0})}};
    finish_scene(scene);
    return scene;
  };
  const Triangles start = grid(0);
  Triangles now = start;
  DeviceScene world(shared_scene(start), options_for(BuilderId::Device));
  ASSERT_EQ(world.forest()->meshes().size(), 2u);
  const std::size_t parts[][2] = {{start.size() / 3, start.size()}, {0, start.size() / 3}};
  for (const auto& [first, end] : parts) {
    const Triangles other = grid(float(end));
    std::copy(other.begin() + std::ptrdiff_t(first), other.begin() + std::ptrdiff_t(end),
              now.begin() + std::ptrdiff_t(first));
    const std::vector<glm::vec3> positions =
        vertices_of({now.begin() + std::ptrdiff_t(first), now.begin() + std::ptrdiff_t(end)});
    move(world, {first, end - first, {}, positions}, UpdateMode::Refit);
    DeviceScene fresh(shared_scene(now), options_for(BuilderId::Balanced));
    EXPECT_EQ(count_different(hits_of(fresh), hits_of(world)), 0u);
    const MeshExtents &found = world.forest()->meshes()[0].extents, &truth = fresh.forest()->meshes()[0].extents;
    EXPECT_EQ(found.largest_triangle, truth.largest_triangle);
    EXPECT_EQ(found.bounds.hi, truth.bounds.hi);
    EXPECT_EQ(world.scene().triangles, fresh.scene().triangles);
  }
}

// Triangles that fall together have no tree; they get one again.
TEST_F(LargeMesh, MayVanish) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  const Triangles start = grid(0);
  DeviceScene world(scene_of(start), options_for(BuilderId::Device));
  const std::vector<Hit> before = hits_of(world);
  const std::vector<glm::vec3> positions(3 * start.size(), glm::vec3(0.5f));
  move(world, {0, start.size(), {}, positions}, UpdateMode::Refit);
  EXPECT_TRUE(world.forest()->meshes()[0].extents.empty);
  for (const Hit& hit : hits_of(world)) {
    if (hit.prim == NO_HIT) continue;
    EXPECT_EQ(world.forest()->place_of(hit.prim).instance, 1u);
  }
  move(world, {0, start.size(), {}, vertices_of(start)}, UpdateMode::Refit);
  EXPECT_EQ(count_different(before, hits_of(world)), 0u);
}

}  // namespace
}  // namespace ballot
