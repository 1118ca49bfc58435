// Answers checked against the exact oracle: the figures of a record, their sums over records, and their JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/ballot.h"
#include "tools/bench/json_place.h"

namespace ballot::bench {

/// A wrong answer and the reason why it is wrong.
struct WrongAnswer {
  std::uint64_t index = 0;    // of the ray in its batch
  std::string kind;           // "false miss", ...
  bool within_bound = false;  // the error bound of the mode's arithmetic explains it
  std::string reason;         // a sentence
  Ray ray{};
  Hit answer{};
  std::uint32_t prim = NO_HIT;  // of the exact hit
  double t = 0;                 // of the exact hit
};

/// The errors of a record's answers. ErrorFigures (engine/oracle/errors.h) defines what is counted.
struct Accuracy {
  std::uint64_t rays = 0, false_misses = 0, false_hits = 0, wrong_prims = 0, ties = 0, wrong_values = 0,
                within_bound = 0, beyond_bound = 0, unwritten = 0, self_hits = 0, beyond_range = 0;
  double t_ulp_median = 0, t_ulp_p99 = 0, t_ulp_max = 0;  // |t - exact t| in units in the last place of float32
  std::optional<double> image_rmse;                       // tools/bench/image_error.h; primary rays only
  std::vector<WrongAnswer> cases;

  std::uint64_t wrong() const { return false_misses + false_hits + wrong_prims; }

  /// Adds the figures of another record. Counts are summed, errors in ulp take the maximum, squared image errors are
  /// averaged by rays (right for one ray kind only), and cases are appended.
  void add(const Accuracy& other);
};

Accuracy accuracy_of(const ErrorFigures& figures);

/// Returns the number of answers that break the promise of the numeric mode. Mode exact promises the exact answer, ties
/// included. Conservative modes promise that their error bound explains each wrong answer, and that no value is beyond
/// it. The other modes promise only that every record is written. (A record that was not written is beyond every bound,
/// too.)
std::uint64_t broken_promises(const Accuracy& accuracy, const std::string& numeric);
/// True if the mode is conservative; false for modes that the registry does not know.
bool is_conservative(const std::string& numeric);
bool is_exact(const std::string& numeric);

/// Adds the figures to the JSON object of a record.
void add_json(nlohmann::json& record, const Accuracy& accuracy);
/// Reads the figures of a record; none if it was not checked against the exact oracle. Throws Error(Work) as JsonPlace
/// does.
std::optional<Accuracy> read_accuracy(const JsonPlace& record);

}  // namespace ballot::bench
