// Reads the questions of a call, rays and points, from the caller's memory, by all cores; or has a device make them.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>

#include "engine/answer/filters.h"
#include "engine/answer/stream.h"
#include "engine/answer/sums.h"
#include "engine/api/columns.h"
#include "engine/core/parallel.h"
#include "engine/model/recentring.h"
#include "shaders/shared/layout.h"
#include "shaders/shared/query.h"

namespace ballot::api {

constexpr std::size_t kChunk = 1 << 13;  // questions that a thread takes at a time

/// Words of questions that filters read: of each filter one for each question, at any stride. Keeps the caller's
/// pointers, but not those of words that stand for all.
class FilterColumns {
 public:
  /// Throws Refused if the description is wrong.
  FilterColumns(const char* what, const Shape& shape, const BallotColumn& masks, const BallotColumn& excluded,
                const BallotColumn& groups);
  /// Returns false if none were given: nothing is left out.
  explicit operator bool() const {
    return std::ranges::any_of(lanes_, [](const Lane& lane) { return bool(lane); });
  }
  /// Returns whether a filter (FILTER_...) has words.
  bool has(std::size_t filter) const { return bool(lanes_[filter]); }
  /// Returns what reads them in an order. Refers to this.
  FilterReaders readers(const RowOrder& order = {}) const;

 private:
  void read(std::size_t filter, std::size_t place, std::span<std::uint32_t> to) const;

  std::array<Lane, FILTERS> lanes_;
};

/// The poses of rays: 3 x 4 matrices by rows. Keeps the caller's pointer, but not that of a pose that stands for all.
class PoseColumn {
 public:
  /// Throws Refused if the description is wrong, or a pose for all is not finite.
  PoseColumn(const Column& column, const Shape& shape);
  /// Returns false if none were given: rays stay where they are.
  explicit operator bool() const { return bool(lane_); }
  /// Moves rays from number `place` on: origins as points, directions as vectors.
  void move(std::size_t place, std::span<Ray> rays) const;

 private:
  Lane lane_;
};

/// The rays of a call in double. Keeps the caller's pointers, but not those of numbers that stand for all.
class RayLanes {
 public:
  RayLanes(const Shape& shape, const std::array<Column, 4>& columns, const Column& pose);
  /// Writes the rays from number `place` on, moved by their poses.
  void read(std::size_t place, std::span<RayInDouble> to) const;
  /// Returns true if a ray is far from what is asked, and its origin or direction was given in double.
  bool any_far(const Recentring& of) const;

 private:
  Lane origin_, t_min_, direction_, t_max_, pose_;
};

/// The weights of rays, rounded to float32. Keeps the caller's pointer, but not that of a weight that stands for all.
class WeightColumn {
 public:
  /// Throws Refused if the description is wrong.
  WeightColumn(const Shape& shape, const BallotColumn& given);
  /// Returns false if none were given: each is 1.
  explicit operator bool() const { return bool(lane_); }
  /// Writes the weights of rays from number `place` on.
  void read(std::size_t place, std::span<float> to) const;
  /// Returns the bits of the largest size of `count` weights. Throws Refused, which names the first, if one is not
  /// finite.
  std::uint32_t largest(std::size_t count) const;

 private:
  Lane lane_;
};

/// The rays of a call.
class RayArray {
 public:
  /// Throws Refused if the description is wrong.
  explicit RayArray(const BallotRays& rays);
  std::size_t count() const { return shape_.count; }
  /// Fills `rays` from number `first` of the array on. An infinite t_max becomes the largest float, which is no bound
  /// either.
  void read(std::size_t first, std::span<Ray> rays) const { read(RowOrder(), first, rays); }
  /// The same for the rays in an order.
  void read(const RowOrder& order, std::size_t first, std::span<Ray> rays) const;
  /// Returns the rays [first, first + count) where they lie, if they are records that read() would copy as they are;
  /// null if not.
  const Ray* in_place(std::size_t first, std::size_t count) const;
  const FilterColumns& filters() const { return filters_; }
  const WeightColumn& weights() const { return weights_; }
  /// Returns what makes the rays on a device, in an order, if that has less to carry than the rays are; else nothing.
  MakeQuestions<Ray> make_there(Context& gpu, const RowOrder& order) const;
  /// Asks a scene: what is read then are rays about its origin, moved to its bounds if they are far. The device is
  /// held.
  /// `as_double`: in numeric mode double, where they are not moved.
  void ask(const SceneState& scene, bool as_double = false);
  /// Returns true unless float32 holds the rays: some were given in double, or are counted from an origin.
  bool in_double() const;
  /// Fills `rays` from number `first` of the array in an order on, in double about the origin of the scene.
  void read_in_double(const RowOrder& order, std::size_t first, std::span<RayInDouble> rays) const;
  /// Returns how rays are moved; null: they are read as they are.
  const Recentring* recentring() const { return recentring_ ? &*recentring_ : nullptr; }
  /// Fills `rays` from number `first` of the array on, as they were given.
  void read_given(std::size_t first, std::span<RayInDouble> rays) const { lanes_.read(first, rays); }

 private:
  void recentre(std::size_t place, std::span<Ray> rays) const;

  Shape shape_;
  Column origin_, t_min_, direction_, t_max_, pose_;
  Columns<8> columns_;
  PoseColumn poses_;
  RayLanes lanes_;
  FilterColumns filters_;
  WeightColumn weights_;
  std::optional<Recentring> recentring_;
};

/// The points of a call.
class PointArray {
 public:
  /// Throws Refused if the description is wrong, or a limit for all is not above 0, with `needs_limit` is below 0 or is
  /// none.
  explicit PointArray(const BallotPoints& points, bool needs_limit = false);
  std::size_t count() const { return shape_.count; }
  void read(std::uint64_t first, std::span<ProbePoint> points) const;
  const FilterColumns& filters() const { return filters_; }
  /// As of RayArray, in turn.
  MakeQuestions<ProbePoint> make_there(Context& gpu) const;
  /// Asks a scene: what is read then are points about its origin.
  void ask(const SceneState& scene);
  const glm::dvec3& origin() const { return origin_; }
  /// Fills `points` from number `first` of the array on, as they were given.
  void read_given(std::uint64_t first, std::span<glm::dvec3> points) const;

 private:
  void recentre(std::uint64_t first, std::span<ProbePoint> points) const;

  Shape shape_;
  Column at_, limit_;
  std::array<Column, 3> axes_;  // the same one by one, or in the place of it
  Columns<4> columns_;
  FilterColumns filters_;
  std::array<Lane, 3> lanes_;  // none: the points are in `at`
  Lane at_lane_;
  glm::dvec3 origin_{0};  // of the scene that is asked
};

}  // namespace ballot::api
