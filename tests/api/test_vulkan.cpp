// Ballot on a program's own device, and calls of scenes in its shaders.
#include <ballot/ballot_vulkan.h>

#include "api.h"
#include "consumer/own_vulkan.h"

namespace {

/// A program's Vulkan with validation, whose messages are counted until the instance is gone.
class Watched {
 public:
  explicit Watched(const vk::PhysicalDeviceVulkan12Features& features = {}) {
    static constexpr const char *kLayer = "VK_LAYER_KHRONOS_validation", *kDebug = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
    using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
    const vk::DebugUtilsMessengerCreateInfoEXT messenger(
        {}, Severity::eWarning | Severity::eError, vk::DebugUtilsMessageTypeFlagBitsEXT::eValidation, note, &messages);
    const auto enable = vk::ValidationFeatureEnableEXT::eSynchronizationValidation;
    const vk::ValidationFeaturesEXT checks(1, &enable, 0, nullptr, &messenger);  // of the instance's own beginning, end
    own.emplace(vk::InstanceCreateInfo({}, nullptr, 1, &kLayer, 1, &kDebug, &checks), features);
    messenger_.emplace(own->instance, messenger);
  }
  ~Watched() { close(); }
  void close() {
    messenger_.reset();
    own.reset();
    EXPECT_EQ(messages, 0);
  }
  ballot::Vulkan vulkan() const {
    return {.instance = *own->instance,
            .physical_device = *own->physical,
            .device = *own->device,
            .queue = *own->queue,
            .queue_family = own->family};
  }

  int messages = 0;
  std::optional<OwnVulkan> own;

 private:
  static VkBool32 note(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                       const VkDebugUtilsMessengerCallbackDataEXT* data, void* count) {
    std::fprintf(stderr, "validation: %s\n", data->pMessage);
    ++*static_cast<int*>(count);
    return VK_FALSE;
  }
  std::optional<vk::raii::DebugUtilsMessengerEXT> messenger_;
};

struct Asked {  // as the shader has it
  ballot::Ray ray;
  ballot::Hit hit;
  ballot::NearestPoint near;
  std::uint32_t any, count;
};

constexpr const char* kAsksAll = R"(
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint STACK_SIZE = 7u;
struct Asked { Ray ray; Hit hit; Nearest near; uint any_hit, crossings; };
layout(set = 0, binding = 0, scalar) buffer Questions { Asked asked[]; };
layout(push_constant) uniform Push { uint number; } push;
uint world = 1u, nodes = 2u, leaves[3], first_prim, takes_any;
float larger(float a) { return 2.0 * a; }
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.number) return;
  if (i % 3u != 0u) {
    asked[i].hit = nearest(asked[i].ray);
    for (uint k = 0u; k < i % 5u; ++k) asked[i].crossings = count(asked[i].ray);
  }
  if (i % 2u == 0u) asked[i].any_hit = uint(any(asked[i].ray)) + uint(ballot_is_cut());
  asked[i].near = closest(asked[i].ray.origin, 2.25);
}
)";

/// Runs a pass over rays, and returns what it has written.
std::vector<Asked> run(const OwnVulkan& own, const ballot::Include& calls, const std::vector<ballot::Ray>& rays,
                       const std::string& shader) {
  const std::size_t bytes = rays.size() * sizeof(Asked);
  const OwnBuffer buffer(own, bytes);
  std::vector<Asked> all(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) all[i].ray = rays[i];
  std::memcpy(buffer.mapped, all.data(), bytes);
  const auto n = std::uint32_t(rays.size());
  const OwnPass pass(own, buffer, VkDescriptorSetLayout(calls.set_layout), sizeof n,
                     std::string("#version 460\n") + calls.text + shader);
  pass.run(buffer, VkDescriptorSet(calls.set), n, (n + 63) / 64, 1);
  std::memcpy(all.data(), buffer.mapped, bytes);
  return all;
}

