// Method auto: the table of measured rows by which it takes a method.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "engine/answer/query.h"
#include "engine/core/geometry.h"

namespace ballot {

/// A method with knobs, which override the tuning table.
struct Candidate {
  std::string method;
  Knobs knobs;
  std::string name() const;  // "packet-wide fallback=0"
  /// Returns the query with this method and these knobs.
  Query apply(Query query) const;
};

/// A batch of unknown size, which is taken for a long one.
inline constexpr std::size_t kManyRays = std::size_t(1) << 32;

/// What auto goes by, beside the query and the device.
struct AutoFacts {
  std::size_t rays = kManyRays;  // in the batch
  std::size_t triangles = 0;     // in the scene
  double even = 0;               // even_triangles() of the scene
  bool instances = false;        // methods without kernels for instances are left out
  bool collapses = true;         // trees of other formats than pairs can be had soon
};

/// What auto takes for a query.
struct AutoChoice {
  Candidate chosen;
  /// On GPUs, for long batches: another method that is faster in some scenes. Both are timed on the first such batch.
  std::optional<Candidate> rival = {};
};

/// Returns the first row of the table that fits the query, the device and the facts. Every candidate gets the knobs of
/// the query; a method that cannot follow them is left out. If no row is left, any row whose method follows the knobs
/// is taken. If there is none, throws Error(Arguments) with the reason for the first.
AutoChoice auto_choice(const Query& query, const DeviceInfo& device, const AutoFacts& facts = {});

/// Returns how fine a scene is: the number of triangles of one size whose edges are as long, all together, and whose
/// surface is as large: (sum of the roots of the areas)^2 / sum of the areas. A few large walls hide many small
/// triangles from most rays. Of more than 2^16 triangles a sample counts.
double even_triangles(std::span<const Triangle> triangles);

/// Returns true for the names of ray classes that the table knows: ray kinds, and what ray_class_of() returns.
bool is_ray_class(std::string_view name);

/// Returns true if the rows for a batch of so many rays differ by ray class, so that a look at the rays pays.
bool depends_on_class(const DeviceInfo& device, std::size_t rays);

}  // namespace ballot
