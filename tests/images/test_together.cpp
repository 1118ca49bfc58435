// Passes that are recorded together give what passes give that the host waits for, and are few submissions.
#include "engine/render/path/integrators.h"
#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

/// A room of mirrors, glass, paint and a lamp, in which paths are long.
Scene hall_scene() {
  Scene scene;
  scene.name = "hall";
  scene.materials.push_back({.name = "paint", .base_color = {0.75f, 0.5f, 0.25f}});
  scene.materials.push_back({.name = "mirror", .base_color = {0.9f, 0.9f, 0.9f}, .metallic = 1, .roughness = 0});
  scene.materials.push_back({.name = "glass", .base_color = {1, 1, 1}, .roughness = 0, .transmission = 1});
  scene.materials.push_back({.name = "lamp", .emissive = {4, 4, 4}});
  scene.materials.push_back({.name = "veil", .base_color = {0.2f, 0.6f, 0.2f}, .alpha = 0.5f});
  add_rectangle(scene, {-1, -1}, {1, 1}, 0);
  add_rectangle(scene, {-1, -1}, {0, 1}, 0.25f, 1);
  for (const float z : {0.5f, 0.625f, 0.75f, 0.875f}) add_rectangle(scene, {-0.75f, -0.75f}, {0.75f, 0.5f}, z, 2);
  add_rectangle(scene, {-1, 0.5f}, {1, 1}, 2, 3);
  add_rectangle(scene, {-4, -4}, {4, 4}, 5, 1);
  scene.views.push_back(view_from({0, 0, 3}));
  finish_scene(scene);
  return scene;
}

Scene veiled(Scene scene, int layers) {
  scene.materials[4].alpha_mode = Alpha::Blend;
  for (int i = 0; i < layers; ++i) add_rectangle(scene, {-1, -1}, {0.5f, 1}, 1 + 0.125f * float(i), 4);
  finish_scene(scene);
  return scene;
}

/// Whether loops run to their end on this driver, so that nothing has to be looked at.
bool records(Engine& engine) { return engine.tracer().can_record({.method = "while-while", .rays = "primary"}, 4096); }

void expect_equal(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (std::size_t c = 0; c < a.channels.size(); ++c) {
    EXPECT_TRUE(a.channels[c].floats == b.channels[c].floats) << a.channels[c].name;
    EXPECT_TRUE(a.channels[c].uints == b.channels[c].uints) << a.channels[c].name;
  }
}

/// Rays of all passes; `begin` makes rays unless the traversal does, which it does not where passes are waited for.
std::uint64_t rays_of(const Picture& picture, bool begun) {
  std::uint64_t rays = 0;
  for (const PassTime& t : picture.times.passes.all()) rays += t.name != "begin" || begun ? t.rays : 0;
  return rays;
}

/// The picture by passes recorded together, held to the one by passes that are waited for; returns submissions of the first
/// where copies to the host are none.
std::uint64_t submissions_of(Scene scene, const RenderOptions& options) {
  Engine engine(std::move(scene), with_validation());
  Context& gpu = *engine.context();
  const View view = engine.scene().views.front();
  gpu.set_batches(false);
  const Picture alone = render(engine, view, options);
  gpu.set_batches(true);
  render(engine, view, options);  // kernels are made
  const std::uint64_t before = gpu.submissions();
  const Picture together = render(engine, view, options);
  const std::uint64_t spent = gpu.submissions() - before;
  expect_equal(alone.image, together.image);
  const bool begun = !engine.tracer().makes_rays();
  EXPECT_EQ(rays_of(together, begun), rays_of(alone, begun));
  EXPECT_EQ(together.times.rays, alone.times.rays);
  if (records(engine) && gpu.info().is_cpu()) return spent;
  return 0;  // or the driver wants looks
}

RenderOptions small(std::string_view shading, std::uint32_t spp, const char* method = "while-while") {
  return {.width = 40, .height = 24, .spp = spp, .shading = std::string(shading), .query = {.method = method}};
}

