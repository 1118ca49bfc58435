#include "engine/trace/auto/race.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace ballot {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHopeless = 2;      // so many times as slow as the fastest at the first look: out
constexpr double kOutpaced = 1.5;    // after a round
constexpr double kMargin = 1.25;     // a runner may take so many times as long to enter as expected
constexpr double kBusy = 1.3;        // contention above this tells more than how long the reference took
constexpr double kUnprepared = 1.5;  // one that is not prepared may take so many times as long
constexpr double kForever = 3600;    // seconds: longer than any kernel compiles
constexpr double kMostBusy = 4;      // a moment may be busier than those that follow, so no price counts more
constexpr double kAgainMs = 4;       // for tracing again a runner that may have been disturbed
constexpr std::size_t kRoundsToHalve = 3;
constexpr double kRoundShare = 0.1;      // of the budget: what the fastest runner may take for a round
constexpr double kPreparedShare = 0.85;  // of the budget, for a runner that is prepared before the race
constexpr double kLeastShare = 0.1;      // of the budget, for rounds in any case

double least_look(const std::vector<Runner>& runners) {
  double least = kInfinity;
  for (const Runner& r : runners)
    if (r.look_ms > 0) least = std::min(least, r.look_ms);
  return least;
}

std::size_t running(const std::vector<Runner>& runners) {
  return std::size_t(std::ranges::count_if(runners, [](const Runner& r) { return !r.out; }));
}

/// Puts out the runners that a round left behind. After every third round, or every pass over all samples if these are
/// more than three, it also puts out the slower half, but leaves two.
void put_out(std::vector<Runner>& runners, int round, const RaceRules& rules) {
  const std::vector<double> slowness = slowness_of(runners, rules.samples, rules.statistic);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < runners.size(); ++i)
    if (!runners[i].out) order.push_back(i);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return slowness[i]; });
  const bool halve = (std::size_t(round) + 1) % std::max(rules.samples, kRoundsToHalve) == 0;
  const std::size_t stay = halve ? std::max<std::size_t>(2, (order.size() + 1) / 2) : order.size();
  for (std::size_t place = 0; place < order.size(); ++place)
    runners[order[place]].out = place >= stay || slowness[order[place]] > kOutpaced;
}

/// Returns the seconds that a runner of known entry_s may take to enter on cores of a given pace.
double entering_s(const Runner& r, bool prepared, double pace) {
  return r.entry_s * pace * (prepared ? kMargin : kUnprepared);
}

/// A race under way.
class Race {
 public:
  Race(std::vector<Runner>& runners, const RaceRules& rules, const RaceHost& host)
      : runners_(runners), rules_(rules), host_(host), start_(host.now() - rules.spent_s), pace_(rules.contention) {}

  /// Lets runners enter: the reference, and those that the time left suffices for.
  void enter_all() {
    std::size_t fresh = 0;
    for (std::size_t i = 0; i < runners_.size(); ++i) {
      Runner& r = runners_[i];
      const bool before = r.tried;
      r.out = true;
      if (before && i > 0) continue;
      if (may_wait() && !fits(r, fresh < rules_.must, r.prepared)) {
        leave(r);
        continue;
      }
      paid_ |= is_paid(r);
      r.put_off_s = 0;
      if (fresh + !before < rules_.must && !(i == 0 && is_begun())) prepare_next(i);
      enter(i);
      fresh += !before && r.look_ms > 0;
      if (r.look_ms > 0) host_.keep();
    }
  }

  /// Lets the runners that are left trace samples in turn. Returns the rays of a round.
  std::size_t run_rounds() {
    const double end = host_.now() + std::max(left(), kLeastShare * budget());
    const std::size_t size = round_rays(end - host_.now());
    double longest = 0;  // the first rays of a sample may be the quick ones
    for (int round = 0; round < rules_.rounds && running(runners_) > 1; ++round) {
      const double begin = host_.now();
      const double next_s = is_strict() ? std::max(round_s(size), longest) : round_s(size);
      if (round > 0 && begin + next_s > end && (is_strict() || !is_in_doubt(round))) break;
      run_round(round, size);
      longest = std::max(longest, host_.now() - begin);
      put_out(runners_, round, rules_);
    }
    return size;
  }

 private:
  /// Returns true if the race keeps to its budget: it knows how long runners take to enter.
  bool is_strict() const { return runners_[0].entry_s > 0; }

  /// Returns true if looks and first rounds disagree on the fastest runner: one of the two was disturbed.
  bool is_in_doubt(int rounds) const {
    if (std::size_t(rounds) >= kRoundsToHalve) return false;
    const std::vector<double> slowness = slowness_of(runners_, rules_.samples, rules_.statistic);
    std::size_t by_looks = 0, by_rounds = 0;
    for (std::size_t i = 0; i < runners_.size(); ++i) {
      if (runners_[i].out) continue;
      if (runners_[by_looks].out || runners_[i].look_ms < runners_[by_looks].look_ms) by_looks = i;
      if (runners_[by_rounds].out || slowness[i] < slowness[by_rounds]) by_rounds = i;
    }
    return by_looks != by_rounds;
  }

