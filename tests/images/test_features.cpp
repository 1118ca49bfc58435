// Tests that a scene pays only for the features that it has. Each feature is tested alone: it must cause its kernels,
// bindings, buffers and dispatches, and no others.
#include <optional>
#include <set>

#include "engine/render/data/camera.h"
#include "shaders/shared/render.h"
#include "shaders/shared/variant.h"
#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

using Bindings = std::set<std::uint32_t>;
using Names = std::set<std::string>;

/// Returns the bindings that a compiled kernel uses.
Bindings bindings_of(const KernelSource& source) {
  const Reflection r = reflect(compile_shader(source.file, source.defines).words, source.name);
  Bindings all(r.storage_buffers.begin(), r.storage_buffers.end());
  all.insert(r.texel_buffers.begin(), r.texel_buffers.end());
  return all;
}

/// Returns the size of a kernel's SPIR-V in bytes.
std::size_t bytes_of(const KernelSource& source) {
  return compile_shader(source.file, source.defines).words.size() * 4;
}

/// Returns the names of kernels, without what follows the first '+'.
Names names_of(const std::vector<KernelSource>& sources) {
  Names names;
  for (const KernelSource& s : sources) names.insert(s.name.substr(0, s.name.find('+')));
  return names;
}

const Bindings kTextures{BIND_UVS, BIND_TEXELS, BIND_TEXTURES, BIND_TEXTURE_USES};
const Bindings kNext{BIND_CARRIED, BIND_NEXT_RAYS, BIND_NEXT_CARRIED},
    kSecond{BIND_DEFERRED_RAYS, BIND_DEFERRED_CARRIED, BIND_DEFERRED};
const Bindings kShadow{BIND_SHADOW_RAYS, BIND_SHADOW_LIGHT};

Bindings operator+(Bindings a, const Bindings& b) {
  a.insert(b.begin(), b.end());
  return a;
}

/// A feature that a scene may have, and the further bindings that the kernel of each of these integrators needs for it.
struct Alone {
  const char* name;
  SceneFeatures features;
  Sky::Kind sky = Sky::Kind::None;
  Bindings ao = {}, whitted = {}, path = {};
};

std::vector<Alone> each_alone() {
  const auto with = [](auto change) {
    SceneFeatures f{.perspective = true};
    change(f);
    return f;
  };
  using F = SceneFeatures&;
  const Sky::Kind none = Sky::Kind::None;
  const Bindings normals{BIND_NORMALS}, lit = kShadow + Bindings{BIND_EMITTERS}, suns = kShadow + Bindings{BIND_LIGHTS};
  return {
      {"shading normals", with([](F f) { f.shading_normals = true; }), none, normals, normals, normals},
      {"mirror", with([](F f) { f.reflects = f.glossy = true; }), none, {}, kNext, {}},
      {"glass", with([](F f) { f.refracts = f.glossy = true; }), none, {}, kNext + kSecond, {}},
      {"emission", with([](F f) { f.emits = true; }), none, {}, lit, lit},
      {"gloss", with([](F f) { f.glossy = true; }), none, {}, kNext, {}},
      {"unlit", with([](F f) { f.unlit = true; })},
      {"alpha", with([](F f) { f.alpha = true; })},
      {"colours of vertices", with([](F f) { f.vertex_colors = true; }), none, {}, {BIND_COLORS}, {BIND_COLORS}},
      {"colour texture", with([](F f) { f.base_texture = true; }), none, {}, kTextures, kTextures},
      {"roughness texture",
       with([](F f) { f.glossy = f.surface_texture = true; }),
       none,
       {},
       kTextures + kNext,
       kTextures},
      {"emission texture",
       with([](F f) { f.emits = f.emissive_texture = true; }),
       none,
       {},
       kTextures + lit,
       kTextures + lit},
      {"normal map", with([](F f) { f.normal_texture = true; }), none, {}, kTextures, kTextures},
      {"punctual light", with([](F f) { f.lights = true; }), none, {}, suns, suns},
      {"sky", with([](F f) { f.sky = true; }), Sky::Kind::Constant, {}, kShadow + Bindings{BIND_SKY}, {BIND_SKY}},
      {"picture of a sky",
       with([](F f) { f.sky = f.sky_map = true; }),
       Sky::Kind::Map,
       {},
       kShadow + Bindings{BIND_SKY},
       kShadow + Bindings{BIND_SKY}},
      {"orthographic camera", with([](F f) { f.orthographic = true; })},
      {"deep tree", with([](F f) { f.tree.depth = 90; })},
      {"large leaves", with([](F f) { f.tree.largest_leaf = 6; })},
  };
}