class ApiVulkan : public testing::Test {
 protected:
  /// Holds a pass that asks everything to the built-in answers.
  static void expect_built_in_answers(const Watched& w, const ballot::Device& device, const ballot::Scene& scene,
                                      const char* what) {
    SCOPED_TRACE(what);
    const std::vector<ballot::Ray> rays = rays_down(2000);
    std::vector<ballot::Hit> hits(rays.size());
    scene.trace(rays, hits);
    const std::vector<std::int64_t> counts = scene.count_crossings(rays);
    std::vector<ballot::Point> points;
    for (const ballot::Ray& r : rays) points.push_back({{r.origin[0], r.origin[1], r.origin[2]}, 2.25f});
    ballot::Array<ballot::Point> at(device, rays.size());
    ballot::Array<ballot::NearestPoint> there(device, rays.size());
    at.write(points);
    scene.nearest(at, {{"nearest", there}}, rays.size());
    std::vector<ballot::NearestPoint> near(rays.size());
    there.read(near);
    const auto calls = ballot::shader_include(scene, {.calls = "nearest any count closest", .set = 1});
    const std::vector<Asked> found = run(*w.own, calls, rays, kAsksAll);
    const auto differ = [](const auto& x, const auto& y) { return std::memcmp(&x, &y, sizeof x) != 0; };
    std::size_t wrong_hits = 0, wrong_counts = 0, wrong_any = 0, wrong_near = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Asked& a = found[i];
      wrong_hits += i % 3 != 0 && differ(a.hit, hits[i]);
      wrong_counts += i % 3 != 0 && i % 5 != 0 && a.count != counts[i];
      wrong_any += i % 2 == 0 && a.any != std::uint32_t(hits[i].prim != ballot::kMiss);
      wrong_near += differ(a.near, near[i]);
    }
    EXPECT_EQ(wrong_hits, 0u);
    EXPECT_EQ(wrong_counts, 0u);
    EXPECT_EQ(wrong_any, 0u);
    EXPECT_EQ(wrong_near, 0u);
  }
  const Grid grid_{16}, other_{5, 0.5f};
  const std::vector<float> places_{1, 0, 0, 0.25f, 0, 1, 0, 0, 0, 0, 1, 0, 0.5f, 0, 0, 0, 0, 1, 0, 0.1f, 0, 0, 1, -1};
};

TEST_F(ApiVulkan, CallsInTheProgramsShaderFindWhatTheBuiltInAnswersAreAndFollowTheScene) {
  Watched w;
  {
    const ballot::Device device(w.vulkan());
    EXPECT_EQ(device.info().usable, 1u);
    ballot::Scene flat(device, {grid_.mesh(), other_.mesh()});
    expect_built_in_answers(w, device, flat, "flat");
    const std::string before = ballot::shader_include(flat, {.calls = "nearest any", .set = 1}).text;
    const std::uint64_t set = ballot::shader_include(flat, {.calls = "nearest any", .set = 1}).set;
    EXPECT_EQ(set, ballot::shader_include(flat, {.calls = "nearest any", .set = 1}).set);
    std::vector<float> moved = grid_.positions;
    for (std::size_t i = 2; i < moved.size(); i += 3) moved[i] = 0.3f * moved[i - 1];
    move(flat, 0, moved);
    EXPECT_EQ(before, ballot::shader_include(flat, {.calls = "nearest any", .set = 1}).text);
    expect_built_in_answers(w, device, flat, "moved");
    flat.add_instances(ballot::instances(places_, std::vector<std::uint32_t>{0, 1}));
    flat.commit();
    expect_built_in_answers(w, device, flat, "instances were added");
    ballot::Scene among(device, std::vector{grid_.mesh()}, ballot::instances(places_));
    expect_built_in_answers(w, device, among, "instances");
    std::vector<float> later = places_;
    later[3] = -0.25f;
    place(among, later);
    expect_built_in_answers(w, device, among, "instances have moved");
  }
  w.close();
}

TEST_F(ApiVulkan, FeaturesAreUsedThatTheProgramHasEnabled) {
  vk::PhysicalDeviceVulkan12Features features;
  features.bufferDeviceAddress = VK_TRUE;
  Watched w(features);
  {
    ballot::Vulkan vulkan = w.vulkan();
    vulkan.enabled = "scalarBlockLayout bufferDeviceAddress";
    const ballot::Device device(vulkan);
    ballot::Scene scene(device, std::vector{grid_.mesh()}, ballot::instances(places_));
    expect_built_in_answers(w, device, scene, "instances");
    const std::vector<ballot::Ray> rays = rays_down(10);
    std::vector<ballot::Hit> hits(rays.size());
    std::string text;
    EXPECT_EQ(code_of([&] { scene.trace(rays, hits, {.numeric = "exact"}); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find("shaderFloat64"), text.npos) << text;
  }
  w.close();
}

TEST_F(ApiVulkan, HooksStandInTheProgramsShader) {
  Watched w;
  {
    const ballot::Device device(w.vulkan());
    const ballot::Scene scene(device, {grid_.mesh(), other_.mesh()});
    const std::vector<ballot::Ray> rays = rays_down(1000);
    std::vector<ballot::Hit> hits(rays.size());
    const ballot::Scene lower(device, {grid_.mesh()});
    lower.trace(rays, hits);
    const auto calls = ballot::shader_include(scene, {.calls = "nearest place accept", .set = 1});
    const std::vector<Asked> found = run(*w.own, calls, rays, R"(
layout(local_size_x = 64) in;
struct Asked { Ray ray; Hit hit; Nearest near; uint any_hit, crossings; };
layout(set = 0, binding = 0, scalar) buffer Questions { Asked asked[]; };
layout(push_constant) uniform Push { uint number; };
bool accept(Hit hit) { return place(hit.prim).x == 0u; }
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i < number) asked[i].hit = nearest(asked[i].ray);
}
)");
    for (std::size_t i = 0; i < rays.size(); ++i)
      ASSERT_EQ(std::memcmp(&found[i].hit, &hits[i], sizeof hits[i]), 0) << i;
  }
  w.close();
}

