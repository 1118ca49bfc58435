// Sums of weights by what rays end on, in a caller's arrays.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "engine/answer/sums.h"
#include "engine/api/sources.h"
#include "engine/api/state.h"

namespace ballot::api {

/// The columns of sums, by SumsBy.
inline constexpr std::array<std::string_view, kSumsBy> kSums{"prim_sums", "instance_sums", "mesh_sums"};

/// Returns the number of entries of sums, and one. Throws Refused if there is less room.
std::size_t need_entries(const PlaceTable& table, SumsBy by, std::uint64_t room, const char* call);

/// Sums up hits as they come, by all cores. Keeps the caller's pointers and references to scene, rays and order.
class SumArrays {
 public:
  /// `row`: hits of each ray. Throws Refused if a weight is not finite, if there is no room for the sums, or if there
  /// are weights but no sums.
  SumArrays(const BallotHits& to, const SceneState& scene, const RayArray& rays, const RowOrder& order,
            std::uint32_t row);
  /// Adds the hits of the rays from number `first` of the order on.
  void add(std::size_t first, std::span<const Hit> hits);
  /// Writes the sums.
  void end() const;

 private:
  void add_row(std::size_t place, std::span<const Hit> hits);

  const PlaceTable& table_;
  const RayArray& rays_;
  const RowOrder& order_;
  std::uint32_t row_;
  std::array<BallotSums, kSumsBy> to_;
  std::optional<SumUnit> unit_;                            // none: no sums are wanted
  std::array<std::vector<std::int64_t>, kSumsBy> sums_{};  // of those that are
};

}  // namespace ballot::api
