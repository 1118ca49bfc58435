#include "engine/api/state.h"

#include <atomic>
#include <new>

namespace ballot::api {

namespace {

thread_local std::string thread_error, asked_error;

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

std::shared_ptr<JobState> use(const BallotJob* handle) {
  auto state = jobs().find(handle);
  if (!state) refuse_closed("job");
  if (!state->is_ours()) refuse_forked("job", state->owner());
  return state;
}

const char* thread_text() { return thread_error.c_str(); }

const char* thread_copy(const std::string& text) {
  asked_error = text;
  return asked_error.c_str();
}

BallotStatus report(LastError* error) {
  BallotStatus status = BALLOT_ERROR_WORK;
  std::string text;
  try {
    throw;
  } catch (const Refused& e) {
    status = e.status, text = e.what();
  } catch (const Error& e) {
    status = BallotStatus(int(e.kind())), text = e.what();
  } catch (const std::bad_alloc&) {
    status = BALLOT_ERROR_MEMORY, text = "the host has too little memory for this call";
  } catch (const std::exception& e) {
    text = fmt::format("internal error: {}; please report it with the call that caused it", e.what());
  } catch (...) {
    text = "internal error; please report it with the call that caused it";
  }
  thread_error = text;
  if (error) error->set(text);
  return status;
}

void check_buffer(const BufferState& buffer, const SceneState& scene, std::uint64_t count, const char* call,
                  const char* what) {
  if (buffer.device != scene.device)
    throw Refused(BALLOT_ERROR_ARGUMENT,
                  fmt::format("{}: the buffer of {} is on another device than the scene ({} and {}); make both by the "
                              "same ballot_device_open()",
                              call, what, buffer.device->gpu->info().name, scene.device->gpu->info().name));
  if (buffer.records < count)
    throw Refused(BALLOT_ERROR_ARGUMENT,
                  fmt::format("{}: the buffer of {} has {} records; expected {}", call, what, buffer.records, count));
}

void keep_fit(SceneState& scene) {
  if (scene.engine && scene.update == UpdateMode::Auto && scene.engine->rebuild_if_overdue()) scene.refits = 0;
}

Engine& engine_of(const SceneState& scene, const char* call) {
  if (!scene.engine)
    throw Refused(BALLOT_ERROR_ARGUMENT,
                  fmt::format("{}: the scene is one of instances, which this call does not take; "
                              "trace arrays of rays, or make a scene of moved copies",
                              call));
  return *scene.engine;
}

void need(const void* pointer, const char* call, const char* what) {
  if (!pointer) throw Refused(BALLOT_ERROR_ARGUMENT, fmt::format("{}: {} is NULL", call, what));
}

}  // namespace ballot::api
