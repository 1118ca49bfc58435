// The trials of method auto: every candidate in turn traces samples of the rays, until the time is up.
#include <algorithm>
#include <chrono>
#include <exception>
#include <limits>

#include "engine/core/error.h"
#include "engine/trace/auto/chooser.h"
#include "engine/trace/auto/coherence.h"

namespace ballot {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// The effort of a trial: enough rays to fill the device, but no more than it traces many times in the time given.
struct Effort {
  std::size_t least;      // rays; for smaller batches calibrating costs more than it gains
  std::size_t sample;     // rays that a candidate traces in a round
  std::size_t samples;    // the most samples; rounds take them in turn, as caches must not help from one to the next
  std::size_t stretches;  // runs of neighbouring rays that make up a sample
  int sure;               // candidates that are compiled, however long that takes
  double compile_s;       // seconds from the start, after which no other candidate is compiled
  double rounds_s;        // seconds from the first round, after which none begins; kLeastRounds begin in any case
  double until_s;         // seconds from the start, after which no round begins; the same exception
  int rounds;             // the most rounds
  double warm_s;          // seconds of tracing beforehand, until the clocks are up
};
constexpr Effort kCpuEffort{1 << 15, 1 << 15, 3, 4, 2, 0.6, 0.35, 0.85, 9, 0};
constexpr Effort kGpuEffort{1 << 18, 1 << 22, 1, 16, 1, 0.1, 0.08, 1, 15, 0.02};
const Effort& effort_on(const DeviceInfo& device) { return device.is_cpu() ? kCpuEffort : kGpuEffort; }
constexpr int kLeastRounds = 3;  // one for each sample
/// The largest tree that is collapsed for a trial. That takes about a second, and the result is not kept. In scenes
/// with more nodes, methods that need a collapsed tree are no candidates.
constexpr std::size_t kMostNodesToCollapse = 1 << 20;
constexpr std::uint32_t kWarmUpRays = 4096;
constexpr double kHopeless = 2;       // a candidate so many times as slow as the fastest traces no further round
constexpr double kPreference = 1.02;  // a candidate must be so many times as fast as one before it in the list
constexpr std::size_t kClassSample = 4096, kClassStretches = 64;

struct Stretch {
  std::size_t first, count;
};

/// Returns a sample of a batch of `count` rays: `stretches` runs of neighbours, about `wanted` rays together, spread
/// evenly over the batch. Runs begin at multiples of 64, where tiles and packets begin. It is number `which` of
/// `samples` such samples, which share no rays.
std::vector<Stretch> stretches_of(std::size_t count, std::size_t wanted, std::size_t stretches, std::size_t which = 0,
                                  std::size_t samples = 1) {
  if (count <= wanted) return {{0, count}};
  const std::size_t length = wanted / stretches, last = std::max<std::size_t>(1, stretches * samples - 1);
  std::vector<Stretch> all;
  for (std::size_t i = 0; i < stretches; ++i)
    all.push_back({(count - length) * (i * samples + which) / last / 64 * 64, length});
  return all;
}

/// Removes the candidates whose methods are `such`, unless all are.
template <class Such>
void leave_out(std::vector<Candidate>& candidates, const Such& such) {
  const auto leaves = [&](const Candidate& c) { return such(find_method(c.method)); };
  if (!std::ranges::all_of(candidates, leaves)) std::erase_if(candidates, leaves);
}

std::size_t size_of(const std::vector<Stretch>& stretches) {
  std::size_t size = 0;
  for (const Stretch& s : stretches) size += s.count;
  return size;
}

/// Copies the sample to the front of a buffer.
void copy_sample(Buffer<Ray>& to, const Buffer<Ray>& rays, const std::vector<Stretch>& stretches) {
  std::vector<RawBuffer::Part> parts;
  std::size_t done = 0;
  for (const Stretch& s : stretches) {
    parts.push_back({s.first * sizeof(Ray), done * sizeof(Ray), s.count * sizeof(Ray)});
    done += s.count;
  }
  to.copy_parts(rays, parts);
}

/// Returns the sample as a copy on the device.
Buffer<Ray> sampled_rays(Context& gpu, const Buffer<Ray>& rays, const std::vector<Stretch>& stretches) {
  Buffer<Ray> sample(gpu, size_of(stretches), Access::Storage, "sampled rays");
  copy_sample(sample, rays, stretches);
  return sample;
}

using Trial = Chooser::Trial;

/// Returns the milliseconds that a trial takes for all samples. Each sample counts with its best of the first `rounds`
/// rounds, as a disturbance makes a round slower, never faster. Rounds take the samples in turn.
double cost_of(const Trial& trial, std::size_t rounds, std::size_t samples) {
  double sum = 0;
  for (std::size_t s = 0; s < std::min(samples, rounds); ++s) {
    double least = trial.ms[s];
    for (std::size_t r = s; r < rounds; r += samples) least = std::min(least, trial.ms[r]);
    sum += least;
  }
  return sum;
}

/// Returns how many times as slow as the fastest a trial is, in the rounds that it took part in; infinity if there are
/// none.
double slowness(const Trial& trial, const std::vector<Trial>& trials, std::size_t samples) {
  const std::size_t rounds = trial.ms.size();
  if (rounds == 0) return std::numeric_limits<double>::infinity();
  double least = std::numeric_limits<double>::infinity();
  for (const Trial& t : trials)
    if (t.ms.size() >= rounds) least = std::min(least, cost_of(t, rounds, samples));
  return cost_of(trial, rounds, samples) / least;
}

/// Returns the candidates: the chosen one first, then the others by speed. The first in the list that the fastest beats
/// by no more than noise (kPreference) is chosen.
std::vector<Candidate> in_order(const std::vector<Trial>& trials, std::size_t rays, std::size_t samples) {
  std::vector<std::pair<double, Candidate>> all;
  for (const Trial& t : trials) {
    all.emplace_back(slowness(t, trials, samples), t.candidate);
    if (t.ms.empty()) continue;  // it could not run, or was not tried
    const std::size_t traced = rays * std::min(samples, t.ms.size());
    all.back().second.mrays_per_s = double(traced) / cost_of(t, t.ms.size(), samples) * 1e-3;
  }
  double least = std::numeric_limits<double>::infinity();
  for (const auto& each : all) least = std::min(least, each.first);
  const auto chosen = std::ranges::find_if(all, [&](const auto& each) { return each.first <= kPreference * least; });
  std::rotate(all.begin(), chosen, chosen + 1);
  std::stable_sort(all.begin() + 1, all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Candidate> candidates;
  for (auto& each : all) candidates.push_back(std::move(each.second));
  return candidates;
}

}  // namespace

Chooser::Chooser(Context& gpu, const Bvh& bvh, Trace trace)
    : gpu_(gpu), bvh_(&bvh), trace_(std::move(trace)), choices_(gpu.info(), bvh.stats, bvh.bounds) {}

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
  if (!find_method(query.method).chooses) return query;
  const Effort& effort = effort_on(gpu_.info());
  if (count < effort.least && !choices_.find(query)) return unmeasured(query, gpu_.info());
  if (query.rays.empty()) query.rays = class_of(rays, count);
  const Choice* known = choices_.find(query);
  const bool unfinished = known && known->remembered && !known->complete() && count >= effort.least;
  if (!known || unfinished) choices_.add(calibrate(query, rays, count));
  return resolve(query);
}