TEST(Together, PathsAreAsPassByPassInFewSubmissions) {
  // 17 depths of five passes, and four depths at least in a submission.
  EXPECT_LE(submissions_of(hall_scene(), small("path", 4)), 6u);
  RenderOptions long_paths = small("path", 1);
  long_paths.bounces = 64;
  EXPECT_LE(submissions_of(hall_scene(), long_paths), 18u);
  submissions_of(hall_scene(), small("path", 2, "dynamic-fetch"));
  submissions_of(hall_scene(), small("path", 2, "auto"));
}

TEST(Together, RaysThatPartAreAsPassByPass) {
  EXPECT_LE(submissions_of(hall_scene(), small("whitted", 2)), 40u);
  RenderOptions deep = small("whitted", 1);
  deep.bounces = 12;
  submissions_of(hall_scene(), deep);
  deep.bounces = 0;
  EXPECT_LE(submissions_of(hall_scene(), deep), 2u);
}

// Rays that paths put off take most of the memory: a picture of few paths after one of many gets no more for them.
TEST(Together, RaysThatArePutOffTakeWhatTheirPictureNeeds) {
  Engine engine(hall_scene(), with_validation());
  const View view = engine.scene().views.front();
  const RenderOptions few{.width = 24, .height = 24, .spp = 4, .shading = "whitted"};
  const Picture before = render(engine, view, few);
  render(engine, view, {.width = 96, .height = 96, .spp = 8, .shading = "ao"});
  const std::uint64_t bytes = engine.render_bytes();
  expect_equal(render(engine, view, few).image, before.image);
  EXPECT_LT(engine.render_bytes(), bytes + (16 << 20)) << "for a second wave, 9 MB";
}

TEST(Together, RaysBehindWhatIsTransparentAreAsPassByPass) {
  submissions_of(veiled(hall_scene(), 1), small("path", 2));
  submissions_of(veiled(hall_scene(), 6), small("path", 2));
  submissions_of(veiled(hall_scene(), 6), small("whitted", 1));
  submissions_of(veiled(hall_scene(), 3), small("eyelight", 3));
}

/// Batches of one sample of every pixel.
RenderOptions in_batches(RenderOptions options, std::uint32_t width, std::uint32_t height) {
  options.width = width;
  options.height = height;
  options.most_rays = width * height;
  return options;
}

// What a batch is recorded for is what those before it needed: it may need less, or more.
TEST(Together, BatchesAfterBatches) {
  submissions_of(hall_scene(), in_batches(small("path", 12), 8, 4));
  submissions_of(hall_scene(), in_batches(small("path", 4), 40, 24));
  RenderOptions deep = small("whitted", 12);
  deep.bounces = 12;
  submissions_of(hall_scene(), in_batches(deep, 3, 2));
  submissions_of(hall_scene(), in_batches(deep, 16, 12));
  RenderOptions long_paths = small("path", 12);
  long_paths.bounces = 64;
  submissions_of(hall_scene(), in_batches(long_paths, 2, 2));
}

TEST(Together, BatchesBehindWhatIsTransparent) {
  for (const std::uint32_t width : {1u, 2u, 5u, 13u}) {
    submissions_of(veiled(hall_scene(), 8), in_batches(small("path", 24), width, 3));
    submissions_of(veiled(hall_scene(), 8), in_batches(small("whitted", 12), width, 3));
  }
  submissions_of(veiled(hall_scene(), 8), in_batches(small("ao", 6), 5, 3));
}

TEST(Together, ShadingsAndAmbientOcclusionAreAsPassByPass) {
  EXPECT_LE(submissions_of(hall_scene(), small("eyelight", 8)), 3u);
  EXPECT_LE(submissions_of(hall_scene(), small("normals", 1)), 2u);
  EXPECT_LE(submissions_of(hall_scene(), small("ao", 4)), 2u);
  submissions_of(hall_scene(), small("eyelight", 3, "dynamic-fetch"));
}

// Rays that the traversal makes and reads are the same.
void expect_made_as_read(Engine& engine, const RenderOptions& options, bool orthographic, bool needs_rays = false) {
  SCOPED_TRACE(fmt::format("{}, {} samples, orthographic {}", options.shading, options.spp, orthographic));
  View view = engine.scene().views.front();
  view.orthographic = orthographic;
  view.ymag = 2;
  engine.tracer().make_rays = false;
  const Picture read = render(engine, view, options);
  EXPECT_GT(read.times.generate_ms, 0);
  engine.tracer().make_rays = true;
  const Picture made = render(engine, view, options);
  EXPECT_EQ(made.times.generate_ms == 0, records(engine) && !needs_rays);
  expect_equal(read.image, made.image);
}

