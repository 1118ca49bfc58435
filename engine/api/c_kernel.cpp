// Kernels of the user by the C interface.
#include <algorithm>

#include "engine/api/arrays.h"

namespace ballot::api {
namespace {

UserText text_of(const char* text, const BallotKernelOptions& o) {
  UserText user{.text = text};
  if (o.name) user.name = o.name.text;
  if (o.file) user.file = o.file.text;
  if (o.first_line) user.first_line = o.first_line;
  if (o.numeric) user.numeric = o.numeric.text;
  return user;
}

BallotInputInfo info_of(const std::string& name, const std::string& type, std::uint32_t bytes) {
  BallotInputInfo info = BALLOT_INIT(BallotInputInfo);
  write_name(info.name, name);
  write_name(info.type, type);
  info.bytes = bytes;
  return info;
}

/// The inputs of a run. Keeps the arrays.
struct Inputs {
  Inputs(const BallotInput* given, std::size_t count) {
    if (count) need(given, "ballot_kernel_run", "inputs");
    const std::size_t stride = count ? read_struct(given, "BallotInput"), given->size : 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto* at = reinterpret_cast<const BallotInput*>(reinterpret_cast<const char*>(given) + i * stride);
      const BallotInput input = read_struct(at, "BallotInput");
      need(input.name, "ballot_kernel_run", "the name of an input");
      if (!input.buffer == !input.number)
        refuse(fmt::format("input '{}': expected buffer, of an array, or number", input.name.text));
      all.push_back({input, input.buffer ? use(input.buffer) : nullptr});
    }
  }
  /// Throws Refused unless there is one of this name.
  void check_given(const std::string& kernel, const char* what, const std::string& name) const {
    const auto given = std::ranges::count_if(all, [&](const One& one) { return one.input.name.text == name; });
    if (given != 1)
      refuse(fmt::format("kernel {}: {} '{}' is given {} times; each one that the text declares has to be given once",
                         kernel, what, name, given));
  }

  struct One {
    BallotInput input;
    std::shared_ptr<BufferState> buffer;
  };
  std::vector<One> all;
};

TraceTimes run(KernelState& state, const std::shared_ptr<SceneState>& scene, std::uint32_t count, const Inputs& inputs,
               Watch& watch) {
  const std::string& name = state.text.name;
  const std::string where = fmt::format("kernel {}", name);
  for (const UserArray& array : state.inputs.arrays) inputs.check_given(name, "array", array.name);
  for (const UserNumber& number : state.inputs.numbers) inputs.check_given(name, "number", number.name);
  std::erase_if(state.scenes, [](const auto& one) { return one.expired(); });
  if (std::ranges::none_of(state.scenes, [&](const auto& one) { return one.lock() == scene; }))
    state.scenes.push_back(scene);
  UserKernel& kernel = scene->world->kernel(state.text);
  for (const auto& [input, buffer] : inputs.all) {
    if (buffer) {
      check_buffer(*buffer, *scene, 0, where.c_str(), input.name);
      kernel.bind(input.name.text, BufferPart(buffer->raw(), 0, buffer->records * buffer->record_bytes));
    } else {
      kernel.set(input.name.text, {static_cast<const std::byte*>(input.number), input.bytes});
    }
  }
  std::function<void(std::uint32_t)> progress;
  if (watch) progress = [&](std::uint32_t done) { watch(double(done) / double(count)); };
  return kernel.run(count, progress);
}

}  // namespace

KernelState::~KernelState() {
  std::vector<std::shared_ptr<SceneState>> used;  // go when the device is free
  for (const auto& scene : scenes) used.push_back(scene.lock());
  const DeviceHold hold(*device);
  for (const auto& scene : used)
    if (scene) scene->world->drop_kernel(text);
}

}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_kernel_create(BallotDevice* device, const char* text, const BallotKernelOptions* options,
                                  BallotKernel** kernel) {
  return guarded_use(device, [&](const std::shared_ptr<DeviceState>& d) {
    need(text, "ballot_kernel_create", "text");
    need(kernel, "ballot_kernel_create", "kernel");
    auto state = std::make_shared<KernelState>();
    state->device = d;
    state->text = text_of(text, read_struct(options, "BallotKernelOptions"));
    {
      const DeviceHold hold(*d);
      try {
        state->inputs = ballot::inputs_of(*d->gpu, state->text);
      } catch (const ballot::Error& error) {
        if (error.kind() != ballot::Failure::Arguments) throw;
        throw Refused(BALLOT_ERROR_ARGUMENT, error.what(), true);
      }
    }
    *kernel = kernels().add(std::move(state));
  });
}

BallotStatus ballot_kernel_inputs(BallotKernel* kernel, BallotInputInfo* infos, size_t room, size_t* count) {
  return guarded_use(kernel, [&](const std::shared_ptr<KernelState>& state) {
    need(count, "ballot_kernel_inputs", "count");
    if (room) need(infos, "ballot_kernel_inputs", "infos");
    std::vector<BallotInputInfo> all;
    for (const ballot::UserArray& a : state->inputs.arrays) {
      all.push_back(info_of(a.name, a.type, a.bytes));
      all.back().is_array = 1, all.back().written = a.written;
    }
    for (const ballot::UserNumber& n : state->inputs.numbers) all.push_back(info_of(n.name, n.type, n.bytes));
    write_structs(infos, std::min(room, all.size()), all, "BallotInputInfo");
    *count = all.size();
  });
}

BallotStatus ballot_kernel_run(BallotKernel* kernel, BallotScene* scene, uint64_t count, const BallotInput* inputs,
                               size_t input_count, const BallotQuery* query, BallotTimes* times) {
  return guarded_use(kernel, [&](const std::shared_ptr<KernelState>& state) {
    const auto of = use(scene);
    const Inputs given(inputs, input_count);
    if (of->device != state->device)
      refuse(fmt::format("kernel {}: the scene is on another device ({}) than the kernel ({}); make both on one device",
                         state->text.name, of->device->gpu->info().name, state->device->gpu->info().name));
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
    if (count > kMost)
      refuse(fmt::format("kernel {}: count is {}; expected at most {}", state->text.name, count, kMost));
    run_call(*of, query, kKernelKind, "indices", times, [&](const BallotQuery&, Watch& watch) {
      const Clock clock;
      return clock.times(run(*state, of, std::uint32_t(count), given, watch), 0);
    });
  });
}
