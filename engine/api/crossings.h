// Hits that are the first crossings of rays: with filters, culling or alpha, or several a ray.
#pragma once

#include "engine/api/arrays.h"

namespace ballot::api {

/// Where the columns of hits go, and the values of attributes.
struct WantedHits {
  const BallotHits& columns;
  std::span<const WantedValues> values;
};
/// Finds the first, last or strongest crossings of each ray, hits_of_each(), and writes them to `to`, filled up with
/// misses. Adds the rays that hit to `hits`. Throws Refused if an option does not fit. The device's mutex is held.
TraceTimes first_crossings(SceneState& scene, const RayArray& rays, const WantedHits& to, const BallotQuery& query,
                           Watch& watch, std::uint64_t& hits);

/// Finds of each ray those crossings whose values of BallotQuery::value are largest, and passes rows of
/// BallotQuery::strongest on. Throws Refused if no mesh has such an attribute, or it has several numbers.
TraceTimes strongest_crossings(SceneState& scene, const RaySource& rays, const BallotQuery& query,
                               const CrossingQuery& how, const TakeFirst& take);

/// The same as first_crossings() for rays on the device, whose hits go to the array `hits`.
TraceTimes first_crossings(SceneState& scene, const Buffer<Ray>& rays, std::uint64_t count, const BallotQuery& query,
                           Buffer<Hit>& hits);

/// Throws Refused if options of hits do not fit to first crossings.
void check_first(const BallotQuery& query);

}  // namespace ballot::api
