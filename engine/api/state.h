// What stands behind the handles of the C interface, and the one place where exceptions become error codes.
#pragma once

#include <unistd.h>

#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "engine/answer/attributes.h"
#include "engine/api/ballot_c.h"
#include "engine/api/cuda_memory.h"
#include "engine/api/handles.h"
#include "engine/api/jobs.h"
#include "engine/api/place_table.h"
#include "engine/scene/device_scene.h"

namespace ballot::api {

/// A failure with a code that ballot::Error does not have.
struct Refused : std::runtime_error {
  /// `lines`: the text keeps its lines.
  Refused(BallotStatus code, const std::string& text, bool lines = false)
      : std::runtime_error(text), status(code), has_lines(lines) {}
  BallotStatus status;
  bool has_lines;
};

/// The text of a handle's last failed call. Thread-safe.
class LastError {
 public:
  void set(const std::string& text) {
    const std::lock_guard lock(mutex_);
    text_ = text;
  }
  std::string get() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

/// A device. Its mutex is held by every call that uses the device or what is on it: DeviceHold.
struct DeviceState {
  explicit DeviceState(const ContextOptions& options) : gpu(std::make_shared<Context>(options)) {}

  std::shared_ptr<Context> gpu;
  std::mutex mutex;
  std::vector<std::shared_ptr<void>> late;  // what callbacks have let go of during the call that holds the device
  pid_t owner = getpid();
  JobQueue jobs;
  LastError error;
};

/// Marks that the calling thread runs a function of the caller during a call that holds the device.
class InCallback {
 public:
  explicit InCallback(const DeviceState& device);
  ~InCallback();
  InCallback(const InCallback&) = delete;
  InCallback& operator=(const InCallback&) = delete;
  /// Returns true if the calling thread does so for this device.
  static bool of(const DeviceState& device);
  /// Throws Refused if it does so: the call would wait for itself.
  static void refuse(const DeviceState& device);

 private:
  const DeviceState* outer_;
};

/// Holds a device for a call. Throws Refused in a callback of the call that holds it.
class DeviceHold {
 public:
  explicit DeviceHold(DeviceState& device) : DeviceHold(device, false) {}
  ~DeviceHold();
  DeviceHold(const DeviceHold&) = delete;
  DeviceHold& operator=(const DeviceHold&) = delete;

 protected:
  DeviceHold(DeviceState& device, bool asks);

 private:
  DeviceState& device_;
};

/// The same for a call that submits work. Batches that wait to be sent (ballot_submit_buffers) are sent first: a call
/// that fails drops what is recorded, which is then its own alone. Before it waits for another call, or sends such
/// batches, the caller's progress function is asked (ask_interruption()).
class DeviceUse : DeviceHold {
 public:
  explicit DeviceUse(DeviceState& device);
};

using VerticesInDouble = std::shared_ptr<const std::vector<glm::dvec3>>;

/// What a mesh's caller gave, and what the next caller may ask.
struct MeshState {
  std::size_t triangles = 0, vertices = 0;
  std::vector<std::uint32_t> indices = {};  // empty: vertices in turn, or indices that lie on the device
  std::optional<Bounds> bounds = {};        // in its own space; found when somebody asks
  /// The indices on the device, of a mesh that was given them there. It goes while the device is held.
  std::shared_ptr<const Buffer<std::uint32_t>> indices_there = {};
  ShapeKind kind = ShapeKind::Triangles;
  std::vector<float> radii = {};  // these two of each vertex, where its shapes have them
  std::vector<glm::vec3> normals = {};
  std::vector<MeshAttribute> attributes = {};       // on the device, as indices_there
  glm::dvec3 origin{0};                             // of its own space, that its vertices are counted from
  double rounding = 0;                              // how far float32 has moved one of its vertices at most
  VerticesInDouble in_double = {};                  // about the origin; null: float32 holds them, or heights tell them
  std::shared_ptr<const HeightField> heights = {};  // that tell its triangles; or null

  std::size_t columns() const { return heights ? heights->columns : 0; }  // as MeshLabel has it
};

/// Edits that wait for a commit.
struct PendingEdits {
  /// Vertices in the caller's memory, or on the device.
  struct Vertices {
    const float* positions = nullptr;
    std::size_t stride = 0, count = 0;
    std::optional<DeviceVertices> there = {};
    std::vector<glm::vec3> own = {};  // what `positions` names, if the caller's are of another kind or origin
    double rounding = 0;
    VerticesInDouble in_double = {};
    std::shared_ptr<const HeightField> heights = {};  // that `own` is made of
  };
  PendingEdits(const Scene& scene, SceneNumbers& next) : edits(scene, next) {}
  /// Lets go of what meshes have on the device, which is held.
  void let_go() { meshes.clear(), there.clear(), attributes.clear(); }