const SceneFeatures kNothing{.perspective = true};

TEST(Features, EachAloneBindsWhatItNeeds) {
  const struct {
    const char* name;
    Bindings bare;  // those of materials, shadow rays and secondary rays that a scene without any feature needs
    Bindings Alone::*more;
  } cases[] = {{"ao", {BIND_SHADOW_RAYS}, &Alone::ao},
               {"whitted", {BIND_MATERIALS}, &Alone::whitted},
               {"path", {BIND_MATERIALS, BIND_NEXT_RAYS}, &Alone::path}};
  for (const auto& [name, bare, more] : cases) {
    const Integrator& integrator = *find_integrator(name);
    const Bindings none = bindings_of(scatter_source(integrator, kNothing, Sky::Kind::None, false));
    for (const std::uint32_t b : kTextures + kSecond + Bindings{BIND_NORMALS, BIND_SKY, BIND_EMITTERS, BIND_LIGHTS})
      EXPECT_FALSE(none.contains(b)) << name << " binds " << b;
    for (const std::uint32_t b : {BIND_MATERIALS, BIND_SHADOW_RAYS, BIND_NEXT_RAYS})
      EXPECT_EQ(none.contains(b), bare.contains(b)) << name << " and binding " << b;
    for (const Alone& a : each_alone())
      EXPECT_EQ(bindings_of(scatter_source(integrator, a.features, a.sky, false)), none + a.*more)
          << name << " of a scene with " << a.name;
  }
}

// A scene feature adds exactly the kernels that it needs, and the plan of every integrator agrees with its kernel.
// Kernels are looked up by name, so names are compared.
TEST(Features, EachAloneAsksForItsKernels) {
  std::vector<Alone> scenes = each_alone();
  scenes.push_back({"nothing", kNothing});
  for (const Integrator& integrator : kIntegrators) {
    const Names always{"rays.primary.listed", fmt::format("{}.scatter", integrator.name), "path.indirect", "path.film"};
    for (const Alone& a : scenes) {
      SCOPED_TRACE(fmt::format("{} of a scene with {}", integrator.name, a.name));
      const Bindings bound = bindings_of(scatter_source(integrator, a.features, a.sky, false));
      Names wanted = always;
      if (bound.contains(BIND_SHADOW_RAYS)) wanted.insert("path.connect");
      if (a.features.alpha) wanted.insert("path.alpha");
      for (const bool makes_rays : {false, true})
        EXPECT_EQ(names_of(kernels_of(integrator, a.features, a.sky, makes_rays)), wanted);
      const WavePlan plan = plan_of(integrator, a.features);
      EXPECT_EQ(plan.alpha, a.features.alpha);
      EXPECT_EQ(plan.shadow, bound.contains(BIND_SHADOW_RAYS));
      EXPECT_EQ(plan.next, bound.contains(BIND_NEXT_RAYS));
      EXPECT_EQ(plan.second, bound.contains(BIND_DEFERRED_RAYS));
    }
  }
  for (const Shading& shading : kShadings)
    for (const Alone& a : each_alone()) {
      Names wanted{"rays.primary.listed", fmt::format("shade.{}", shading.name)};
      if (a.features.alpha) wanted.insert("path.alpha");
      for (const bool makes_rays : {false, true})
        EXPECT_EQ(names_of(kernels_of(shading, a.features, makes_rays)), wanted)
            << shading.name << " of a scene with " << a.name;
    }
}

// Compares the SPIR-V: a scene feature that a kernel does not use leaves its words unchanged.
TEST(Features, WhatAKernelDoesNotAskForDoesNotChangeIt) {
  const auto words = [](const KernelSource& s) { return compile_shader(s.file, s.defines).words; };
  const auto ao = [&](const SceneFeatures& f, Sky::Kind sky) {
    return words(scatter_source(kIntegrators[0], f, sky, false));
  };
  const auto path = [&](const SceneFeatures& f) {
    return words(scatter_source(*find_integrator("path"), f, Sky::Kind::None, false));
  };
  for (const Alone& a : each_alone()) {
    EXPECT_EQ(ao(a.features, a.sky) == ao(kNothing, Sky::Kind::None), !a.features.shading_normals) << a.name;
    EXPECT_EQ(words(shading_source("normals", a.features)) == words(shading_source("normals", kNothing)),
              !a.features.shading_normals)
        << a.name;
    const bool same = a.features.alpha || a.features.orthographic || a.features.tree != TreeFacts{};
    if (a.sky != Sky::Kind::None) continue;  // the features alone do not give the kind of sky
    EXPECT_EQ(path(a.features) == path(kNothing), same) << a.name;
  }
}

