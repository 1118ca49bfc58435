// The plain types of Ballot's C++ interface (ballot.h): errors, rays, hits, meshes, queries, results, views.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
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
  /// Of a kind, with a text of one line.
  Error(Code code, const std::string& text) : std::runtime_error(text), code_(code) {}
  /// Returns the kind of the failure; what() returns the text.
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

/// The names that an argument takes.
enum class Names {
  Methods = BALLOT_NAMES_METHODS,     // Query::method
  Numeric = BALLOT_NAMES_NUMERIC,     // Query::numeric
  Builders = BALLOT_NAMES_BUILDERS,   // SceneOptions::builder
  RayKinds = BALLOT_NAMES_RAY_KINDS,  // Scene::make_rays()
  Shadings = BALLOT_NAMES_SHADINGS,   // Picture::shading
};
/// Returns the names that an argument takes.
inline std::vector<std::string> names(Names which) {
  std::vector<std::string> list;
  while (const char* name = ballot_name(BallotNames(which), list.size())) list.emplace_back(name);
  return list;
}

/// A ray, 32 bytes: float origin[3], t_min, dir[3], t_max. Hits are sought at origin + t * dir, t in [t_min, t_max]. An
/// infinite t_max is no bound. A ray is dead, and reported as a miss, if t_max <= t_min, if a component is NaN or
/// infinite, or if dir is zero or denormal.
using Ray = BallotRay;

/// Numbers of questions as they lie in the caller's memory: one of each, or three, a point or direction. double is
/// rounded to the nearest float, beyond its range to infinity.
struct Column {
  /// Bytes from one question to the next along each axis.
  using Strides = std::array<std::ptrdiff_t, BALLOT_AXES>;

  Column() = default;  // the default of what it is for
  /// One for all questions.
  Column(float number) : kind(Kind::Own), own{number}, numbers(1) {}
  /// One point or direction for all questions.
  Column(float x, float y, float z) : kind(Kind::Own), own{x, y, z}, numbers(3) {}
  /// Numbers side by side, as of a vector, an array or a span. Those of one question alone are one for all.
  template <std::convertible_to<std::span<const float>> Numbers>
  Column(const Numbers& side_by_side) : Column(std::span<const float>(side_by_side), BALLOT_FLOAT32) {}
  /// The same for double.
  template <std::convertible_to<std::span<const double>> Numbers>
  Column(const Numbers& side_by_side) : Column(std::span<const double>(side_by_side), BALLOT_FLOAT64) {}
  /// At any stride: bytes from one question to the next along each axis of the view's shape, 0: one for all; `gap`:
  /// bytes between a number and the next of its three.
  Column(const float* first, const Strides& bytes, std::ptrdiff_t gap_bytes = 0)
      : kind(Kind::Strided), data(first), strides(bytes), gap(gap_bytes) {}
  /// The same for double.
  Column(const double* first, const Strides& bytes, std::ptrdiff_t gap_bytes = 0)
      : kind(Kind::Strided), data(first), strides(bytes), gap(gap_bytes), type(BALLOT_FLOAT64) {}

  /// Where the numbers are: nowhere, in `own`, or at `data`.
  enum class Kind { None, Own, SideBySide, Strided };
  Kind kind = Kind::None;               // as it was made
  const void* data = nullptr;           // the first number
  std::array<float, 3> own = {};        // numbers that stand for all questions
  std::size_t numbers = 0;              // of `own`, or side by side
  Strides strides = {};                 // as they were given
  std::ptrdiff_t gap = 0;               // bytes between the three numbers of a question; 0: side by side
  std::uint32_t type = BALLOT_FLOAT32;  // or BALLOT_FLOAT64

 private:
  template <class T>
  Column(std::span<const T> all, std::uint32_t number)
      : kind(Kind::SideBySide), data(all.data()), numbers(all.size()), type(number) {}
};

/// The lengths of the axes along which questions lie: {n}, or {h, w} for h rows of w. Without one there are as many
/// questions as the longest column with its numbers side by side has.
using Shape = std::array<std::size_t, BALLOT_AXES>;