  SceneEdits edits;
  std::map<std::uint32_t, MeshState> meshes;                       // that are added, or have other triangles, by number
  TrianglesOfMeshes there;                                         // of those of `meshes` that the device has made
  std::map<std::uint32_t, Vertices> vertices;                      // that move, by number
  std::map<std::uint32_t, std::vector<MeshAttribute>> attributes;  // that meshes of the scene get, by number
  std::vector<Transform> transforms;  // of all instances, if they do not lie side by side in the caller's memory
  /// Of all instances, on the device. Beside transforms no other edits of meshes and instances.
  std::shared_ptr<const RawBuffer> transforms_there = {}, masks_there = {};
};

/// The unit normals of the triangles of a scene without instances.
struct NormalTable {
  std::uint64_t generation = 0;  // of the tree that the triangles are in
  std::vector<glm::vec3> normals;
};

/// What writes columns of answers on the device, and what these are of: as many records as a call has had.
struct AnswersThere {
  AnswersThere(Context& gpu, const PlaceTable& places)
      : columns(gpu, places.prim_table()), sums(gpu, places.sum_table()) {}
  ColumnWriter columns;
  SumWriter sums;
  std::unique_ptr<ValueWriter> values;         // made on first use; none once meshes have other attributes
  std::unique_ptr<Buffer<Hit>> hits, valued;   // of traces; of those that pass through the host
  std::unique_ptr<Buffer<ProbePoint>> points;  // these of a part of the points
  std::array<std::unique_ptr<Buffer<std::uint32_t>>, FILTERS> words;
  std::unique_ptr<Buffer<Nearest>> nearest;
  std::unique_ptr<Buffer<std::uint32_t>> inside;
  std::unique_ptr<Buffer<float>> windings;
};

struct SceneState {
  ~SceneState() {
    const DeviceHold hold(*device);
    there.reset();
    world.reset();
    meshes.clear();
    if (pending) pending->let_go();
  }
  /// Takes a finished scene and the options of its engine.
  void open(Scene scene, const DeviceSceneOptions& options, const Progress& progress);

  std::shared_ptr<DeviceState> device;
  std::unique_ptr<DeviceScene> world;
  std::map<std::uint32_t, MeshState> meshes;  // by number
  IdSource ids = IdSource::Mesh;
  std::optional<PlaceTable> places;          // there with the engine
  NormalTable normals;                       // made by a call that asks for more of them than there are triangles
  std::unique_ptr<AnswersThere> there;       // made by a call for columns on the device
  std::map<std::string, UserText> includes;  // that were asked for, by what was asked
  SceneNumbers next;                         // of meshes and instances
  std::unique_ptr<PendingEdits> pending;
  UpdateMode update = UpdateMode::Auto;
  std::uint64_t refits = 0;    // since the last build
  std::string sky;             // the one in use, as a picture named it; empty: the scene's own
  std::optional<Sky> own_sky;  // the scene's, once a picture has named another
  LastError error;
};

struct BufferState;

/// Throws Refused if a buffer is of another device than the scene, or has fewer records.
void check_buffer(const BufferState& buffer, const SceneState& scene, std::uint64_t count, const char* call,
                  const char* what);

/// Writes a name for a caller, cut off if there is no room for all of it.
template <std::size_t Room>
void write_name(char (&to)[Room], const std::string& name) {
  to[name.copy(to, Room - 1)] = 0;
}

/// Builds the tree of a scene anew if it is to follow what moves by itself and has lost more time than that takes. The
/// device's mutex is held.
void keep_fit(SceneState& scene);

/// An array on a device, and its address in CUDA once somebody asked for it.
struct BufferState {
  ~BufferState() {
    const DeviceHold hold(*device);
    cuda.reset();
    array.emplace<std::monostate>();
  }
  RawBuffer& raw() {
    return *std::visit(
        [](auto& buffer) -> RawBuffer* {
          if constexpr (std::is_base_of_v<RawBuffer, std::decay_t<decltype(buffer)>>) return &buffer;
          return nullptr;
        },
        array);
  }

