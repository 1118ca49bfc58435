// Vertices that lie on the device: scenes that follow them are those that follow the same vertices of the host, bit for
// bit, and what cannot be leaves a scene as it was.
#include "tests/device/crossing_test.h"
#include "tests/device/sheets.h"

namespace ballot {
namespace {

using namespace harness;
using shapes::Triangles;

class VerticesThere : public CrossingTest {
 protected:
  void SetUp() override {
    if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  }

  /// Three sheets, one above the other. Large: trees of the first stay on the device where there are instances.
  static std::vector<Sheet> sheets(bool large) { return {{large ? 182u : 31u, 0}, {17, 0.5f}, {9, 1}}; }

  static DeviceSceneOptions options_for(BuilderId builder) {
    DeviceSceneOptions options;
    options.context = gpu_;
    options.build.builder = builder;
    options.use_cache = false;
    return options;
  }

  /// Puts vertices on the device, `stride` bytes apart.
  static DeviceVertices put(std::span<const glm::vec3> positions, std::uint64_t offset = 0, std::uint64_t stride = 12) {
    std::vector<std::byte> bytes(offset + positions.size() * stride, std::byte{0xFF});  // NaN between them
    for (std::size_t i = 0; i < positions.size(); ++i)
      std::memcpy(bytes.data() + offset + i * stride, &positions[i], sizeof(glm::vec3));
    auto buffer = std::make_shared<Buffer<std::byte>>(*gpu_, bytes.size(), Access::Storage, "vertices of the caller");
    buffer->upload(bytes);
    return {std::move(buffer), offset, stride, positions.size()};
  }

  /// A mesh that moves, by its number.
  struct Move {
    std::uint32_t mesh;
    Positions positions;
  };
  static void commit(DeviceScene& world, const std::vector<Sheet>& sheets, const std::vector<Move>& moves, bool there,
                     UpdateMode mode, std::uint64_t offset = 0, std::uint64_t stride = 12) {
    const SceneInstances& all = world.scene_facts().instances;
    std::vector<MovedVertices> meshes;
    for (const Move& m : moves) {
      MovedVertices& moved = meshes.emplace_back();
      moved.first = all.first[m.mesh], moved.triangles = all.triangles_of(m.mesh);
      moved.corners = sheets[m.mesh].corners;
      moved.mesh = moved.number = m.mesh;
      if (there)
        moved.there = put(m.positions, offset, stride);
      else
        moved.positions = m.positions;
    }
    SceneChange change{.vertices = meshes};
    world.commit(change, mode);
  }

  static std::vector<Hit> hits_of(DeviceScene& world, const char* numeric = "watertight") {
    std::vector<Ray> rays = shapes::random_rays(500);
    for (std::size_t i = 0; i < rays.size(); i += 2)
      rays[i] = {{rays[i].origin.x, 5, rays[i].origin.z}, 0, {0, -1, 0}, 99};
    for (const Ray& r : shapes::edge_rays(world.scene().triangles, 200, {0.1f, 3, 0.2f})) rays.push_back(r);
    std::vector<Hit> hits(rays.size());
    world.trace(rays, hits, {.numeric = numeric});
    return hits;
  }

  /// Expects equal scenes after a commit. In mode auto the time that each has taken decides how its tree follows.
  static void expect_equal(DeviceScene& there, DeviceScene& here, UpdateMode mode) {
    if (mode != UpdateMode::Auto) {
      EXPECT_EQ(there.last_update().refitted, here.last_update().refitted);
    }
    EXPECT_EQ(there.scene().triangles, here.scene().triangles);
    EXPECT_EQ(there.scene().bounds.lo, here.scene().bounds.lo);
    EXPECT_EQ(there.scene().bounds.hi, here.scene().bounds.hi);
    const std::vector<Hit> hits = hits_of(here);
    EXPECT_GT(std::ranges::count_if(hits, [](const Hit& h) { return h.prim != NO_HIT; }), 200);
    EXPECT_EQ(count_different(hits_of(there), hits), 0u);
  }

