#include "engine/trace/auto/race.h"

#include <algorithm>
#include <limits>

namespace ballot {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHopeless = 2;      // so many times as slow as the fastest at the first look: out
constexpr double kOutpaced = 1.5;    // after a round
constexpr double kRoundShare = 0.1;  // of the budget: what a runner may take for a round
constexpr double kLeastShare = 0.3;  // of the budget, for rounds in any case

double least_look(const std::vector<Runner>& runners) {
  double least = kInfinity;
  for (const Runner& r : runners)
    if (r.look_ms > 0) least = std::min(least, r.look_ms);
  return least;
}

std::size_t running(const std::vector<Runner>& runners) {
  return std::size_t(std::ranges::count_if(runners, [](const Runner& r) { return !r.out; }));
}

/// Puts out those whom a round left behind; when every sample has been traced, the slower half too.
void put_out(std::vector<Runner>& runners, int round, std::size_t samples) {
  const std::vector<double> slowness = slowness_of(runners, samples);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < runners.size(); ++i)
    if (!runners[i].out) order.push_back(i);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return slowness[i]; });
  const bool halve = (std::size_t(round) + 1) % samples == 0;
  const std::size_t stay = halve ? std::max<std::size_t>(2, (order.size() + 1) / 2) : order.size();
  for (std::size_t place = 0; place < order.size(); ++place)
    runners[order[place]].out = place >= stay || slowness[order[place]] > kOutpaced;
}

/// The time of a race.
class Watch {
 public:
  Watch(const RaceRules& rules, const RaceHost& host) : rules_(rules), host_(host), start_(host.now()) {}
  /// Returns the seconds that the race may take, as far as the looks tell.
  double budget(const std::vector<Runner>& runners) const {
    const double least = least_look(runners);
    if (least == kInfinity) return rules_.budget_s;
    const double batch_s = rules_.all_rays / double(rules_.look_rays) * least * 1e-3;
    return std::max(rules_.budget_s, rules_.share * batch_s);
  }
  /// Returns true if `more` seconds more would be over it.
  bool is_over(const std::vector<Runner>& runners, double more = 0) const {
    return host_.now() - start_ + more > budget(runners);
  }
  /// The same for rounds, the first of which began at `begin`: compiling may have taken all the time.
  bool are_rounds_over(const std::vector<Runner>& runners, double begin) const {
    return is_over(runners) && host_.now() - begin > kLeastShare * budget(runners);
  }

 private:
  const RaceRules& rules_;
  const RaceHost& host_;
  double start_;
};

/// Compiles a runner and takes its first look.
void enter(std::vector<Runner>& runners, std::size_t i, const RaceRules& rules, const RaceHost& host) {
  Runner& r = runners[i];
  r.tried = true;
  r.out = !host.compile(i);
  if (r.out) return;
  const double others = least_look(runners);
  const auto look = [&] { return std::max(host.trace(i, 0, rules.look_rays), 1e-9); };
  r.look_ms = look();
  if (r.look_ms > kHopeless * others) r.look_ms = std::min(r.look_ms, look());  // it may have been disturbed
  r.out = r.look_ms > kHopeless * others;
}

/// Prepares the first runner after `i` that was not tried.
void prepare_next(const std::vector<Runner>& runners, std::size_t i, const RaceHost& host) {
  const auto next =
      std::find_if(runners.begin() + std::ptrdiff_t(i) + 1, runners.end(), [](const Runner& r) { return !r.tried; });
  if (host.prepare && next != runners.end()) host.prepare(std::size_t(next - runners.begin()));
}

}  // namespace

double cost_of(const Runner& runner, std::size_t rounds, std::size_t samples) {
  double sum = 0;
  for (std::size_t s = 0; s < std::min(samples, rounds); ++s) {
    double least = runner.ms[s];
    for (std::size_t r = s; r < rounds; r += samples) least = std::min(least, runner.ms[r]);
    sum += least;
  }
  return sum;
}

std::vector<double> slowness_of(const std::vector<Runner>& runners, std::size_t samples) {
  std::vector<double> all(runners.size(), kInfinity);
  const double look = least_look(runners);
  for (std::size_t i = 0; i < runners.size(); ++i) {
    const Runner& r = runners[i];
    if (r.look_ms <= 0) continue;
    all[i] = r.look_ms / look;
    if (r.ms.empty()) continue;
    double least = kInfinity;
    for (const Runner& t : runners)
      if (t.ms.size() >= r.ms.size()) least = std::min(least, cost_of(t, r.ms.size(), samples));
    all[i] = cost_of(r, r.ms.size(), samples) / least;
  }
  for (std::size_t i = 1; i < runners.size(); ++i)
    if (runners[i].slower > 0 && runners[i].look_ms <= 0) all[i] = runners[i].slower * all[0];
  const double least = std::ranges::min(all);
  for (double& each : all)
    if (least > 0 && least < kInfinity) each /= least;
  return all;
}

std::size_t race(std::vector<Runner>& runners, const RaceRules& rules, const RaceHost& host) {
  const Watch watch(rules, host);
  std::size_t fresh = 0;
  double longest = 0;  // seconds that a runner took to enter: the next one may take as long
  for (std::size_t i = 0; i < runners.size(); ++i) {
    Runner& r = runners[i];
    const bool before = r.tried;
    r.out = true;
    if (before && i > 0) continue;
    if (!before && fresh >= rules.must && watch.is_over(runners, longest)) continue;
    if (fresh + !before < rules.must) prepare_next(runners, i, host);
    const double begin = host.now();
    enter(runners, i, rules, host);
    longest = std::max(longest, host.now() - begin);
    fresh += !before && r.look_ms > 0;
    if (r.look_ms > 0) host.keep();
  }
  const double round_ms = kRoundShare * watch.budget(runners) * 1e3;
  const double rays = double(rules.look_rays) * round_ms / least_look(runners);
  const auto size = std::size_t(std::clamp(rays, double(rules.look_rays), double(rules.most_rays)));
  const double begin = host.now();
  for (int round = 0; round < rules.rounds && running(runners) > 1; ++round) {
    if (round > 0 && watch.are_rounds_over(runners, begin)) break;
    const std::size_t sample = std::size_t(round) % rules.samples;
    for (std::size_t i = 0; i < runners.size(); ++i) {
      // The first runner of a round finds the caches cold, so they take turns at being first.
      const std::size_t who = (i + std::size_t(round)) % runners.size();
      if (!runners[who].out) runners[who].ms.push_back(host.trace(who, sample, size));
    }
    put_out(runners, round, rules.samples);
  }
  return size;
}

}  // namespace ballot
