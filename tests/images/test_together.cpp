// Tests of passes that are recorded together. They give the same picture as passes that the host waits for one by one,
// and take few submissions.
#include "engine/render/path/integrators.h"
#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

/// Returns a room of mirrors, glass, paint and a lamp, in which paths are long. Material 4 is for veiled().
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

/// Adds transparent layers of material 4 in front of a scene.
Scene veiled(Scene scene, int layers) {
  scene.materials[4].alpha_mode = Alpha::Blend;
  for (int i = 0; i < layers; ++i) add_rectangle(scene, {-1, -1}, {0.5f, 1}, 1 + 0.125f * float(i), 4);
  finish_scene(scene);
  return scene;
}

/// True if loops run to their end on this driver, so that the host need not check the result of a dispatch.
bool records(DeviceScene& world) {
  return world.tracer().can_record({.method = "while-while", .rays = "primary"}, 4096);
}

void expect_equal(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (std::size_t c = 0; c < a.channels.size(); ++c) {
    EXPECT_TRUE(a.channels[c].floats == b.channels[c].floats) << a.channels[c].name;
    EXPECT_TRUE(a.channels[c].uints == b.channels[c].uints) << a.channels[c].name;
  }
}

/// Returns the ray count of all passes. Pass `begin` generates the camera rays unless the traversal does. The traversal
/// never does where the host waits for passes. The rays of `begin` count only if `begun` is true.
std::uint64_t rays_of(const Picture& picture, bool begun) {
  std::uint64_t rays = 0;
  for (const PassTime& t : picture.times.passes.all()) rays += t.name != "begin" || begun ? t.rays : 0;
  return rays;
}

/// Renders with passes that are recorded together and with passes that the host waits for, and expects equal pictures.
/// Returns the number of submissions of the former; 0 on GPUs, where copies to the host are submissions too, and where
/// the driver makes the host check results.
std::uint64_t submissions_of(Scene scene, const RenderOptions& options) {
  DeviceScene world(std::move(scene), with_validation());
  Context& gpu = *world.context();
  const View view = world.scene().views.front();
  gpu.set_batches(false);
  const Picture alone = render(world, view, options);
  gpu.set_batches(true);
  render(world, view, options);  // compiles the kernels
  const std::uint64_t before = gpu.submissions();
  const Picture together = render(world, view, options);
  const std::uint64_t spent = gpu.submissions() - before;
  expect_equal(alone.image, together.image);
  const bool begun = !world.tracer().makes_rays();
  EXPECT_EQ(rays_of(together, begun), rays_of(alone, begun));
  EXPECT_EQ(together.times.rays, alone.times.rays);
  if (records(world) && gpu.info().is_cpu()) return spent;
  return 0;
}

RenderOptions small(std::string_view shading, std::uint32_t spp, const char* method = "while-while") {
  return {.width = 40, .height = 24, .spp = spp, .shading = std::string(shading), .query = {.method = method}};
}

