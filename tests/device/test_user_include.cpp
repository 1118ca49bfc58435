// The texts of calls for shaders of programs, as devices of all kinds would have them: they compile.
#include "engine/answer/query_kernel.h"
#include "engine/answer/user_include.h"
#include "engine/core/error.h"
#include "tests/device/harness.h"

namespace ballot {
namespace {

/// Returns the text for a device and a tree.
std::string included(const UserText& user, const DeviceInfo& device, const TreeFacts& tree) {
  WholeText whole = whole_text(user);
  for (const char* define : {"BALLOT_HAS_INSTANCES", "BALLOT_STORED", "BALLOT_HAS_SHAPES"})
    whole.defines.emplace_back(define, std::string_view(define) == "BALLOT_HAS_INSTANCES" && tree.top_depth > 0);
  return flat_include(
      user, own_source("called", device, tree, whole.defines, {whole.text, user.name, user.numeric, true}), device);
}

DeviceInfo device_of(VkPhysicalDeviceType type, bool address) {
  DeviceInfo device;
  device.name = "a device";
  device.type = type;
  device.driver_id = type == VK_PHYSICAL_DEVICE_TYPE_CPU ? VK_DRIVER_ID_MESA_LLVMPIPE : VK_DRIVER_ID_NVIDIA_PROPRIETARY;
  device.subgroup_size = device.min_subgroup_size = device.max_subgroup_size = 32;
  device.max_group_invocations = device.max_group_size_x = 1024;
  device.max_group_subgroups = 32;
  device.shared_bytes = 48 << 10;
  device.buffer_address = device.size_control = device.uniform_flow = address;
  return device;
}

TEST(UserInclude, CompilesForDevicesAndTreesOfAllKinds) {
  const TreeFacts flat{.depth = 32, .largest_leaf = MAX_LEAF_TRIANGLES};
  TreeFacts far = flat, instances = flat, large = flat;
  far.far = true;
  instances.top_depth = 24;
  large.large = true;
  const DeviceInfo devices[] = {device_of(VK_PHYSICAL_DEVICE_TYPE_CPU, true),
                                device_of(VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU, false),
                                device_of(VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU, true)};
  bool by_address = false;
  for (const DeviceInfo& device : devices)
    for (const TreeFacts& tree : {flat, far, instances, large}) {
      const UserText user{.text = "nearest any count closest corner place accept", .include_set = 2};
      const std::string text = included(user, device, tree);
      EXPECT_EQ(text.find("push_constant"), text.npos);
      EXPECT_EQ(text.find("shared "), text.npos);
      for (const char* operation : {"subgroupAny", "subgroupBallot", "gl_Subgroup"})
        EXPECT_EQ(text.find(operation), text.npos);
      by_address = by_address || text.find("buffer_reference") != text.npos;
      const std::string shader = "#version 460\n" + text +
                                 "bool accept(Hit hit) { return hit.prim != 3u; }\n"
                                 "layout(local_size_x = 8, local_size_y = 4) in;\nvoid main() {}\n";
      EXPECT_NO_THROW(compile_shader("query/mine.comp", {}, false, Calls::Kept, {shader, "mine"})) << shader;
    }
  EXPECT_TRUE(by_address);
}

TEST(UserInclude, LeavesNamesToTheProgram) {
  const TreeFacts tree{.depth = 32, .largest_leaf = MAX_LEAF_TRIANGLES, .top_depth = 24};
  const std::string text = included({.text = "nearest count closest corner", .include_set = 0},
                                    device_of(VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU, true), tree);
  const std::string shader = "#version 460\n" + text + R"(
layout(local_size_x = 8) in;
layout(push_constant) uniform Push { uint push; };
layout(constant_id = 1) const uint STACK_SIZE = 3u;
struct Walker { float best; };
uint world, first_prim, nodes, leaves, top_push, whole_push, instances, triangles, placed, asked_ray, hit_words;
float traverse(float larger) { return 2.0 * larger; }
#define is_dead(x) false
void main() { world = push + uint(traverse(1.0)); }
)";
  EXPECT_NO_THROW(compile_shader("query/mine.comp", {}, false, Calls::Kept, {shader, "mine"}));
}

}  // namespace
}  // namespace ballot
