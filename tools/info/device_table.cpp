#include "tools/info/device_table.h"

#include "engine/scene/device_scene.h"

namespace ballot::cli {

namespace {

nlohmann::json device_json(const DeviceInfo& d) {
  return {{"name", d.name},
          {"driver", d.driver},
          {"subgroup_size", d.subgroup_size},
          {"min_subgroup_size", d.min_subgroup_size},
          {"max_subgroup_size", d.max_subgroup_size},
          {"max_storage_range", d.max_storage_range},
          {"max_texels", d.max_texels},
          {"max_allocation", d.max_allocation},
          {"max_buffer", d.max_buffer},
          {"shared_bytes", d.shared_bytes},
          {"refusals", d.refusals},
          {"lacks", d.lacks}};
}

}  // namespace

nlohmann::json print_devices(const std::string& wanted) {
  const auto devices = list_devices();
  const std::size_t chosen = choose_device(devices, wanted);
  nlohmann::json json = nlohmann::json::array();
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const DeviceInfo& d = devices[i];
    say("{} {}: {}\n", i == chosen ? "*" : " ", i, d.name);
    say("     driver {}, Vulkan {}.{}.{}\n", d.driver, VK_API_VERSION_MAJOR(d.api_version),
        VK_API_VERSION_MINOR(d.api_version), VK_API_VERSION_PATCH(d.api_version));
    say("     subgroup {} ({} to {}), workgroup up to {}, shared memory {} KiB\n", d.subgroup_size, d.min_subgroup_size,
        d.max_subgroup_size, d.max_group_invocations, d.shared_bytes / 1024);
    say("     at most: storage buffer {} MiB, texel buffer {} MiB, allocation {} MiB, any buffer {} MiB\n",
        d.max_storage_range >> 20, d.max_texels >> 16, d.max_allocation >> 20, d.max_buffer >> 20);
    for (const std::string& r : d.refusals) say("     refused: {}\n", r);
    for (const std::string& l : d.lacks) say("     lacks {}\n", l);
    json.push_back(device_json(d));
  }
  say("the device marked * is used{}\n", wanted.empty() ? " unless --device names another" : "");
  return json;
}

}  // namespace ballot::cli