  void run_round(int round, std::size_t rays) {
    const std::size_t sample = std::size_t(round) % rules_.samples;
    for (std::size_t i = 0; i < runners_.size(); ++i) {
      // The first runner of a round finds the caches cold, so they take turns at being first.
      const std::size_t who = (i + std::size_t(round)) % runners_.size();
      if (!runners_[who].out) runners_[who].ms.push_back(host_.trace(who, sample, rays));
    }
    const std::vector<double> slowness = slowness_of(runners_, rules_.samples, rules_.statistic);
    for (std::size_t i = 0; i < runners_.size(); ++i) {
      Runner& r = runners_[i];
      if (!r.out) r.ms.back() = confirmed(i, sample, rays, r.ms.back(), r.ms.back() / slowness[i] * kOutpaced);
    }
  }

  /// Returns the seconds of the fastest look; 0 before the first.
  double look_s() const { return least_look(runners_) < kInfinity ? least_look(runners_) * 1e-3 : 0; }
  /// Returns the seconds that the race may take, as far as the looks tell.
  double budget() const { return std::max(rules_.budget_s, share_s()); }
  double share_s() const { return rules_.share * rules_.all_rays / double(rules_.look_rays) * look_s(); }
  double left() const { return start_ + budget() - host_.now(); }

  /// Returns true if a runner need not enter: another one has been looked at, so that there is one to choose.
  bool may_wait() const { return !rules_.patient && look_s() > 0; }

  /// Returns the seconds that a runner needs to enter, if its entry_s is known.
  double needs_s(const Runner& r, bool prepared) const { return entering_s(r, prepared, pace_) + 2 * look_s(); }

  bool is_paid(const Runner& r) const { return r.put_off_s > 0 && price_of(r) <= std::max(rules_.paid_s, share_s()); }

  /// Returns true if a runner is expected to enter within the time left, less that of a round and `reserved_s`. Also if
  /// it is the first that is paid for, or if its entry_s is unknown and it must enter.
  bool fits(const Runner& r, bool must, bool prepared, double reserved_s = 0) const {
    if (r.entry_s <= 0) return must || prepared || longest_ <= left();
    if (!paid_ && is_paid(r)) return true;
    return needs_s(r, prepared) <= left() - kLeastShare * budget() - reserved_s;
  }

  /// Leaves a runner to a later race, or puts it off.
  void leave(Runner& r) const {
    if (r.entry_s > 0 && (rules_.last || r.put_off_s > 0 || r.entry_s > budget())) r.put_off_s = price_of(r);
  }

  /// Returns the least seconds that entering should take: at the best pace of this race, which counts as 1 at least.
  double price_of(const Runner& r) const {
    return std::clamp(least_pace_ < kInfinity ? least_pace_ : rules_.contention, 1.0, kMostBusy) * r.entry_s;
  }

  /// Returns the seconds that a round may take: all runners but the fastest trace it twice (confirmed()).
  double round_s(std::size_t rays) const {
    double ms = -least_look(runners_);
    for (const Runner& r : runners_)
      if (!r.out) ms += 2 * r.look_ms;
    return ms * 1e-3 * double(rays) / double(rules_.look_rays);
  }

  /// Returns the rays of a round, at least those of a look. The fastest runner takes its share of the budget. Rounds
  /// with all samples, one each, take at most `seconds` together, if these suffice for more than looks.
  std::size_t round_rays(double seconds) const {
    const double all_s = round_s(rules_.look_rays);
    const double looks = std::min(kRoundShare * budget() / look_s(), seconds / (double(rules_.samples) * all_s));
    return std::size_t(
        std::clamp(looks * double(rules_.look_rays), double(rules_.look_rays), double(rules_.most_rays)));
  }

  /// Compiles a runner and takes its first look.
  void enter(std::size_t i) {
    Runner& r = runners_[i];
    const double begin = host_.now(), others = least_look(runners_);
    const bool before = std::exchange(r.tried, true);
    r.out = !host_.compile(i);
    const double compiled = host_.now();
    if (host_.settle) host_.settle(rules_.patient ? kForever : std::max(0.0, left() - kLeastShare * budget()));
    const double waited = host_.now() - compiled;  // for another runner
    if (!r.out) {
      r.look_ms = std::max(host_.trace(i, 0, rules_.look_rays), 1e-9);
      r.look_ms = confirmed(i, 0, rules_.look_rays, r.look_ms, kHopeless * others);
      r.out = r.look_ms > kHopeless * others;
    }
    const double taken = host_.now() - begin - waited;
    longest_ = std::max(longest_, taken);
    if (r.entry_s <= 0) return;
    const double pace = (compiled - begin - r.look_ms * 1e-3) / r.entry_s;
    pace_ = std::max(pace_, pace);
    if (before) return;
    if (i > 0)
      least_pace_ = std::min(least_pace_, pace);
    else if (rules_.contention < kBusy)
      pace_ = std::max(pace_, first_pace());
  }

