// The Vulkan of a program by the C interface.
#include <sstream>

#include "engine/api/vulkan.h"
#include "engine/gpu/given.h"

namespace ballot::api {
namespace {

BallotVulkanNeed need_of(const VulkanNeed& n) {
  BallotVulkanNeed need = BALLOT_INIT(BallotVulkanNeed);
  write_name(need.name, n.name);
  write_name(need.of, n.of);
  write_name(need.without, n.why);
  need.is_extension = !*n.of;
  need.required = n.required;
  return need;
}

UserText text_of(const BallotIncludeOptions& o) {
  UserText text{.name = "include", .text = o.calls.text, .file = "calls", .include_set = o.set};
  if (o.numeric) text.numeric = o.numeric.text;
  return text;
}

/// Returns the text that asks for an include, as it is known to the scene from now on.
const UserText& known_text(SceneState& scene, const UserText& text) {
  const std::string key = fmt::format("{} {} {}", *text.include_set, text.numeric, text.text);
  return scene.includes.try_emplace(key, text).first->second;
}

}  // namespace

GivenVulkan given_vulkan(const BallotVulkan& v) {
  GivenVulkan given{.instance = v.instance,
                    .physical_device = v.physical_device,
                    .device = v.device,
                    .queue = v.queue,
                    .queue_family = v.queue_family,
                    .api_version = v.api_version,
                    .find = v.get_instance_proc_addr,
                    .lock = v.lock,
                    .unlock = v.unlock,
                    .user = v.user};
  std::istringstream names(v.enabled ? v.enabled.text : "");
  for (std::string name; names >> name;) given.enabled.push_back(name);
  return given;
}

}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_vulkan_needs(BallotVulkanNeed* needs, size_t room, size_t* count) {
  return guarded(nullptr, [&] {
    need(count, "ballot_vulkan_needs", "count");
    if (room) need(needs, "ballot_vulkan_needs", "needs");
    std::vector<BallotVulkanNeed> all;
    for (const ballot::VulkanNeed& one : ballot::vulkan_needs()) all.push_back(need_of(one));
    write_structs(needs, std::min(room, all.size()), all, "BallotVulkanNeed");
    *count = all.size();
  });
}

BallotStatus ballot_scene_include(BallotScene* scene, const BallotIncludeOptions* options, BallotInclude* include) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(options, "ballot_scene_include", "options");
    need(include, "ballot_scene_include", "include");
    const BallotIncludeOptions o = read_struct(options, "BallotIncludeOptions");
    need(o.calls, "ballot_scene_include", "calls");
    if (!state->device->gpu->is_given())
      refuse(
          "ballot_scene_include: the scene's device is the library's own; open one on the program's by "
          "BallotDeviceOptions::vulkan");
    const DeviceUse use(*state->device);
    keep_fit(*state);
    const ballot::UserText& text = known_text(*state, text_of(o));
    const ballot::UserInclude made = state->world->kernel(text).include();
    BallotInclude found = BALLOT_INIT(BallotInclude);
    found.text = made.text.c_str();
    found.set_layout = made.set_layout;
    found.set = made.set;
    write_struct(include, found, "BallotInclude");
  });
}
