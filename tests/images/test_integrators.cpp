// Tests of the integrators on scenes whose radiance is known: furnaces, a mirror, a glass slab, transparent sheets,
// textures.
#include <map>

#include "shaders/shared/render.h"
#include "tests/cpu/shapes.h"
#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

constexpr glm::vec3 kBlack(0);

/// Returns a unit sphere of this material under a uniform white sky.
Scene sphere_of(const Material& material) {
  Scene scene;
  scene.name = "ball";
  scene.materials.push_back(material);
  scene.triangles = shapes::sphere(3);
  scene.views.push_back(view_from({0, 0, 3}));
  scene.sky = make_sky("1,1,1");
  finish_scene(scene);
  return scene;
}

/// The mean colour of all pixels that are wholly covered, and its standard error.
struct Mean {
  glm::dvec3 value{0}, error{0};
};

Mean mean_of(const Picture& p) {
  Mean mean;
  double count = 0;
  for (std::uint32_t y = 0; y < p.image.height; ++y)
    for (std::uint32_t x = 0; x < p.image.width; ++x) {
      if (p.at("A", x, y) < 1) continue;
      mean.value += glm::dvec3(p.color(x, y));
      mean.error += glm::dvec3(p.at("variance.R", x, y), p.at("variance.G", x, y), p.at("variance.B", x, y));
      ++count;
    }
  return {mean.value / count, glm::sqrt(mean.error) / count};
}

RenderOptions path_options(std::uint32_t size, std::uint32_t spp) {
  return {.width = size, .height = size, .spp = spp, .shading = "path", .aovs = {"color", "variance", "prim"}};
}

// Under a uniform sky a convex Lambertian body shows its albedo, at every pixel and without noise.
TEST(Furnace, WhiteAndColouredSpheresShowTheirAlbedo) {
  const Picture p = render(sphere_of({.name = "paint", .base_color = {1, 0.5f, 0.25f}}), path_options(24, 4));
  std::size_t inside = 0;
  for (std::uint32_t y = 0; y < 24; ++y)
    for (std::uint32_t x = 0; x < 24; ++x)
      if (p.at("A", x, y) == 1) {
        ++inside;
        EXPECT_LT(glm::length(p.color(x, y) - glm::vec3(1, 0.5f, 0.25f)), 1e-3f) << x << ", " << y;
      } else if (p.at("A", x, y) == 0) {
        EXPECT_EQ(p.color(x, y), glm::vec3(1)) << x << ", " << y;
      }
  EXPECT_GT(inside, 100u);
}

// Shading normals do not darken the rim of a sphere, where they lean away from the camera. A mirror shows the sky there
// too.
TEST(Furnace, RimsOfSmoothSpheres) {
  for (const bool mirror : {false, true})
    for (const char* shading : {"path", "whitted"}) {
      Scene scene = sphere_of({.name = "ball", .metallic = mirror ? 1.0f : 0.0f, .roughness = mirror ? 0.0f : 1.0f});
      scene.triangles = shapes::sphere(1);
      scene.material_of.clear();
      for (const Triangle& t : scene.triangles)
        scene.normals.push_back({glm::normalize(t[0]), glm::normalize(t[1]), glm::normalize(t[2])});
      finish_scene(scene);
      RenderOptions options = path_options(32, 64);
      options.shading = shading;
      const Picture p = render(std::move(scene), options);
      for (std::uint32_t i = 0; i < 32 * 32; ++i)
        if (p.at("A", i % 32, i / 32) == 1) {
          EXPECT_GT(p.color(i % 32, i / 32).g, 0.5f) << shading << ", mirror " << mirror << ", pixel " << i;
          EXPECT_LT(p.color(i % 32, i / 32).g, 1.5f) << shading << ", mirror " << mirror << ", pixel " << i;
        }
    }
}

// The kernel that is compiled for every feature renders the same picture, and also does work that the scene does not
// need.
TEST(Furnace, EveryFeatureShowsTheSame) {
  RenderOptions options = path_options(12, 2);
  options.aovs = {"color"};
  DeviceScene world(sphere_of({.name = "paint", .base_color = {1, 0.5f, 0.25f}}), with_validation());
  const Picture own = render(world, world.scene().views[0], options);
  options.every_feature = true;
  const Picture every = render(world, world.scene().views[0], options);
  for (const char* name : {"R", "G", "B"})
    for (std::size_t i = 0; i < 144; ++i)
      EXPECT_NEAR(own.image.channel(name).floats[i], every.image.channel(name).floats[i], 1e-3f) << name << " " << i;
  const auto has_alpha_pass = [](const Picture& p) { return p.times.passes.ms("alpha") > 0; };
  EXPECT_FALSE(has_alpha_pass(own));
  EXPECT_TRUE(has_alpha_pass(every));
}

