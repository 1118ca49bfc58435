// The C++ interface of Ballot: fast, correct ray queries by Vulkan compute, on any Vulkan 1.2 device, such as a GPU
// without ray tracing hardware or, through Mesa lavapipe, a plain CPU. C++20; needs the standard library alone.
//
//   ballot::Device device;                                    // the best GPU, else a CPU device
//   ballot::Scene scene(device, {{.positions = vertices, .indices = triangles}});
//   std::vector<ballot::Hit> hits(rays.size());
//   scene.trace(rays, hits);                                  // nearest hits, watertight
//   std::vector<std::uint8_t> blocked(rays.size());
//   scene.trace(rays, {.occluded = blocked.data()}, {.any = true});
//
// Errors    Every failure throws ballot::Error: a code, and a text of one line that says what, where, found, expected and
//           what to do. A failed call writes nothing to its outputs and leaves scenes as they were.
// Threads   Every function may be called from any thread. Calls on one device, its scenes and its arrays run one after
//           another; devices are independent of each other. A device does not survive fork().
// Lifetime  Scenes, arrays and jobs keep their device open, so objects may be destroyed in any order.
// Units     Lengths in scene units, angles in radians. t counts multiples of a ray's direction, which need not be of unit
//           length.
// Numerics  "watertight" (the default): no ray slips between triangles that share an edge; hits are equal bit for bit for
//           every method on one device. "exact": every answer is that of arithmetic without rounding, on every device.
//           "plain" and "fast": the usual float32, without promises. The manual, engine/README.md, says which to choose.
//
// Link with find_package(Ballot 1 CONFIG) and Ballot::ballot, or with pkg-config ballot. The layer is header-only, over
// the C interface of ballot_c.h, so that the library's binary interface does not depend on the compiler.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "ballot_c.h"

