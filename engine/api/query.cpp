#include "engine/api/query.h"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "engine/core/error.h"
#include "generated/door_rows.h"

namespace ballot::api {

const Kind kHitsKind{door::kHits, "hits"}, kCrossingsKind{door::kCrossings, "crossings"},
    kPointsKind{door::kPoints, "points"}, kWithinKind{door::kWithin, "triangles within a limit"},
    kOverlappingKind{door::kWithin, "triangles that overlap boxes"},
    kClearanceKind{door::kWithin, "distances of scenes"}, kPictureKind{door::kHits, "pictures", false},
    kKernelKind{0, "kernels"};
const Kind kArraysKind{door::kHits, "arrays on the device", true, true, true},
    kArrayJobsKind{door::kHits, "jobs of arrays on the device", false},
    kCrossingArraysKind{door::kCrossings, "crossings", true, true},
    kPointArraysKind{door::kPoints, "points", true, true},
    kWithinArraysKind{door::kWithin, "triangles within a limit", true, true};

namespace {

bool is_set(const BallotQuery& query, const door::Row& row) {
  constexpr char kUnset[sizeof(void*)] = {};
  const char* member = reinterpret_cast<const char*>(&query) + row.offset;
  return std::memcmp(member, kUnset, row.type == door::Type::Text ? sizeof(const char*) : sizeof(std::uint32_t)) != 0;
}

/// Returns whether a kind of answer has an option.
bool has(const Kind& kind, const door::Row& row) {
  return (row.kinds & kind.options) && (kind.filters || row.kinds != (door::kHits | door::kCrossings));
}

/// Returns whether a query asks for mode exact, of an answer that has no more modes than two.
bool is_exact(const char* numeric) {
  const std::string_view name = numeric ? numeric : kDefaultNumeric;
  if (name != "exact" && name != kDefaultNumeric)
    fail(Failure::Arguments, "numeric is '{}'; expected {} or exact{}", name, kDefaultNumeric,
         name == "double" ? ": double answers arrays of the host, by the library" : "");
  return name == "exact";
}

/// Adds the settings of a text "vote=count,lanes=8".
void read_knobs(std::string_view text, Knobs& knobs) {
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(','));
    const std::size_t sign = one.find('=');
    if (sign == 0 || sign == one.npos)
      fail(Failure::Arguments, "knobs: found '{}'; expected NAME=VALUE, and commas between several", one);
    knobs[std::string(one.substr(0, sign))] = one.substr(sign + 1);
    text.remove_prefix(std::min(text.size(), one.size() + 1));
  }
}

}  // namespace

void check_options(const BallotQuery& query, const Kind& kind) {
  for (const door::Row& row : door::kQueryRows) {
    if (has(kind, row) || !is_set(query, row)) continue;
    std::string options;
    for (const door::Row& r : door::kQueryRows)
      if (has(kind, r)) options += fmt::format("{}{}", options.empty() ? "" : ", ", r.name);
    fail(Failure::Arguments, "{} is no option of {}; expected {}", row.name, kind.name,
         options.empty() ? "none" : "some of " + options);
  }
  for (std::size_t f = 0; f < FILTERS; ++f)
    if (const FilterArray array = filter_array(query, f); array.words && !kind.there)
      fail(Failure::Arguments, "{0} on the device are no option of {1}; expected {0} where the questions are",
           array.name, kind.name);
  if (query.weights && !kind.sums)
    fail(Failure::Arguments, "weights on the device are no option of {}; expected none: it has no sums", kind.name);
  for (const auto& [name, count] : {std::pair{"last", query.last}, std::pair{"strongest", query.strongest}})
    if (count && !kind.filters) fail(Failure::Arguments, "{} is no option of {}; expected none", name, kind.name);
  for (const door::Row& row : door::kQueryRows) {
    if (row.type != door::Type::Bool) continue;
    const auto value = *reinterpret_cast<const BallotBool*>(reinterpret_cast<const char*>(&query) + row.offset);
    if (value > 1) fail(Failure::Arguments, "{} is {}; expected 0 or 1", row.name, value);
  }
}

Query hit_query(const BallotQuery& q) {
  Query query;
  if (q.any) query.want = Want::Any;
  if (q.method) query.method = q.method.text;
  if (q.numeric) query.numeric = q.numeric.text;
  if (q.knobs) read_knobs(q.knobs.text, query.knobs);
  if (q.ray_class) query.rays = q.ray_class.text;
  return query;
}

bool asks_for_crossings(const BallotQuery& q) {
  return q.first || q.last || q.strongest || q.value || q.alpha || q.masks || q.excluded || q.groups ||
         (q.cull && std::string_view(q.cull.text) != "none");
}

std::uint32_t hits_of_each(const BallotQuery& q) { return std::max({q.first, q.last, q.strongest, 1u}); }

FilterArray filter_array(const BallotQuery& q, std::size_t filter) {
  if (filter == FILTER_MASK) return {"masks", q.masks};
  return filter == FILTER_EXCLUDED ? FilterArray{"excluded", q.excluded} : FilterArray{"groups", q.groups};
}

CrossingQuery crossing_query(const BallotQuery& q, bool in_double) {
  if (q.first == kAllHits) fail(Failure::Arguments, "first is 2^32 - 1; expected 1 to 2^32 - 2, or 0 for all");
  CrossingQuery query{.last = q.last != 0, .exact = !in_double && is_exact(q.numeric), .alpha = q.alpha != 0};
  if (q.first) query.most = q.first;
  const std::string_view cull = q.cull ? q.cull.text : "none";
  const std::string_view known[] = {"none", "back", "front"};
  const auto* found = std::ranges::find(known, cull);
  if (found == std::end(known)) fail(Failure::Arguments, "cull is '{}'; expected none, back or front", cull);
  query.cull = Cull(found - known);
  if (query.alpha && query.exact)
    fail(Failure::Arguments, "alpha is 1 and numeric is 'exact'; expected one of them: textures are read in float32");
  return query;
}

PointQuery point_query(const BallotQuery& q, bool in_double) {
  const std::string_view sign = q.sign ? q.sign.text : "parity";
  if (sign != "parity" && sign != "pseudonormal" && sign != "winding")
    fail(Failure::Arguments, "sign is '{}'; expected parity, pseudonormal or winding", sign);
  PointQuery query{.exact = !in_double && is_exact(q.numeric), .sides = sign == "pseudonormal"};
  if (q.beta != 0) query.beta = q.beta;
  return query;
}

bool decides_by_winding(const BallotQuery& q) { return q.sign && std::string_view(q.sign.text) == "winding"; }

}  // namespace ballot::api