TEST(Together, MadeRaysAreAsThoseThatAreRead) {
  Engine hall(hall_scene(), with_validation());
  for (const bool orthographic : {false, true}) {
    for (const std::uint32_t spp : {1u, 3u, 20u}) expect_made_as_read(hall, small("eyelight", spp), orthographic);
    for (const Integrator& integrator : kIntegrators) {
      RenderOptions options = small(integrator.name, 3);
      options.seed = orthographic ? 9 : 0;
      expect_made_as_read(hall, options, orthographic);
      expect_made_as_read(hall, in_batches(options, 13, 7), orthographic);
      options.spp = 70;  // more than go together where pixels are many
      options.width = 5;
      options.height = 3;
      expect_made_as_read(hall, options, orthographic);
    }
  }
}

TEST(Together, RaysAreReadWhereSomethingIsTransparent) {
  Engine engine(veiled(hall_scene(), 1), with_validation());
  expect_made_as_read(engine, small("ao", 2), false, true);
}

// Method auto reads rays until it has chosen, and makes those of the parts that follow.
TEST(Together, RaysAreReadForTrialsAndThenMade) {
  RenderOptions options = small("ao", 8, "auto");
  options.width = options.height = 128;
  options.most_rays = 1 << 15;  // as many as auto looks at
  Engine engine(hall_scene(), with_validation());
  const View view = engine.scene().views.front();
  engine.tracer().make_rays = true;
  const Picture made = render(engine, view, options);
  const auto begun = [](const Picture& p) {
    for (const PassTime& t : p.times.passes.all())
      if (t.name == "begin") return t.rays;
    return std::uint64_t(0);
  };
  const std::uint64_t all = 128 * 128 * 8;
  if (engine.context()->info().is_cpu()) {  // a GPU's auto wants more rays
    EXPECT_GT(begun(made), 0u);
  }
  if (records(engine)) {
    EXPECT_LT(begun(made), all);
  }
  engine.tracer().make_rays = false;
  const Picture read = render(engine, view, options);
  EXPECT_EQ(begun(read), all);
  expect_equal(read.image, made.image);
}

// Rays to lights from further hits have a choice of their own.
TEST(Together, RaysToLightsAreChosenForByTheirHits) {
  RenderOptions options = small("path", 24, "auto");
  options.width = options.height = 128;
  options.bounces = 3;
  Scene closed = hall_scene();
  for (const float z : {-1.0f, 4.0f}) add_rectangle(closed, {-40, -40}, {40, 40}, z);  // many further hits
  finish_scene(closed);
  Engine engine(std::move(closed), with_validation());
  if (!engine.context()->info().is_cpu()) GTEST_SKIP() << "as many rays as CPU devices look at";
  render(engine, engine.scene().views.front(), options);
  std::vector<std::string> kinds;
  for (const Choice& c : engine.tracer().choices().all()) kinds.push_back(c.rays);
  for (const char* kind : {"primary", "diffuse", "shadow", "shadow of diffuse"})
    EXPECT_NE(std::ranges::find(kinds, kind), kinds.end()) << kind;
}

// Waves of no ray, of one, and as full as a wave can be.
TEST(Together, AnyNumberOfRays) {
  Scene away = hall_scene();
  away.views[0] = view_from({0, 0, 30});  // past everything but the back of the far mirror
  submissions_of(away, small("path", 1));
  Scene empty = square_scene();
  empty.views[0] = view_from({0, 0, -9});  // looks away
  submissions_of(empty, small("path", 2));
  RenderOptions one = small("path", 1);
  one.width = one.height = 1;
  submissions_of(hall_scene(), one);
  RenderOptions full = small("path", 4);
  full.width = full.height = 64;
  Scene closed = hall_scene();
  add_rectangle(closed, {-40, -40}, {40, 40}, -1);  // behind all: every camera ray hits
  finish_scene(closed);
  submissions_of(closed, full);
}

}  // namespace
}  // namespace ballot::test