TEST(Features, KindsOfCameras) {
  const SceneFeatures eye{.perspective = true}, plan{.orthographic = true};
  const SceneFeatures both{.perspective = true, .orthographic = true};
  const auto scatters = [](const SceneFeatures& f) {
    return scatter_source(kIntegrators[0], f, Sky::Kind::None, true);
  };
  for (const auto& make : {+[](const SceneFeatures& f) { return primary_source(true, f); }, +scatters}) {
    EXPECT_LT(bytes_of(make(eye)), bytes_of(make(both)));
    EXPECT_LT(bytes_of(make(plan)), bytes_of(make(both)));
    EXPECT_NE(make(eye).name, make(plan).name);
    EXPECT_ANY_THROW(bytes_of(make({})));  // a kernel needs at least one kind of camera
  }
  const auto of_cameras = [](const SceneFeatures& f, bool makes_rays) {
    Names names;
    for (const KernelSource& s : kernels_of(kIntegrators[0], f, Sky::Kind::None, makes_rays))
      if (s.file == "rays/primary.comp" || s.file == "integrators/ao.comp") names.insert(s.name);
    return names;
  };
  EXPECT_EQ(of_cameras(eye, false), (Names{"rays.primary.listed+perspective", "ao.scatter"}));
  EXPECT_EQ(of_cameras(plan, true), (Names{"rays.primary.listed+orthographic", "ao.scatter+orthographic"}));
  EXPECT_EQ(of_cameras(both, true), (Names{"rays.primary.listed+perspective", "rays.primary.listed+orthographic",
                                           "ao.scatter+perspective", "ao.scatter+orthographic"}));
  SceneFeatures veiled = eye;
  veiled.alpha = true;  // with alpha, other passes read the camera rays
  EXPECT_EQ(of_cameras(veiled, true), of_cameras(eye, false));
  EXPECT_EQ(through(both, View{.name = "", .orthographic = true}), plan);
  EXPECT_EQ(through(plan, View{}), eye);
}

// The depth of the tree determines the size of the traversal stacks and nothing else in a kernel.
TEST(Features, StacksAreMadeForTheTree) {
  const Context gpu({.device = "", .validate = false});
  EXPECT_EQ(stack_entries({.depth = 0}), 16u);
  EXPECT_EQ(stack_entries({.depth = 15}), 16u);
  EXPECT_EQ(stack_entries({.depth = 16}), 32u);
  EXPECT_EQ(stack_entries({.depth = 5}, 3), 16u);
  EXPECT_EQ(stack_entries({.depth = 6}, 3), 32u);
  EXPECT_EQ(stack_entries({.depth = 5}, 3, 1), 32u);
  EXPECT_EQ(stack_entries(SceneFeatures::every().tree), 64u);
  for (const Method& method : kMethods) {
    if (method.chooses) continue;
    const NumericMode& numeric = find_numeric(kDefaultNumeric);
    const Variant v{&method, &numeric, Want::Nearest, kernel_config_for(method, numeric, gpu.info())};
    const std::uint32_t most = format_of(method.tree).pushes, spare = method.spare_entries();
    const KernelSource shallow = kernel_source(v, gpu.info(), {.depth = 15, .largest_leaf = 2});
    KernelSource deep = kernel_source(v, gpu.info(), {.depth = 16, .largest_leaf = 6});
    EXPECT_EQ(shallow.defines, deep.defines) << method.name;
    EXPECT_EQ(shallow.constants.at(SPEC_STACK_SIZE), stack_entries({.depth = 15}, most, spare)) << method.name;
    EXPECT_EQ(std::exchange(deep.constants.at(SPEC_STACK_SIZE), shallow.constants.at(SPEC_STACK_SIZE)),
              stack_entries({.depth = 16}, most, spare))
        << method.name;
    EXPECT_EQ(shallow.constants, deep.constants) << method.name;
  }
}

