// The race of method auto finds the fastest of its candidates in little time. Rays and devices are behind RaceHost.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <vector>

namespace ballot {

/// A candidate in a race. To enter is to be compiled and to take a first look.
struct Runner {
  bool tried = false;     // in this race or in an earlier one
  double slower = 0;      // slowdown over the reference, the first runner, in an earlier race; 0: unknown
  double entry_s = 0;     // seconds to enter on a quiet device, once prepared; 0: unknown, the longest so far counts
  double put_off_s = 0;   // if it is put off: the seconds that entering would take; else 0
  bool prepared = false;  // begun to compile before it enters
  bool out = false;       // takes part in no further round
  double look_ms = 0;     // the first look; 0: none, as it cannot run or was not begun
  std::vector<double> ms = {};  // of each round
};

/// What a runner's rounds tell of it.
enum class Statistic {
  Least,   // its best round: other processes make a round slower, never faster. For CPUs
  Median,  // its middle round: rounds vary by themselves, some kernels' more than others'. For GPUs
};

struct RaceRules {
  double budget_s = 0.3;      // of the trial; rounds get 0.1 of it in any case
  double share = 0.05;        // of the time that the fastest takes for `all_rays`: the budget, if longer than budget_s
  double spent_s = 0;         // seconds of the budget, spent before the race
  double first_s = 0;         // seconds that the reference took to enter and trace `first_rays`, before spent_s
  double first_rays = 0;      // of the batch, traced before the race
  double all_rays = 0;        // of the batch that waits for the race
  double contention = 1;      // how many times as long as on idle cores a thread takes
  double paid_s = 0;          // one runner that was put off enters if that takes no longer than this
  std::size_t must = 1;       // so many untried runners enter, if their entry_s is unknown even if no time is left
  bool patient = false;       // no runner is put off or left to a later race
  bool last = false;          // runners that do not fit are put off; else they are left to the next race
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
  /// Waits for what prepare() began, at most `seconds`. Empty on GPUs, where compiling does not slow down a look.
  std::function<void(double seconds)> settle = {};
  std::function<void()> keep = {};  // saves what the runners tell so far, in case of an interruption
};

/// Successive halving (Karnin et al. 2013). Runners enter in their order, the reference first. Those that may win then
/// trace samples in rounds, until the time is up. A runner is out if its first look, and each repeat of it, takes more
/// than twice as long as the fastest look before; in rounds less suffices. Of the runners that were tried before, only
/// the reference runs again.
///
/// A runner whose entry_s is known enters if the time left covers it, with a margin, on cores as busy as they are:
/// nothing can interrupt it. One that does not fit is left to a later race. The last race puts it off, and any race
/// puts off what takes longer than the whole budget on idle cores. Of runners with an unknown entry_s, `must` enter.
/// The others enter if they are prepared, or if the longest time of entering so far is left. While one enters, the next
/// that is expected to fit is prepared, as long as fewer than `must` were tried. Returns the rays of a round.
std::size_t race(std::vector<Runner>& runners, const RaceRules& rules, const RaceHost& host);

/// Returns the first runner after the reference that was not tried and is expected to fit into the budget of a race, if
/// it is prepared before; 0 if there is none.
std::size_t next_to_prepare(const std::vector<Runner>& runners, const RaceRules& rules);

/// Returns, for each runner, how many times as slow as the fastest it is; infinity if that is not known.
std::vector<double> slowness_of(const std::vector<Runner>& runners, std::size_t samples, Statistic statistic);

/// Returns the sum over samples of a runner's statistic in its first `rounds` rounds, in milliseconds.
double cost_of(const Runner& runner, std::size_t rounds, std::size_t samples, Statistic statistic);

}  // namespace ballot
