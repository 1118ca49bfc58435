// Tests of live pictures, which stay on the device. They equal those of render(), for every ray kind, also while they
// are refined sample by sample.
#include <algorithm>
#include <array>
#include <cmath>

#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

const std::string kCornell = std::string(BALLOT_SOURCE_DIR) + "/scenes/cornell.gltf";
constexpr std::uint32_t kWidth = 90, kHeight = 70;  // not multiples of a tile's size

class Live : public testing::Test {
 protected:
  static void SetUpTestSuite() { world_ = std::make_unique<DeviceScene>(load_scene(kCornell), with_validation()); }
  static void TearDownTestSuite() { world_.reset(); }
  void TearDown() override { EXPECT_TRUE(world_->messages().empty()) << world_->messages().front(); }

  static const View& view() { return world_->scene().views[0]; }
  static LiveOptions options() {
    LiveOptions o;
    o.width = kWidth, o.height = kHeight;
    return o;
  }
  /// Downloads the packed 8-bit colours of the picture.
  static std::vector<std::uint32_t> pixels() {
    std::vector<std::uint32_t> all(std::size_t(kWidth) * kHeight);
    world_->live().pixels().download(all);
    return all;
  }
  inline static std::unique_ptr<DeviceScene> world_;
};

/// Returns the largest difference of a colour channel, in 8-bit steps. It may be 1, as half floats and pow() round.
int difference(const Image& image, const std::vector<std::uint32_t>& pixels) {
  int most = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const char* names[] = {"B", "G", "R"};
      most = std::max(most, std::abs(test::srgb(image.channel(names[c]).floats[i]) - int(pixels[i] >> (8 * c) & 255)));
    }
  return most;
}

TEST_F(Live, ShowsWhatRenderWrites) {
  for (const char* shading : {"eyelight", "normals", "heat"}) {
    LiveOptions o = options();
    o.shading = shading;
    o.heat = "lanes";
    const LiveTimes times = world_->live().add_sample(view(), o);
    const RenderOptions same{.width = kWidth, .height = kHeight, .shading = shading, .heat = "lanes"};
    EXPECT_LE(difference(world_->render(view(), same), pixels()), 1) << shading;
    EXPECT_EQ(times.rays, std::uint64_t(kWidth) * kHeight);
    EXPECT_GT(times.trace_ms, 0);
  }
}

TEST_F(Live, RefinesToWhatRenderMakesOfAsManySamples) {
  LiveOptions o = options();
  o.sample_count = 5;
  for (o.sample_index = 0; o.sample_index < o.sample_count; ++o.sample_index) world_->live().add_sample(view(), o);
  const Image image = world_->render(view(), {.width = kWidth, .height = kHeight, .spp = 5});
  EXPECT_LE(difference(image, pixels()), 1);
}

/// Adds the samples [0, 3) of an integrator, and returns how many calls that took.
int add_three_samples(DeviceScene& world, const View& view, LiveOptions o, const Integrator& integrator) {
  o.shading = integrator.name;
  o.sample_count = 3;
  int calls = 0;
  for (o.sample_index = 0; o.sample_index < o.sample_count; ++o.sample_index) {
    o.goes_on = false;
    for (bool finished = false; !finished; o.goes_on = true, ++calls)
      finished = world.live().add_sample(view, o).finished;
  }
  return calls;
}

TEST_F(Live, ShowsWhatIntegratorsRender) {
  for (const Integrator& integrator : kIntegrators) {
    SCOPED_TRACE(integrator.name);
    EXPECT_EQ(add_three_samples(*world_, view(), options(), integrator), 3);
    RenderOptions same{.width = kWidth, .height = kHeight, .spp = 3, .clamp = integrator.clamp};
    same.shading = integrator.name;
    Image image = world_->render(view(), same);
    const Tone tone{.neutral = integrator.sees == Sees::Materials};
    for (std::size_t i = 0; i < std::size_t(kWidth) * kHeight; ++i) {
      std::array<float, 3> color{};
      for (int c = 0; c < 3; ++c) color[std::size_t(c)] = image.channel(std::string(1, "RGB"[c])).floats[i];
      color = toned(color, tone);
      for (Channel& channel : image.channels)
        for (int c = 0; c < 3; ++c)
          if (channel.name == std::string(1, "RGB"[c])) channel.floats[i] = color[std::size_t(c)];
    }
    EXPECT_LE(difference(image, pixels()), 1);
  }
}

TEST_F(Live, ASampleInPartsIsTheSameSample) {
  const Integrator& path = *find_integrator("path");
  add_three_samples(*world_, view(), options(), path);
  const auto whole = pixels();
  LiveOptions in_parts = options();
  in_parts.part_ms = 1e-3;  // as few pixels a call as it gets
  EXPECT_GT(add_three_samples(*world_, view(), in_parts, path), 6);
  EXPECT_EQ(pixels(), whole);
}

TEST_F(Live, AnIntegratorTakesNoOtherRays) {
  LiveOptions o = options();
  o.shading = "path";
  o.rays = "shadow";
  EXPECT_THROW(world_->live().add_sample(view(), o), Error);
}