// Every wall of a closed room emits 0.5 and reflects half, so the radiance is 0.5 + 0.25 + ... = 1 everywhere. Shadow
// rays, chance hits of emitters, the weights of both and Russian roulette all take part.
TEST(Furnace, ClosedRoomThatShines) {
  Scene scene;
  scene.name = "room";
  scene.materials.push_back({.name = "wall", .base_color = glm::vec3(0.5f), .emissive = glm::vec3(0.5f)});
  for (Triangle t : shapes::sphere(1)) scene.triangles.push_back(t);
  scene.views.push_back(view_from({0, 0, 0.2}));
  finish_scene(scene);
  DeviceScene world(std::move(scene), with_validation());
  RenderOptions options = path_options(16, 64);
  options.bounces = 32;
  const Mean mean = mean_of(render(world, world.scene().views[0], options));
  EXPECT_NEAR(mean.value.g, 1, 4 * mean.error.g + 2e-3);
  EXPECT_LT(mean.error.g, 0.01);
}

/// Returns the mean colour of a floor under a square lamp that reflects nothing.
Mean floor_under_lamp(Alpha mode, int bounces) {
  Scene scene;
  scene.name = "lit floor";
  scene.materials = {{.name = "floor", .base_color = glm::vec3(0.5f)},
                     {.name = "lamp", .base_color = kBlack, .emissive = glm::vec3(2), .alpha_mode = mode}};
  if (mode != Alpha::Opaque) scene.materials[1].alpha = 0.25f;
  add_rectangle(scene, {-0.5f, -0.5f}, {0.5f, 0.5f}, 0, 0);
  add_rectangle(scene, {-4, -4}, {4, 4}, 2, 1);
  scene.views.push_back(view_from({0, 0, 0.5}));
  finish_scene(scene);
  RenderOptions options = path_options(8, 256);
  options.bounces = bounces;
  return mean_of(render(std::move(scene), options));
}

// Without bounces all light of a lamp comes from shadow rays, and the share that bounced rays would have found must not
// be missing. A lamp of alpha 1/4 gives a quarter of the light, and a masked one none, whichever way the light is
// found.
TEST(Furnace, LampIsFoundInFullByEitherWay) {
  const Mean full = floor_under_lamp(Alpha::Opaque, 2);
  // The lamp's share of the cosine-weighted hemisphere, times emission 2 and albedo 0.5.
  EXPECT_NEAR(full.value.g, 0.8, 0.15);
  for (const auto& [mode, share] :
       {std::pair(Alpha::Opaque, 1.0), std::pair(Alpha::Blend, 0.25), std::pair(Alpha::Mask, 0.0)})
    for (const int bounces : {0, 2}) {
      const Mean mean = floor_under_lamp(mode, bounces);
      EXPECT_NEAR(mean.value.g, share * full.value.g, 4 * (mean.error.g + full.error.g) + 1e-3)
          << share << " of the light, " << bounces << " bounces";
      EXPECT_LT(mean.error.g, 0.02);
    }
}

// Glass that absorbs nothing neither loses nor adds light. A rough white metal loses only what a model of single
// scattering leaves out.
TEST(Furnace, GlassAndMetal) {
  const Mean glass = mean_of(
      render(sphere_of({.name = "glass", .roughness = 0, .transmission = 1, .ior = 1.5f}), path_options(20, 64)));
  EXPECT_NEAR(glass.value.g, 1, 4 * glass.error.g + 5e-3);
  const Mean rough = mean_of(
      render(sphere_of({.name = "frosted", .roughness = 0.4f, .transmission = 1, .ior = 1.5f}), path_options(20, 64)));
  EXPECT_LT(rough.value.g, 1 + 4 * rough.error.g);
  EXPECT_GT(rough.value.g, 0.8);
  const Mean metal =
      mean_of(render(sphere_of({.name = "metal", .metallic = 1, .roughness = 0.5f}), path_options(20, 64)));
  EXPECT_LT(metal.value.g, 1 + 4 * metal.error.g);
  EXPECT_NEAR(metal.value.g, 0.880, 4 * metal.error.g + 0.01);  // the integral of the lobe, computed numerically
}

