// Method auto: rays are sampled and every candidate traces the sample, in turn, until the time for it is up.
#include <algorithm>
#include <chrono>
#include <exception>
#include <limits>

#include "engine/core/error.h"
#include "engine/trace/coherence.h"
#include "engine/trace/tracer.h"

namespace ballot {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Enough rays to fill the device, and no more than it traces many times in the budget.
struct Effort {
  std::size_t least;           // rays of a batch, below which calibrating costs more than it gains
  std::size_t sample;          // rays traced by each candidate in a round
  std::size_t stretches;       // of neighbours that the sample is made of
  double compile_s, rounds_s;  // candidates are compiled, and rounds begun, until then
  int rounds;                  // at most
};
constexpr Effort kCpuEffort{1 << 15, 1 << 15, 4, 0.4, 0.35, 9}, kGpuEffort{1 << 18, 1 << 22, 16, 0.1, 0.08, 15};
constexpr int kLeastRounds = 3;  // one may be disturbed
constexpr std::uint32_t kWarmUpRays = 4096;
constexpr double kHopeless = 1.5;     // times as slow as the fastest: traces no further round
constexpr double kPreference = 1.02;  // by which a candidate must beat one before it in the list
constexpr std::size_t kSortSample = 4096, kSortStretches = 64;

struct Stretch {
  std::size_t first, count;
};

/// `stretches` runs of neighbours of about `wanted` rays together, evenly over the batch, at multiples of 64 where tiles and
/// packets begin.
std::vector<Stretch> stretches_of(std::size_t count, std::size_t wanted, std::size_t stretches) {
  if (count <= wanted) return {{0, count}};
  const std::size_t length = wanted / stretches;
  std::vector<Stretch> all;
  for (std::size_t i = 0; i < stretches; ++i) all.push_back({(count - length) * i / (stretches - 1) / 64 * 64, length});
  return all;
}

std::size_t size_of(const std::vector<Stretch>& stretches) {
  std::size_t size = 0;
  for (const Stretch& s : stretches) size += s.count;
  return size;
}

std::vector<Ray> sample_of(const Buffer<Ray>& rays, const std::vector<Stretch>& stretches) {
  std::vector<Ray> sample(size_of(stretches));
  std::size_t done = 0;
  for (const Stretch& s : stretches) {
    rays.download(std::span(sample).subspan(done, s.count), s.first);
    done += s.count;
  }
  return sample;
}

/// The same on the device.
Buffer<Ray> sampled_rays(Context& gpu, const Buffer<Ray>& rays, const std::vector<Stretch>& stretches) {
  Buffer<Ray> sample(gpu, size_of(stretches), Access::Storage, "sampled rays");
  std::size_t done = 0;
  for (const Stretch& s : stretches) {
    sample.copy_from(rays, s.first, done, s.count);
    done += s.count;
  }
  return sample;
}

struct Trial {
  Candidate candidate;
  Query query;
  double ms;  // of the fastest round
  bool out;   // traces no round, or no further one
};

double fastest(const std::vector<Trial>& trials) {
  double ms = std::numeric_limits<double>::infinity();
  for (const Trial& t : trials) ms = std::min(ms, t.ms);
  return ms;
}

/// The chosen one first, the others by speed; a candidate keeps its place before slower ones in the list unless beaten by
/// more than noise.
std::vector<Candidate> in_order(std::vector<Trial> trials, std::size_t rays) {
  const double best = fastest(trials);
  const auto chosen = std::ranges::find_if(trials, [&](const Trial& t) { return t.ms <= kPreference * best; });
  std::rotate(trials.begin(), chosen, chosen + 1);
  std::stable_sort(trials.begin() + 1, trials.end(), [](const Trial& a, const Trial& b) { return a.ms < b.ms; });
  std::vector<Candidate> all;
  for (Trial& t : trials) {
    t.candidate.mrays_per_s = double(rays) / t.ms * 1e-3;  // 0 for one that could not run
    all.push_back(std::move(t.candidate));
  }
  return all;
}

}  // namespace

Query Tracer::settle(const Query& query) const {
  if (!find_method(query.method).chooses) return query;
  if (const Choice* choice = choices_.find(query)) return choice->apply(query);
  return unmeasured(query, gpu_.info());
}

Query Tracer::settle(Query query, const Buffer<Ray>& rays, std::size_t count) {
  if (!find_method(query.method).chooses) return query;
  const Effort& effort = gpu_.info().is_cpu() ? kCpuEffort : kGpuEffort;
  if (count < effort.least && !choices_.find(query)) return unmeasured(query, gpu_.info());
  if (query.rays.empty())
    query.rays = sort_of_rays(sample_of(rays, stretches_of(count, kSortSample, kSortStretches)), bvh_.bounds);
  const Choice* known = choices_.find(query);
  const bool unfinished = known && known->remembered && !known->complete() && count >= effort.least;
  if (!known || unfinished) choices_.add(calibrate(query, rays, count));
  return settle(query);
}

std::string Tracer::sort_of(std::span<const Ray> rays) const {
  std::vector<Ray> sample;
  for (const Stretch& s : stretches_of(rays.size(), kSortSample, kSortStretches)) {
    const auto part = rays.subspan(s.first, s.count);
    sample.insert(sample.end(), part.begin(), part.end());
  }
  return sort_of_rays(sample, bvh_.bounds);
}

/// Compiles a candidate. False if it cannot run here: its stacks do not fit, say.
bool Tracer::try_out(const Query& query, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::exception_ptr& why) {
  try {
    trace(rays, hits, std::uint32_t(std::min<std::size_t>(kWarmUpRays, rays.size())), query);
    return true;
  } catch (const Error&) {
    if (!why) why = std::current_exception();
    return false;
  }
}

Choice Tracer::calibrate(const Query& query, const Buffer<Ray>& rays, std::size_t count) {
  const auto start = Clock::now();
  const Effort& effort = gpu_.info().is_cpu() ? kCpuEffort : kGpuEffort;
  Choice choice{query.rays, query.want, query.numeric, query.knobs, candidates_for(query, gpu_.info())};
  if (choice.candidates.size() == 1) return choice;
  const Buffer<Ray> sample = sampled_rays(gpu_, rays, stretches_of(count, effort.sample, effort.stretches));
  choice.sampled = std::uint32_t(sample.size());
  Buffer<Hit> hits(gpu_, sample.size(), Access::Storage, "hits of sampled rays");
  std::vector<Trial> trials;
  std::exception_ptr why;
  bool can_run = false;
  for (const Candidate& c : choice.candidates) {
    Trial& t = trials.emplace_back(Trial{c, query, std::numeric_limits<double>::infinity(), true});
    if (can_run && seconds_since(start) > effort.compile_s) continue;
    t.query.method = c.method;
    t.query.knobs = c.knobs;
    t.candidate.tried = true;
    t.out = !try_out(t.query, sample, hits, why);
    can_run |= !t.out;
  }
  if (!can_run) std::rethrow_exception(why);
  const auto begin = Clock::now();
  for (int round = 0; round < effort.rounds; ++round) {
    if (round >= kLeastRounds && seconds_since(begin) > effort.rounds_s) break;
    for (Trial& t : trials)
      if (!t.out) t.ms = std::min(t.ms, trace(sample, hits, choice.sampled, t.query).device_ms);
    for (Trial& t : trials) t.out |= round + 1 >= kLeastRounds && t.ms > kHopeless * fastest(trials);
  }
  choice.candidates = in_order(std::move(trials), sample.size());
  choice.seconds = seconds_since(start);
  return choice;
}

}  // namespace ballot
