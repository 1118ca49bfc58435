// What a caller asks: the options of a call, read, checked against its kind of answer, and as the engine takes them.
#pragma once

#include "engine/answer/point_queries.h"
#include "engine/answer/query.h"
#include "engine/answer/ray_queries.h"
#include "engine/api/ballot_c.h"

namespace ballot::api {

/// What a call answers: a kind that options are for, and its name in errors.
struct Kind {
  unsigned options;  // door::Kinds
  const char* name;
  bool filters = true;  // it has those options of hits that crossings have, too
  bool there = false;   // its questions and their words are arrays on the device
  bool sums = false;    // weights, too
};
extern const Kind kHitsKind, kCrossingsKind, kPointsKind, kWithinKind, kOverlappingKind, kClearanceKind, kPictureKind,
    kKernelKind;
extern const Kind kArraysKind, kArrayJobsKind, kCrossingArraysKind, kPointArraysKind, kWithinArraysKind;

/// Throws Error(Arguments) if an option is set that a kind does not have, or a truth value is neither 0 nor 1.
void check_options(const BallotQuery& query, const Kind& kind);

/// The query of hits by the methods of `ballot methods`.
Query hit_query(const BallotQuery& query);
/// Returns true if hits are the first crossings: if filters have words on the device, or an option asks for more than
/// methods find.
bool asks_for_crossings(const BallotQuery& query);
/// Returns how many hits each ray has: one, or the first, last or strongest so many.
std::uint32_t hits_of_each(const BallotQuery& query);
/// An array of words of questions on the device (FILTER_...), or null, and the name of its member.
struct FilterArray {
  const char* name;
  BallotBuffer* words;
};
FilterArray filter_array(const BallotQuery& query, std::size_t filter);
/// The query of crossings, without the masks of triangles. Throws Error(Arguments) if an option has a value that it
/// does not take.
CrossingQuery crossing_query(const BallotQuery& query, bool in_double = false);
/// The query of points; `sides`: signs are those of pseudonormals. Throws likewise.
PointQuery point_query(const BallotQuery& query, bool in_double = false);
/// Returns true if winding numbers decide what is inside.
bool decides_by_winding(const BallotQuery& query);

}  // namespace ballot::api
