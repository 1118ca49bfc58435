// Rays and points as Python hands them over: arrays of NumPy, which are read where they lie.
#pragma once

#include "common.h"

namespace ballot::python {

/// The memory of an array. Copies share it; the last one goes with the GIL.
class Memory {
 public:
  Memory() = default;
  /// None: there is none.
  explicit Memory(nb::handle array) {
    if (array.is_none()) return;
    buffer_ = {new Py_buffer{}, [](Py_buffer* buffer) {
                 PyBuffer_Release(buffer);
                 delete buffer;
               }};
    if (PyObject_GetBuffer(array.ptr(), buffer_.get(), PyBUF_STRIDES) != 0) throw nb::python_error();
  }

  explicit operator bool() const { return buffer_ != nullptr; }
  /// The length of the last axis.
  std::size_t width() const { return std::size_t(buffer_->shape[buffer_->ndim - 1]); }
  /// Describes the array for questions of a shape that its axes broadcast to: one number of each; or, if its last axis
  /// has the numbers of an entry, those from number `first` on.
  BallotColumn column(std::size_t axes) const { return column(axes, std::size_t(buffer_->ndim), buffer_->itemsize, 0); }
  BallotColumn numbers(std::size_t axes, std::size_t first = 0) const {
    const auto last = std::size_t(buffer_->ndim - 1);
    return column(axes, last, buffer_->strides[last], first);
  }

 private:
  BallotColumn column(std::size_t axes, std::size_t own, std::ptrdiff_t step, std::size_t first) const {
    BallotColumn c{};
    c.data = static_cast<const char*>(buffer_->buf) + std::ptrdiff_t(first) * step;
    c.type = buffer_->itemsize == sizeof(double) ? BALLOT_FLOAT64 : BALLOT_FLOAT32;
    c.gap = step - buffer_->itemsize;
    for (std::size_t a = 0; a < own; ++a)
      if (buffer_->shape[a] != 1) c.stride[axes - own + a] = buffer_->strides[a];
    return c;
  }

  std::shared_ptr<Py_buffer> buffer_;
};

/// Questions, as a Source of ballot/_sources.py has them: a shape; rows of rays, origins, points, their x, or low
/// corners; directions, or high corners; t_min; t_max, or limits; masks; poses; y and z; weights; excluded; groups. The
/// arrays have float32 or float64, words uint32, and their axes broadcast to the shape; to its product, if it has more
/// than BALLOT_AXES.
class Source {
 public:
  explicit Source(const Objects& given)
      : first_(given[1]),
        directions_(given[2]),
        low_(given[3]),
        high_(given[4]),
        masks_(given[5]),
        poses_(given[6]),
        y_(given[7]),
        z_(given[8]),
        weights_(given[9]),
        excluded_(given[10]),
        groups_(given[11]) {
    const auto shape = nb::borrow<nb::tuple>(given[0]);
    for (const nb::handle length : shape) {
      const auto n = nb::cast<std::size_t>(length);
      if (shape.size() <= BALLOT_AXES) shape_[axes_++] = n;
      count_ *= n;
    }
    if (shape.size() > BALLOT_AXES) axes_ = 1;
    if (count_ == 0 || axes_ <= 1) shape_[0] = count_;  // an axis of none, no axis, or one for all
  }

  std::size_t count() const { return count_; }
  /// Refer to the arrays.
  BallotRays rays() const {
    auto rays = BALLOT_INIT(BallotRays);
    std::copy_n(shape_, BALLOT_AXES, rays.shape);
    rays.origin = first_.numbers(axes_);
    const bool is_full = !directions_ && first_.width() == 8;
    rays.direction = directions_ ? directions_.numbers(axes_) : first_.numbers(axes_, is_full ? 4 : 3);
    if (is_full) rays.t_min = first_.numbers(axes_, 3), rays.t_max = first_.numbers(axes_, 7);
    if (low_) rays.t_min = low_.column(axes_);
    if (high_) rays.t_max = high_.column(axes_);
    add_words(rays);
    if (poses_) rays.pose = poses_.numbers(axes_);
    if (weights_) rays.weight = weights_.column(axes_);
    return rays;
  }
  BallotPoints points() const {
    auto points = BALLOT_INIT(BallotPoints);
    std::copy_n(shape_, BALLOT_AXES, points.shape);
    if (y_)
      points.x = first_.column(axes_), points.y = y_.column(axes_), points.z = z_.column(axes_);
    else
      points.at = first_.numbers(axes_);
    if (high_) points.limit = high_.column(axes_);
    add_words(points);
    return points;
  }
  BallotBoxes boxes() const {
    auto boxes = BALLOT_INIT(BallotBoxes);
    std::copy_n(shape_, BALLOT_AXES, boxes.shape);
    boxes.low = first_.numbers(axes_), boxes.high = directions_.numbers(axes_);
    add_words(boxes);
    return boxes;
  }
  BallotPoses poses() const {
    auto poses = BALLOT_INIT(BallotPoses);
    std::copy_n(shape_, BALLOT_AXES, poses.shape);
    poses.pose = first_.numbers(axes_);
    if (high_) poses.limit = high_.column(axes_);
    return poses;
  }

 private:
  template <class Questions>
  void add_words(Questions& to) const {
    const std::tuple<const Memory&, BallotColumn&> all[] = {
        {masks_, to.mask}, {excluded_, to.excluded}, {groups_, to.group}};
    for (const auto& [words, column] : all)
      if (words) column = words.column(axes_), column.type = BALLOT_UINT32;
  }

  Memory first_, directions_, low_, high_, masks_, poses_, y_, z_, weights_, excluded_, groups_;
  std::size_t shape_[BALLOT_AXES] = {}, axes_ = 0, count_ = 1;
};

}  // namespace ballot::python