  /// Returns how many times as long as on a quiet device the reference took to enter before the race. Less than 1 if
  /// the driver had its code, or if most of that time was spent on rays.
  double first_pace() const {
    const double traced_s = runners_[0].look_ms * 1e-3 * rules_.first_rays / double(rules_.look_rays);
    return traced_s < 0.5 * rules_.first_s ? (rules_.first_s - traced_s) / (kUnprepared * runners_[0].entry_s) : 0;
  }

  /// Traces a sample again if `ms` is more than `enough`, as the runner may have been disturbed: once, and more often
  /// while that takes no longer than kAgainMs together. Returns the least time.
  double confirmed(std::size_t i, std::size_t sample, std::size_t rays, double ms, double enough) const {
    for (double spent = 0; ms > enough && (spent == 0 || spent < kAgainMs);) {
      const double one = std::max(host_.trace(i, sample, rays), 1e-9);
      spent += one;
      ms = std::min(ms, one);
    }
    return ms;
  }

  /// Returns true if a runner was prepared before the race.
  bool is_begun() const { return std::ranges::any_of(runners_, &Runner::prepared); }

  /// Prepares the first runner after `i` that was not tried and is expected to fit once `i` has entered.
  void prepare_next(std::size_t i) {
    const Runner& r = runners_[i];
    const double reserved_s = i == 0 ? 0 : needs_s(r, r.prepared);
    const auto next = std::find_if(runners_.begin() + std::ptrdiff_t(i) + 1, runners_.end(), [&](const Runner& other) {
      return !other.tried && (rules_.patient || fits(other, true, true, reserved_s));
    });
    if (!host_.prepare || next == runners_.end()) return;
    host_.prepare(std::size_t(next - runners_.begin()));
    next->prepared = true;
  }

  std::vector<Runner>& runners_;
  const RaceRules& rules_;
  const RaceHost& host_;
  const double start_;
  bool paid_ = false;              // a runner that was put off has entered
  double longest_ = 0;             // seconds that a runner took to enter
  double pace_;                    // the largest of the contention and of actual over expected times of entering
  double least_pace_ = kInfinity;  // the least such ratio of runners tried for the first time
};

}  // namespace

double cost_of(const Runner& runner, std::size_t rounds, std::size_t samples, Statistic statistic) {
  double sum = 0;
  for (std::size_t s = 0; s < std::min(samples, rounds); ++s) {
    std::vector<double> ms;
    for (std::size_t r = s; r < rounds; r += samples) ms.push_back(runner.ms[r]);
    std::ranges::sort(ms);
    sum += statistic == Statistic::Least ? ms[0] : 0.5 * (ms[(ms.size() - 1) / 2] + ms[ms.size() / 2]);
  }
  return sum;
}

std::vector<double> slowness_of(const std::vector<Runner>& runners, std::size_t samples, Statistic statistic) {
  std::vector<double> all(runners.size(), kInfinity);
  const double look = least_look(runners);
  for (std::size_t i = 0; i < runners.size(); ++i) {
    const Runner& r = runners[i];
    if (r.look_ms <= 0) continue;
    all[i] = r.look_ms / look;
    if (r.ms.empty()) continue;
    double least = kInfinity;
    for (const Runner& t : runners)
      if (t.ms.size() >= r.ms.size()) least = std::min(least, cost_of(t, r.ms.size(), samples, statistic));
    all[i] = cost_of(r, r.ms.size(), samples, statistic) / least;
  }
  for (std::size_t i = 1; i < runners.size(); ++i)
    if (runners[i].slower > 0 && runners[i].look_ms <= 0) all[i] = runners[i].slower * all[0];
  const double least = std::ranges::min(all);
  for (double& each : all)
    if (least > 0 && least < kInfinity) each /= least;
  return all;
}

std::size_t next_to_prepare(const std::vector<Runner>& runners, const RaceRules& rules) {
  for (std::size_t i = 1; i < runners.size(); ++i) {
    const Runner& r = runners[i];
    const bool paid = r.put_off_s > 0 && r.put_off_s <= rules.paid_s;
    if (!r.tried && (paid || entering_s(r, true, rules.contention) <= kPreparedShare * rules.budget_s)) return i;
  }
  return 0;
}

std::size_t race(std::vector<Runner>& runners, const RaceRules& rules, const RaceHost& host) {
  Race race(runners, rules, host);
  race.enter_all();
  return race.run_rounds();
}

}  // namespace ballot