  std::shared_ptr<DeviceState> device;
  std::size_t records = 0, record_bytes = 0;
  std::variant<std::monostate, Buffer<Ray>, Buffer<Hit>, Buffer<ProbePoint>, Buffer<Nearest>, Buffer<float>,
               Buffer<std::uint32_t>, Buffer<glm::vec3>, Buffer<glm::vec2>, Buffer<std::uint8_t>, Buffer<Transform>,
               Buffer<std::int64_t>, Buffer<double>, Buffer<glm::vec4>>
      array;
  std::unique_ptr<CudaMemory> cuda;
  LastError error;
};

/// A user's kernel: its text, and the scenes that keep what they have made of it.
struct KernelState {
  ~KernelState();
  std::shared_ptr<DeviceState> device;
  UserText text;
  UserInputs inputs;
  std::vector<std::weak_ptr<SceneState>> scenes;  // with the device's mutex
  LastError error;
};

/// Returns the array behind a buffer of a call for `count` records on the scene's device. `what` names its records.
/// Throws Refused if the buffer holds other records, is of another device or too small.
template <class T>
Buffer<T>& array_of(BufferState& buffer, const SceneState& scene, std::uint64_t count, const char* call,
                    const char* what) {
  auto* array = std::get_if<Buffer<T>>(&buffer.array);
  if (!array) throw Refused(BALLOT_ERROR_ARGUMENT, fmt::format("{}: the buffer of {} holds other records", call, what));
  check_buffer(buffer, scene, count, call, what);
  return *array;
}

/// The same for what belongs to questions: a record of each, or one for all.
template <class T>
Buffer<T>& array_beside(BufferState& buffer, const SceneState& scene, std::uint64_t count, const char* call,
                        const char* what) {
  return array_of<T>(buffer, scene, buffer.records == 1 ? 1 : count, call, what);
}

/// The open handles. They outlive main(), so that a program may close them from any destructor.
Handles<BallotDevice, DeviceState>& devices();
Handles<BallotScene, SceneState>& scenes();
Handles<BallotBuffer, BufferState>& buffers();
Handles<BallotJob, JobState>& jobs();
Handles<BallotKernel, KernelState>& kernels();

/// Returns the state behind a handle. Throws Refused if it is closed or of another process.
std::shared_ptr<DeviceState> use(const BallotDevice* handle);
std::shared_ptr<SceneState> use(const BallotScene* handle);
std::shared_ptr<BufferState> use(const BallotBuffer* handle);
std::shared_ptr<JobState> use(const BallotJob* handle);
std::shared_ptr<KernelState> use(const BallotKernel* handle);

/// Returns the code and keeps the text of the exception that is being handled, for the thread and for a handle.
BallotStatus report(LastError* error);
/// Returns the text of the calling thread's last failed call.
const char* thread_text();
/// Returns the text of a handle's last failed call; valid until the calling thread asks again.
const char* thread_copy(const std::string& text);

/// Runs a call of the interface: exceptions become error codes.
template <class Call>
BallotStatus guarded(LastError* error, const Call& call) {
  try {
    call();
    return BALLOT_OK;
  } catch (...) {
    return report(error);
  }
}

/// Runs call(state) for an open handle; the state lives at least until it returns.
template <class Handle, class Call>
BallotStatus guarded_use(const Handle* handle, const Call& call) {
  std::shared_ptr<typename decltype(use(handle))::element_type> state;
  try {
    state = use(handle);
    call(state);
    return BALLOT_OK;
  } catch (...) {
    return report(state ? &state->error : nullptr);
  }
}

/// Throws Refused(BALLOT_ERROR_ARGUMENT) unless `pointer` is set.
void need(const void* pointer, const char* call, const char* what);

/// Throws Refused(BALLOT_ERROR_ARGUMENT).
[[noreturn]] void refuse(const std::string& text);

constexpr std::size_t kMostBytes = std::size_t{1} << 47;  // that a process can address

/// Returns the bytes from one record of a caller's array to the next: `given`, or `record` if that is 0.
/// Throws Refused, which begins with `where`, unless it is a multiple of 4 and no record overlaps the next, or if
/// `count` records reach farther than any memory.
std::size_t stride_of(std::size_t given, std::size_t record, std::size_t count, const std::string& where);

/// Returns a copy of a struct of the interface that a caller with another version filled: members that it does not know
/// are zero. Throws Refused if the size is none that any version had.
template <class T>
T read_struct(const T* given, const char* name) {
  T copy{};
  if (!given) return copy;
  if (given->size < sizeof(std::size_t) || given->size > 4096)
    throw Refused(BALLOT_ERROR_ARGUMENT,
                  fmt::format("{}: size is {}; begin with BALLOT_INIT({})", name, given->size, name));
  std::memcpy(static_cast<void*>(&copy), given, std::min(given->size, sizeof(T)));
  copy.size = sizeof(T);
  return copy;
}

/// Writes a struct of the interface, no farther than the caller's version of it goes.
template <class T>
void write_struct(T* to, const T& value, const char* name) {
  if (!to) return;
  const std::size_t size = to->size;
  if (size < sizeof(std::size_t) || size > 4096)
    throw Refused(BALLOT_ERROR_ARGUMENT, fmt::format("{}: size is {}; begin with BALLOT_INIT({})", name, size, name));
  std::memcpy(static_cast<void*>(to), &value, std::min(size, sizeof(T)));
  to->size = size;
}

/// Writes the first `room` of some structs of the interface to an array whose first element has the size of all.
template <class T>
void write_structs(T* to, std::size_t room, const std::vector<T>& values, const char* name) {
  const std::size_t stride = room ? to->size : 0;
  for (std::size_t i = 0; i < room; ++i) {
    auto* one = reinterpret_cast<T*>(reinterpret_cast<char*>(to) + i * stride);
    one->size = stride;
    write_struct(one, values[i], name);
  }
}

}  // namespace ballot::api
