#include "engine/api/state.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "engine/core/failure_text.h"
#include "engine/core/interruption.h"

namespace ballot::api {

namespace {

thread_local std::string thread_error, asked_error;
thread_local const DeviceState* in_callback_of = nullptr;

/// A table that is never destroyed.
template <class Table>
Table& forever() {
  static Table& table = *new Table;
  return table;
}

[[noreturn]] void refuse_closed(const char* what) {
  throw Refused(BALLOT_ERROR_CLOSED, fmt::format("{}: the handle is closed, or was never opened", what));
}

[[noreturn]] void refuse_forked(const char* what, pid_t owner) {
  throw Refused(BALLOT_ERROR_FORKED,
                fmt::format("{}: it belongs to process {}, and this is its child {}; a device does not survive fork(): "
                            "open one in each process (in Python: multiprocessing's method 'spawn')",
                            what, owner, getpid()));
}

template <class State>
std::shared_ptr<State> checked(std::shared_ptr<State> state, const DeviceState* device, const char* what) {
  if (!state) refuse_closed(what);
  if (device->owner != getpid()) refuse_forked(what, device->owner);
  return state;
}

}  // namespace

std::uintptr_t next_handle() {
  static std::atomic<std::uintptr_t> next{0};
  return 16 * ++next;
}

Handles<BallotDevice, DeviceState>& devices() { return forever<Handles<BallotDevice, DeviceState>>(); }
Handles<BallotScene, SceneState>& scenes() { return forever<Handles<BallotScene, SceneState>>(); }
Handles<BallotBuffer, BufferState>& buffers() { return forever<Handles<BallotBuffer, BufferState>>(); }
Handles<BallotJob, JobState>& jobs() { return forever<Handles<BallotJob, JobState>>(); }

Handles<BallotKernel, KernelState>& kernels() { return forever<Handles<BallotKernel, KernelState>>(); }

std::shared_ptr<DeviceState> use(const BallotDevice* handle) {
  auto state = devices().find(handle);
  const DeviceState* device = state.get();
  return checked(std::move(state), device, "device");
}
std::shared_ptr<SceneState> use(const BallotScene* handle) {
  auto state = scenes().find(handle);
  const DeviceState* device = state ? state->device.get() : nullptr;
  return checked(std::move(state), device, "scene");
}
std::shared_ptr<BufferState> use(const BallotBuffer* handle) {
  auto state = buffers().find(handle);
  const DeviceState* device = state ? state->device.get() : nullptr;
  return checked(std::move(state), device, "buffer");
}

std::shared_ptr<KernelState> use(const BallotKernel* handle) {
  auto state = kernels().find(handle);
  const DeviceState* device = state ? state->device.get() : nullptr;
  return checked(std::move(state), device, "kernel");
}

std::shared_ptr<JobState> use(const BallotJob* handle) {
  auto state = jobs().find(handle);
  if (!state) refuse_closed("job");
  if (!state->is_ours()) refuse_forked("job", state->owner());
  return state;
}

InCallback::InCallback(const DeviceState& device) : outer_(std::exchange(in_callback_of, &device)) {}
InCallback::~InCallback() { in_callback_of = outer_; }

bool InCallback::of(const DeviceState& device) { return in_callback_of == &device; }

void InCallback::refuse(const DeviceState& device) {
  if (of(device))
    throw Refused(
        BALLOT_ERROR_WORK,
        "the device was called from a progress function, or another function that a call on it was given, and "
        "would wait for itself; call it once that call has returned");
}

DeviceHold::DeviceHold(DeviceState& device, bool asks) : device_(device) {
  InCallback::refuse(device);
  if (device.mutex.try_lock()) return;
  if (asks && !in_callback_of) ask_interruption();
  device.mutex.lock();
}

DeviceHold::~DeviceHold() {
  const auto late = std::exchange(device_.late, {});  // goes when the device is free
  device_.mutex.unlock();
}

DeviceUse::DeviceUse(DeviceState& device) : DeviceHold(device, true) {
  if (!device.gpu->has_recorded()) return;
  if (!in_callback_of) ask_interruption();
  device.gpu->flush();
}

const char* thread_text() { return thread_error.c_str(); }

const char* thread_copy(const std::string& text) {
  asked_error = text;
  return asked_error.c_str();
}

BallotStatus report(LastError* error) {
  BallotStatus status = BALLOT_ERROR_WORK;
  std::string text;
  bool has_lines = false;
  try {
    throw;
  } catch (const Refused& e) {
    status = e.status, text = e.what(), has_lines = e.has_lines;
  } catch (...) {
    FailureText failure = failure_text();
    status = failure.memory ? BALLOT_ERROR_MEMORY : BallotStatus(int(failure.kind));
    text = std::move(failure.text);
  }
  // A text is one line, also where it names what a file or a caller has called so.
  const auto breaks = [](char c) { return c == '\n' || c == '\r'; };
  if (!has_lines) std::ranges::replace_if(text, breaks, ' ');
  thread_error = text;
  if (error) error->set(text);
  return status;
}

void check_buffer(const BufferState& buffer, const SceneState& scene, std::uint64_t count, const char* call,
                  const char* what) {
  if (buffer.device != scene.device)
    throw Refused(BALLOT_ERROR_ARGUMENT,
                  fmt::format("{}: the buffer of {} is on another device than the scene ({} and {}); make both on "
                              "one device",
                              call, what, buffer.device->gpu->info().name, scene.device->gpu->info().name));
  if (buffer.records < count)
    throw Refused(BALLOT_ERROR_ARGUMENT,
                  fmt::format("{}: the buffer of {} has {} records; expected {}", call, what, buffer.records, count));
}

void SceneState::open(Scene scene, const DeviceSceneOptions& options, const Progress& progress) {
  next = {static_cast<std::uint32_t>(scene.instances.meshes()),
          static_cast<std::uint32_t>(scene.instances.placements.size())};
  places.emplace(scene, ids);
  world = std::make_unique<DeviceScene>(std::move(scene), options, progress);
}

void keep_fit(SceneState& scene) {
  if (scene.update == UpdateMode::Auto && scene.world->rebuild_if_overdue()) scene.refits = 0;
}

void refuse(const std::string& text) { throw Refused(BALLOT_ERROR_ARGUMENT, text); }

std::size_t stride_of(std::size_t given, std::size_t record, std::size_t count, const std::string& where) {
  const std::size_t stride = given ? given : record;
  if (stride < record || stride % sizeof(float))
    refuse(fmt::format("{} is {} bytes; expected a multiple of 4, at least {}, or 0 for {}", where, given, record,
                       record));
  if (count && (stride > kMostBytes || count > kMostBytes / stride))
    refuse(
        fmt::format("{} is {} bytes, and the records are {}; no memory reaches that far: expected less than 2^47 "
                    "bytes in all",
                    where, std::ptrdiff_t(stride), count));
  return stride;
}

void need(const void* pointer, const char* call, const char* what) {
  if (!pointer) throw Refused(BALLOT_ERROR_ARGUMENT, fmt::format("{}: {} is NULL", call, what));
}

}  // namespace ballot::api