TEST(Together, PathsAreAsPassByPassInFewSubmissions) {
  // 17 path depths of five passes each, and at least four depths in a submission.
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

// Deferred rays take most of the memory. A picture of few paths gets no further memory for them after a picture of
// many.
TEST(Together, RaysThatArePutOffTakeWhatTheirPictureNeeds) {
  DeviceScene world(hall_scene(), with_validation());
  const View view = world.scene().views.front();
  const RenderOptions few{.width = 24, .height = 24, .spp = 4, .shading = "whitted"};
  const Picture before = render(world, view, few);
  render(world, view, {.width = 96, .height = 96, .spp = 8, .shading = "ao"});
  const std::uint64_t bytes = world.render_bytes();
  expect_equal(render(world, view, few).image, before.image);
  EXPECT_LT(world.render_bytes(), bytes + (16 << 20)) << "a second wave may take 9 MB, and deferred rays nothing";
}

TEST(Together, RaysBehindWhatIsTransparentAreAsPassByPass) {
  submissions_of(veiled(hall_scene(), 1), small("path", 2));
  submissions_of(veiled(hall_scene(), 6), small("path", 2));
  submissions_of(veiled(hall_scene(), 6), small("whitted", 1));
  submissions_of(veiled(hall_scene(), 3), small("eyelight", 3));
}

/// Returns the options for a picture that is rendered in batches of one sample of every pixel.
RenderOptions in_batches(RenderOptions options, std::uint32_t width, std::uint32_t height) {
  options.width = width;
  options.height = height;
  options.most_rays = width * height;
  return options;
}

// A batch is recorded for the work that the batches before it needed. It may need less, or more.
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

/// Renders with camera rays that the traversal reads and with rays that it generates, and expects equal pictures. With
/// `needs_rays`, other passes read the camera rays too, so that the traversal never generates them.
void expect_made_as_read(DeviceScene& world, const RenderOptions& options, bool orthographic, bool needs_rays = false) {
  SCOPED_TRACE(fmt::format("{}, {} samples, orthographic {}", options.shading, options.spp, orthographic));
  View view = world.scene().views.front();
  view.orthographic = orthographic;
  view.ymag = 2;
  world.tracer().make_rays = false;
  const Picture read = render(world, view, options);
  EXPECT_GT(read.times.generate_ms, 0);
  world.tracer().make_rays = true;
  const Picture made = render(world, view, options);
  EXPECT_EQ(made.times.generate_ms == 0, records(world) && !needs_rays);
  expect_equal(read.image, made.image);
}

TEST(Together, MadeRaysAreAsThoseThatAreRead) {
  DeviceScene hall(hall_scene(), with_validation());
  for (const bool orthographic : {false, true}) {
    for (const std::uint32_t spp : {1u, 3u, 20u}) expect_made_as_read(hall, small("eyelight", spp), orthographic);
    for (const Integrator& integrator : kIntegrators) {
      RenderOptions options = small(integrator.name, 3);
      options.seed = orthographic ? 9 : 0;
      expect_made_as_read(hall, options, orthographic);
      expect_made_as_read(hall, in_batches(options, 13, 7), orthographic);
      options.spp = 70;  // more than are rendered together in a picture of many pixels
      options.width = 5;
      options.height = 3;
      expect_made_as_read(hall, options, orthographic);
    }
  }
}

TEST(Together, RaysAreReadWhereSomethingIsTransparent) {
  DeviceScene world(veiled(hall_scene(), 1), with_validation());
  expect_made_as_read(world, small("ao", 2), false, true);
}

// Method auto reads camera rays until it has chosen a method. For the parts that follow, the traversal generates them.
TEST(Together, RaysAreReadForTrialsAndThenMade) {
  RenderOptions options = small("ao", 8, "auto");
  options.width = options.height = 128;
  options.most_rays = 1 << 15;  // the sample size of method auto on CPU devices
  DeviceScene world(hall_scene(), with_validation());
  const View view = world.scene().views.front();
  world.tracer().make_rays = true;
  const Picture made = render(world, view, options);
  const auto begun = [](const Picture& p) {
    for (const PassTime& t : p.times.passes.all())
      if (t.name == "begin") return t.rays;
    return std::uint64_t(0);
  };
  const std::uint64_t all = 128 * 128 * 8;
  if (world.context()->info().is_cpu()) {  // on a GPU, method auto samples more rays than the picture has
    EXPECT_GT(begun(made), 0u);
  }
  if (records(world)) {
    EXPECT_LT(begun(made), all);
  }
  world.tracer().make_rays = false;
  const Picture read = render(world, view, options);
  EXPECT_EQ(begun(read), all);
  expect_equal(read.image, made.image);
}

// Waves of no ray, of one ray, and of as many rays as a wave can hold.
TEST(Together, AnyNumberOfRays) {
  Scene away = hall_scene();
  away.views[0] = view_from({0, 0, 30});  // sees only the back of the far mirror
  submissions_of(away, small("path", 1));
  Scene empty = square_scene();
  empty.views[0] = view_from({0, 0, -9});  // looks away from the square
  submissions_of(empty, small("path", 2));
  RenderOptions one = small("path", 1);
  one.width = one.height = 1;
  submissions_of(hall_scene(), one);
  RenderOptions full = small("path", 4);
  full.width = full.height = 64;
  Scene closed = hall_scene();
  add_rectangle(closed, {-40, -40}, {40, 40}, -1);  // behind everything, so that every camera ray hits
  finish_scene(closed);
  submissions_of(closed, full);
}

}  // namespace
}  // namespace ballot::test