TEST_F(Live, ShowsEveryRayKind) {
  for (const RayKind& kind : kRayKinds) {
    SCOPED_TRACE(kind.name);
    LiveOptions o = options();
    o.rays = kind.name;
    const LiveTimes times = world_->live().add_sample(view(), o);
    EXPECT_GT(times.rays, 0u);
    if (!kind.from_camera()) {
      // One ray per primary hit and generator, as in a batch with one ray per hit.
      const auto batch = world_->make_batch(view(), kind, kWidth, kHeight, {.ao_rays = 1});
      EXPECT_EQ(times.rays, batch->count());
      EXPECT_GT(times.primary_ms, 0);
    }
    const auto all = pixels();
    EXPECT_GT(std::ranges::count_if(all, [](std::uint32_t p) { return (p & 0xFFFFFF) != 0; }), 500);
    o.shading = "heat";
    EXPECT_EQ(world_->live().add_sample(view(), o).rays, times.rays);
  }
}

/// Returns live pictures of three sizes after each of two samples. Adds to `generate_ms` the milliseconds of passes
/// that generate the rays of second samples.
std::vector<std::vector<std::uint32_t>> pictures_of(DeviceScene& world, View view, LiveOptions o, double& generate_ms) {
  std::vector<std::vector<std::uint32_t>> all;
  o.sample_count = 2;
  for (const auto& [width, height] : {std::pair(90u, 70u), std::pair(130u, 41u), std::pair(64u, 96u)}) {
    o.width = width, o.height = height;
    for (o.sample_index = 0; o.sample_index < 2; ++o.sample_index) {
      const LiveTimes times = world.live().add_sample(view, o);
      if (o.sample_index > 0) generate_ms += times.generate_ms;
      EXPECT_EQ(times.rays, std::uint64_t(width) * height);
      all.emplace_back(std::size_t(width) * height);
      world.live().pixels().download(all.back());
    }
  }
  return all;
}

TEST_F(Live, RaysThatTheTraversalMakesAreThoseThatAreRead) {
  for (const bool orthographic : {false, true}) {
    SCOPED_TRACE(orthographic ? "orthographic" : "perspective");
    LiveOptions o = options();
    o.query.method = "while-while";
    View v = view();
    v.orthographic = orthographic;
    Tracer& tracer = world_->tracer();
    double made_ms = 0, read_ms = 0;
    tracer.make_rays = true;
    const auto made = pictures_of(*world_, v, o, made_ms);
    tracer.make_rays = false;
    const auto read = pictures_of(*world_, v, o, read_ms);
    tracer.make_rays.reset();
    EXPECT_EQ(made, read);
    EXPECT_GT(read_ms, 0);
    Query query = o.query;
    query.rays = kPrimaryRays;
    const bool could = tracer.can_record(query, kWidth * kHeight);  // false where a driver cuts loops short
    EXPECT_EQ(made_ms == 0, could)
        << "rays must come from a pass of their own exactly where the traversal cannot generate them";
  }
}

TEST_F(Live, RaysOfPicturesOfSeveralDispatchesAreMadeToo) {
  LiveOptions o = options();
  o.query.method = "while-while";
  Tracer& tracer = world_->tracer();
  o.width = o.height = std::uint32_t(std::sqrt(tracer.chunk_rays())) + 6;
  ASSERT_GT(std::size_t(o.width) * o.height, tracer.chunk_rays());
  std::vector<std::vector<std::uint32_t>> pictures;
  for (const bool made : {true, false}) {
    tracer.make_rays = made;
    world_->live().add_sample(view(), o);
    pictures.emplace_back(std::size_t(o.width) * o.height);
    world_->live().pixels().download(pictures.back());
  }
  tracer.make_rays.reset();
  EXPECT_EQ(pictures[0], pictures[1]);
}

TEST_F(Live, ProbesAPixel) {
  const Image image = world_->render(view(), {.width = kWidth, .height = kHeight, .stats = true});
  for (const auto& [x, y] : {std::pair(0u, 0u), std::pair(45u, 35u), std::pair(kWidth - 1, kHeight - 1)}) {
    const std::size_t at = std::size_t(y) * kWidth + x;
    const Probe plain = world_->live().probe(view(), options(), x, y, false);
    const Probe counted = world_->live().probe(view(), options(), x, y, true);
    EXPECT_EQ(plain.hit.prim, image.channel("prim").uints[at]);
    EXPECT_EQ(counted.hit.prim, plain.hit.prim);
    for (const HeatKind& kind : kHeatKinds)
      EXPECT_EQ(kind.value(counted.stats), image.channel("stats." + std::string(kind.name)).floats[at]) << kind.name;
    EXPECT_FALSE(plain.counted);
  }
  EXPECT_THROW(world_->live().probe(view(), options(), kWidth, 0, false), Error);
}

TEST_F(Live, RefusesBadOptions) {
  LiveOptions o = options();
  o.rays = "sideways";
  EXPECT_THROW(world_->live().add_sample(view(), o), Error);
  o = options();
  o.width = 0;
  EXPECT_THROW(world_->live().add_sample(view(), o), Error);
  o = options();
  o.query.knobs["vote"] = "any";
  EXPECT_THROW(world_->live().add_sample(view(), o), Error);
  EXPECT_THROW(world_->make_presenter(), Error);
}

}  // namespace
}  // namespace ballot::test