/// Rays by their columns, as {.origins = {0, 0, 9}, .directions = all, .t_max = 2}.
struct RayView {
  Column origins, directions;     // three numbers each
  Column t_min = {}, t_max = {};  // 0, and no end
  Shape shape = {};               // empty: that of the columns
};

/// Points by their column, where that has strides.
struct PointView {
  Column at;         // three numbers each
  Shape shape = {};  // empty: that of the column
};

/// A hit, 16 bytes: float t, uint32 prim, float u, v. On a miss prim is kMiss, t infinity, and u = v = 0. u and v are
/// the barycentric coordinates of the triangle's vertices 1 and 2. prim counts triangles through all meshes of the
/// scene, or through all its instances.
using Hit = BallotHit;
/// The number of no triangle, mesh or instance.
inline constexpr std::uint32_t kMiss = BALLOT_MISS;

/// A device, as devices() lists it.
struct DeviceInfo {
  std::string name, driver;         // such as "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"
  std::string refusal;              // why Ballot cannot use it; empty: it can
  bool is_cpu = false;              // a CPU device, such as lavapipe
  std::uint32_t subgroup_size = 0;  // lanes
  bool exports = false;             // its arrays can be shared with CUDA and others
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

/// Where meshes lie in the world, in the caller's memory, read before the call returns: a 3 x 4 matrix for each
/// instance, row by row. A point p of the mesh lies at m[0..2] . p + m[3], and so on for y and z. Reflections
/// (negative determinants) turn the triangles round, as moving the vertices of a flat scene does.
struct Instances {
  std::span<const float> transforms;           // 12 floats each, or as `stride` says
  std::span<const std::uint32_t> meshes = {};  // number of each instance's mesh; empty: 0
  std::size_t stride = 0;                      // bytes from one matrix to the next; 0: 48. Of 4 x 4 matrices: 64
  std::span<const std::uint32_t> masks = {};   // of each, as Scene::set_masks() says; empty: all bits
};

/// How a scene is made.
struct SceneOptions {
  /// How the tree is built: "best", "balanced", "fast", "device" or "auto" (`ballot methods` says what they are).
  /// Empty: of meshes "auto", which is "device" on a GPU and "balanced" on a CPU unless expected_rays says otherwise;
  /// of files "best", the quickest to trace.
  std::string builder = {};
  std::uint32_t max_leaf = 6;  // most triangles of a leaf, 1 to 6
  float split_budget = 0.5f;   // of "best": share of references that spatial splits may add, 0 to 16
  bool cache = false;          // keep the tree on disk, in $XDG_CACHE_HOME/ballot
  /// How a tree follows Scene::set_vertices(). "refit" keeps its shape and moves its boxes: the quickest update, but
  /// traces become slower as triangles move apart. "rebuild" builds it anew. "auto" refits, and rebuilds once queries
  /// have lost more time than a rebuild costs over a refit. If a triangle gains or loses its area, it is always
  /// rebuilt.
  std::string update = "auto";
  double expected_rays = 0;    // hint for builder "auto": rays that will be traced in all; 0: unknown
  bool allow_outside = false;  // a scene file may name buffers, images and materials outside of its folder
  /// Meshes that a glTF file uses several times. "keep": each is there once, as are meshes that an animation moves as a
  /// whole. "copy": each use is a moved copy. "auto": kept where that saves 4 million triangles and half of the
  /// scene's, or where copies would not fit into memory.
  std::string instances = "auto";
  /// Which meshes lie in one tree. "auto": those that the scene is made with, unless instances are given or a file
  /// keeps them once. "merge": those that are placed once, by the identity. "separate": none, so that each moves by
  /// itself.
  std::string layout = "auto";
  /// What Results::mesh_ids holds for a scene file: "mesh" (of glTF, or the group of OBJ), "node" (of glTF) or
  /// "material", by the numbers of the file. Of scenes made of meshes: Mesh::id.
  std::string ids = {};  // empty: "mesh"
  /// Called now and then with the share of the tree that is built, by any thread, one at a time. Returning false ends
  /// the call with Error(Interrupted). Must not throw.
  std::function<bool(double done)> progress = {};
};

/// How to find hits.
struct Query {
  bool any = false;                               // some hit, for visibility and shadows; false: the nearest
  std::string method = "auto";                    // `ballot methods` lists them
  std::string numeric = "watertight";             // "watertight", "exact", "plain", "fast"
  std::map<std::string, std::string> knobs = {};  // settings of the method, such as {"vote", "count"}
  std::string ray_class = {};  // for method auto: a ray kind, or coherent, mixed, incoherent; empty: it looks
  /// Called now and then with the share done. Returning false ends the call with Error(Interrupted); the outputs are
  /// then unspecified. Must not throw.
  std::function<bool(double done)> progress = {};
};

/// Where results go: arrays of one entry for each ray. Null pointers are not written. On a miss t is infinity, numbers
/// are kMiss, and the others are 0.
struct Results {
  Hit* hits = nullptr;                 // whole hits
  float* t = nullptr;                  // distance, in multiples of the direction
  std::uint32_t* prims = nullptr;      // number of the triangle within its mesh, unlike Hit::prim
  std::uint32_t* mesh_ids = nullptr;   // Mesh::id, or as SceneOptions::ids says
  float* uvs = nullptr;                // two floats
  float* normals = nullptr;            // three floats: unit normal, by the right-hand rule over the vertices
  std::uint8_t* occluded = nullptr;    // 1: hit
  std::uint32_t* instances = nullptr;  // number of the instance
};

/// What a call took.
struct Times {
  double seconds = 0;      // wall time of the call
  double device_ms = 0;    // of the traversal on the device
  std::uint64_t hits = 0;  // rays that hit
};

/// Where the answers for points go: arrays with an entry for each point; those that are null are not written. Without a
/// triangle within the limit distances are infinite, numbers kMiss, and the rest 0.
struct NearestResults {
  float* distances = nullptr;         // from the nearest triangle, of those as near the one with the smallest number
  float* points = nullptr;            // x y z of the nearest point
  std::uint32_t* prims = nullptr;     // number of its triangle within its mesh
  std::uint32_t* mesh_ids = nullptr;  // as Results::mesh_ids
  float* uvs = nullptr;               // u v: two floats
  float* normals = nullptr;           // x y z: unit normal of the triangle
  float* signed_distances = nullptr;  // negative inside; of a closed mesh, or by PointQuery::sign
  std::uint8_t* inside = nullptr;     // 1: inside; the same
};

/// What decides the sign of a distance, and what is inside. Parity: the number of crossings of one ray; closed meshes
/// alone. Pseudonormal: the side of the nearest triangle, at its corners and edges by the angle-weighted sum of the
/// normals there; meshes with open edges too, if their triangles are wound alike.
enum class Sign : std::uint32_t { Parity = BALLOT_SIGN_PARITY, Pseudonormal = BALLOT_SIGN_PSEUDONORMAL };

/// A point on the device, 16 bytes: float at[3], limit.
using Point = BallotPoint;
/// Its answer, 32 bytes: float at[3], distance, uint32 prim, float u, v, and a spare word.
using NearestPoint = BallotNearestPoint;

/// How to answer points.
struct PointQuery {
  /// Triangles farther away are not looked for: one above 0 for all, or of each point. Arrays on the device have their
  /// own.
  Column limit = {};           // no limit
  bool assume_closed = false;  // go on with a mesh that `sign` refuses; answers near its faults are then arbitrary
  std::string numeric = "watertight";              // or "exact": decided as by exact arithmetic
  Sign sign = Sign::Parity;                        // what decides what is inside
  std::function<bool(double done)> progress = {};  // as Query::progress; told no share of arrays on the device
};

/// The triangles that are left out: those that a ray meets from behind or from the front. The front is the side from
/// which the vertices run counter-clockwise.
enum class Cull : std::uint32_t { None = BALLOT_CULL_NONE, Back = BALLOT_CULL_BACK, Front = BALLOT_CULL_FRONT };

/// How to find crossings.
struct CrossingQuery {
  std::uint32_t most = 0;              // list the first so many of each ray; 0: all
  std::string numeric = "watertight";  // or "exact": numbers and order of exact arithmetic; of instances by t
  Cull cull = Cull::None;              // which triangles are left out
  std::span<const std::uint32_t> ray_masks = {};  // of each ray, as Scene::set_masks() says; empty: all bits
  bool alpha = false;  // leave out a triangle where its surface stops nothing: BallotLists::alpha
  std::function<bool(double done)> progress = {};  // as Query::progress
};

/// All crossings of rays: those of ray i are hits[counts[0] + ... + counts[i - 1]] and the counts[i] - 1 behind it.
struct Crossings {
  std::vector<std::int64_t> counts;  // of each ray
  std::vector<Hit> hits;             // of each ray in order of t, at equal t in order of prim
};

/// What a scene holds, and its tree.
struct SceneInfo {
  std::uint64_t triangles = 0, degenerate = 0, meshes = 0, views = 0;  // degenerate: triangles without area
  float lo[3] = {}, hi[3] = {};                                        // the bounds; zero if the scene is empty
  std::uint64_t nodes = 0, leaves = 0, depth = 0;  // of the tree; of all trees, and the deepest one's depth
  double sah = 0;            // expected cost of a random ray that meets the bounds; 0 of several trees
  double build_seconds = 0;  // of the last build of the tree; of all trees if there are several
  std::uint64_t instances = 0, instance_triangles = 0;  // triangles counted through all instances
  double top_seconds = 0;                               // of the last build or refit of the tree over the instances
  double decay = 1;           // sah divided by that at the last build: traces are slower by about this factor
  double update_seconds = 0;  // of the last commit or change of time
  std::uint64_t refits = 0;   // such since the last build
  std::uint64_t trees = 0;    // below the tree over the instances; 0: one tree over all, in the world
};

/// A mesh of a scene: triangles `first` to first + triangles - 1 of Scene::triangles().
struct MeshInfo {
  std::string name = {};                   // as in the file, else "mesh N", or "scene" of one; cut off after 255 bytes
  std::uint32_t id = 0;                    // Mesh::id, or the mesh or group in the file
  std::uint64_t first = 0, triangles = 0;  // the first one's number, and how many
  float lo[3] = {}, hi[3] = {};            // its bounds, in its own space; zero if it has no triangle
  std::uint32_t mesh = 0;                  // its number
};

/// An instance of a mesh: Hit::prim is `first` to first + triangles - 1.
struct InstanceInfo {
  std::string name = {};                   // of its node in the file, else of its mesh; cut off after 255 bytes
  std::uint32_t id = 0;                    // its node in the file; else its own number
  std::uint32_t mesh = 0;                  // its number
  std::uint64_t first = 0, triangles = 0;  // the first one's number, and how many
  float transform[12] = {};                // as Instances::transforms
  float lo[3] = {}, hi[3] = {};            // a box in the world that holds it; zero if it has no triangle
  std::uint32_t instance = 0;              // its number
  std::uint32_t mask = 0;                  // as Scene::set_masks() says
};

/// An animation of a scene file.
struct AnimationInfo {
  std::string name = {};       // as in the file
  double seconds = 0;          // its times are 0 to this
  std::uint64_t channels = 0;  // what it moves; 0: nothing
};

/// A camera, as in glTF: it looks along -z of its frame, with +y up.
struct View {
  std::string name = {};  // a view of the scene; empty: the members below, or the scene's first view if eye is target
  double eye[3] = {0, 0, 0}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};  // where it is, what it looks at, what is up
  double yfov = 0;                                                      // full vertical angle; 0: pi / 3
  double ymag = 0;  // above 0: orthographic, half the height of the view
};

/// What to render.
struct Picture {
  std::uint32_t width = 512, height = 512;  // pixels, 1 to 16384
  std::uint32_t samples = 1;                // of each pixel, 1 to 65536
  std::string shading = "eyelight";         // or "normals", "ao", "whitted", "path"
  std::string sky = {};                     // a sky as `ballot render --sky` takes it; empty: the scene's own
  std::int32_t bounces = 0;                 // last path depth, 1 to 64; 0: the shading's own
  std::uint32_t seed = 0;                   // of the random numbers
};

}  // namespace v1
}  // namespace ballot
