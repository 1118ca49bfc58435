// The race of method auto: which of its candidates is fastest, found in little time. Knows neither rays nor devices.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <vector>

namespace ballot {

/// A candidate in a race.
struct Runner {
  bool tried = false;     // in this race or in an earlier one
  double slower = 0;      // from an earlier race: how many times as slow as the reference, the first runner; 0: unknown
  double entry_s = 0;     // seconds to enter on a quiet device; 0: as long as the longest so far
  double put_off_s = 0;   // seconds that it would take to enter, if it is put off for that reason; else 0
  bool prepared = false;  // begun to compile before it enters
  bool out = false;       // takes part in no further round
  double look_ms = 0;     // the first look; 0: none, as it cannot run or was not begun
  std::vector<double> ms = {};  // of each round

  /// Returns the seconds that it takes to enter, as far as is known before the race.
  double price_s() const { return std::max(entry_s, put_off_s); }
};

/// What a runner's rounds tell of it.
enum class Statistic {
  Least,   // its best round: other processes make a round slower, never faster. For CPUs
  Median,  // its middle round: rounds vary by themselves, some kernels' more than others'. For GPUs
};

struct RaceRules {
  double budget_s = 0.3;      // nothing is begun that would end later, except for `must` and 0.1 times as long rounds
  double share = 0.05;        // ... or after this share of the time that the fastest takes for `all_rays`, if longer
  double spent_s = 0;         // seconds of that which were spent before the race
  double all_rays = 0;        // of the batch that waits for the race
  std::size_t must = 1;       // untried runners that are tried unless they are put off; the survivors trace a round
  bool patient = false;       // no runner is put off or left to a later race
  std::size_t samples = 1;    // rounds trace them in turn, as caches must not help from one to the next
  std::size_t look_rays = 1;  // of the first look
  std::size_t most_rays = 1;  // of a round: fewer if the look was slow, or little time is left
  int rounds = 1;             // the most
  Statistic statistic = Statistic::Least;
};

/// What a race asks for.
struct RaceHost {
  std::function<double()> now;                      // seconds of a clock that only goes on
  std::function<bool(std::size_t runner)> compile;  // false: the runner cannot run here
  /// Traces this many rays of a sample, and returns the milliseconds.
  std::function<double(std::size_t runner, std::size_t sample, std::size_t rays)> trace;
  /// Begins to compile a runner beside what else is done, so that compile() takes less. Empty: nothing is begun.
  std::function<void(std::size_t runner)> prepare = {};
  /// Waits for what prepare() began. Empty on GPUs, where compiling does not slow down a look.
  std::function<void()> settle = {};
  std::function<void()> keep = {};  // the runners tell something new, which is to survive an interruption
};

/// Tries runners in their order, the reference first, and lets those that may win trace samples in turn, until the time
/// is up: successive halving (Karnin et al. 2013). A runner that is twice as slow as another at its first look, and at
/// a second one, is out; later less suffices. Runners that were tried before do not run again, except the reference.
/// While one enters, the next is prepared if it is one of those that must be tried. Others enter if they are prepared,
/// or if what they are expected to take is left: the device counts as slow as those that entered have found it. A
/// runner that by itself would take more than the budget is put off: it costs more than it gains, until a batch pays
/// for it.
/// Returns the rays of a round.
std::size_t race(std::vector<Runner>& runners, const RaceRules& rules, const RaceHost& host);

/// Returns, for each runner, how many times as slow as the fastest it is; infinity if that is not known.
std::vector<double> slowness_of(const std::vector<Runner>& runners, std::size_t samples, Statistic statistic);

/// Returns the milliseconds that a runner took in the first `rounds` rounds, once for each sample.
double cost_of(const Runner& runner, std::size_t rounds, std::size_t samples, Statistic statistic);

}  // namespace ballot
