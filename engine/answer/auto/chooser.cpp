#include "engine/answer/auto/chooser.h"

#include <algorithm>

#include "engine/answer/auto/coherence.h"
#include "engine/core/error.h"

namespace ballot {

namespace {

/// The largest tree that the host collapses for auto, in about a second.
constexpr std::size_t kMostNodesToCollapse = 1 << 20;
constexpr std::size_t kClassSample = 4096, kClassStretches = 64;  // rays, in so many runs of neighbours
constexpr std::size_t kMostCompared = 1 << 20;                    // rays
constexpr int kRepeats = 5;                                       // of each method, behind one that compiles it
constexpr double kPreference = 1.02;  // the rival must be so many times as fast: a smaller lead is noise

std::string key_of(const Query& query) {
  std::string key = fmt::format("{}|{}|{}", query.rays, query.want == Want::Any ? "any" : "nearest", query.numeric);
  for (const auto& [knob, value] : query.knobs) key += fmt::format("|{}={}", knob, value);
  return key;
}

bool is_auto(const Query& query) { return find_method(query.method).chooses; }

/// A run of neighbouring rays of a batch.
struct Stretch {
  std::size_t first, count;
};

/// Returns a sample of a batch: runs of neighbours, spread evenly over it. They begin at multiples of 64, where tiles
/// and packets begin.
std::vector<Stretch> sample_of(std::size_t count) {
  if (count <= kClassSample) return {{0, count}};
  constexpr std::size_t kLength = kClassSample / kClassStretches;
  std::vector<Stretch> all;
  for (std::size_t i = 0; i < kClassStretches; ++i)
    all.push_back({(count - kLength) * i / (kClassStretches - 1) / 64 * 64, kLength});
  return all;
}

std::vector<Ray> sampled(const Questions<Ray>& rays) {
  std::vector<Ray> sample;
  for (const Stretch& s : sample_of(rays.size())) {
    const std::vector<Ray> part = rays.part(s.first, s.count);
    sample.insert(sample.end(), part.begin(), part.end());
  }
  return sample;
}

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + std::ptrdiff_t(values.size() / 2));
  return values[values.size() / 2];
}

}  // namespace

Chooser::Chooser(Context& gpu, const DeviceInfo& device, const Bvh& bvh,
                 std::optional<std::span<const Triangle>> triangles, Trace trace)
    : gpu_(gpu), device_(device), trace_(std::move(trace)) {
  replace(bvh, triangles);
}

void Chooser::replace(const Bvh& bvh, std::optional<std::span<const Triangle>> triangles) {
  bvh_ = &bvh;
  has_instances_ = !triangles;
  even_ = triangles ? even_triangles(*triangles) : 0;
  known_.clear();
  rival_wins_.clear();
}

void Chooser::moved(const Bvh& bvh) {
  bvh_ = &bvh;
  known_.clear();
  moving_ = true;
}

AutoChoice Chooser::choice_for(const Query& query, std::size_t count) const {
  // The device collapses its own trees, and keeps their shape when they move. The host would begin anew at each move.
  const bool is_there = !has_instances_ && bvh_->stats.builder == BuilderId::Device && bvh_->nodes.empty();
  const std::size_t nodes = std::max<std::size_t>(bvh_->nodes.size(), bvh_->stats.nodes);
  return auto_choice(query, device_,
                     {.rays = count,
                      .triangles = bvh_->stats.triangles,
                      .even = even_,
                      .instances = has_instances_,
                      .collapses = is_there || (!moving_ && nodes <= kMostNodesToCollapse)});
}

Query Chooser::resolve(const Query& query, std::size_t count) const {
  if (!is_auto(query)) return query;
  const AutoChoice choice = choice_for(query, count);
  const auto compared = choice.rival ? rival_wins_.find(key_of(query)) : rival_wins_.end();
  return (compared != rival_wins_.end() && compared->second ? *choice.rival : choice.chosen).apply(query);
}

