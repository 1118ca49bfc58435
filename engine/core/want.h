// What is asked of a ray, and by which arithmetic it is answered: who answers and who judges agree on both.
#pragma once

#include <cstdint>

namespace ballot {

/// The hit that a ray asks for: the nearest one, or any.
enum class Want : std::uint32_t { Nearest = 0, Any = 1 };

/// The triangle test that makes an answer, whose rounding error the judge allows for. Exact: the test decides without
/// rounding, so no answer is a tie; t must lie within one ulp of float32 of the exact t, and u and v within 2^-22.
/// WoopInDouble: Woop in float64, whose answers are then rounded to float32.
enum class Arithmetic { Woop, MoellerTrumbore, WoopAffine, Exact, WoopInDouble };

}  // namespace ballot
