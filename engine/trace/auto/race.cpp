#include "engine/trace/auto/race.h"

#include <algorithm>
#include <limits>

namespace ballot {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHopeless = 2;      // so many times as slow as the fastest at the first look: out
constexpr double kOutpaced = 1.5;    // after a round
constexpr double kUnprepared = 1.5;  // a runner that is not prepared may take so many times as long as expected
constexpr double kAgainMs = 4;       // for tracing again a runner that may have been disturbed
constexpr std::size_t kRoundsToHalve = 3;
constexpr double kRoundShare = 0.1;  // of the budget: what the fastest runner may take for a round
constexpr double kLeastShare = 0.1;  // of the budget, for rounds in any case

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

/// A race under way.
class Race {
 public:
  Race(std::vector<Runner>& runners, const RaceRules& rules, const RaceHost& host)
      : runners_(runners), rules_(rules), host_(host), start_(host.now() - rules.spent_s) {}

  /// Lets runners enter: the reference, those that must be tried, and those that the time left suffices for.
  void enter_all() {
    std::size_t fresh = 0;
    for (std::size_t i = 0; i < runners_.size(); ++i) {
      Runner& r = runners_[i];
      const bool before = r.tried;
      r.out = true;
      if (before && i > 0) continue;
      if (takes_too_long(r)) {
        r.put_off_s = price_of(r);
        continue;
      }
      if (may_wait(r) && fresh >= rules_.must && expected_s(r) > left()) continue;
      r.put_off_s = 0;
      if (fresh + !before < rules_.must) prepare_next(i);
      enter(i);
      fresh += !before && r.look_ms > 0;
      if (r.look_ms > 0) host_.keep();
    }
  }

  /// Lets the runners that are left trace samples in turn. Returns the rays of a round.
  std::size_t run_rounds() {
    const double end = host_.now() + std::max(left(), kLeastShare * budget());
    const std::size_t size = round_rays(end - host_.now());
    for (int round = 0; round < rules_.rounds && running(runners_) > 1; ++round) {
      if (round > 0 && host_.now() + round_s(size) > end && !is_in_doubt(round)) break;
      run_round(round, size);
      put_out(runners_, round, rules_);
    }
    return size;
  }

 private:
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

  /// Returns the seconds that the race may take, as far as the looks tell.
  double budget() const {
    const double least = least_look(runners_);
    if (least == kInfinity) return rules_.budget_s;
    return std::max(rules_.budget_s, rules_.share * rules_.all_rays / double(rules_.look_rays) * least * 1e-3);
  }
  double left() const { return start_ + budget() - host_.now(); }

  /// Returns the seconds that a runner which is not prepared may take to enter.
  double expected_s(const Runner& r) const { return r.entry_s > 0 ? kUnprepared * pace_ * r.entry_s : longest_; }

  /// Returns the least seconds that entering should take: entry_s at the best pace of this race, which counts as 1 at
  /// least; before any pace is known, price_s().
  double price_of(const Runner& r) const {
    return least_pace_ < kInfinity ? std::max(1.0, least_pace_) * r.entry_s : r.price_s();
  }
  /// Returns true if a runner need not enter: another one has been looked at, so that there is one to choose.
  bool may_wait(const Runner& r) const { return !rules_.patient && !r.prepared && least_look(runners_) < kInfinity; }
  bool takes_too_long(const Runner& r) const { return may_wait(r) && price_of(r) > budget(); }

  /// Returns the seconds that a round may take: all runners but the fastest trace it twice (confirmed()).
  double round_s(std::size_t rays) const {
    double ms = -least_look(runners_);
    for (const Runner& r : runners_)
      if (!r.out) ms += 2 * r.look_ms;
    return ms * 1e-3 * double(rays) / double(rules_.look_rays);
  }

  /// Returns the rays of a round, at least those of a look. The fastest runner takes its share of the budget, and all
  /// together at most `seconds`, if these suffice for more than a look.
  std::size_t round_rays(double seconds) const {
    const double look_s = least_look(runners_) * 1e-3, all_s = round_s(rules_.look_rays);
    const double looks = std::min(kRoundShare * budget() / look_s, seconds / all_s);
    return std::size_t(
        std::clamp(looks * double(rules_.look_rays), double(rules_.look_rays), double(rules_.most_rays)));
  }

  /// Compiles a runner and takes its first look.
  void enter(std::size_t i) {
    Runner& r = runners_[i];
    const double begin = host_.now(), others = least_look(runners_);
    const bool fresh = !r.tried && i > 0;  // the reference may have been compiled for the rays before the race
    r.tried = true;
    r.out = !host_.compile(i);
    const double compiled = host_.now();
    if (host_.settle) host_.settle();
    const double waited = host_.now() - compiled;  // for another runner
    if (!r.out) {
      r.look_ms = std::max(host_.trace(i, 0, rules_.look_rays), 1e-9);
      r.look_ms = confirmed(i, 0, rules_.look_rays, r.look_ms, kHopeless * others);
      r.out = r.look_ms > kHopeless * others;
    }
    const double taken = host_.now() - begin - waited;
    longest_ = std::max(longest_, taken);
    if (r.entry_s <= 0) return;
    pace_ = std::max(pace_, taken / r.entry_s);
    if (fresh) least_pace_ = std::min(least_pace_, taken / r.entry_s);
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

  /// Prepares the first runner after `i` that was not tried and is not put off.
  void prepare_next(std::size_t i) {
    const auto next = std::find_if(runners_.begin() + std::ptrdiff_t(i) + 1, runners_.end(),
                                   [&](const Runner& r) { return !r.tried && !takes_too_long(r); });
    if (!host_.prepare || next == runners_.end()) return;
    host_.prepare(std::size_t(next - runners_.begin()));
    next->prepared = true;
  }

  std::vector<Runner>& runners_;
  const RaceRules& rules_;
  const RaceHost& host_;
  const double start_;
  double longest_ = 0;             // seconds that a runner took to enter
  double pace_ = 1;                // the largest ratio of actual to expected time of entering
  double least_pace_ = kInfinity;  // the least, of runners tried for the first time
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

std::size_t race(std::vector<Runner>& runners, const RaceRules& rules, const RaceHost& host) {
  Race race(runners, rules, host);
  race.enter_all();
  return race.run_rounds();
}

}  // namespace ballot
