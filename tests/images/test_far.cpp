// Pictures of scenes far from the origin: they are, bit for bit, those of the same scene near it.
#include <functional>

#include "engine/tree/host/bvh.h"
#include "tests/cpu/shapes.h"
#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

constexpr glm::vec3 kFarAway(2e5f, -1e5f, 5e4f);
constexpr std::uint32_t kFarSide = 20;

Triangle turned_inside_out(const Triangle& t) { return {{t[0], t[2], t[1]}}; }

/// Returns a scene about `at`: a room with a mirror, a glass ball and a lamp, and a view of it. Coordinates far from
/// zero are rounded. `instances`: the balls are one mesh that is there once, and the room lies in the world.
Scene room_at(const glm::vec3& at, bool instances) {
  Scene scene;
  scene.name = "room";
  scene.materials = {{.name = "wall", .base_color = {0.7f, 0.5f, 0.3f}},
                     {.name = "lamp", .emissive = glm::vec3(2)},
                     {.name = "mirror", .metallic = 1, .roughness = 0},
                     {.name = "glass", .roughness = 0, .transmission = 1, .ior = 1.5f}};
  const auto add = [&](const shapes::Triangles& triangles, const glm::vec3& by, std::uint32_t material) {
    for (const Triangle& t : shapes::moved(triangles, by)) scene.triangles.push_back(t);
    scene.material_of.resize(scene.triangles.size(), material);
  };
  for (const Triangle& t : shapes::box({-1, -1, -1}, {1, 1, 1})) add({turned_inside_out(t)}, at, 0);
  add({{{{-0.25f, 0.875f, -0.25f}, {0.25f, 0.875f, -0.25f}, {0, 0.875f, 0.25f}}}}, at, 1);
  const shapes::Triangles ball = shapes::scaled(shapes::sphere(2), 0.375f);
  const glm::vec3 places[] = {{-0.5f, -0.5f, -0.25f}, {0.5f, -0.5f, 0.25f}};
  if (instances) {
    const std::size_t room = scene.triangles.size();
    add(ball, {}, 3);
    scene.instances.first = {0, room, scene.triangles.size()};
    scene.instances.placements.push_back({});
    for (const glm::vec3& p : places) {
      Placement placed{.mesh = 1, .transform = {}};
      for (int r = 0; r < 3; ++r) placed.transform.m[r][3] = at[r] + p[r];
      scene.instances.placements.push_back(placed);
    }
  } else {
    for (std::uint32_t i = 0; i < 2; ++i) add(ball, at + places[i], 2 + i);
  }
  scene.lights.push_back({.name = "point", .position = at + glm::vec3(0.5f, 0.5f, 0.5f)});
  scene.views.push_back(view_from(glm::dvec3(at) + glm::dvec3(0, 0, 0.75)));
  scene.views.back().yfov = 1.5;
  finish_scene(scene);
  return scene;
}

/// Returns the scene with the point `by` at zero. Nothing rounds if the scene is small and far away.
Scene brought_near(Scene scene, const glm::vec3& by) {
  const std::size_t moved = scene.instanced() ? scene.instances.first[1] : scene.triangles.size();
  for (std::size_t i = 0; i < moved; ++i)
    for (glm::vec3& v : scene.triangles[i]) v -= by;
  for (std::size_t i = 1; i < scene.instances.placements.size(); ++i)
    for (int r = 0; r < 3; ++r) scene.instances.placements[i].transform.m[r][3] -= by[r];
  scene.lights[0].position -= by;
  scene.views[0].world_from_camera[3] -= glm::dvec4(glm::dvec3(by), 0);
  finish_scene(scene);
  return scene;
}

void expect_same_picture(const Picture& a, const Picture& b, const std::string& what) {
  for (const char* name : {"R", "G", "B", "A", "Z"})
    EXPECT_EQ(a.image.channel(name).floats, b.image.channel(name).floats) << what << ", " << name;
  EXPECT_EQ(a.image.channel("prim").uints, b.image.channel("prim").uints) << what;
}

RenderOptions far_options(const char* shading) {
  return {.width = kFarSide, .height = kFarSide, .spp = 2, .shading = shading};
}

TEST(Far, PicturesAreThoseNearZero) {
  for (const bool instances : {false, true}) {
    const Scene scene = room_at(kFarAway, instances);
    const glm::vec3 origin = box_origin(scene.bounds);
    ASSERT_NE(origin, glm::vec3(0));
    DeviceScene far(scene, with_validation()), near(brought_near(scene, origin), with_validation());
    for (const char* shading : {"eyelight", "ao", "whitted", "path"})
      expect_same_picture(render(far, far.scene().views[0], far_options(shading)),
                          render(near, near.scene().views[0], far_options(shading)), shading);
    far.set_sky(make_sky("0.5,1,2"));
    near.set_sky(make_sky("0.5,1,2"));
    expect_same_picture(render(far, far.scene().views[0], far_options("path")),
                        render(near, near.scene().views[0], far_options("path")), "under a sky");
  }
}