/// Adds 16 emitting strips along y in the plane z = `z`, each 1 wide, from x = -8 on. Strip i emits (i + 1, 16 - i, 1).
void add_strips(Scene& scene, float z) {
  for (int i = 0; i < 16; ++i) {
    scene.materials.push_back({.name = "strip", .base_color = kBlack, .emissive = {i + 1, 16 - i, 1}});
    add_rectangle(scene, {i - 8, -8}, {i - 7, 8}, z, std::uint32_t(scene.materials.size() - 1));
  }
}

/// Sets `light` to the emission of the strips at `x`. Returns false near an edge of a strip and outside the strips.
bool strip_at(double x, glm::vec3& light) {
  const double strip = std::floor(x + 8), off = x + 8 - strip;
  if (off < 0.05 || off > 0.95 || strip < 0 || strip > 15) return false;
  light = {strip + 1, 16 - strip, 1};
  return true;
}

// A mirror in the plane z = 0 shows the strips behind the camera where the reflected ray meets them.
TEST(Whitted, MirrorObeysTheLawOfReflection) {
  Scene scene;
  scene.name = "mirror";
  scene.materials.push_back({.name = "mirror", .base_color = {0.5f, 1, 0.25f}, .metallic = 1, .roughness = 0});
  scene.triangles = {{{{-8, -8, 0}, {8, -8, 0}, {8, 8, 0}}}, {{{-8, -8, 0}, {8, 8, 0}, {-8, 8, 0}}}};
  scene.material_of = {0, 0};
  add_strips(scene, 6);  // behind the camera, facing the mirror
  scene.views.push_back(view_from({0.3, 0.2, 3}));
  finish_scene(scene);
  const Picture p = render(std::move(scene), {.width = 40, .height = 40, .shading = "whitted"});
  const View view = view_from({0.3, 0.2, 3});
  std::size_t seen = 0;
  for (std::uint32_t x = 0; x < 40; ++x) {
    const glm::dvec2 at = plane_point(view, x + 0.5, 20.5, 40, 40);
    glm::vec3 light;
    if (!strip_at(0.3 + at.x * (3 + 6), light)) continue;  // 3 down to the mirror and 6 up to the strips
    ++seen;
    // Schlick's approximation for metals: base + (1 - base) (1 - cosine)^5.
    const double cosine = 1 / std::sqrt(1 + at.x * at.x + at.y * at.y), f = std::pow(1 - cosine, 5);
    const glm::vec3 base(0.5f, 1, 0.25f), expected = light * (base + (1.0f - base) * float(f));
    EXPECT_LT(glm::length(p.color(x, 20) - expected), 2e-3f * glm::length(expected)) << x;
  }
  EXPECT_GT(seen, 20u);
}

