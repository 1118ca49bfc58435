#include "tools/verify/hard.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>

#include "tools/bench/measure.h"
#include "tools/hard/hard.h"
#include "tools/program/interrupt.h"

namespace ballot::verify {

namespace {

using bench::Entry;
using bench::HardRecord;

std::uint64_t count_differing(const std::vector<Hit>& a, const std::vector<Hit>& b, bool any) {
  std::uint64_t n = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    n += any ? (a[i].prim == NO_HIT) != (b[i].prim == NO_HIT) : std::memcmp(&a[i], &b[i], sizeof(Hit)) != 0;
  return n;
}

/// Counts the answers that differ from those that the case knows by construction.
std::uint64_t count_unlike(const std::vector<Hit>& hits, const HardRays& rays) {
  std::uint64_t n = 0;
  for (std::size_t i = 0; i < rays.answers.size(); ++i) {
    const std::uint32_t known = rays.answers[i], found = hits[i].prim;
    const bool some = known == kSomePrim || (rays.want == Want::Any && known != NO_HIT);
    n += some ? found == NO_HIT : found != known;
  }
  return n;
}

HardRecord record_of(const HardCase& hard, const HardRays& rays, const Entry& entry) {
  HardRecord r;
  r.name = hard.name;
  r.from = hard.from;
  r.what = hard.what;
  r.rays = rays.name;
  r.any = rays.want == Want::Any;
  r.closed = rays.closed;
  r.label = entry.label;
  r.method = entry.query.method;
  r.numeric = entry.query.numeric;
  r.knobs = entry.query.knobs;
  return r;
}

class HardRun {
 public:
  HardRun(const std::vector<Entry>& entries, const HardOptions& options,
          const std::function<void(const DeviceInfo&)>& begin)
      : entries_(entries), options_(options), begin_(begin), bar_("hard cases"), context_(options.world.context) {}

  HardResult run() {
    try {
      refuse_all();
      for (std::size_t i = 0; i < hard_cases().size(); ++i) {
        case_ = i;
        answer(hard_cases()[i]);
      }
    } catch (const bench::Interrupted&) {
      result_.signal = interrupt_.signal();
    }
    result_.context = context_;
    return std::move(result_);
  }

 private:
  void poll(double done_in_case) {
    bar_.update((double(case_) + done_in_case) / double(hard_cases().size()));
    if (interrupt_.wanted()) throw bench::Interrupted();
  }

  /// Checks that every scene that must be refused is refused.
  void refuse_all() {
    for (const HardRefusal& refusal : hard_refusals()) {
      std::string found = "was accepted";
      try {
        Scene scene = refusal.make();
        finish_scene(scene);
        build_bvh(scene.triangles);
      } catch (const Error& error) {
        if (std::string_view(error.what()).find(refusal.says) != std::string_view::npos) continue;
        found = fmt::format("was refused by '{}'", error.what());
      }
      result_.not_refused.push_back(
          fmt::format("{} ({}) {}, expected an error with '{}'", refusal.name, refusal.from, found, refusal.says));
    }
  }

  void answer(const HardCase& hard) try {
    poll(0);
    HardScene made = hard.make(options_.quick);
    DeviceSceneOptions how = options_.world;
    how.build = made.build;
    how.use_cache = false;  // the scenes are small and generated in each run
    how.context = context_;
    DeviceScene world(std::move(made.scene), how);
    context_ = world.context();
    if (begin_) std::exchange(begin_, {})(world.device());
    for (std::size_t i = 0; i < made.rays.size(); ++i) answer(world, hard, made.rays, i);
    result_.messages = world.messages().size();
  } catch (const Error& error) {
    if (error.kind() != Failure::Work) throw;
    HardRecord record = record_of(hard, {}, {});
    record.failed = error.what();
    result_.records.push_back(std::move(record));
  }

  void answer(DeviceScene& world, const HardCase& hard, const std::vector<HardRays>& sets, std::size_t set) {
    const HardRays& rays = sets[set];
    const std::unique_ptr<RayBatch> batch = world.make_batch(rays.name, rays.rays, rays.want);
    const ExactTruth truth = world.checker().exact_truth(*batch);
    std::map<std::string, std::vector<Hit>> first;  // by mode
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const Entry& entry = entries_[i];
      HardRecord record = record_of(hard, rays, entry);
      record.errors = world.checker().verify(*batch, truth, entry.query, options_.listed);
      const std::vector<Hit> hits = batch->hits();
      if (rays.closed)
        record.leaks = std::uint64_t(std::ranges::count_if(hits, [](const Hit& h) { return h.prim == NO_HIT; }));
      record.unlike = count_unlike(hits, rays);
      record.differing = count_differing(first.try_emplace(record.numeric, hits).first->second, hits, record.any);
      result_.records.push_back(std::move(record));
      if (const Context::Timed longest = context_->longest_pass(); longest.ms > result_.longest.ms)
        result_.longest = {fmt::format("{}, in case {}, {}", longest.what, hard.name, rays.name), longest.ms};
      poll((double(set) + double(i + 1) / double(entries_.size())) / double(sets.size()));
    }
  }

  const std::vector<Entry>& entries_;
  const HardOptions& options_;
  std::function<void(const DeviceInfo&)> begin_;
  ProgressBar bar_;
  std::shared_ptr<Context> context_;  // all cases run on one device, which is opened once
  InterruptGuard interrupt_;
  HardResult result_;
  std::size_t case_ = 0;
};

}  // namespace

HardResult run_hard_cases(const std::vector<Entry>& entries, const HardOptions& options,
                          const std::function<void(const DeviceInfo&)>& begin) {
  return HardRun(entries, options, begin).run();
}

std::uint64_t broken_promises(const HardRecord& r) {
  if (!r.failed.empty()) return 1;
  const std::uint64_t always = std::max(bench::broken_promises(r.errors, r.numeric), r.unlike);
  return find_numeric(r.numeric).conservative ? std::max({always, r.leaks, r.differing}) : always;
}

}  // namespace ballot::verify