// The size of the leaves matters to a kernel only in whether it loops over a leaf's triangles. packet-wide, which loads
// the triangles of a leaf together, always has the loop.
TEST(Features, ALoopOverTrianglesOnlyWhereALeafHasSeveral) {
  const Context gpu({.device = "", .validate = false});
  for (const Method& method : kMethods) {
    if (method.chooses) continue;
    SCOPED_TRACE(method.name);
    const NumericMode& numeric = find_numeric(kDefaultNumeric);
    const Variant v{&method, &numeric, Want::Nearest, kernel_config_for(method, numeric, gpu.info())};
    const KernelSource several = kernel_source(v, gpu.info(), {.depth = 9, .largest_leaf = 2});
    const KernelSource one = kernel_source(v, gpu.info(), {.depth = 9, .largest_leaf = 1});
    EXPECT_EQ(one.constants, several.constants);
    EXPECT_EQ(one.name == several.name, method.ray_packets);
    if (method.ray_packets)
      EXPECT_EQ(one.defines, several.defines);
    else
      EXPECT_LT(bytes_of(one), bytes_of(several));
  }
}

TEST(Features, OfABuiltTree) {
  Scene scene = square_scene();
  for (float z = 1; z < 40; ++z) add_rectangle(scene, {-1, -1}, {1, 1}, z);
  finish_scene(scene);
  for (const std::uint32_t most : {1u, 3u, 6u}) {
    const Bvh bvh = build_bvh(scene.triangles, {.max_leaf = most});
    std::uint32_t largest = 0;
    for (const BvhNode& n : bvh.nodes) largest = std::max(largest, n.count);
    const SceneFeatures f = features_of(scene, facts_of(bvh));
    EXPECT_EQ(f.tree, (TreeFacts{bvh.stats.depth, largest}));
    EXPECT_LE(largest, most);
    EXPECT_GT(f.tree.depth, 2u);
  }
}

/// A change to the scene of the square, and its cost for a picture of 8 x 8 pixels: device memory, buffers and passes.
struct Changed {
  const char* name;
  std::uint64_t scene_bytes;  // of device memory, without triangles and materials
  bool shadow, alpha;         // true if it needs buffers for shadow rays; for rays behind transparent surfaces
  std::string passes;         // of shading "whitted", in the order of first use
  void (*change)(Scene&) = [](Scene&) {};
};

constexpr const char* kPlain = "begin,trace primary,scatter,film,";
constexpr const char* kLit = "begin,trace primary,scatter,trace shadow,connect,film,";

std::vector<Changed> changed_squares() {
  return {
      {"nothing", 0, false, false, kPlain},
      {"shading normals", 96, false, false, kPlain,
       [](Scene& s) {
         s.normals.assign(2, {glm::vec3(0, 0, 1), glm::vec3(0, 0, 1), glm::vec3(0, 0, 1)});
       }},
      {"colours of vertices", 64, false, false, kPlain,
       [](Scene& s) {
         s.colors.assign(2, {glm::vec4(1), glm::vec4(1), glm::vec4(1)});
       }},
      {"mirror", 0, false, false, "begin,trace primary,scatter,trace secondary,film,",
       [](Scene& s) {
         s.materials[0].metallic = 1;
         s.materials[0].roughness = 0;
         add_rectangle(s, {-9, -9}, {9, 9}, 4);  // behind the camera, for the mirror to reflect
       }},
      {"glass", 0, false, false, "begin,trace primary,scatter,trace secondary,film,",
       [](Scene& s) {
         s.materials[0].transmission = 1;
         s.materials[0].roughness = 0;
       }},
      {"emission", 32, true, false, kPlain, [](Scene& s) { s.materials[0].emissive = glm::vec3(1); }},
      {"unlit", 0, false, false, kPlain, [](Scene& s) { s.materials[0].unlit = true; }},
      {"alpha", 0, false, true, "begin,trace primary,alpha,trace behind,scatter,film,",
       [](Scene& s) {
         s.materials[0].alpha_mode = Alpha::Mask;
         s.materials[0].alpha = 0;
       }},
      {"light", 52, true, false, kLit,
       [](Scene& s) {
         s.lights.push_back({.position = {0, 0, 2}});
       }},
      {"sky", 48, true, false, kLit, [](Scene& s) { s.sky = make_sky("1,1,1"); }},
      {"orthographic camera", 0, false, false, kPlain, [](Scene& s) { s.views[0].orthographic = true; }},
  };
}

