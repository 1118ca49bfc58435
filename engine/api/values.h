// Columns of answers that the device makes, for arrays of the host: values of attributes, colors, shading normals.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "engine/api/outputs.h"
#include "engine/api/row_order.h"
#include "engine/api/state.h"

namespace ballot::api {

/// Where the values of an attribute go.
struct WantedValues {
  std::string attribute;
  float* data;
};
/// Returns the values that a caller's struct wants: BallotHits, BallotNearest. `call` begins the text of errors. Throws
/// Refused unless each has a name and an array.
template <class Struct>
std::vector<WantedValues> read_values(const Struct& to, const char* call) {
  std::vector<WantedValues> all;
  if (to.value_count) need(to.values, call, "values");
  for (std::size_t i = 0; i < to.value_count; ++i) {
    need(to.values[i].attribute, call, "attribute of values");
    need(to.values[i].data, call, "data of values");
    all.push_back({to.values[i].attribute.text, to.values[i].data});
  }
  return all;
}

/// The columns of a call that the device makes of its hits. Keeps the caller's pointers and a reference to the scene.
class MadeColumns {
 public:
  /// `count`: of the hits that will come, in an order. Throws Refused if no mesh has such an attribute, or one is
  /// wanted twice.
  MadeColumns(const BallotHits& to, std::span<const WantedValues> values, SceneState& scene, const RowOrder& order,
              std::size_t count);
  /// Returns false if none is wanted.
  explicit operator bool() const { return !to_.empty(); }
  /// Keeps the hits from number `first` of the order on. By one thread at a time.
  void add(std::size_t first, std::span<const Hit> hits);
  /// Writes the columns, and adds what that takes.
  void end(TraceTimes& times);

 private:
  struct Column {
    float* data;
    std::uint32_t width;  // numbers of an entry
    std::uint32_t column = ALL_COLUMNS;
    std::string attribute = {};  // if there is no column
  };
  void end_part(std::size_t first, std::size_t count, std::vector<Buffer<float>>& there, TraceTimes& times);

  SceneState& scene_;
  RowOrder order_;
  std::vector<Column> to_;
  std::vector<Hit> hits_;
};

}  // namespace ballot::api