TEST_F(ApiVulkan, TextsCompileForAllCallsAndSets) {
  Watched w;
  {
    const ballot::Device device(w.vulkan());
    Grid far(4);
    for (float& x : far.positions) x += 1000;
    const ballot::Scene flat(device, {grid_.mesh()}), away(device, {far.mesh()}),
        among(device, std::vector{grid_.mesh()}, ballot::instances(places_));
    const std::pair<const char*, const char*> rows[] = {
        {"nearest", ""},
        {"any", ""},
        {"count", ""},
        {"closest", ""},
        {"corner", ""},
        {"place", ""},
        {"any count corner", ""},
        {"count closest accept", "bool accept(Hit hit) { return hit.t > 1.0; }"},
        {"nearest count intersect", "bool intersect(uint p, Ray r, inout Hit h) { h.t = r.t_min; return p > 1u; }"},
        {"any intersect is_shape",
         "bool intersect(uint p, Ray r, inout Hit h) { return false; } bool is_shape(uint p) { return p < 2u; }"}};
    for (const ballot::Scene* scene : {&flat, &away, &among})
      for (const auto& [names, hooks] : rows) {
        const std::string text = ballot::shader_include(*scene, {.calls = names, .set = 3}).text;
        EXPECT_EQ(text.find("#include"), text.npos);
        EXPECT_EQ(text.find("push_constant"), text.npos);
        EXPECT_EQ(text.find("constant_id"), text.npos);
        EXPECT_EQ(text.find("local_size"), text.npos);
        EXPECT_EQ(text.find("set = 0"), text.npos);
        EXPECT_NO_THROW(compiled("#version 460\n" + text + hooks + "\nvoid main() {}")) << names;
      }
    for (const char* numeric : {"watertight", "plain", "fast"})
      EXPECT_NO_THROW(compiled(std::string("#version 460\n") +
                               ballot::shader_include(flat, {.calls = "nearest any", .numeric = numeric}).text +
                               "void main() {}"));
  }
  w.close();
}

TEST_F(ApiVulkan, AllElseRunsOnTheProgramsDeviceBesideItsOwnWork) {
  Watched w;
  ballot::Vulkan vulkan = w.vulkan();
  int held = 0, times = 0;
  std::pair<int*, int*> counts(&held, &times);
  vulkan.user = &counts;
  vulkan.lock = [](void* user) { ++*static_cast<decltype(counts)*>(user)->first; };
  vulkan.unlock = [](void* user) {
    --*static_cast<decltype(counts)*>(user)->first;
    ++*static_cast<decltype(counts)*>(user)->second;
  };
  {
    const ballot::Device device(vulkan);
    const ballot::Scene scene(device, {grid_.mesh()}, {.builder = "best"});
    const ballot::Kernel kernel(device, R"(readonly buffer Rays { Ray rays[]; }; buffer Found { uint found[]; };
                                           void main(uint index) { found[index] = count(rays[index]); })");
    const std::vector<ballot::Ray> rays = rays_down(500);
    ballot::Array<ballot::Ray> asked(device, rays.size());
    ballot::Array<std::uint32_t> found(device, rays.size());
    asked.write(rays);
    kernel.run(scene, rays.size(), {{"rays", asked}, {"found", found}});
    std::vector<std::uint32_t> counted(rays.size());
    found.read(counted);
    for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(counted[i], inside(rays[i]) ? 1u : 0u) << i;
    EXPECT_EQ(scene.render({}, {.width = 16, .height = 16}).size(), 16u * 16 * 4);
  }
  EXPECT_EQ(held, 0);
  EXPECT_GT(times, 0);
  const OwnBuffer buffer(*w.own, 64);  // what is the program's still works
  const OwnPass pass(*w.own, buffer, *buffer.layout, 4,
                     "#version 460\nlayout(set = 0, binding = 0) buffer B { uint b[]; };\n"
                     "layout(push_constant) uniform P { uint p; };\nvoid main() { b[0] = p; }");
  pass.run(buffer, *buffer.set, std::uint32_t(17), 1, 1);
  EXPECT_EQ(*static_cast<const std::uint32_t*>(buffer.mapped), 17u);
}

