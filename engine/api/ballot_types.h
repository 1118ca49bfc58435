// The types of Ballot's C++ interface (ballot.h): those of the C interface with its defaults, errors, and views of the
// caller's memory.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "ballot_c.h"

namespace ballot {
inline namespace v1 {

// Structs of the C interface: their comments there say what the members are. Those that callers fill are written as
// {.any = 1, .method = "packet"}; what is left out has its default. What they refer to must live until the call
// returns.
using AnimationInfo = BallotAnimationInfo;  ///< an animation of a scene file
using Attribute = BallotAttribute;          ///< numbers of a mesh beside its geometry
using AttributeInfo = BallotAttributeInfo;  ///< an attribute of a mesh
using DeviceInfo = BallotDeviceInfo;        ///< a device, as devices() lists it
using Hit = BallotHit;                      ///< a hit, 16 bytes
using InputInfo = BallotInputInfo;          ///< an array or number of a kernel
using InstanceInfo = BallotInstanceInfo;    ///< an instance of a mesh
using Instances = BallotInstances;          ///< where meshes lie; instances() makes it of spans
using KernelOptions = BallotKernelOptions;  ///< what a kernel is called, and how its calls answer
using Mesh = BallotMesh;                    ///< a triangle mesh; mesh() makes it of spans, or of arrays on a device
using MeshInfo = BallotMeshInfo;            ///< a mesh of a scene
using NearestPoint = BallotNearestPoint;    ///< the answer for a point on the device, 32 bytes
using NearestResults = BallotNearest;       ///< where the answers for points go
using ClearanceResults = BallotClearance;   ///< where the distances of scenes go
using Output = BallotOutput;                ///< where a column of answers goes on the device
using ListArrays = BallotListBuffers;       // on a device
using Picture = BallotPicture;              ///< what to render
using Point = BallotPoint;                  ///< a point on the device, 16 bytes
using Query = BallotQuery;                  ///< how to answer questions
using Ray = BallotRay;                      ///< a ray, 32 bytes
using RayDouble = std::array<double, 8>;    ///< the same in double: origin, t_min, direction, t_max
using Results = BallotHits;                 ///< where hits go
using SceneInfo = BallotSceneInfo;          ///< what a scene holds, and its tree
using SceneOptions = BallotSceneOptions;    ///< how a scene is made
using Times = BallotTimes;                  ///< what a call took
using Values = BallotValues;                ///< where the values of an attribute go
using Vertex = BallotVertex;                ///< a vertex on the device, 12 bytes
using Matrix = std::array<float, 12>;       ///< a 3 x 4 matrix on the device, row by row
using View = BallotView;                    ///< a camera, as in glTF
using Code = BallotStatus;                  ///< the kind of a failure, as BALLOT_ERROR_ARGUMENT
/// The number of no triangle, mesh or instance.
inline constexpr std::uint32_t kMiss = BALLOT_MISS;
/// The group of instances that rays and points of all groups meet.
inline constexpr std::uint32_t kShared = BALLOT_SHARED;

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
  if (status != BALLOT_OK) throw Error(status, ballot_last_error());
}

/// Returns the version of the library that is loaded, such as "1.0.0".
inline std::string version() { return ballot_version(); }

/// Returns the names that an argument takes, as BALLOT_NAMES_METHODS.
inline std::vector<std::string> names(BallotNames which) {
  std::vector<std::string> list;
  while (const char* name = ballot_name(which, list.size())) list.emplace_back(name);
  return list;
}

/// Returns a mesh over x y z of each vertex and three indices for each triangle, of 32 or 16 bits; without them
/// vertices 0 1 2, 3 4 5, ... are triangles. `stride`: bytes from one vertex to the next; 0: 12. `normals`: unit normal
/// of each vertex, side by side, for pictures; none: flat. Throws Error(BALLOT_ERROR_ARGUMENT) if there are too few.
inline Mesh mesh(std::span<const float> positions, std::span<const std::uint32_t> indices = {}, std::size_t stride = 0,
                 std::span<const float> normals = {}) {
  const std::size_t bytes = positions.size_bytes(), step = stride ? stride : 3 * sizeof(float);
  Mesh m{.positions = positions.data(), .position_stride = stride};
  m.vertex_count = bytes < 3 * sizeof(float) ? 0 : (bytes - 3 * sizeof(float)) / step + 1;
  if (!indices.empty()) {
    m.indices = indices.data(), m.index_count = indices.size(), m.index_type = BALLOT_INDEX_U32;
  }
  if (normals.empty()) return m;
  if (normals.size() < 3 * m.vertex_count)
    throw Error(BALLOT_ERROR_ARGUMENT, "mesh: " + std::to_string(normals.size()) + " numbers of normals, but " +
                                           std::to_string(m.vertex_count) + " vertices; expected three for each");
  m.normals = normals.data();
  return m;
}
/// The same in double, kept as float32 about an origin (BallotMesh::positions_double). `stride` 0: 24.
inline Mesh mesh(std::span<const double> positions, std::span<const std::uint32_t> indices = {},
                 std::size_t stride = 0) {
  const std::size_t bytes = positions.size_bytes(), step = stride ? stride : 3 * sizeof(double);
  Mesh m = mesh(std::span<const float>(), indices);
  m.positions_double = positions.data(), m.position_stride = stride;
  m.vertex_count = bytes < 3 * sizeof(double) ? 0 : (bytes - 3 * sizeof(double)) / step + 1;
  return m;
}
/// The same for indices of 16 bits.
inline Mesh mesh(std::span<const float> positions, std::span<const std::uint16_t> indices, std::size_t stride = 0,
                 std::span<const float> normals = {}) {
  Mesh m = mesh(positions, std::span<const std::uint32_t>(), stride, normals);
  m.indices = indices.data(), m.index_count = indices.size(), m.index_type = BALLOT_INDEX_U16;
  return m;
}
/// Returns a mesh of shapes, as BallotMesh::shapes names them, over x y z of each vertex, with a radius and a normal of
/// each, side by side, where they have some. Throws Error(BALLOT_ERROR_ARGUMENT) if there are too few.
inline Mesh shapes(const char* kind, std::span<const float> positions, std::span<const float> radii = {},
                   std::span<const std::uint32_t> indices = {}, std::span<const float> normals = {}) {
  Mesh m = mesh(positions, indices, 0, normals);
  m.shapes = kind;
  if (radii.empty()) return m;
  if (radii.size() < m.vertex_count)
    throw Error(BALLOT_ERROR_ARGUMENT, "shapes: " + std::to_string(radii.size()) + " radii, but " +
                                           std::to_string(m.vertex_count) + " vertices; expected one for each");
  m.radii = radii.data();
  return m;
}

/// Returns a mesh of heights, row by row, `columns` in a row; NaN: none (BallotMesh::heights). `spacing`: x and y from
/// a sample to the next; `corner`: those of the first.
inline Mesh heights(std::span<const float> samples, std::size_t columns, const std::array<double, 2>& spacing = {1, 1},
                    const std::array<double, 2>& corner = {0, 0}) {
  Mesh m{.vertex_count = samples.size(), .shapes = "heights"};
  m.heights = samples.data(), m.columns = columns;
  std::ranges::copy(spacing, m.spacing);
  std::ranges::copy(corner, m.corner);
  return m;
}

/// Returns an attribute over `components` numbers of each value, side by side. Throws Error(BALLOT_ERROR_ARGUMENT) if
/// they are no multiple.
inline Attribute attribute(const char* name, std::span<const float> values, std::uint32_t components = 1,
                           BallotValuesOf of = BALLOT_OF_VERTICES) {
  if (components == 0 || values.size() % components)
    throw Error(BALLOT_ERROR_ARGUMENT, std::string("attribute '") + name + "': " + std::to_string(values.size()) +
                                           " numbers; expected a multiple of " + std::to_string(components));
  Attribute a{.name = name, .of = of, .components = components};
  a.count = values.size() / components, a.data = values.data();
  return a;
}

namespace detail {
/// Returns how many matrices there are.
template <class Number>
std::size_t matrices(std::span<const Number> transforms, std::size_t stride) {
  if (stride == 0) stride = 12 * sizeof(Number);
  const std::size_t bytes = transforms.size_bytes();
  return bytes < 12 * sizeof(Number) ? 0 : (bytes - 12 * sizeof(Number)) / stride + 1;
}
/// Throws Error(BALLOT_ERROR_ARGUMENT) unless there are as many.
inline void check_as_many(const char* what, std::size_t found, const char* of, std::size_t expected) {
  if (found != expected)
    throw Error(BALLOT_ERROR_ARGUMENT, "instances: " + std::to_string(found) + " " + what + ", but " +
                                           std::to_string(expected) + " " + of + "; expected as many");
}
}  // namespace detail

namespace detail {
/// Returns instances of so many matrices, which are set by the caller.
inline Instances placed(std::size_t count, std::size_t stride, std::span<const std::uint32_t> meshes,
                        std::span<const std::uint32_t> masks, std::span<const std::uint32_t> groups) {
  Instances all{.count = count, .transform_stride = stride};
  if (!masks.empty()) check_as_many("masks", masks.size(), "matrices", count);
  if (!groups.empty()) check_as_many("groups", groups.size(), "matrices", count);
  if (!meshes.empty()) check_as_many("numbers of meshes", meshes.size(), "matrices", count);
  all.meshes = meshes.empty() ? nullptr : meshes.data();
  all.masks = masks.empty() ? nullptr : masks.data();
  all.groups = groups.empty() ? nullptr : groups.data();
  return all;
}
}  // namespace detail

/// Returns instances over 3 x 4 matrices, row by row, numbers of meshes (none: 0), masks (none: all bits) and groups
/// (none: shared). `stride`: bytes from one matrix to the next; 0: 48; of 4 x 4 matrices: 64. Throws
/// Error(BALLOT_ERROR_ARGUMENT) if there are not as many of each.
inline Instances instances(std::span<const float> transforms, std::span<const std::uint32_t> meshes = {},
                           std::span<const std::uint32_t> masks = {}, std::size_t stride = 0,
                           std::span<const std::uint32_t> groups = {}) {
  Instances all = detail::placed(detail::matrices(transforms, stride), stride, meshes, masks, groups);
  all.transforms = transforms.data();
  return all;
}
/// The same in double (BallotInstances::transforms_double). `stride` 0: 96; of 4 x 4 matrices: 128.
inline Instances instances(std::span<const double> transforms, std::span<const std::uint32_t> meshes = {},
                           std::span<const std::uint32_t> masks = {}, std::size_t stride = 0,
                           std::span<const std::uint32_t> groups = {}) {
  Instances all = detail::placed(detail::matrices(transforms, stride), stride, meshes, masks, groups);
  all.transforms_double = transforms.data();
  return all;
}

/// Numbers of questions as they lie in the caller's memory: one of each, or three, a point or direction, or the 12 of a
/// pose. BallotColumn tells what becomes of double.
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
  /// The same for words.
  template <std::convertible_to<std::span<const std::uint32_t>> Numbers>
  Column(const Numbers& side_by_side) : Column(std::span<const std::uint32_t>(side_by_side), BALLOT_UINT32) {}
  /// At any stride: bytes from one question to the next along each axis of the view's shape, 0: one for all; `gap`:
  /// bytes between a number and the next of a question.
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
  std::ptrdiff_t gap = 0;               // bytes between the numbers of a question; 0: side by side
  std::uint32_t type = BALLOT_FLOAT32;  // or BALLOT_FLOAT64; of words BALLOT_UINT32

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
  Column masks = {};              // std::uint32_t: as BallotRays::mask; all bits
  Column poses = {};              // 12 numbers each, as BallotRays::pose: matrices that move the rays; none
  Column weights = {};            // as BallotRays::weight: for sums; 1
  Column excluded = {};           // std::uint32_t: as BallotRays::excluded; none
  Column groups = {};             // std::uint32_t: as BallotRays::group; all instances are met
  Shape shape = {};               // empty: that of the columns
};

