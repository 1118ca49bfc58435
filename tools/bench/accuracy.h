// Answers held to the exact oracle: the figures of a record, their sums over records, and their JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/ballot.h"
#include "tools/bench/json_place.h"

namespace ballot::bench {

/// One wrong answer and why it is one.
struct WrongAnswer {
  std::uint64_t index = 0;  // of the ray in its batch
  std::string kind;         // "false miss", ...
  bool within_bound = false;
  std::string reason;  // a sentence
  Ray ray{};
  Hit answer{};
  std::uint32_t prim = NO_HIT;  // of the exact hit
  double t = 0;                 // of the exact hit
};

/// As ErrorFigures (engine/oracle/errors.h), which says what is counted.
struct Accuracy {
  std::uint64_t rays = 0, false_misses = 0, false_hits = 0, wrong_prims = 0, ties = 0, wrong_values = 0,
                within_bound = 0, beyond_bound = 0, unwritten = 0, self_hits = 0;
  double t_ulp_median = 0, t_ulp_p99 = 0, t_ulp_max = 0;  // |t - exact t| in units in the last place of float32
  std::optional<double> image_rmse;                       // image_error.h; of primary rays only
  std::vector<WrongAnswer> cases;

  std::uint64_t wrong() const { return false_misses + false_hits + wrong_prims; }

  /// Counts are added, of errors in ulp the largest holds, squares of image errors are weighed by rays, cases appended.
  void add(const Accuracy& other);
};

Accuracy accuracy_of(const ErrorFigures& figures);

/// Answers that a mode has promised not to give: in `exact` any that is not the truth to the last tie; in conservative
/// modes what their bound does not explain, and values beyond it; in the others records that were not written. (A record
/// that was not written is beyond every bound, too.)
std::uint64_t broken_promises(const Accuracy& accuracy, const std::string& numeric);
/// False too for modes that the registry does not know.
bool is_conservative(const std::string& numeric);
bool is_exact(const std::string& numeric);

/// Adds the figures to the object of a record.
void add_json(nlohmann::json& record, const Accuracy& accuracy);
/// None where a record was not held to the exact oracle. Throws Error(Work) as JsonPlace does.
std::optional<Accuracy> read_accuracy(const JsonPlace& record);

}  // namespace ballot::bench