TEST_F(ApiVulkan, HandlesCloseInAnyOrderBeforeTheProgramsDevice) {
  Watched w;
  {
    std::optional<ballot::Device> device(w.vulkan());
    const ballot::Scene scene(*device, {grid_.mesh()});
    device.reset();
    const std::vector<ballot::Ray> rays = rays_down(10);
    std::vector<ballot::Hit> hits(rays.size());
    scene.trace(rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(hits[i].prim != ballot::kMiss, inside(rays[i])) << i;
  }
  w.close();  // vkDestroyDevice() finds nothing of Ballot's
}

TEST_F(ApiVulkan, NeedsAreListed) {
  const auto needs = ballot::vulkan_needs();
  ASSERT_GT(needs.size(), 5u);
  EXPECT_STREQ(needs[0].name, "scalarBlockLayout");
  EXPECT_STREQ(needs[0].of, "VkPhysicalDeviceVulkan12Features");
  EXPECT_EQ(std::ranges::count_if(needs, [](const ballot::VulkanNeed& n) { return n.required != 0; }), 1);
  for (const ballot::VulkanNeed& n : needs) EXPECT_NE(*n.without, 0) << n.name;
}

TEST_F(ApiVulkan, WhatIsMissingIsNamed) {
  Watched w;
  const ballot::Vulkan good = w.vulkan();
  const auto refusal = [&](auto change, ballot::Code code) {
    ballot::Vulkan vulkan = good;
    change(vulkan);
    std::string text;
    EXPECT_EQ(code_of([&] { const ballot::Device device(vulkan); }, &text), code) << text;
    return text;
  };
  using V = ballot::Vulkan;
  const auto names = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), text.npos) << text << "; expected " << part;
  };
  constexpr auto kArgument = BALLOT_ERROR_ARGUMENT, kDevice = BALLOT_ERROR_DEVICE;
  names(refusal([](V& v) { v.instance = nullptr; }, kArgument), "VkInstance");
  names(refusal([](V& v) { v.physical_device = nullptr; }, kArgument), "VkPhysicalDevice");
  names(refusal([](V& v) { v.device = nullptr; }, kArgument), "VkDevice");
  names(refusal([](V& v) { v.queue = nullptr; }, kArgument), "VkQueue");
  names(refusal([](V& v) { v.physical_device = &v; }, kArgument), "none of the");
  names(refusal([](V& v) { v.queue_family = 99; }, kArgument), "queue_family is 99");
  names(refusal([](V& v) { v.api_version = VK_API_VERSION_1_1; }, kDevice), "api_version is 1.1, Ballot needs 1.2");
  names(refusal([](V& v) { v.enabled = "shaderFloat64"; }, kDevice), "no scalarBlockLayout");
  names(refusal([](V& v) { v.enabled = "scalarBlockLayout float64"; }, kArgument), "'float64'; expected names of");
  names(refusal([](V& v) { v.lock = [](void*) {}; }, kArgument), "lock without unlock");
  names(refusal([](V& v) { v.unlock = [](void*) {}; }, kArgument), "unlock without lock");
  BallotDevice* device = nullptr;
  const BallotDeviceOptions named{.name = "cpu", .vulkan = &good}, checked{.validate = 1, .vulkan = &good};
  EXPECT_EQ(ballot_device_open(&named, &device), kArgument);
  names(ballot_last_error(), "name and vulkan");
  EXPECT_EQ(ballot_device_open(&checked, &device), kArgument);
  names(ballot_last_error(), "validate and vulkan");
}

TEST_F(ApiVulkan, WrongIncludesAreRefused) {
  Watched w;
  {
    const ballot::Device device(w.vulkan());
    const ballot::Scene scene(device, {grid_.mesh()});
    const auto refusal = [&](const ballot::IncludeOptions& options) {
      std::string text;
      EXPECT_EQ(code_of([&] { ballot::shader_include(scene, options); }, &text), BALLOT_ERROR_ARGUMENT) << text;
      return text;
    };
    EXPECT_NE(refusal({}).find("calls"), std::string::npos);
    EXPECT_NE(refusal({.calls = " "}).find("at least one of nearest"), std::string::npos);
    EXPECT_NE(refusal({.calls = "accept"}).find("at least one of nearest"), std::string::npos);
    EXPECT_NE(refusal({.calls = "nearest hit"}).find("calls has 'hit'"), std::string::npos);
    EXPECT_NE(refusal({.calls = "closest intersect"}).find("closest()"), std::string::npos);
    EXPECT_NE(refusal({.calls = "nearest", .numeric = "exact"}).find("exact"), std::string::npos);
    EXPECT_NE(refusal({.calls = "count", .numeric = "fast"}).find("count()"), std::string::npos);
    const ballot::Device own;
    const ballot::Scene elsewhere(own, {grid_.mesh()});
    std::string text;
    EXPECT_EQ(code_of([&] { ballot::shader_include(elsewhere, {.calls = "any"}); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find("BallotDeviceOptions::vulkan"), text.npos) << text;
  }
  w.close();
}

}  // namespace