Query Chooser::resolve(Query query, const Buffer<Ray>& rays, std::size_t count, std::size_t batch) {
  if (!is_auto(query)) return query;
  batch = std::max(batch, count);
  if (!is_ray_class(query.rays) && depends_on_class(device_, batch)) note(query, look_at(rays, count));
  if (is_resolved(query, batch)) return resolve(query, batch);
  return faster(choice_for(query, batch), query, rays, count).apply(query);
}

bool Chooser::is_resolved(const Query& query, std::size_t most) const {
  return !is_auto(query) || !choice_for(query, most).rival || rival_wins_.contains(key_of(query));
}

/// Times both methods of a choice on the rays, in turns, and notes which is the faster. One that cannot run, for
/// example because its stacks do not fit, loses.
Candidate Chooser::faster(const AutoChoice& choice, const Query& query, const Buffer<Ray>& rays, std::size_t count) {
  const auto some = std::uint32_t(std::min(count, kMostCompared));
  Buffer<Hit> hits(gpu_, some, Access::Storage, "hits of compared rays");
  std::vector<double> ms[2];
  try {
    for (int turn = 0; turn <= kRepeats; ++turn)
      for (const int i : {0, 1}) {
        const double taken = trace_(rays, hits, some, (i ? *choice.rival : choice.chosen).apply(query));
        if (turn > 0) ms[i].push_back(taken);
      }
    rival_wins_[key_of(query)] = median(ms[0]) > kPreference * median(ms[1]);
  } catch (const Error&) {
    rival_wins_[key_of(query)] = false;
  }
  return rival_wins_[key_of(query)] ? *choice.rival : choice.chosen;
}

Chooser::Seen::Seen(std::span<const Ray> sample)
    : rays(ray_class_of(sample)), behind(std::ranges::any_of(sample, [](const Ray& ray) { return ray.t_min < 0; })) {}

void Chooser::note(Query& query, const Seen& seen) const {
  query.rays = seen.rays;
  if (!seen.behind || query.knobs.contains("minmax")) return;
  const Method& any = find_method(kPlainestMethod);
  if (kernel_config_for(any, find_numeric(query.numeric), device_, {}).minmax == MinMax::Integer)
    query.knobs["minmax"] = "builtin";
}

/// Looks at the rays of a known buffer again only at every kLooksAgain-th call: looking takes a GPU as long as tracing
/// some hundred thousand rays, and a buffer is mostly refilled with rays of the same class.
Chooser::Seen Chooser::look_at(const Buffer<Ray>& rays, std::size_t count) {
  constexpr int kLooksAgain = 32;
  constexpr std::size_t kKept = 8;
  const auto known =
      std::ranges::find_if(known_, [&](const Known& k) { return k.buffer == rays.id() && k.count == count; });
  if (known != known_.end() && ++known->uses < kLooksAgain) return known->seen;
  if (!class_sample_) class_sample_.emplace(gpu_, kClassSample, Access::Host, "sample of rays");
  std::vector<RawBuffer::Part> parts;
  std::size_t size = 0;
  for (const Stretch& s : sample_of(count)) {
    parts.push_back({s.first * sizeof(Ray), size * sizeof(Ray), s.count * sizeof(Ray)});
    size += s.count;
  }
  class_sample_->copy_parts(rays, parts);
  const Seen found({reinterpret_cast<const Ray*>(class_sample_->mapped()), size});
  if (known != known_.end()) known_.erase(known);
  if (known_.size() == kKept) known_.erase(known_.begin());
  known_.push_back({rays.id(), count, found, 0});
  return found;
}

void Chooser::classify(Query& query, const Questions<Ray>& rays, std::size_t batch) const {
  if (is_auto(query) && !is_ray_class(query.rays) && depends_on_class(device_, std::max(batch, rays.size())))
    note(query, Seen(sampled(rays)));
}

std::string ray_class(const Questions<Ray>& rays) { return std::string(ray_class_of(sampled(rays))); }

}  // namespace ballot
