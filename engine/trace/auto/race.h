// The race of method auto finds the fastest of its candidates in little time. Rays and devices are behind RaceHost.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <vector>

namespace ballot {

/// A candidate in a race. To enter is to be compiled and to take a first look.
struct Runner {
  bool tried = false;           // in this race or in an earlier one
  double slower = 0;            // slowdown over the reference, the first runner, in an earlier race; 0: unknown
  double entry_s = 0;           // seconds to enter on a quiet device; 0: unknown, the longest so far counts
  double put_off_s = 0;         // if it is put off: the seconds that entering would take; else 0
  bool prepared = false;        // begun to compile before it enters
  bool out = false;             // takes part in no further round
  double look_ms = 0;           // the first look; 0: none, as it cannot run or was not begun
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
  double budget_s = 0.3;      // of the trial; past it enter those that must or are prepared, and rounds get 0.1 of it
  double share = 0.05;        // of the time that the fastest takes for `all_rays`: the budget, if longer than budget_s
  double spent_s = 0;         // seconds of the budget, spent before the race
  double all_rays = 0;        // of the batch that waits for the race
  std::size_t must = 1;       // so many untried runners enter, even if no time is left; those put off do not count
  bool patient = false;       // no runner is put off or left to a later race
  std::size_t samples = 1;    // rounds take them in turn: caches hold the rays of the round before
  std::size_t look_rays = 1;  // of the first look
  std::size_t most_rays = 1;  // of a round, at most: fewer if looks are slow or little time is left
  int rounds = 1;             // at most; the first is run whenever two runners are left
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
  std::function<void()> keep = {};  // saves what the runners tell so far, in case of an interruption
};

/// Successive halving (Karnin et al. 2013). Runners enter in their order, the reference first. Those that may win then
/// trace samples in rounds, until the time is up. A runner is out if its first look, and each repeat of it, takes more
/// than twice as long as the fastest look before; in rounds less suffices. Of the runners that were tried before, only
/// the reference runs again. While one enters, the next is prepared if it must be tried. Beyond those a runner enters
/// if it is prepared, or if the time left covers 1.5 times its expected time, scaled by the largest ratio of actual to
/// expected time so far. A runner that alone would exceed the budget is put off to a race with a larger one.
/// Returns the rays of a round.
std::size_t race(std::vector<Runner>& runners, const RaceRules& rules, const RaceHost& host);

/// Returns, for each runner, how many times as slow as the fastest it is; infinity if that is not known.
std::vector<double> slowness_of(const std::vector<Runner>& runners, std::size_t samples, Statistic statistic);

/// Returns the sum over samples of a runner's statistic in its first `rounds` rounds, in milliseconds.
double cost_of(const Runner& runner, std::size_t rounds, std::size_t samples, Statistic statistic);

}  // namespace ballot