TEST(Far, WindowsShowWhatTheyShowNearZero) {
  const Scene scene = room_at(kFarAway, false);
  const glm::vec3 origin = box_origin(scene.bounds);
  DeviceScene far(scene, with_validation()), near(brought_near(scene, origin), with_validation());
  LiveOptions options;
  options.width = options.height = kFarSide;
  for (const char* rays : {"primary", "ao", "shadow"}) {
    options.rays = rays;
    std::vector<std::uint32_t> shown[2];
    for (DeviceScene* world : {&far, &near}) {
      world->live().add_sample(world->scene().views[0], options);
      std::vector<std::uint32_t>& pixels = shown[world == &far];
      pixels.resize(kFarSide * kFarSide);
      world->live().pixels().download(pixels);
    }
    EXPECT_EQ(shown[0], shown[1]) << rays;
  }
  const Probe there = far.live().probe(far.scene().views[0], options, 5, 5, false),
              here = near.live().probe(near.scene().views[0], options, 5, 5, false);
  EXPECT_EQ(there.hit.prim, here.hit.prim);
  EXPECT_EQ(there.hit.t, here.hit.t);
  EXPECT_LT(glm::length(there.ray.origin - kFarAway), 1);
}

// Pictures follow a scene that moves, also from near zero to far away and back. Hits are those of the scene where it
// lies, before and after.
TEST(Far, PicturesFollowWhatMoves) {
  const Scene far = room_at(kFarAway, false), near = room_at({}, false);
  DeviceScene world(near, with_validation()), fresh(far, with_validation());
  const Picture first = render(world, near.views[0], far_options("path"));
  world.move(far.triangles);
  const Ray ray{kFarAway, 0, {0.3f, -1, 0.2f}, 1e30f};
  Hit before{}, after{}, expected{};
  world.trace({&ray, 1}, {&before, 1});
  fresh.trace({&ray, 1}, {&expected, 1});
  Scene lit = far;  // move() leaves the lights where they were
  lit.lights = near.lights;
  DeviceScene moved(lit, with_validation());
  expect_same_picture(render(world, far.views[0], far_options("path")),
                      render(moved, far.views[0], far_options("path")), "moved");
  world.trace({&ray, 1}, {&after, 1});
  for (const Hit& hit : {before, after}) EXPECT_TRUE(hit.prim == expected.prim && hit.t == expected.t);
  EXPECT_NE(before.prim, NO_HIT);
  world.move(near.triangles);
  expect_same_picture(render(world, near.views[0], far_options("path")), first, "and back");
}

// Every wall emits 0.5 and reflects half, so the radiance is 1, to the bound that holds near zero
// (Furnace.ClosedRoomThatShines).
void expect_furnace(const shapes::Triangles& room, const glm::vec3& eye, const shapes::Triangles& beside,
                    const std::string& which) {
  Scene scene;
  scene.name = "room";
  scene.materials.push_back({.name = "wall", .base_color = glm::vec3(0.5f), .emissive = glm::vec3(0.5f)});
  scene.triangles = shapes::joined(room, beside);
  scene.views.push_back(view_from(eye));
  finish_scene(scene);
  const Picture p =
      render(std::move(scene),
             {.width = 16, .height = 16, .spp = 64, .shading = "path", .aovs = {"color", "variance"}, .bounces = 32});
  double sum = 0, variance = 0;
  for (std::uint32_t i = 0; i < 256; ++i) {
    EXPECT_EQ(p.at("A", i % 16, i / 16), 1);
    sum += p.color(i % 16, i / 16).g, variance += p.at("variance.G", i % 16, i / 16);
  }
  EXPECT_NEAR(sum / 256, 1, 4 * std::sqrt(variance) / 256 + 2e-3) << which;
}

TEST(Far, ClosedRoomThatShines) {
  for (const float away : {1.f, 16.f, 256.f}) {
    const glm::vec3 at = kFarAway * away;
    expect_furnace(shapes::moved(shapes::scaled(shapes::sphere(1), away), at), at + glm::vec3(0, 0, 0.2f * away), {},
                   std::to_string(away));
  }
}

// In a scene that reaches far to both sides no copy is nearer to zero. Shadow rays end before the wall that they aim at
// although its points are rounded by a three-hundredth of the room.
TEST(Far, ClosedRoomInAHugeScene) {
  for (const float reach : {1e3f, 1e4f, 5e4f}) {
    const glm::vec3 at(reach, -0.5f * reach, 0.25f * reach), eye = at + glm::vec3(0, 0, 0.2f);
    const shapes::Triangles box = shapes::box(glm::vec3(-0.5f), glm::vec3(0.5f));
    for (const shapes::Triangles& room : {shapes::sphere(2), box})
      expect_furnace(shapes::moved(room, at), eye, shapes::moved(room, -at),
                     std::to_string(reach) + " " + std::to_string(room.size()));
  }
}

// What no copy near zero can mend is said.
TEST(Far, SmallTrianglesInHugeScenesAreSaid) {
  Scene scene = room_at(kFarAway, false);
  EXPECT_EQ(DeviceScene(scene, with_validation()).picture_note(), "");
  EXPECT_EQ(DeviceScene(square_scene(), with_validation()).picture_note(), "");
  scene.triangles.push_back({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}});
  scene.material_of.push_back(0);
  finish_scene(scene);
  const std::string note = DeviceScene(scene, with_validation()).picture_note();
  EXPECT_TRUE(note.starts_with("270 of 270 triangles are smaller than 3.05, and the scene reaches 2e+05")) << note;
}

}  // namespace
}  // namespace ballot::test