/// Returns rays of shape {poses, directions}: each direction (3 numbers) from each pose (12 numbers, as
/// RayView::poses), such as those of a camera's pixels or of a scanner's turn. The arrays must outlive it.
inline RayView from_poses(std::span<const float> directions, std::span<const float> poses) {
  return {.origins = {0, 0, 0},
          .directions = Column(directions.data(), {0, std::ptrdiff_t(3 * sizeof(float))}),
          .poses = Column(poses.data(), {std::ptrdiff_t(12 * sizeof(float)), 0}),
          .shape = {poses.size() / 12, directions.size() / 3}};
}

/// Returns the view of rays that lie as records, to which masks and the like may be added.
inline RayView rays(std::span<const Ray> records) {
  constexpr Column::Strides kStep{std::ptrdiff_t(sizeof(Ray))};
  const auto* numbers = reinterpret_cast<const float*>(records.data());
  if (records.empty()) return {};
  return {.origins = Column(numbers, kStep),
          .directions = Column(numbers + 4, kStep),
          .t_min = Column(numbers + 3, kStep),
          .t_max = Column(numbers + 7, kStep),
          .shape = {records.size()}};
}

/// Points by their columns.
struct PointView {
  Column at = {};     // three numbers each
  Column limit = {};  // triangles farther away are not looked for: one above 0 for all, or of each; none: no limit
  Column masks = {};  // std::uint32_t: as BallotPoints::mask; all bits
  Column x = {}, y = {}, z = {};      // instead of `at`: one number each
  Column excluded = {}, groups = {};  // as of RayView
  Shape shape = {};                   // empty: that of the columns
};