bool Chooser::is_resolved(const Query& query, std::size_t most) const {
  return most < effort_on(gpu_.info()).least || has_chosen(query);
}

bool Chooser::has_chosen(const Query& query) const {
  if (!find_method(query.method).chooses) return true;
  const Choice* known = choices_.find(query);
  return known && (!known->remembered || known->complete());
}

/// Looks at the rays of a buffer again at every kLooksAgain-th call alone: looking takes a GPU as long as tracing some
/// hundred thousand rays, and a buffer is mostly filled with rays that are alike.
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
bool Chooser::try_out(const Query& query, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::exception_ptr& why) {
  try {
    trace_(rays, hits, std::uint32_t(std::min<std::size_t>(kWarmUpRays, rays.size())), query);
    return true;
  } catch (const Error&) {
    if (!why) why = std::current_exception();
    return false;
  }
}

/// Has every candidate in turn trace every sample, until the time is up. Of that time, `spent_s` have passed already.
/// Hopeless candidates drop out.
void Chooser::race(std::vector<Trial>& trials, const std::vector<Buffer<Ray>>& samples, Buffer<Hit>& hits,
                   double spent_s) {
  const Effort& effort = effort_on(gpu_.info());
  const double rounds_s = std::min(effort.rounds_s, effort.until_s - spent_s);
  const auto run = [&](const Trial& t, const Buffer<Ray>& rays) {
    return trace_(rays, hits, std::uint32_t(rays.size()), t.query);
  };
  for (const auto warm = Clock::now(); seconds_since(warm) < effort.warm_s;)
    for (const Trial& t : trials)
      if (!t.dropped) run(t, samples[0]);
  const auto begin = Clock::now();
  for (int round = 0; round < effort.rounds; ++round) {
    if (round >= kLeastRounds && seconds_since(begin) > rounds_s) break;
    const Buffer<Ray>& rays = samples[std::size_t(round) % samples.size()];
    for (std::size_t i = 0; i < trials.size(); ++i) {
      // The first trial of a round finds the caches cold, so the trials take turns at being first.
      Trial& t = trials[(i + std::size_t(round)) % trials.size()];
      if (!t.dropped) t.ms.push_back(run(t, rays));
    }
    if (round + 1 < kLeastRounds) continue;
    for (Trial& t : trials) t.dropped |= slowness(t, trials, samples.size()) > kHopeless;
  }
}