namespace ballot {
inline namespace v1 {

/// The kind of a failure.
enum class Code {
  Work = BALLOT_ERROR_WORK,                // a file, the driver or the device failed
  Argument = BALLOT_ERROR_ARGUMENT,        // an argument is out of range, or arguments disagree
  Device = BALLOT_ERROR_DEVICE,            // there is no usable Vulkan device
  Memory = BALLOT_ERROR_MEMORY,            // the host ran out of memory
  Closed = BALLOT_ERROR_CLOSED,            // the object was moved from
  Forked = BALLOT_ERROR_FORKED,            // the object was made before fork()
  Interrupted = BALLOT_ERROR_INTERRUPTED,  // the progress function asked to stop
};

/// The only exception that Ballot throws.
class Error : public std::runtime_error {
 public:
  Error(Code code, const std::string& text) : std::runtime_error(text), code_(code) {}
  Code code() const { return code_; }

 private:
  Code code_;
};

/// Throws Error unless `status` is BALLOT_OK.
inline void check(BallotStatus status) {
  if (status != BALLOT_OK) throw Error(Code(status), ballot_last_error());
}

/// Returns the version of the library that is loaded, such as "1.0.0".
inline std::string version() { return ballot_version(); }

/// A ray, 32 bytes: float origin[3], t_min, dir[3], t_max. Hits are sought at origin + t * dir, t in [t_min, t_max]. An
/// infinite t_max is no bound. A ray is dead, and reported as a miss, if t_max <= t_min, if a component is NaN or infinite,
/// or if dir is zero or denormal.
using Ray = BallotRay;

/// A hit, 16 bytes: float t, uint32 prim, float u, v. On a miss prim is kMiss, t the ray's t_max (0 for a dead ray), and
/// u = v = 0. u and v weigh vertices 1 and 2 of the triangle. prim numbers the triangles of the scene through its meshes.
using Hit = BallotHit;
inline constexpr std::uint32_t kMiss = BALLOT_MISS;

/// A device, as devices() lists it.
struct DeviceInfo {
  std::string name, driver;
  std::string refusal;  // why Ballot cannot use it; empty: it can
  bool is_cpu = false;
  std::uint32_t subgroup_size = 0;
  bool exports = false;  // its arrays can be shared with CUDA and others
};

namespace detail {
inline DeviceInfo info_of(const BallotDeviceInfo& i) {
  return {i.name, i.driver, i.refusal, i.is_cpu != 0, i.subgroup_size, i.exports != 0};
}

/// Owns a handle of the C interface.
template <class T, void (*kClose)(T*)>
class Handle {
 public:
  Handle() = default;
  explicit Handle(T* handle) : handle_(handle) {}
  ~Handle() { kClose(handle_); }
  Handle(Handle&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  T* get() const { return handle_; }

 private:
  T* handle_ = nullptr;
};
}  // namespace detail

/// Returns the Vulkan devices of this machine, usable or not. Throws Error(Device) if there is no driver.
inline std::vector<DeviceInfo> devices() {
  std::size_t count = 0;
  check(ballot_devices(nullptr, 0, &count));
  std::vector<BallotDeviceInfo> infos(count, BALLOT_INIT(BallotDeviceInfo));
  check(ballot_devices(infos.data(), infos.size(), &count));
  std::vector<DeviceInfo> list;
  for (const BallotDeviceInfo& i : infos) list.push_back(detail::info_of(i));
  return list;
}

/// A device that is open.
class Device {
 public:
  /// `name`: an index, part of a name, "gpu" or "cpu"; empty: the best GPU, else a CPU device. `validate` turns on Vulkan
  /// validation, for tests. Throws Error(Device), which says what each device lacks, if none is usable.
  explicit Device(const std::string& name = {}, bool validate = false) {
    auto options = BALLOT_INIT(BallotDeviceOptions);
    options.name = name.c_str();
    options.validate = validate;
    BallotDevice* device = nullptr;
    check(ballot_device_open(&options, &device));
    handle_ = Owner(device);
  }
  DeviceInfo info() const {
    auto info = BALLOT_INIT(BallotDeviceInfo);
    check(ballot_device_info(handle_.get(), &info));
    return detail::info_of(info);
  }
  BallotDevice* handle() const { return handle_.get(); }

 private:
  using Owner = detail::Handle<BallotDevice, ballot_device_close>;
  Owner handle_;
};

/// A triangle mesh in the caller's memory, read before the scene's constructor returns.
struct Mesh {
  std::span<const float> positions;               // x y z of each vertex; finite, at most 1e12
  std::span<const std::uint32_t> indices = {};    // three for each triangle
  std::span<const std::uint16_t> indices16 = {};  // the same as 16 bits; without either: vertices 0 1 2, 3 4 5, ...
  std::uint32_t id = 0;                           // any number; Results::mesh_ids reports it
  std::span<const float> normals = {};            // unit normal of each vertex, for pictures; empty: flat
  std::size_t stride = 0;                         // bytes from one vertex to the next; 0: 12
};

struct SceneOptions {
  std::uint32_t max_leaf = 6;  // most triangles of a leaf, 1 to 6
  float split_budget = 0.5f;   // share of references that spatial splits may add, 0 to 16
  bool cache = false;          // keep the tree and the choices of method auto on disk, in $XDG_CACHE_HOME/ballot
};

/// How to find hits.
struct Query {
  bool any = false;                    // some hit, for visibility and shadows; false: the nearest
  std::string method = "auto";         // `ballot methods` lists them
  std::string numeric = "watertight";  // "watertight", "exact", "plain", "fast"
  std::map<std::string, std::string> knobs = {};
  std::string ray_class = {};  // a name for rays that are alike, for method auto; empty: it looks at them
  /// Called now and then with the share done. Returning false ends the call with Error(Interrupted); the outputs are then
  /// unspecified. Must not throw.
  std::function<bool(double done)> progress = {};
};

/// Where results go: arrays of one entry for each ray. Null pointers are not written. On a miss t is infinity, numbers are
/// kMiss, and the others are 0.
struct Results {
  Hit* hits = nullptr;
  float* t = nullptr;
  std::uint32_t* prims = nullptr;     // number of the triangle within its mesh
  std::uint32_t* mesh_ids = nullptr;  // Mesh::id
  float* uvs = nullptr;               // two floats
  float* normals = nullptr;           // three floats: unit normal, by the right-hand rule over the vertices
  std::uint8_t* occluded = nullptr;   // 1: hit
};

struct Times {
  double seconds = 0;      // wall time of the call
  double device_ms = 0;    // of the traversal on the device
  std::uint64_t hits = 0;  // rays that hit
};

namespace detail {
/// A query in the form of the C interface. Refers to the query.
class QueryArgument {
 public:
  explicit QueryArgument(const Query& q) : c_(BALLOT_INIT(BallotQuery)) {
    c_.any = q.any;
    c_.method = q.method.c_str();
    c_.numeric = q.numeric.c_str();
    for (const auto& [name, value] : q.knobs) knobs_.push_back({name.c_str(), value.c_str()});
    c_.knobs = knobs_.data();
    c_.knob_count = knobs_.size();
    if (!q.ray_class.empty()) c_.ray_class = q.ray_class.c_str();
    if (!q.progress) return;
    c_.user = const_cast<void*>(static_cast<const void*>(&q.progress));
    c_.progress = [](void* user, double done) {
      return int(!(*static_cast<const std::function<bool(double)>*>(user))(done));
    };
  }
  QueryArgument(const QueryArgument&) = delete;
  QueryArgument& operator=(const QueryArgument&) = delete;
  const BallotQuery* c() const { return &c_; }

 private:
  std::vector<BallotKnob> knobs_;
  BallotQuery c_;
};

inline BallotHits hits_of(const Results& r) {
  auto h = BALLOT_INIT(BallotHits);
  h.hits = r.hits, h.t = r.t, h.prims = r.prims, h.mesh_ids = r.mesh_ids, h.uvs = r.uvs, h.normals = r.normals;
  h.occluded = r.occluded;
  return h;
}

inline BallotRays rays_of(std::span<const Ray> rays) {
  auto r = BALLOT_INIT(BallotRays);
  r.data = reinterpret_cast<const float*>(rays.data());
  r.count = rays.size();
  return r;
}

inline Times times_of(const BallotTimes& t) { return {t.seconds, t.device_ms, t.hits}; }
}  // namespace detail

/// A trace in the background. The destructor waits for it. Rays and results must stay where they are until then.
class Job {
 public:
  explicit Job(BallotJob* job) : handle_(job) {}
  /// Waits for the end. Throws the Error that the trace would have thrown.
  Times wait() {
    auto times = BALLOT_INIT(BallotTimes);
    check(ballot_job_wait(handle_.get(), &times));
    return detail::times_of(times);
  }
  /// Returns true if the trace has ended; wait() then returns at once.
  bool poll() const { return ballot_job_poll(handle_.get()) != BALLOT_NOT_READY; }

 private:
  detail::Handle<BallotJob, ballot_job_destroy> handle_;
};

/// An array of Ray or Hit on a device.
template <class T>
class Array {
  static_assert(std::is_same_v<T, Ray> || std::is_same_v<T, Hit>);

 public:
  /// `exported`: CUDA and others can use the memory. Throws Error(Work) if the device has no room or cannot export.
  Array(const Device& device, std::size_t count, bool exported = false) : count_(count) {
    auto options = BALLOT_INIT(BallotBufferOptions);
    options.exported = exported;
    BallotBuffer* buffer = nullptr;
    check(ballot_buffer_create(device.handle(), std::is_same_v<T, Ray> ? BALLOT_RECORD_RAY : BALLOT_RECORD_HIT, count,
                               &options, &buffer));
    handle_ = Owner(buffer);
  }
  std::size_t size() const { return count_; }
  /// Copy records to and from the host, beginning with number `first`.
  void write(std::span<const T> records, std::size_t first = 0) {
    check(ballot_buffer_write(handle_.get(), first, records.data(), records.size()));
  }
  void read(std::span<T> records, std::size_t first = 0) const {
    check(ballot_buffer_read(handle_.get(), first, records.data(), records.size()));
  }
  /// Returns the address in CUDA's primary context of the same GPU, valid as long as this array. Calls of Ballot wait for
  /// the device before they return; wait for your own stream before a call that uses the array.
  std::uint64_t cuda_address() const {
    std::uint64_t address = 0;
    int device = 0;
    check(ballot_buffer_cuda(handle_.get(), &address, &device));
    return address;
  }
  /// Returns a new file descriptor of the memory, which the caller owns, and its size in bytes.
  std::pair<int, std::uint64_t> fd() const {
    std::pair<int, std::uint64_t> result{-1, 0};
    check(ballot_buffer_fd(handle_.get(), &result.first, &result.second));
    return result;
  }
  BallotBuffer* handle() const { return handle_.get(); }

 private:
  using Owner = detail::Handle<BallotBuffer, ballot_buffer_destroy>;
  std::size_t count_;
  Owner handle_;
};

struct SceneInfo {
  std::uint64_t triangles = 0, degenerate = 0, meshes = 0, views = 0;  // degenerate: triangles without area
  float lo[3] = {}, hi[3] = {};                                        // the bounds; zero if the scene is empty
  std::uint64_t nodes = 0, leaves = 0, depth = 0;
  double sah = 0, build_seconds = 0;
};

/// A camera, as in glTF: it looks along -z of its frame, with +y up.
struct View {
  std::string name = {};  // a view of the scene; empty: the members below, or the scene's first view if eye is target
  double eye[3] = {0, 0, 0}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};
  double yfov = 0;  // full vertical angle; 0: pi / 3
  double ymag = 0;  // above 0: orthographic, half the height of the view
};

struct Picture {
  std::uint32_t width = 512, height = 512;  // pixels, 1 to 16384
  std::uint32_t samples = 1;                // of each pixel, 1 to 65536
  std::string shading = "eyelight";         // or "normals", "ao", "whitted", "path"
  std::string sky = {};                     // "none", "gradient", "r,g,b"; empty: the scene's own
  std::int32_t bounces = 0;                 // last path depth, 1 to 64; 0: the shading's own
  std::uint32_t seed = 0;
};

/// A scene on a device.
class Scene {
 public:
  /// Makes a scene of meshes. Triangles are numbered through the meshes in their order. Triangles without area keep their
  /// number and are never hit. Throws Error(Argument), which names mesh and vertex or index, if a number is not finite, an
  /// index is out of range, a mesh is empty, or there are more than 2^31 - 1 triangles.
  Scene(const Device& device, std::span<const Mesh> meshes, const SceneOptions& options = {}) {
    std::vector<BallotMesh> list;
    for (const Mesh& m : meshes) list.push_back(mesh_of(m));
    const BallotSceneOptions o = options_of(options);
    BallotScene* scene = nullptr;
    check(ballot_scene_create(device.handle(), list.data(), list.size(), &o, &scene));
    handle_ = Owner(scene);
  }
  Scene(const Device& device, std::initializer_list<Mesh> meshes, const SceneOptions& options = {})
      : Scene(device, std::span(meshes.begin(), meshes.size()), options) {}

  /// Loads a glTF 2.0 (.gltf, .glb) or OBJ file: one mesh with id 0, with the file's cameras and materials. Throws
  /// Error(Work), which names file and place, if the file is wrong.
  static Scene load(const Device& device, const std::string& path, const SceneOptions& options = {.cache = true}) {
    const BallotSceneOptions o = options_of(options);
    BallotScene* scene = nullptr;
    check(ballot_scene_load(device.handle(), path.c_str(), &o, &scene));
    return Scene(scene);
  }

  /// Moves the vertices of a mesh: as many positions as it was made with. Later traces find the moved triangles.
  void update(std::size_t mesh, std::span<const float> positions, std::size_t stride = 0) {
    check(ballot_scene_update(handle_.get(), mesh, positions.data(), vertices(positions, stride), stride));
  }

  /// Traces rays and returns when the results are written. Neighbouring rays share a subgroup: order them for coherence.
  Times trace(std::span<const Ray> rays, const Results& results, const Query& query = {}) const {
    const detail::QueryArgument q(query);
    const BallotRays r = detail::rays_of(rays);
    const BallotHits h = detail::hits_of(results);
    auto times = BALLOT_INIT(BallotTimes);
    check(ballot_trace(handle_.get(), &r, &h, q.c(), &times));
    return detail::times_of(times);
  }
  /// The same; `hits` must be as many as the rays.
  Times trace(std::span<const Ray> rays, std::span<Hit> hits, const Query& query = {}) const {
    if (rays.size() != hits.size())
      throw Error(Code::Argument, "trace: " + std::to_string(rays.size()) + " rays, but room for " +
                                      std::to_string(hits.size()) + " hits");
    return trace(rays, Results{.hits = hits.data()}, query);
  }
  /// The same for arrays on the device: the first `count` rays.
  Times trace(const Array<Ray>& rays, Array<Hit>& hits, std::size_t count, const Query& query = {}) const {
    const detail::QueryArgument q(query);
    auto times = BALLOT_INIT(BallotTimes);
    check(ballot_trace_buffers(handle_.get(), rays.handle(), hits.handle(), count, q.c(), &times));
    return detail::times_of(times);
  }

  /// Begins a trace in the background. Jobs of a device run in their order. query.progress must outlive the job.
  Job submit(std::span<const Ray> rays, const Results& results, const Query& query = {}) const {
    const detail::QueryArgument q(query);
    const BallotRays r = detail::rays_of(rays);
    const BallotHits h = detail::hits_of(results);
    BallotJob* job = nullptr;
    check(ballot_submit(handle_.get(), &r, &h, q.c(), &job));
    return Job(job);
  }

  /// The same for arrays on the device, so that one batch follows another without a gap. Two jobs are on their way to the
  /// device at once; those behind them are sent together by a later call, poll() or wait(). Keep scene and arrays as they
  /// are until the job has ended.
  Job submit(const Array<Ray>& rays, Array<Hit>& hits, std::size_t count, const Query& query = {}) const {
    const detail::QueryArgument q(query);
    BallotJob* job = nullptr;
    check(ballot_submit_buffers(handle_.get(), rays.handle(), hits.handle(), count, q.c(), &job));
    return Job(job);
  }

  SceneInfo info() const {
    auto i = BALLOT_INIT(BallotSceneInfo);
    check(ballot_scene_info(handle_.get(), &i));
    SceneInfo info{i.triangles, i.degenerate, i.meshes, i.views,        {}, {}, i.nodes,
                   i.leaves,    i.depth,      i.sah,    i.build_seconds};
    for (int axis = 0; axis < 3; ++axis) info.lo[axis] = i.lo[axis], info.hi[axis] = i.hi[axis];
    return info;
  }

  /// Returns nine floats for each triangle: x y z of its vertices.
  std::vector<float> triangles() const {
    std::vector<float> all(9 * info().triangles);
    if (!all.empty()) check(ballot_scene_triangles(handle_.get(), all.data()));
    return all;
  }

  /// Makes the rays of a kind (`ballot methods`: "primary", "shadow", "ao", ...) for a view.
  std::vector<Ray> make_rays(const View& view, const std::string& kind, std::uint32_t width,
                             std::uint32_t height) const {
    const BallotView v = view_of(view);
    std::vector<Ray> rays(std::size_t{width} * height);
    std::size_t count = 0;
    check(ballot_make_rays(handle_.get(), &v, kind.c_str(), width, height, rays.data(), rays.size(), &count));
    if (count > rays.size()) {  // kinds with several rays a pixel
      rays.resize(count);
      check(ballot_make_rays(handle_.get(), &v, kind.c_str(), width, height, rays.data(), rays.size(), &count));
    }
    rays.resize(count);
    return rays;
  }

  /// Renders a view: width * height * 4 floats, linear Rec.709 and coverage, rows from the top.
  std::vector<float> render(const View& view, const Picture& picture, const Query& query = {}) const {
    std::vector<float> rgba(std::size_t{4} * picture.width * picture.height);
    const BallotView v = view_of(view);
    auto p = BALLOT_INIT(BallotPicture);
    p.width = picture.width, p.height = picture.height, p.samples = picture.samples;
    p.shading = picture.shading.c_str(), p.bounces = picture.bounces, p.seed = picture.seed;
    if (!picture.sky.empty()) p.sky = picture.sky.c_str();
    p.rgba = rgba.data();
    const detail::QueryArgument q(query);
    check(ballot_render(handle_.get(), &v, &p, q.c(), nullptr));
    return rgba;
  }

  BallotScene* handle() const { return handle_.get(); }

 private:
  using Owner = detail::Handle<BallotScene, ballot_scene_destroy>;
  explicit Scene(BallotScene* scene) : handle_(scene) {}

  static std::size_t vertices(std::span<const float> positions, std::size_t stride) {
    if (stride == 0) stride = 3 * sizeof(float);
    const std::size_t bytes = positions.size_bytes();
    return bytes < 3 * sizeof(float) ? 0 : (bytes - 3 * sizeof(float)) / stride + 1;
  }
  static BallotMesh mesh_of(const Mesh& m) {
    auto mesh = BALLOT_INIT(BallotMesh);
    mesh.positions = m.positions.data();
    mesh.vertex_count = vertices(m.positions, m.stride);
    mesh.position_stride = m.stride;
    if (!m.indices.empty()) {
      mesh.indices = m.indices.data(), mesh.index_count = m.indices.size(), mesh.index_type = BALLOT_INDEX_U32;
    } else if (!m.indices16.empty()) {
      mesh.indices = m.indices16.data(), mesh.index_count = m.indices16.size(), mesh.index_type = BALLOT_INDEX_U16;
    }
    mesh.id = m.id;
    if (!m.normals.empty()) mesh.normals = m.normals.data();
    return mesh;
  }
  static BallotSceneOptions options_of(const SceneOptions& options) {
    auto o = BALLOT_INIT(BallotSceneOptions);
    o.max_leaf = options.max_leaf;
    o.split_budget = options.split_budget > 0 ? options.split_budget : -1;
    o.cache = options.cache;
    return o;
  }
  static BallotView view_of(const View& view) {
    auto v = BALLOT_INIT(BallotView);
    if (!view.name.empty()) v.name = view.name.c_str();
    for (int axis = 0; axis < 3; ++axis)
      v.eye[axis] = view.eye[axis], v.target[axis] = view.target[axis], v.up[axis] = view.up[axis];
    v.yfov = view.yfov, v.ymag = view.ymag;
    return v;
  }

  Owner handle_;
};

}  // namespace v1
}  // namespace ballot