/// Closed boxes with sides along the axes, by their columns.
struct BoxView {
  Column low = {}, high = {};                     // three numbers each; infinite: no bound
  Column masks = {}, excluded = {}, groups = {};  // as of RayView
  Shape shape = {};                               // empty: that of the columns
};

/// Where another scene is placed, by columns. Without any it stays where it is.
struct PoseView {
  Column pose = {};   // 12 numbers each: a matrix of 3 rows of 4
  Column limit = {};  // what is farther away is not looked for: of all, or of each; none: no limit
  Shape shape = {};   // empty: that of the columns, or one pose
};

/// Returns the points of a grid, of shape {x.size(), y.size(), z.size()}. The arrays must outlive it.
inline PointView grid(std::span<const float> x, std::span<const float> y, std::span<const float> z) {
  constexpr auto kStep = std::ptrdiff_t(sizeof(float));
  return {.x = Column(x.data(), {kStep, 0, 0}),
          .y = Column(y.data(), {0, kStep, 0}),
          .z = Column(z.data(), {0, 0, kStep}),
          .shape = {x.size(), y.size(), z.size()}};
}

/// Lists of triangles, one for each question: that of question i is hits[offsets[i]] to hits[offsets[i + 1]] - 1.
struct Lists {
  std::vector<std::int64_t> counts;   // of each question
  std::vector<std::int64_t> offsets;  // one more than questions
  std::vector<Hit> hits;              // of each question in order of t, at equal t in order of prim
};

}  // namespace v1
}  // namespace ballot
