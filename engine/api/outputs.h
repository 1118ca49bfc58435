// Columns of answers that go to arrays on the device.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <span>

#include "engine/api/state.h"
#include "generated/door_rows.h"

namespace ballot::api {

/// Where columns go on the device, but for whole records and sums.
struct Targets {
  struct Values {
    std::string attribute;
    RawBuffer* to;
  };
  ColumnBuffers columns{};
  std::vector<Values> values;

  bool any_of(std::initializer_list<std::uint32_t> some) const {
    return std::ranges::any_of(some, [&](std::uint32_t column) { return columns[column] != nullptr; });
  }
};

/// The outputs of a call. Keeps their arrays.
struct Outputs {
  /// `rows`: the columns of the kind of answer. `asked`: the array of questions. `call` names the call in errors.
  /// Throws Refused unless each output names another column or attribute, and another array, of its numbers, with
  /// `count` records on the scene's device.
  Outputs(std::span<const BallotOutput> given, std::span<const door::Row> rows, const SceneState& scene,
          const BufferState& asked, std::uint64_t count, const char* call);
  /// Throws Refused unless the arrays of sums have their entries, and what is no column is an attribute, of as many
  /// numbers. The device is held.
  void check_held(const SceneState& scene) const;

  Targets to;
  Buffer<Hit>* hits = nullptr;         // whole hits; null: not wanted
  Buffer<Nearest>* nearest = nullptr;  // whole nearest points
  Buffer<float>* windings = nullptr;
  SumBuffers sums{};
  bool has_sums() const { return sums != SumBuffers{}; }
  std::vector<std::shared_ptr<BufferState>> arrays;

 private:
  void add(const door::Row& row, BufferState& array);
  const char* call_;
  std::span<const door::Row> rows_;
};

/// Returns what writes columns of a scene's answers.
AnswersThere& answers_there(SceneState& scene);

/// Records the writing of columns behind all earlier passes. On a device without float64 it waits, and the host writes
/// those that need it.
void record_columns(SceneState& scene, const ColumnRecords& from, const Targets& to, const Context::Done& done);

}  // namespace ballot::api