  static std::string error_of(const std::function<void()>& call) {
    try {
      call();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Failure::Arguments);
      return error.what();
    }
    ADD_FAILURE() << "nothing was refused";
    return {};
  }

  /// Expects that bad vertices are refused as those of the host are, and leave the scene as it was.
  static void expect_refused(Made made, bool large) {
    const std::vector<Sheet> all = sheets(large);
    DeviceScene world(scene_of(all, made), options_for(BuilderId::Device));
    for (const UpdateMode mode : {UpdateMode::Refit, UpdateMode::Rebuild, UpdateMode::Auto}) {
      commit(world, all, {{0, all[0].positions(float(mode))}}, true, mode);
      const std::vector<Hit> before = hits_of(world);
      const Triangles triangles = world.scene().triangles;
      const double sah = world.bvh_stats().sah;
      for (const float bad : {NAN, INFINITY, -2e12f})
        for (const std::uint32_t mesh : {0u, 2u}) {
          std::vector<Move> moves{{0, all[0].positions(9)}, {2, all[2].positions(9)}};
          Positions& at = moves[mesh / 2].positions;
          at[77].z = bad, at[78].x = NAN, at.back().y = bad;
          const auto refused = [&](bool there) { commit(world, all, moves, there, mode, 8, 20); };
          const std::string text = error_of([&] { refused(true); });
          EXPECT_TRUE(text.starts_with(fmt::format("mesh {}: vertex 77 is (", mesh))) << text;
          EXPECT_EQ(text, error_of([&] { refused(false); }));
          EXPECT_EQ(count_different(before, hits_of(world)), 0u) << bad;
          EXPECT_EQ(world.scene().triangles, triangles);
          EXPECT_NEAR(world.bvh_stats().sah, sah, 1e-6 * sah);
        }
    }
    const std::vector<Move> good{{0, all[0].positions(4)}};
    commit(world, all, good, true, UpdateMode::Refit);
    DeviceScene here(scene_of(all, made), options_for(BuilderId::Device));
    commit(here, all, good, false, UpdateMode::Refit);
    expect_equal(world, here, UpdateMode::Refit);
  }
};

TEST_F(VerticesThere, AreThoseOfTheHost) {
  const std::vector<Sheet> all = sheets(false);
  DeviceScene there(scene_of(all, Made::Flat), options_for(BuilderId::Device)),
      here(scene_of(all, Made::Flat), options_for(BuilderId::Device));
  const auto move = [&](const std::vector<Move>& moves, UpdateMode mode, std::uint64_t offset, std::uint64_t stride) {
    SCOPED_TRACE(fmt::format("mode {}, {} meshes, offset {}, stride {}", int(mode), moves.size(), offset, stride));
    commit(there, all, moves, true, mode, offset, stride);
    commit(here, all, moves, false, mode);
    expect_equal(there, here, mode);
    EXPECT_EQ(there.triangle(17), here.triangle(17));
  };
  for (const UpdateMode mode : {UpdateMode::Refit, UpdateMode::Rebuild, UpdateMode::Auto}) {
    const float phase = float(mode);
    move({{1, all[1].positions(phase + 1)}}, mode, 0, 12);
    move({{0, all[0].positions(phase + 2)}, {2, all[2].positions(phase)}}, mode, 4, 12);
    move({{0, all[0].positions(phase)}, {1, all[1].positions(phase)}, {2, all[2].positions(3)}}, mode, 1028, 36);
  }
  if (at_default_size(gpu_->info())) {
    EXPECT_EQ(count_different(hits_of(there, "exact"), hits_of(here, "exact")), 0u);
  }
  DeviceScene fresh(Scene(there.scene()), options_for(BuilderId::Balanced));
  EXPECT_EQ(count_different(hits_of(there), hits_of(fresh)), 0u);
  const auto batch = there.make_batch("rays", shapes::random_rays(200), Want::Nearest);
  const ExactTruth truth = there.checker().exact_truth(*batch);  // of nodes that are read back
  EXPECT_EQ(there.checker().verify(*batch, truth, {.method = "while-while"}).beyond_bound, 0u);
}

// Whatever reads triangles on the host gets the new ones: each of these is asked first after a commit of its own.
TEST_F(VerticesThere, AllAnswersFollowThem) {
  if (!at_default_size(gpu_->info())) GTEST_SKIP() << "as at the default size, and slow";
  const std::vector<Sheet> all = sheets(false);
  DeviceScene there(scene_of(all, Made::Flat), options_for(BuilderId::Device)),
      here(scene_of(all, Made::Flat), options_for(BuilderId::Device));
  const std::vector<Ray> rays = shapes::random_rays(300);
  const std::vector<std::function<std::vector<float>(DeviceScene&)>> answers{
      [&](DeviceScene& world) {
        std::vector<float> found;
        for (const std::vector<Hit>& hits : lists(world.rays(), source_of(rays), {.exact = true}))
          for (const Hit& hit : hits) found.insert(found.end(), {hit.t, float(hit.prim)});
        return found;
      },
      [&](DeviceScene& world) {
        std::vector<float> found;
        const Image image = world.render(world.scene_facts().views[0], {.width = 32, .height = 32});
        for (const auto& channel : image.channels)
          found.insert(found.end(), channel.floats.begin(), channel.floats.end());
        return found;
      },
      [&](DeviceScene& world) {
        std::vector<ProbePoint> points;
        for (const Ray& ray : rays) points.push_back({ray.origin, std::numeric_limits<float>::infinity()});
        std::vector<Nearest> nearest(points.size());
        world.points().nearest(points, nearest);
        std::vector<float> found;
        for (const Nearest& n : nearest) found.insert(found.end(), {n.distance, float(n.prim)});
        return found;
      },
      [](DeviceScene& world) { return std::vector<float>{float(world.topology().first_boundary.size())}; },
      [](DeviceScene& world) {
        return std::vector<float>{world.triangle(5)[1].y, world.triangle(1999)[2].y};
      }};
  for (std::size_t i = 0; i < 2 * answers.size(); ++i) {
    SCOPED_TRACE(i);
    const UpdateMode mode = i % 2 ? UpdateMode::Refit : UpdateMode::Rebuild;
    const std::vector<Move> moves{{i % 3 ? 0u : 1u, all[i % 3 ? 0 : 1].positions(float(i))}};
    commit(there, all, moves, true, mode);
    commit(here, all, moves, false, mode);
    const std::vector<float> found = answers[i / 2](there);
    EXPECT_GT(found.size(), 0u);
    EXPECT_EQ(found, answers[i / 2](here));
  }
}

// The scene grows and shrinks, to nothing too: the cost of its tree is found all the same.
TEST_F(VerticesThere, MayBeOfAnySize) {
  const std::vector<Sheet> all = sheets(false);
  DeviceScene there(scene_of(all, Made::Flat), options_for(BuilderId::Device)),
      here(scene_of(all, Made::Flat), options_for(BuilderId::Device));
  for (const float scale : {1e3f, 1e11f, 1e-12f, 0.f, 1.f}) {
    SCOPED_TRACE(scale);
    std::vector<Move> moves;
    for (std::uint32_t m = 0; m < all.size(); ++m) moves.push_back({m, all[m].positions(1, scale)});
    commit(there, all, moves, true, UpdateMode::Refit);
    commit(here, all, moves, false, UpdateMode::Refit);
    EXPECT_EQ(there.last_update().refitted, here.last_update().refitted);
    EXPECT_EQ(there.scene().triangles, here.scene().triangles);
    EXPECT_EQ(count_different(hits_of(there), hits_of(here)), 0u);
    EXPECT_NEAR(there.bvh_stats().sah, here.bvh_stats().sah, 1e-5 * here.bvh_stats().sah);
  }
}

// Triangles lose their area, and get it again.
TEST_F(VerticesThere, MayFallTogether) {
  const std::vector<Sheet> all = sheets(false);
  DeviceScene there(scene_of(all, Made::Flat), options_for(BuilderId::Device)),
      here(scene_of(all, Made::Flat), options_for(BuilderId::Device));
  for (const UpdateMode mode : {UpdateMode::Refit, UpdateMode::Rebuild, UpdateMode::Auto})
    for (const bool falls : {true, false}) {
      SCOPED_TRACE(fmt::format("mode {}, {}", int(mode), falls));
      Positions positions = all[0].positions(2);
      if (falls) std::fill_n(positions.begin(), positions.size() / 2, positions[3]);
      commit(there, all, {{0, positions}}, true, mode);
      commit(here, all, {{0, positions}}, false, mode);
      EXPECT_FALSE(there.last_update().refitted && mode != UpdateMode::Auto);
      expect_equal(there, here, mode);
    }
}

// The tree of the first mesh lies on the device, those of the others with the host.
TEST_F(VerticesThere, MoveMeshesOfInstances) {
  const std::vector<Sheet> all = sheets(true);
  DeviceScene there(scene_of(all, Made::Instances), options_for(BuilderId::Device)),
      here(scene_of(all, Made::Instances), options_for(BuilderId::Device));
  ASSERT_TRUE(there.tracer().tree().built(0));
  ASSERT_FALSE(there.tracer().tree().built(1));
  for (const UpdateMode mode : {UpdateMode::Refit, UpdateMode::Rebuild, UpdateMode::Auto}) {
    SCOPED_TRACE(int(mode));
    const std::vector<Move> moves{{0, all[0].positions(1 + float(mode))}, {2, all[2].positions(2 + float(mode))}};
    commit(there, all, moves, true, mode, 20, 16);
    commit(here, all, moves, false, mode);
    expect_equal(there, here, mode);
    EXPECT_EQ(there.forest()->meshes()[0].extents.largest_triangle,
              here.forest()->meshes()[0].extents.largest_triangle);
  }
}

TEST_F(VerticesThere, AreReadBackForTreesOfTheHost) {
  const std::vector<Sheet> all = sheets(false);
  DeviceScene there(scene_of(all, Made::Flat), options_for(BuilderId::Balanced)),
      here(scene_of(all, Made::Flat), options_for(BuilderId::Balanced));
  for (const UpdateMode mode : {UpdateMode::Refit, UpdateMode::Rebuild}) {
    const std::vector<Move> moves{{0, all[0].positions(1)}, {2, all[2].positions(2)}};
    commit(there, all, moves, true, mode, 16, 24);
    commit(here, all, moves, false, mode);
    expect_equal(there, here, mode);
  }
}

TEST_F(VerticesThere, BadOnesLeaveAFlatSceneAsItWas) { expect_refused(Made::Flat, false); }

TEST_F(VerticesThere, BadOnesLeaveInstancesAsTheyWere) {
  if (!at_default_size(gpu_->info())) GTEST_SKIP() << "as at the default size, and slow";
  expect_refused(Made::Instances, true);
}

TEST_F(VerticesThere, WrongArraysAreRefused) {
  const std::vector<Sheet> all = sheets(false);
  DeviceScene world(scene_of(all, Made::Flat), options_for(BuilderId::Device));
  const std::vector<Hit> before = hits_of(world);
  const Positions positions = all[1].positions(3);
  const SceneInstances& meshes = world.scene_facts().instances;
  const auto text_of = [&](const DeviceVertices& there, bool indices = true) {
    MovedVertices moved;
    moved.first = meshes.first[1], moved.triangles = meshes.triangles_of(1);
    if (indices) moved.corners = all[1].corners;
    moved.mesh = moved.number = 1;
    moved.there = there;
    SceneChange change{.vertices = std::span(&moved, 1)};
    const std::string text = error_of([&] { world.commit(change, UpdateMode::Refit); });
    EXPECT_EQ(count_different(before, hits_of(world)), 0u) << text;
    return text;
  };
  const DeviceVertices good = put(positions, 8, 16);
  const auto with = [&](auto change) {
    DeviceVertices v = good;
    change(v);
    return v;
  };
  EXPECT_NE(text_of(with([](DeviceVertices& v) { v.stride = 14; })).find("mesh 1: the stride of vertices is 14"),
            std::string::npos);
  EXPECT_NE(text_of(with([](DeviceVertices& v) { v.stride = 8; })).find("is 8 bytes"), std::string::npos);
  EXPECT_NE(text_of(with([](DeviceVertices& v) { v.offset = 6; })).find("begin at byte 6"), std::string::npos);
  for (const std::uint64_t offset : {std::uint64_t{28}, std::uint64_t{1} << 40, ~std::uint64_t{3}})
    EXPECT_NE(text_of(with([=](DeviceVertices& v) { v.offset = offset; })).find("has room for"), std::string::npos);
  EXPECT_NE(text_of(with([](DeviceVertices& v) { v.stride = ~std::uint64_t{3}; })).find("room for 1 vertices"),
            std::string::npos);
  EXPECT_NE(text_of(with([](DeviceVertices& v) { v.count = ~std::uint64_t{0}; })).find("has room for"),
            std::string::npos);
  EXPECT_NE(text_of(good, false).find("mesh 1: 324 vertices, but its 578 triangles"), std::string::npos);
  EXPECT_NE(text_of(with([](DeviceVertices& v) { v.buffer.reset(); })).find("freed"), std::string::npos);
  const auto gone = std::make_shared<RawBuffer>(*gpu_, 1 << 16, Access::Storage, "moved elsewhere");
  const RawBuffer taken = std::move(*gone);
  EXPECT_NE(text_of(with([&](DeviceVertices& v) { v.buffer = gone; })).find("freed"), std::string::npos);
  Context other(options());
  const auto far = std::make_shared<RawBuffer>(other, 1 << 16, Access::Storage, "of another device");
  EXPECT_NE(text_of(with([&](DeviceVertices& v) { v.buffer = far; })).find("'of another device' of vertices lies on"),
            std::string::npos);
  const auto unread = std::make_shared<RawBuffer>(*gpu_, 1 << 16, Access::Host, "unread");
  EXPECT_NE(text_of(with([&](DeviceVertices& v) { v.buffer = unread; })).find("cannot read"), std::string::npos);
}

// More meshes than are recorded together share a tree. Those that stay tell their extents once, on the device.
TEST_F(VerticesThere, ManyMeshesShareATree) {
  const std::vector<Sheet> all = [] {
    std::vector<Sheet> sheets;
    for (int i = 0; i < 300; ++i) sheets.emplace_back(3, 0.01f * float(i));
    return sheets;
  }();
  DeviceScene there(scene_of(all, Made::Flat), options_for(BuilderId::Device)),
      here(scene_of(all, Made::Flat), options_for(BuilderId::Device));
  std::vector<Move> every;
  for (std::uint32_t m = 0; m < all.size(); ++m) every.push_back({m, all[m].positions(float(m), 3)});
  for (const std::vector<Move>& moves : {std::vector<Move>{{7, all[7].positions(2, 2)}}, every, {every[299]}}) {
    commit(there, all, moves, true, UpdateMode::Refit, 4, 16);
    commit(here, all, moves, false, UpdateMode::Refit);
    expect_equal(there, here, UpdateMode::Refit);
  }
}

// The host waits once for a refit, and twice for a build: for the vertices, which must be good, and for the tree.
TEST_F(VerticesThere, TakeFewSubmissions) {
  for (const Made made : {Made::Flat, Made::Instances}) {
    const std::vector<Sheet> all = sheets(made == Made::Instances);
    DeviceScene world(scene_of(all, made), options_for(BuilderId::Device));
    MovedVertices mesh;
    mesh.triangles = all[0].corners.size() / 3;
    mesh.corners = all[0].corners;
    SceneChange change{.vertices = std::span(&mesh, 1)};
    for (const auto& [mode, submissions] : {std::pair(UpdateMode::Refit, 1), std::pair(UpdateMode::Rebuild, 2)}) {
      SCOPED_TRACE(fmt::format("{}, mode {}", int(made), int(mode)));
      mesh.there = put(all[0].positions(1));
      world.commit(change, mode);  // makes kernels and buffers
      hits_of(world);
      mesh.there = put(all[0].positions(2));
      gpu_->finish();
      const std::uint64_t before = gpu_->submissions();
      world.commit(change, mode);
      EXPECT_LE(gpu_->submissions() - before, std::uint64_t(submissions));
    }
  }
}

}  // namespace
}  // namespace ballot
