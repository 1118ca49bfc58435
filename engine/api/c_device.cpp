// Devices, versions and errors of the C interface.
#include <cstdio>

#include "engine/api/state.h"
#include "engine/api/vulkan.h"

namespace ballot::api {
namespace {

template <std::size_t Room>
void write_text(char (&to)[Room], const std::string& text) {
  std::snprintf(to, Room, "%s", text.c_str());
}

BallotDeviceInfo info_of(const DeviceInfo& d) {
  BallotDeviceInfo info = BALLOT_INIT(BallotDeviceInfo);
  write_text(info.name, d.name);
  write_text(info.driver, d.driver);
  std::string refusal;
  for (const std::string& why : d.refusals) refusal += (refusal.empty() ? "" : "; ") + why;
  write_text(info.refusal, refusal);
  info.is_cpu = d.is_cpu();
  info.usable = d.refusals.empty();
  info.subgroup_size = d.subgroup_size;
  info.exports = d.memory_fd;
  return info;
}

/// Returns the names of registries.
template <class... Rows>
std::vector<std::string> list_of(const Rows&... rows) {
  std::vector<std::string> names;
  const auto add = [&names](const auto& registry) {
    for (const auto& row : registry) names.emplace_back(row.name);
  };
  (add(rows), ...);
  return names;
}

/// Lets go of what a closed handle stood for: in a callback of its device once the call has ended. What belongs to
/// another process stays: its driver's threads do not exist here.
template <class State>
void let_go(std::shared_ptr<State> state, const std::shared_ptr<DeviceState>& device) {
  if (device->owner != getpid())
    new std::shared_ptr<State>(std::move(state));
  else if (InCallback::of(*device))
    device->late.push_back(std::move(state));
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

const char* ballot_version(void) {
  static const std::string text =
      fmt::format("{}.{}.{}", BALLOT_VERSION_MAJOR, BALLOT_VERSION_MINOR, BALLOT_VERSION_PATCH);
  return text.c_str();
}

const char* ballot_commit(void) {
  static const std::string text = ballot::commit();
  return text.c_str();
}

const char* ballot_name(BallotNames names, size_t index) {
  static const std::vector<std::string> all[] = {list_of(ballot::kMethods), list_of(ballot::kNumericModes),
                                                 list_of(ballot::kBuilders), list_of(ballot::kRayKinds),
                                                 list_of(ballot::kShadings, ballot::kIntegrators)};
  if (std::size_t(names) >= std::size(all) || index >= all[names].size()) return nullptr;
  return all[names][index].c_str();
}

const char* ballot_last_error(void) { return thread_text(); }

BallotStatus ballot_devices(BallotDeviceInfo* infos, size_t room, size_t* count) {
  return guarded(nullptr, [&] {
    need(count, "ballot_devices", "count");
    if (room) need(infos, "ballot_devices", "infos");
    const auto found = ballot::list_devices();
    std::vector<BallotDeviceInfo> all;
    for (const ballot::DeviceInfo& one : found) all.push_back(info_of(one));
    write_structs(infos, std::min(room, all.size()), all, "BallotDeviceInfo");
    *count = found.size();
  });
}

BallotStatus ballot_device_open(const BallotDeviceOptions* options, BallotDevice** device) {
  return guarded(nullptr, [&] {
    need(device, "ballot_device_open", "device");
    const BallotDeviceOptions o = read_struct(options, "BallotDeviceOptions");
    ballot::ContextOptions open{.device = o.name ? o.name.text : "", .validate = o.validate != 0};
    ballot::GivenVulkan given;
    if (o.vulkan) {
      if (o.name || o.validate)
        refuse(
            fmt::format("ballot_device_open: {} and vulkan are given; a program chooses its device, and its layers, "
                        "itself",
                        o.name ? "name" : "validate"));
      given = given_vulkan(read_struct(o.vulkan, "BallotVulkan"));
      open.given = &given;
    }
    *device = devices().add(std::make_shared<DeviceState>(open));
  });
}

void ballot_device_close(BallotDevice* device) {
  const auto state = devices().remove(device);
  if (state) let_go(state, state);
}

void ballot_scene_destroy(BallotScene* scene) {
  auto state = scenes().remove(scene);
  if (const auto device = state ? state->device : nullptr) let_go(std::move(state), device);
}

void ballot_buffer_destroy(BallotBuffer* buffer) {
  auto state = buffers().remove(buffer);
  if (const auto device = state ? state->device : nullptr) let_go(std::move(state), device);
}

void ballot_kernel_destroy(BallotKernel* kernel) {
  auto state = kernels().remove(kernel);
  if (const auto device = state ? state->device : nullptr) let_go(std::move(state), device);
}

BallotStatus ballot_device_info(BallotDevice* device, BallotDeviceInfo* info) {
  return guarded_use(device, [&](const std::shared_ptr<DeviceState>& state) {
    need(info, "ballot_device_info", "info");
    write_struct(info, info_of(state->gpu->info()), "BallotDeviceInfo");
  });
}

size_t ballot_device_message_count(BallotDevice* device) {
  std::size_t count = 0;
  guarded_use(device, [&](const std::shared_ptr<DeviceState>& state) {
    const DeviceHold hold(*state);
    count = state->gpu->messages().size();
  });
  return count;
}

const char* ballot_device_error(BallotDevice* device) {
  const auto state = devices().find(device);
  return state ? thread_copy(state->error.get()) : thread_text();
}

const char* ballot_scene_error(BallotScene* scene) {
  const auto state = scenes().find(scene);
  return state ? thread_copy(state->error.get()) : thread_text();
}

const char* ballot_buffer_error(BallotBuffer* buffer) {
  const auto state = buffers().find(buffer);
  return state ? thread_copy(state->error.get()) : thread_text();
}

const char* ballot_kernel_error(BallotKernel* kernel) {
  const auto state = kernels().find(kernel);
  return state ? thread_copy(state->error.get()) : thread_text();
}