// A slab of refractive index n between z = 0 and z = -2 shifts what lies behind it by Snell's law and dims it by
// Fresnel's equations.
TEST(Whitted, GlassSlabObeysSnellAndFresnel) {
  constexpr double n = 1.5;
  Scene scene;
  scene.name = "slab";
  scene.materials.push_back({.name = "glass", .roughness = 0, .transmission = 1, .ior = float(n)});
  add_rectangle(scene, {-20, -20}, {20, 20}, 0);
  const glm::vec3 a(-20, -20, -2), b(20, -20, -2), c(20, 20, -2), d(-20, 20, -2);
  scene.triangles.push_back({a, c, b});  // faces down, so that the outside is on both sides of the slab
  scene.triangles.push_back({a, d, c});
  scene.material_of.insert(scene.material_of.end(), 2, 0);
  add_strips(scene, -5);
  scene.views.push_back(view_from({0, 0, 2}));
  scene.views[0].yfov = 2 * std::atan(0.15);  // the picture is 9.6 times as wide as high
  finish_scene(scene);
  DeviceScene world(std::move(scene), with_validation());
  for (const char* shading : {"whitted", "path"}) {
    SCOPED_TRACE(shading);
    const std::uint32_t spp = shading == std::string("path") ? 64 : 1;
    // Two bounces: into the slab and out of it. Light that is reflected inside is left out.
    RenderOptions options{.width = 48, .height = 5, .spp = 1, .shading = shading, .bounces = 2};
    std::map<std::uint32_t, glm::dvec3> sums;
    for (std::uint32_t seed = 0; seed < spp; ++seed) {
      options.seed = seed;
      const Picture p = render(world, world.scene().views[0], options);
      for (std::uint32_t x = 0; x < 48; ++x) sums[x] += glm::dvec3(p.color(x, 2)) / double(spp);
    }
    std::size_t seen = 0;
    for (std::uint32_t x = 0; x < 48; ++x) {
      const glm::dvec2 at = plane_point(world.scene().views[0], x + 0.5, 2.5, 48, 5);
      const double sine = std::abs(at.x) / std::sqrt(1 + at.x * at.x), inner = sine / n;
      const double tangent = inner / std::sqrt(1 - inner * inner) * (at.x < 0 ? -1 : 1);
      glm::vec3 light;
      if (!strip_at(at.x * (2 + 3) + tangent * 2, light)) continue;
      ++seen;
      const double ci = std::sqrt(1 - sine * sine), ct = std::sqrt(1 - inner * inner);
      const double rs = (ci - n * ct) / (ci + n * ct), rp = (n * ci - ct) / (n * ci + ct);
      const double passed = 1 - (rs * rs + rp * rp) / 2;
      const glm::dvec3 expected = glm::dvec3(light) * passed * passed;
      const double tolerance = spp == 1 ? 2e-3 : 4 * std::sqrt((1 - passed * passed) / spp) + 0.02;
      EXPECT_LT(glm::length(sums[x] - expected), tolerance * glm::length(expected)) << x;
    }
    EXPECT_GT(seen, 24u);
  }
}

// A sheet of alpha 1/4 in front of a wall shows as a quarter of the sheet and three quarters of the wall. Its shadow
// takes a quarter of the light. A masked sheet whose alpha is below the cutoff is invisible.
TEST(Alpha, BlendedAndMaskedSheets) {
  const auto sheet_over = [](Alpha mode, float alpha) {
    Scene scene;
    scene.name = "sheet";
    scene.materials = {{.name = "wall", .base_color = {0, 1, 0}}, {.name = "sheet", .base_color = {1, 0, 0}}};
    scene.materials[1].alpha_mode = mode;
    scene.materials[1].alpha = alpha;
    add_rectangle(scene, {-9, -9}, {9, 9}, 0, 0);
    add_rectangle(scene, {-9, -9}, {9, 9}, 1, 1);
    scene.lights.push_back(
        {.kind = Light::Kind::Directional, .direction = {0, 0, -1}, .intensity = glm::vec3(3.14159265f)});
    scene.views.push_back(view_from({0, 0, 3}));
    scene.views.push_back(view_from({0, 0, 0.5}));  // between the wall and the sheet
    finish_scene(scene);
    return scene;
  };
  DeviceScene world(sheet_over(Alpha::Blend, 0.25f), with_validation());
  const auto mean = [&](std::size_t view, const char* shading) {
    const Picture p =
        render(world, world.scene().views[view], {.width = 16, .height = 16, .spp = 64, .shading = shading});
    glm::dvec3 sum(0);
    for (std::uint32_t i = 0; i < 256; ++i) sum += glm::dvec3(p.color(i % 16, i / 16)) / 256.0;
    return sum;
  };
  const glm::dvec3 eye = mean(0, "eyelight");
  EXPECT_NEAR(eye.r / (eye.r + eye.g), 0.25, 0.02);
  EXPECT_NEAR(mean(1, "whitted").g, 0.75, 0.02);  // the wall in the sheet's shadow
  DeviceScene masked(sheet_over(Alpha::Mask, 0.25f), with_validation());
  const Picture p = render(masked, masked.scene().views[0], {.width = 8, .height = 8, .shading = "whitted"});
  EXPECT_NEAR(p.at("G", 4, 4), 1, 2e-3);
  EXPECT_EQ(p.at("R", 4, 4), 0);
  EXPECT_LT(p.prim(4, 4), 2u);
  EXPECT_NEAR(p.at("Z", 4, 4), 3, 0.1);
}