Choice Chooser::calibrate(const Query& query, const Buffer<Ray>& rays, std::size_t count) {
  const auto start = Clock::now();
  const Effort& effort = effort_on(gpu_.info());
  Choice choice{query.rays, query.want, query.numeric, query.knobs, candidates_for(query, gpu_.info())};
  if (has_instances) leave_out(choice.candidates, [](const Method& m) { return !m.instances; });
  if (std::max<std::size_t>(bvh_->nodes.size(), bvh_->stats.nodes) > kMostNodesToCollapse)
    leave_out(choice.candidates, [](const Method& m) { return format_of(m.tree).collapsed; });
  // Each move would have the host derive the other formats anew.
  if (moving_) leave_out(choice.candidates, [](const Method& m) { return format_of(m.tree).encode != nullptr; });
  if (choice.candidates.size() == 1) return choice;
  const std::size_t number = std::clamp<std::size_t>(count / effort.sample, 1, effort.samples);
  std::vector<Buffer<Ray>> samples;
  for (std::size_t i = 0; i < number; ++i)
    samples.push_back(sampled_rays(gpu_, rays, stretches_of(count, effort.sample, effort.stretches, i, number)));
  choice.sampled = std::uint32_t(samples[0].size());
  Buffer<Hit> hits(gpu_, choice.sampled, Access::Storage, "hits of sampled rays");
  std::vector<Trial> trials;
  std::exception_ptr why;
  int run = 0;
  for (const Candidate& c : choice.candidates) {
    Trial& t = trials.emplace_back(Trial{c, query, true, {}});
    if (run >= effort.sure && seconds_since(start) > effort.compile_s) continue;
    t.query.method = c.method;
    t.query.knobs = c.knobs;
    t.candidate.tried = true;
    t.dropped = !try_out(t.query, samples[0], hits, why);
    run += !t.dropped;
  }
  if (run == 0) std::rethrow_exception(why);
  race(trials, samples, hits, seconds_since(start));
  choice.candidates = in_order(trials, choice.sampled, samples.size());
  choice.seconds = seconds_since(start);
  return choice;
}

}  // namespace ballot
