// Tests of the choice of a device, and of the error messages where no device is usable.
#include "engine/gpu/context.h"
#include "tests/cli/cli.h"
#include "tests/cpu/gltf_builder.h"
#include "tests/cpu/needs.h"

namespace ballot::test {
namespace {

DeviceInfo device(const char* name, VkPhysicalDeviceType type, std::vector<std::string> refusals = {}) {
  DeviceInfo d;
  d.name = name;
  d.driver = std::string(name) + " driver";
  d.type = type;
  d.refusals = std::move(refusals);
  return d;
}

const DeviceInfo kCpu = device("llvmpipe", VK_PHYSICAL_DEVICE_TYPE_CPU);
const DeviceInfo kSmall = device("Iris 3 XE", VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU);
const DeviceInfo kVirtual = device("venus", VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU);
const DeviceInfo kBig = device("Radeon 9", VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU);
const DeviceInfo kOld = device("GeForce 8", VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU,
                               {"it offers Vulkan 1.0, Ballot needs 1.2", "it lacks votes"});

TEST(ChooseDevice, TheBestByDefault) {
  EXPECT_EQ(choose_device({kCpu, kSmall, kVirtual, kBig}, ""), 3u);
  EXPECT_EQ(choose_device({kBig, kSmall, kCpu}, ""), 0u);
  EXPECT_EQ(choose_device({kCpu, kSmall, kVirtual}, ""), 2u);
  EXPECT_EQ(choose_device({kCpu, kSmall}, ""), 1u);
  EXPECT_EQ(choose_device({kCpu}, ""), 0u);
  EXPECT_EQ(choose_device({kBig, kBig}, ""), 0u);
  EXPECT_EQ(choose_device({kOld, kCpu}, ""), 1u);
}

TEST(ChooseDevice, ByIndexNameAndKind) {
  const std::vector<DeviceInfo> all{kCpu, kSmall, kBig};
  EXPECT_EQ(choose_device(all, "0"), 0u);
  EXPECT_EQ(choose_device(all, "1"), 1u);
  EXPECT_EQ(choose_device(all, "Iris"), 1u);
  EXPECT_EQ(choose_device(all, "llvm"), 0u);
  EXPECT_EQ(choose_device(all, "gpu"), 2u);
  EXPECT_EQ(choose_device(all, "cpu"), 0u);
  EXPECT_EQ(choose_device({kOld, kSmall, kCpu}, "gpu"), 1u);
}

TEST(ChooseDevice, ANameThatNothingHas) {
  for (const char* name : {"Voodoo", "3", "-1", "99999999999999999999999"})
    expect_error(Failure::Arguments,
                 {"device", name, "0: llvmpipe (llvmpipe driver)", "1: Iris 3 XE", "'gpu' or 'cpu'"}, [&] {
                   choose_device({kCpu, kSmall}, name);
                 });
  expect_error(Failure::Arguments, {"'gpu'", "0: llvmpipe"}, [&] { choose_device({kCpu}, "gpu"); });
  expect_error(Failure::Arguments, {"'cpu'", "0: Radeon 9"}, [&] { choose_device({kBig}, "cpu"); });
}

TEST(ChooseDevice, NoneAtAll) {
  expect_error(Failure::Device, {"no Vulkan device", "apt install mesa-vulkan-drivers"}, [] { choose_device({}, ""); });
  expect_error(Failure::Device, {"no Vulkan device"}, [] { choose_device({}, "cpu"); });
}

TEST(ChooseDevice, RefusalsAreListedWithEveryReason) {
  const DeviceInfo narrow =
      device("Mali", VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU, {"it lacks scalarBlockLayout (layout.h)"});
  expect_error(Failure::Device,
               {"no usable Vulkan device", "0: GeForce 8", "refused: it offers Vulkan 1.0", "refused: it lacks votes",
                "1: Mali", "refused: it lacks scalarBlockLayout"},
               [&] {
                 choose_device({kOld, narrow}, "");
               });
  expect_error(Failure::Device, {"GeForce 8", "refused: it lacks votes"}, [&] {
    choose_device({kCpu, kOld}, "GeForce");
  });
  expect_error(Failure::Device, {"refused: it lacks votes"}, [&] { choose_device({kCpu, kOld}, "1"); });
}

class Devices : public Cli {
 protected:
  void SetUp() override {
    square();
    rays();
  }
};

TEST_F(Devices, WithoutADriverEveryCommandNamesTheRemedy) {
  const Environment none{{"VK_DRIVER_FILES", "/nonexistent/driver.json"},
                         {"VK_ICD_FILENAMES", "/nonexistent/driver.json"}};
  const Words commands[] = {{"info"},
                            {"info", "square.glb"},
                            {"render", "square.glb", "--size", "4x4", "--view", "front", "--out", "p.exr"},
                            {"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy"}};
  for (const Words& command : commands)
    refuse(3,
           {"no Vulkan device: the loader found no driver, as VK_DRIVER_FILES is /nonexistent/driver.json",
            "apt install mesa-vulkan-drivers", "dnf install mesa-vulkan-drivers", "pacman -S vulkan-swrast",
            "pip install \"ballot[cpu]\"", "in a container"},
           command, none);
}

TEST_F(Devices, WithoutALoaderTheTextNamesIt) {
  const Environment none{{"BALLOT_VULKAN_LOADER", "libvulkan-absent.so"}};
  refuse(3, {"no Vulkan loader: libvulkan-absent.so was not found", "apt install mesa-vulkan-drivers libvulkan1"},
         {"info"}, none);
}

// The build compiles every variant without a driver (CMakeLists.txt). Here some are compiled anew, as the cache is
// empty.
TEST_F(Devices, ShadersNeedNoDriver) {
  const Environment none{{"VK_DRIVER_FILES", "/nonexistent/driver.json"},
                         {"VK_ICD_FILENAMES", "/nonexistent/driver.json"}};
  expect_parts(succeed({"shaders", "--only", "packet.nearest.watertight", "--json", "shaders.json"}, none).out,
               {"packet.nearest.watertight", "variants"});
  EXPECT_GT(json("shaders.json").size(), 0u);
  for (const auto& variant : json("shaders.json")) expect_parts(variant["name"], {"packet.nearest.watertight"});
  refuse(2, {"--only none.such", "no variant"}, {"shaders", "--only", "none.such"}, none);
}

TEST_F(Devices, SubgroupsThatTheDeviceDoesNotOffer) {
  succeed({"info", "--json", "info.json"});
  const auto devices = json("info.json")["devices"];
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (!devices[i]["refusals"].empty()) continue;
    const std::string index = std::to_string(i);
    const Words trace{"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy", "--device", index, "--knob"};
    const auto with = [&](const std::string& knob) {
      Words words = trace;
      words.push_back(knob);
      return words;
    };
    const std::string least = std::to_string(devices[i]["min_subgroup_size"].get<int>());
    const std::string most = std::to_string(devices[i]["max_subgroup_size"].get<int>());
    if (devices[i]["max_subgroup_size"] < 64)
      refuse(2, {"knob subgroup=64", "from " + least + " to " + most}, with("subgroup=64"));
    refuse(2, {"knob subgroup"}, with("subgroup=12"));
    const std::string usual = std::to_string(devices[i]["subgroup_size"].get<int>());
    refuse(2, {"knob workgroup=66", "multiple of the subgroup, " + usual}, with("workgroup=66"));
    refuse(2, {"knob workgroup"}, with("workgroup=2048"));
  }
}

TEST_F(Devices, ACpuDeviceByName) {
  succeed({"info", "--json", "info.json"});
  bool has_cpu = false;
  const auto devices = json("info.json")["devices"];
  for (const auto& d : devices) has_cpu |= d["name"].get<std::string>().starts_with("llvmpipe");
  BALLOT_NEEDS(has_cpu, "lavapipe is not installed (package mesa-vulkan-drivers)")
  for (const char* name : {"cpu", "llvmpipe"}) {
    const Result result =
        succeed({"trace", "square.glb", "-v", "--rays", "rays.npy", "--out", "hits.npy", "--device", name});
    expect_parts(result.out, {"on llvmpipe"});
  }
}

}  // namespace
}  // namespace ballot::test
