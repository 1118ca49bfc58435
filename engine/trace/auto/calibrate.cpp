// The trials of method auto: candidates race on samples of the rays.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>

#include "engine/core/contention.h"
#include "engine/core/error.h"
#include "engine/trace/auto/chooser.h"
#include "engine/trace/auto/coherence.h"
#include "engine/trace/auto/race.h"
#include "engine/trace/auto/sample.h"
#include "engine/vk/pipeline.h"

namespace ballot {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// The size of a race: enough rays to fill the device, few enough to trace many times within the budget.
struct Effort {
  std::size_t least;      // rays; for smaller batches a race costs more than it gains
  std::size_t look;       // rays of a candidate's first look
  std::size_t sample;     // the most rays that it traces in a round
  std::size_t samples;    // the most samples
  std::size_t stretches;  // runs of neighbouring rays that make up a sample
  double budget_s;        // RaceRules::budget_s
  int rounds;             // the most
  double warm_s;          // seconds of tracing before the first measurement, in which a GPU's clocks rise
  Statistic statistic;    // RaceRules::statistic
};
constexpr Effort kCpuEffort{1 << 15, 1 << 12, 1 << 15, 3, 4, 0.3, 9, 0, Statistic::Least};
constexpr Effort kGpuEffort{1 << 18, 1 << 18, 1 << 22, 1, 16, 0.3, 15, 0.02, Statistic::Median};
const Effort& effort_on(const DeviceInfo& device) { return device.is_cpu() ? kCpuEffort : kGpuEffort; }
// Once no candidate is left, these race again: the fastest three, and those that were at most 1.25 times as slow as
// the chosen one.
constexpr std::size_t kLookedAgain = 3;
constexpr double kLookedAgainWithin = 1.25;
constexpr double kPatienceSeconds = 2;  // the budget of Choices::try_all
constexpr double kCompiledShare = 0.3;  // of entry_seconds(), if the driver has compiled the kernel before
/// The largest tree that the host collapses for a trial, in about a second. Where it would have to collapse a larger
/// one, methods that need a collapsed tree are left out, unless no other is left.
constexpr std::size_t kMostNodesToCollapse = 1 << 20;
constexpr std::uint32_t kCompileRays = 4096;
/// How many times as fast a candidate must be to be chosen over one before it in the list.
constexpr double kPreference = 1.02;
constexpr std::size_t kClassSample = 4096, kClassStretches = 64;

/// Removes the candidates whose methods satisfy a predicate, unless all do.
template <class Predicate>
void leave_out(std::vector<Candidate>& candidates, const Predicate& predicate) {
  const auto leaves = [&](const Candidate& c) { return predicate(find_method(c.method)); };
  if (!std::ranges::all_of(candidates, leaves)) std::erase_if(candidates, leaves);
}

/// Returns the candidates with their speeds: the chosen one first, then the others by speed, those without one last.
/// The chosen one is the first within kPreference of the fastest: a smaller lead is noise. `rays`: of a round.
std::vector<Candidate> in_order(const std::vector<Candidate>& from, const std::vector<Runner>& runners,
                                const RaceRules& rules, std::size_t rays) {
  const std::size_t samples = rules.samples;
  const std::vector<double> slowness = slowness_of(runners, samples, rules.statistic);
  double best_speed = 0;  // of the fastest, in million rays a second
  std::vector<std::pair<double, Candidate>> all;
  for (std::size_t i = 0; i < from.size(); ++i) {
    all.emplace_back(slowness[i], from[i]);
    const Runner& r = runners[i];
    all[i].second.tried = r.tried;
    all[i].second.put_off_s = r.tried ? 0 : r.put_off_s;
    if (r.look_ms <= 0) continue;
    const std::size_t rounds = r.ms.size();
    const double speed = rounds > 0
                             ? double(rays * std::min(samples, rounds)) / cost_of(r, rounds, samples, rules.statistic)
                             : double(rules.look_rays) / r.look_ms;
    best_speed = std::max(best_speed, speed * slowness[i] * 1e-3);
  }
  for (auto& [slow, candidate] : all) candidate.mrays_per_s = std::isfinite(slow) ? best_speed / slow : 0;
  const auto chosen = std::ranges::find_if(all, [](const auto& each) { return each.first <= kPreference; });
  if (chosen != all.end()) std::rotate(all.begin(), chosen, chosen + 1);
  std::stable_sort(all.begin() + 1, all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Candidate> candidates;
  for (auto& each : all) candidates.push_back(std::move(each.second));
  return candidates;
}

std::ptrdiff_t tried(const std::vector<Candidate>& candidates) {
  return std::ranges::count(candidates, true, &Candidate::tried);
}

/// Returns the rules but for what was spent, the contention and the numbers of rays and samples. `paid_s`:
/// Choice::paid_s(); 0 if the fastest race again.
RaceRules rules_for(const std::vector<Runner>& runners, const Effort& effort, bool try_all, int runs_left,
                    double paid_s) {
  const double budget_s = std::max(effort.budget_s, paid_s);
  const auto untried = std::size_t(std::ranges::count(runners, false, &Runner::tried));
  const std::size_t share = (untried + std::size_t(runs_left) - 1) / std::size_t(runs_left);
  return {.budget_s = try_all ? kPatienceSeconds : budget_s,
          .paid_s = paid_s,
          .must = try_all ? runners.size() : share,
          .patient = try_all,
          .last = runs_left == 1,
          .rounds = effort.rounds,
          .statistic = effort.statistic};
}

/// Counts this process, once, among those that have tried candidates of the choice.
void count_process(Choice& choice) {
  if (choice.remembered || choice.runs == 0) ++choice.runs;
  choice.remembered = false;
}

/// Returns those of a choice's candidates that race again, the chosen one first.
std::vector<Candidate> fastest_of(const std::vector<Candidate>& candidates) {
  std::vector<Candidate> fastest;
  for (const Candidate& c : candidates)
    if (c.mrays_per_s > 0 &&
        (fastest.size() < kLookedAgain || c.mrays_per_s * kLookedAgainWithin >= candidates[0].mrays_per_s))
      fastest.push_back(c);
  return fastest;
}

/// Returns the candidates of a race with those that took no part in it. The speeds of the latter are scaled by
/// the change in speed of the one that was chosen before.
std::vector<Candidate> with_others(std::vector<Candidate> raced, const std::vector<Candidate>& before) {
  const auto in_race = [&](const Candidate& c) { return std::ranges::find(raced, c.name(), &Candidate::name); };
  const auto reference = in_race(before[0]);
  const double ratio =
      reference == raced.end() || before[0].mrays_per_s <= 0 ? 0 : reference->mrays_per_s / before[0].mrays_per_s;
  std::vector<Candidate> others;
  for (const Candidate& c : before)
    if (in_race(c) == raced.end()) others.push_back({c.method, c.knobs, ratio * c.mrays_per_s, c.tried, c.put_off_s});
  raced.insert(raced.end(), others.begin(), others.end());
  return raced;
}

Query query_with(Query query, const Candidate& candidate) {
  query.method = candidate.method;
  query.knobs = candidate.knobs;
  return query;
}

}  // namespace

Chooser::Chooser(Context& gpu, const Bvh& bvh, Trace trace, Prepare prepare)
    : gpu_(gpu),
      bvh_(&bvh),
      trace_(std::move(trace)),
      prepare_(std::move(prepare)),
      choices_(gpu.info(), bvh.stats, bvh.bounds) {}

void Chooser::replace(const Bvh& bvh) {
  bvh_ = &bvh;
  known_.clear();
  choices_.replace_scene(bvh.stats, bvh.bounds);
}

void Chooser::moved(const Bvh& bvh) {
  bvh_ = &bvh;
  known_.clear();
  if (!moving_) choices_.forget();
  moving_ = true;
}

Query Chooser::resolve(const Query& query) const {
  if (!find_method(query.method).chooses) return query;
  if (const Choice* choice = choices_.find(query)) return choice->apply(query);
  return unmeasured(query, gpu_.info());
}

Query Chooser::resolve(Query query, const Buffer<Ray>& rays, std::size_t count) {
  if (begin(query, rays, count) > 0) try_candidates(query, rays, count);
  return resolve(query);
}

std::uint32_t Chooser::begin(Query& query, const Buffer<Ray>& rays, std::size_t count) {
  if (!find_method(query.method).chooses) return 0;
  const std::size_t least = effort_on(gpu_.info()).least;
  if (count < least && !choices_.find(query)) return 0;
  if (query.rays.empty()) query.rays = class_of(rays, count);
  if (!is_due(choices_.find(query), rays, count)) {
    note(query, count);
    return 0;
  }
  if (choices_.try_all) {
    try_candidates(query, rays, count);
    return 0;
  }
  const auto start = Clock::now();
  const Choice choice = choice_for(query);
  const std::vector<Runner> runners = runners_of(query, choice.candidates);
  const double paid_s = choice.paid_s(count), busy = contention();
  const RaceRules rules{
      .budget_s = std::max(effort_on(gpu_.info()).budget_s, paid_s), .contention = busy, .paid_s = paid_s};
  const bool again = choice.complete() && !choice.pays(paid_s);
  const std::size_t prepared = again ? 0 : next_to_prepare(runners, rules);
  if (prepared > 0) prepare_(query_with(query, choice.candidates[prepared]));
  const auto end = Clock::now();
  begun_ = {end - start, end, prepared, std::uint32_t(least), busy};
  return begun_.rays;
}

/// Returns what is known of the rays of a query, or a choice whose candidates are all untried.
Choice Chooser::choice_for(const Query& query) const {
  if (const Choice* known = choices_.find(query)) return *known;
  return {query.rays, query.want, query.numeric, query.knobs, candidates(query)};
}

std::vector<Runner> Chooser::runners_of(const Query& query, const std::vector<Candidate>& candidates) const {
  std::vector<Runner> runners;
  for (const Candidate& c : candidates) {
    const double entry_s = entry_seconds(c, gpu_.info());
    runners.push_back({.tried = c.tried,
                       .slower = c.mrays_per_s > 0 ? candidates[0].mrays_per_s / c.mrays_per_s : 0,
                       .entry_s = choices_.has_tried(query, c) ? kCompiledShare * entry_s : entry_s,
                       .put_off_s = c.put_off_s});
  }
  return runners;
}

bool Chooser::is_due(const Choice* known, const Buffer<Ray>& rays, std::size_t count) const {
  if (!known) return true;
  if (count < effort_on(gpu_.info()).least) return false;
  return is_due(*known, count) || (choices_.try_all && known->buffer != rays.id());
}

bool Chooser::is_due(const Choice& choice, std::size_t count) const {
  if (choice.candidates.size() == 1) return false;
  if (choice.remembered && !choice.complete()) return true;
  if (choice.pays(choice.paid_s(count))) return true;
  if (choice.complete() && fastest_of(choice.candidates).size() < 2) return false;
  const double trial_s = choice.trial_s > 0 ? choice.trial_s : effort_on(gpu_.info()).budget_s;
  return trial_s <= (choice.complete() ? kShareOfLooks : kShareOfTrials) * choice.traced_s;
}

bool Chooser::is_resolved(const Query& query, std::size_t most) const {
  return most < effort_on(gpu_.info()).least || has_chosen(query, most);
}

bool Chooser::has_chosen(const Query& query, std::size_t count) const {
  if (!find_method(query.method).chooses) return true;
  const Choice* known = choices_.find(query);
  return known && !is_due(*known, count);
}

/// Looks at the rays of a known buffer again only at every kLooksAgain-th call: looking takes a GPU as long as tracing
/// some hundred thousand rays, and a buffer is mostly refilled with rays of the same class.
std::string Chooser::class_of(const Buffer<Ray>& rays, std::size_t count) {
  constexpr int kLooksAgain = 32;
  constexpr std::size_t kKept = 8;
  const auto known =
      std::ranges::find_if(known_, [&](const Known& k) { return k.buffer == rays.id() && k.count == count; });
  if (known != known_.end() && ++known->uses < kLooksAgain) return known->rays;
  const std::vector<Stretch> stretches = stretches_of(count, kClassSample, kClassStretches);
  const std::size_t size = size_of(stretches);
  if (!class_sample_ || class_sample_->size() < size)
    class_sample_.emplace(gpu_, std::max(size, kClassSample), Access::Host, "sample of rays");
  copy_sample(*class_sample_, rays, stretches);
  const std::string found = ray_class_of({reinterpret_cast<const Ray*>(class_sample_->mapped()), size}, bvh_->bounds);
  if (known != known_.end()) known_.erase(known);
  if (known_.size() == kKept) known_.erase(known_.begin());
  known_.push_back({rays.id(), count, found, 0});
  return found;
}

std::string Chooser::ray_class(std::span<const Ray> rays) const {
  std::vector<Ray> sample;
  for (const Stretch& s : stretches_of(rays.size(), kClassSample, kClassStretches)) {
    const auto part = rays.subspan(s.first, s.count);
    sample.insert(sample.end(), part.begin(), part.end());
  }
  return ray_class_of(sample, bvh_->bounds);
}

/// Compiles a candidate. Returns false if it cannot run here, for example because its stacks do not fit.
bool Chooser::compile(const Query& query, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::exception_ptr& why) {
  try {
    trace_(rays, hits, std::uint32_t(std::min<std::size_t>(kCompileRays, rays.size())), query);
    return true;
  } catch (const Error&) {
    if (!why) why = std::current_exception();
    return false;
  }
}

std::vector<Candidate> Chooser::candidates(const Query& query) const {
  std::vector<Candidate> all = candidates_for(query, gpu_.info(), bvh_->stats.triangles);
  if (has_instances) leave_out(all, [](const Method& m) { return !m.instances; });
  // The device collapses its own trees, and keeps their shape when they move. The host would begin anew at each move.
  const bool is_there = !has_instances && bvh_->stats.builder == BuilderId::Device && bvh_->nodes.empty();
  const std::size_t nodes = std::max<std::size_t>(bvh_->nodes.size(), bvh_->stats.nodes);
  if (!is_there && (moving_ || nodes > kMostNodesToCollapse))
    leave_out(all, [](const Method& m) { return format_of(m.tree).collapsed(); });
  return all;
}

/// What a race compiles and traces, and what it took.
struct Chooser::Trial {
  const Query& query;
  const std::vector<Candidate>& from;
  const std::vector<Buffer<Ray>>& samples;
  Buffer<Hit>& hits;
  double warm_s;                // for so long the first kernel traces before a trace is timed
  double compile_s = 0;         // spent on compiling
  int compiled = 0;             // candidates, also those that cannot run here
  std::exception_ptr why = {};  // the error of the first that cannot
};

/// Returns what a race asks of the device. The clock and what saves the choice are the caller's.
RaceHost Chooser::host_of(Trial& trial) {
  RaceHost host;
  host.compile = [this, &trial](std::size_t i) {
    const auto begin = Clock::now();
    const bool runs = compile(query_with(trial.query, trial.from[i]), trial.samples[0], trial.hits, trial.why);
    trial.compile_s += seconds_since(begin);
    ++trial.compiled;
    return runs;
  };
  host.trace = [this, &trial](std::size_t i, std::size_t sample, std::size_t some) {
    const Query concrete = query_with(trial.query, trial.from[i]);
    const Buffer<Ray>& first = trial.samples[0];
    for (const auto begin = Clock::now(); seconds_since(begin) < trial.warm_s;)
      trace_(first, trial.hits, std::uint32_t(first.size()), concrete);
    trial.warm_s = 0;
    return trace_(trial.samples[sample], trial.hits, std::uint32_t(some), concrete);
  };
  host.prepare = [this, &trial](std::size_t i) { prepare_(query_with(trial.query, trial.from[i])); };
  if (gpu_.info().is_cpu())
    host.settle = [this, &trial](double seconds) {
      const auto begin = Clock::now();
      settle_pipelines(gpu_, seconds);
      trial.compile_s += seconds_since(begin);
    };
  return host;
}

/// Tries candidates of a choice or, if none is left, the fastest ones again. Adds the choice after each that was
/// tried, so that nothing is lost if the process ends.
void Chooser::try_candidates(const Query& query, const Buffer<Ray>& rays, std::size_t count) {
  const Begun begun = std::exchange(begun_, {});
  const double first_s = begun.rays > 0 ? seconds_since(begun.end) : 0;
  const auto start = Clock::now() - begun.took;
  Choice choice = choice_for(query);
  const Effort& effort = effort_on(gpu_.info());
  const double paid_s = choices_.try_all ? std::numeric_limits<double>::infinity() : choice.paid_s(count);
  const bool again = choice.complete() && !choice.pays(paid_s);
  if (!again) count_process(choice);
  if (choice.candidates.size() == 1) return choices_.add(choice);
  const std::vector<Buffer<Ray>> samples =
      samples_of(gpu_, rays, count, {effort.sample, effort.stretches, effort.samples});
  choice.sampled = std::uint32_t(samples[0].size());
  Buffer<Hit> hits(gpu_, choice.sampled, Access::Storage, "hits of sampled rays");
  const std::vector<Candidate> from = again ? fastest_of(choice.candidates) : choice.candidates;
  std::vector<Runner> runners = again ? std::vector<Runner>(from.size()) : runners_of(query, from);
  if (!again && begun.prepared > 0) runners[begun.prepared].prepared = true;
  RaceRules rules = rules_for(runners, effort, choices_.try_all, again ? 1 : choice.runs_left(), again ? 0 : paid_s);
  rules.first_s = first_s;
  rules.first_rays = begun.rays;
  rules.contention = std::max(begun.contention, contention());
  rules.all_rays = double(count);
  rules.samples = samples.size();
  rules.most_rays = choice.sampled;
  rules.look_rays = std::min(effort.look, rules.most_rays);
  Trial trial{.query = query,
              .from = from,
              .samples = samples,
              .hits = hits,
              .warm_s = again && !choices_.try_all ? 0 : effort.warm_s};
  const std::vector<Candidate> before = choice.candidates;
  const auto keep = [&](std::size_t round) {
    choice.candidates = with_others(in_order(from, runners, rules, round), before);
    if (tried(choice.candidates) > tried(before)) choice.since_entry_s = 0;
    choice.seconds = seconds_since(start);
    choices_.add(choice);
  };
  RaceHost host = host_of(trial);
  host.now = [&] { return seconds_since(start); };
  host.keep = [&] { keep(rules.look_rays); };
  rules.spent_s = std::min(seconds_since(start), 0.5 * rules.budget_s);
  const std::size_t round = race(runners, rules, host);
  if (std::ranges::none_of(runners, [](const Runner& r) { return r.look_ms > 0; })) std::rethrow_exception(trial.why);
  choice.traced_s = 0;
  // The next trial compiles one more, if any is left. On CPUs what is left did not fit, so that it takes the most.
  const bool done = again || std::ranges::all_of(runners, [](const Runner& r) { return r.tried || r.put_off_s > 0; });
  const double one_s = gpu_.info().is_cpu() ? effort.budget_s : trial.compile_s / std::max(trial.compiled, 1);
  choice.trial_s = seconds_since(start) - trial.compile_s + (done ? 0 : one_s);
  choice.buffer = rays.id();
  keep(round);
}

}  // namespace ballot