TEST(Features, BuffersAndDispatchesFollowFromTheScene) {
  std::shared_ptr<Context> context;
  std::optional<std::uint64_t> plain;  // bytes of the unchanged scene, without triangles and materials
  for (const Changed& c : changed_squares()) {
    SCOPED_TRACE(c.name);
    Scene scene = square_scene();
    c.change(scene);
    finish_scene(scene);
    const std::uint64_t own = scene.triangles.size() * 48 + scene.materials.size() * sizeof(GpuMaterial);
    DeviceSceneOptions options = with_validation();
    options.context = context;
    DeviceScene world(std::move(scene), options);
    context = world.context();
    const Picture p =
        render(world, world.scene().views[0], {.width = 8, .height = 8, .shading = "whitted", .bounces = 1});
    std::string names;
    for (const PassTime& t : p.times.passes.all()) names += t.name + ",";
    const bool made = world.tracer().makes_rays() && !c.alpha;  // true if the traversal generates the camera rays
    EXPECT_EQ(made ? "begin," + names : names, c.passes);
    std::uint64_t bytes = world.render_bytes() - own;
    const bool more_waves = world.features().glossy;
    if (!plain) plain = bytes;
    const std::uint64_t shadow = c.shadow ? 64 * (sizeof(Ray) + sizeof(Hit) + sizeof(ShadowPayload)) : 0;
    std::uint64_t alpha = c.alpha ? 2 * 64 * (sizeof(Ray) + sizeof(Hit) + 4) : 0;
    if (c.alpha && world.tracer().makes_rays())
      alpha -= sizeof(PrimaryPush);  // the camera, which only kernels that generate rays need
    if (more_waves)
      EXPECT_GT(bytes, *plain + c.scene_bytes);
    else
      EXPECT_EQ(bytes, *plain + c.scene_bytes + shadow + alpha);
  }
}

// The kernel that is compiled for every feature does the same work by other code. It uses the same random numbers and
// aims shadow rays only at lights that exist.
TEST(Features, EveryFeatureTracesTheSameRays) {
  for (const char* light : {"none", "lamp", "emission", "sky", "lamp and sky", "all"})
    for (const char* shading : {"ao", "whitted", "path"}) {
      SCOPED_TRACE(fmt::format("{} {}", light, shading));
      const bool all = light == std::string("all");
      const auto has = [&](const char* word) { return all || std::string_view(light).find(word) != std::string::npos; };
      Scene scene = square_scene();
      add_rectangle(scene, {-0.5f, -0.5f}, {0.5f, 0.5f}, 1, 1);
      scene.materials.push_back({.name = "roof"});
      if (has("emission")) scene.materials[1].emissive = glm::vec3(2);
      if (has("lamp")) scene.lights.push_back({.position = {1, 2, 2}, .intensity = glm::vec3(3)});
      if (has("sky")) scene.sky = make_sky("gradient");
      finish_scene(scene);
      DeviceScene world(std::move(scene), with_validation());
      RenderOptions options{.width = 16, .height = 16, .spp = 4, .shading = shading};
      const Picture own = render(world, world.scene().views[0], options);
      options.every_feature = true;
      const Picture every = render(world, world.scene().views[0], options);
      EXPECT_EQ(own.times.rays, every.times.rays);
      for (const char* name : {"R", "G", "B"})
        for (std::size_t i = 0; i < 256; ++i)
          EXPECT_NEAR(own.image.channel(name).floats[i], every.image.channel(name).floats[i], 2e-3f)
              << name << " of pixel " << i;
    }
}

TEST(Features, AmbientOcclusionAsksForNoMaterial) {
  const auto bytes = [](Scene scene) {
    DeviceScene world(std::move(scene), with_validation());
    render(world, world.scene().views[0], {.width = 8, .height = 8, .shading = "ao"});
    return world.render_bytes();
  };
  Scene rich = square_scene();
  rich.materials[0].emissive = glm::vec3(1);
  rich.lights.push_back({.position = {0, 0, 2}});
  rich.sky = make_sky("1,1,1");
  EXPECT_EQ(bytes(rich), bytes(square_scene()));
}

}  // namespace
}  // namespace ballot::test
