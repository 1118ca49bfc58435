// Columns of answers that go to arrays on the device.
#pragma once

#include <span>

#include "engine/api/state.h"
#include "generated/door_rows.h"

namespace ballot::api {

/// The outputs of a call. Keeps their arrays.
struct Outputs {
  /// `rows`: the columns of the kind of answer. `asked`: the array of questions. `call` names the call in errors.
  /// Throws Refused unless each output names another column, and another array, of its numbers, with `count` records on
  /// the scene's device.
  Outputs(std::span<const BallotOutput> given, std::span<const door::Row> rows, const SceneState& scene,
          const BufferState& asked, std::uint64_t count, const char* call);
  /// Throws Refused unless the arrays of sums have their entries. The device is held.
  void check_sums(const SceneState& scene) const;

  /// Returns true if one of these columns is wanted.
  template <class... Column>
  bool wants(Column... columns) const {
    return (... || (to[columns] != nullptr));
  }

  ColumnBuffers to{};                  // but for whole records
  Buffer<Hit>* hits = nullptr;         // whole hits; null: not wanted
  Buffer<Nearest>* nearest = nullptr;  // whole nearest points
  SumBuffers sums{};
  bool has_sums() const { return sums != SumBuffers{}; }
  std::vector<std::shared_ptr<BufferState>> arrays;

 private:
  void add(const door::Row& row, BufferState& array);
  const char* call_;
};

/// Returns what writes columns of a scene's answers.
AnswersThere& answers_there(SceneState& scene);

/// Records the writing of columns behind all earlier passes (ColumnWriter::record). On a device that cannot compute
/// normals it waits, and the host writes these.
void record_columns(SceneState& scene, const ColumnRecords& from, const ColumnBuffers& to, const Context::Done& done);

}  // namespace ballot::api