TEST(Textures, ShowWhereTheirCoordinatesSay) {
  Scene scene = square_scene();
  scene.materials[0] = {.name = "checks"};
  scene.materials[0].base_texture = {.texture = 0, .set = 1, .row_u = {1, 0, 0}, .row_v = {0, 1, 0}};
  scene.textures = {{.image = 0, .wrap_u = Wrap::Repeat, .wrap_v = Wrap::Clamp, .nearest = true}};
  scene.images = {{.name = "four",
                   .width = 2,
                   .height = 2,
                   .srgb = true,
                   .rgba = {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 188, 188, 188, 255}}};
  const auto uv = [](const glm::vec3& v) { return glm::vec2((v.x + 1) / 2, (1 - v.y) / 2); };
  for (const Triangle& t : scene.triangles) scene.uvs[1].push_back({uv(t[0]), uv(t[1]), uv(t[2])});
  finish_scene(scene);
  DeviceScene world(std::move(scene), with_validation());
  View view = world.scene().views[0];
  view.orthographic = true;
  const Picture p = render(world, view, {.width = 8, .height = 8});
  EXPECT_EQ(p.color(1, 1), glm::vec3(1, 0, 0));
  EXPECT_EQ(p.color(6, 1), glm::vec3(0, 1, 0));
  EXPECT_EQ(p.color(1, 6), glm::vec3(0, 0, 1));
  EXPECT_NEAR(p.at("R", 6, 6), 0.5029, 1e-3);  // the linear value of the sRGB code 188
}

// A normal map that leans towards growing u bends the normal to the right. One that leans up (green) bends it against
// v, which grows downwards.
TEST(Textures, NormalMapsBendTheNormalTheRightWay) {
  for (const bool right : {true, false}) {
    Scene scene = square_scene();
    scene.materials[0].normal_texture.texture = 0;
    scene.textures = {{.image = 0}};
    const std::uint8_t lean = 218, none = 128;  // components 0.71 and 0
    scene.images = {
        {.name = "lean", .width = 1, .height = 1, .rgba = {right ? lean : none, right ? none : lean, lean, 255}}};
    const auto uv = [](const glm::vec3& v) { return glm::vec2((v.x + 1) / 2, (1 - v.y) / 2); };
    for (const Triangle& t : scene.triangles) scene.uvs[0].push_back({uv(t[0]), uv(t[1]), uv(t[2])});
    finish_scene(scene);
    const glm::vec3 n = render(std::move(scene), {.width = 9, .height = 9}).normal(4, 4);
    EXPECT_LT(glm::length(n - glm::normalize(glm::vec3(right, !right, 1))), 0.01f) << n.x << " " << n.y << " " << n.z;
  }
}

// A sky map gives its full light, by shadow rays and by chance hits together. A Lambertian sphere under a uniform map
// shows its albedo. A floor under a map with one bright pixel shows the integral over that pixel.
TEST(Furnace, PictureOfASky) {
  Scene ball = sphere_of({.name = "paint", .base_color = glm::vec3(0.5f)});
  ball.sky = {.kind = Sky::Kind::Map, .width = 8, .height = 4, .map = std::vector<glm::vec3>(32, glm::vec3(1))};
  const Mean even = mean_of(render(std::move(ball), path_options(16, 64)));
  EXPECT_NEAR(even.value.g, 0.5, 4 * even.error.g + 1e-3);
  Scene floor = square_scene();  // faces +z, white
  floor.materials[0].base_color = glm::vec3(1);
  floor.sky = {.kind = Sky::Kind::Map, .width = 8, .height = 4, .map = std::vector<glm::vec3>(32, glm::vec3(0))};
  // A pixel behind the camera: longitude -180 to -135 degrees, latitude 0 to 45.
  constexpr std::uint32_t kX = 0, kY = 1;
  floor.sky.map[kY * 8 + kX] = glm::vec3(10);
  double expected = 0;  // the integral of 10 / pi cos dw over the pixel, on a fine grid
  constexpr int kSteps = 200;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double pi = 3.14159265358979, phi = ((kX + (i + 0.5) / kSteps) / 8 - 0.5) * 2 * pi;
      const double theta = (kY + (j + 0.5) / kSteps) / 4 * pi;
      const double cosine = std::max(0.0, -std::sin(theta) * std::cos(phi));
      expected += 10 / pi * cosine * std::sin(theta) * (2 * pi / 8 / kSteps) * (pi / 4 / kSteps);
    }
  const Mean spot = mean_of(render(std::move(floor), path_options(16, 64)));
  EXPECT_NEAR(spot.value.g, expected, 4 * spot.error.g + 1e-3);
  EXPECT_LT(spot.error.g, 0.02 * expected);
}

}  // namespace
}  // namespace ballot::test
