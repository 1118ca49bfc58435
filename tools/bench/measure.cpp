#include "tools/bench/measure.h"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <random>

#include "tools/bench/image_error.h"

namespace ballot::bench {

namespace {

using Clock = std::chrono::steady_clock;
using Batch = std::unique_ptr<RayBatch>;
using Samples = std::vector<std::vector<double>>;  // by view

constexpr std::uint32_t kSweepRepeats = 3;
constexpr auto kWarmUp = std::chrono::seconds(1);
constexpr double kLeastMs = 1e-6;  // the least time of a dispatch: a clock that is too coarse returns 0

/// Returns the counters as means per ray; active_share, packet_share and stack_max are no means.
std::map<std::string, double> counter_figures(const Counters& counters) {
  std::map<std::string, double> figures{{"active_share", counters.active_lanes()},
                                        {"packet_share", counters.packet_share()},
                                        {"stack_max", counters.stack}};
  for (const CounterInfo& info : kCounters)
    figures[std::string(info.name)] = double(counters[info.name]) / double(counters.rays);
  return figures;
}

/// An entry and its measurements.
struct Runner {
  const Entry* entry;
  Samples trace, frame;
  std::vector<std::map<std::string, double>> counters;  // by view; this and the next three only if asked for
  std::vector<std::optional<HitCheck>> checks;
  std::vector<std::optional<ErrorFigures>> errors;
  std::vector<std::optional<double>> image_rmse;

  Runner(const Entry& e, std::size_t views)
      : entry(&e), trace(views), frame(views), counters(views), checks(views), errors(views), image_rmse(views) {}
};

class BlockRun {
 public:
  BlockRun(const Surroundings& around, const Plan& plan, const RaySet& rays)
      : around_(around), plan_(plan), rays_(rays) {}

  /// Makes a batch for each view that has such rays. Returns false if none has.
  bool make_batches(const std::vector<const View*>& views) {
    const Recentring recentring = around_.world.recentring();
    for (const RayFile& file : rays_.files) {
      std::vector<Ray> rays = file.rays;
      if (recentring.origin() != glm::dvec3(0))
        for (Ray& r : rays) r.origin = recentring.point(glm::dvec3(r.origin));
      batches_.push_back(around_.world.make_batch(rays_.name, rays, rays_.want));
      views_.push_back(file.view);
    }
    if (!rays_.kind) return true;
    for (const View* view : views) {
      const RunOptions& o = around_.options;
      Batch batch = around_.world.make_batch(*view, *rays_.kind, o.width, o.height, o.kinds);
      if (batch->count() > 0) {
        batches_.push_back(std::move(batch));
        views_.push_back(view->name);
      } else {
        note("view {} of {} starts no {} rays and is left out", view->name, scene(), rays_.name);
      }
    }
    if (batches_.empty())
      note("{}: no view starts {} rays, expected a hit in some view; choose other --views or --rays", scene(),
           rays_.name);
    return !batches_.empty();
  }

  void measure_all() {
    for (const Sweep& sweep : plan_.sweeps)
      for (const Entry& entry : sweep.entries) sweep_.emplace_back(entry, batches_.size());
    for (const Entry& entry : plan_.entries) runners_.emplace_back(entry, batches_.size());
    warm_up();
    repeat(sweep_, sweep_repeats(plan_, around_.options), false);
    add_best();
    repeat(runners_, around_.options.repeats, true);
    for (std::size_t v = 0; v < batches_.size(); ++v) {
      if (around_.options.counters) count(v);
      if (around_.options.check) check(v);
      if (around_.options.verify) verify(v);
    }
    if (retraced_ > 0)
      note("{}, {}: {} rays were cut short by the driver and traced again", scene(), rays_.name, retraced_);
  }

  std::vector<Record> records() const {
    std::vector<Record> all;
    for (const auto* runners : {&sweep_, &runners_})
      for (const Runner& runner : *runners)
        for (std::size_t v = 0; v < batches_.size(); ++v)
          if (!runner.trace[v].empty()) all.push_back(record(runner, v));
    return all;
  }

  std::uint64_t wrong() const { return wrong_; }

 private:
  const std::string& scene() const { return around_.world.scene().name; }

  template <class... Args>
  void note(fmt::format_string<Args...> text, Args&&... args) const {
    around_.quiet();
    say_aside("ballot: note: {}\n", fmt::format(text, std::forward<Args>(args)...));
  }

  double trace_ms(const Runner& runner, std::size_t view) {
    const TraceTimes times = around_.world.trace(*batches_[view], runner.entry->query);
    retraced_ += times.retraced;
    return std::max(times.device_ms, kLeastMs);
  }

  void trace(Runner& runner, std::size_t view, bool keep) {
    const double ms = trace_ms(runner, view);
    if (keep) runner.trace[view].push_back(ms);
    around_.step();
  }

  void frame(Runner& runner, std::size_t view, bool keep) {
    if (!batches_[view]->has_frame()) return;
    const FrameTimes times = around_.world.frame(*batches_[view], runner.entry->query);
    if (keep) runner.frame[view].push_back(std::max(times.total_ms(), kLeastMs));
    around_.step();
  }

  /// Runs every kernel once, which compiles it; then keeps a GPU busy until its clocks have risen.
  void warm_up() {
    for (Runner& runner : sweep_) trace(runner, 0, false);
    for (Runner& runner : runners_) {
      trace(runner, 0, false);
      frame(runner, 0, false);
    }
    if (around_.world.device().is_cpu()) return;
    const auto start = Clock::now();
    for (std::size_t i = 0; Clock::now() - start < kWarmUp; ++i) {
      trace_ms(runners_[i % runners_.size()], 0);
      around_.poll();
    }
  }

  /// Measures every runner on every view, each time in another order.
  void repeat(std::vector<Runner>& runners, std::uint32_t repeats, bool frames) {
    std::vector<std::size_t> order(runners.size());
    std::iota(order.begin(), order.end(), 0);
    for (std::size_t r = 0; r < repeats; ++r)
      for (std::size_t v = 0; v < batches_.size(); ++v) {
        shuffle(order);
        for (const std::size_t i : order) {
          trace(runners[i], v, true);
          if (frames) frame(runners[i], v, true);
        }
      }
  }

  /// Shuffles by Fisher and Yates. std::shuffle would give another order with another standard library.
  void shuffle(std::vector<std::size_t>& order) {
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random_() % i]);
  }

  double total_ms(const Runner& runner) const {
    double ms = 0;
    for (const auto& samples : runner.trace) ms += quantile(samples, 0.5);
    return ms;
  }

  /// Adds, for each sweep, an entry with the threshold that took the least time over all views.
  void add_best() {
    std::size_t first = 0;
    best_.reserve(plan_.sweeps.size());  // runners keep pointers into it
    for (const Sweep& sweep : plan_.sweeps) {
      const auto begin = sweep_.begin() + std::ptrdiff_t(first), end = begin + std::ptrdiff_t(sweep.entries.size());
      const auto best =
          std::min_element(begin, end, [&](const Runner& a, const Runner& b) { return total_ms(a) < total_ms(b); });
      Entry& entry = best_.emplace_back(*best->entry);
      entry.label = sweep.best_label;
      entry.role = Role::Best;
      runners_.emplace_back(entry, batches_.size());
      first += sweep.entries.size();
    }
  }

  void count(std::size_t view) {
    for (Runner& runner : runners_) {
      runner.counters[view] = counter_figures(around_.world.count(*batches_[view], runner.entry->query));
      around_.step();
    }
  }

  void check(std::size_t view) {
    const Truth truth = around_.world.checker().truth(*batches_[view]);
    for (Runner& runner : runners_) {
      const HitCheck found = around_.world.checker().check(*batches_[view], truth, runner.entry->query);
      const Judgement& j = found.judgement;
      const std::uint64_t wrong = j.errors() + found.unwritten;
      if (wrong > 0)
        note("{}, {}, {}, {}: {} hits are wrong, {} were not written{}", scene(), rays_.name, runner.entry->label,
             runner.entry->query.numeric, j.errors(), found.unwritten,
             j.examples.empty() ? "" : "; " + j.examples.front());
      wrong_ += wrong;
      runner.checks[view] = found;
      around_.step();
    }
  }

  /// Computes the exact answers of a view under a progress bar of their own: they take longer than the traces.
  ExactTruth exact_truth(std::size_t view) const {
    around_.quiet();
    const std::string& name = views_[view];
    ProgressBar bar(fmt::format("exact answers: {}, {}{}", scene(), rays_.name, name.empty() ? "" : ", " + name));
    return around_.world.checker().exact_truth(*batches_[view], [&](double done) {
      bar.update(done);
      around_.poll();
    });
  }

  void verify(std::size_t view) {
    const ExactTruth truth = exact_truth(view);
    RayBatch& batch = *batches_[view];
    for (Runner& runner : runners_) {
      runner.errors[view] = around_.world.checker().verify(batch, truth, runner.entry->query, around_.options.cases);
      if (rays_.kind && rays_.kind->from_camera())
        runner.image_rmse[view] = image_rmse(around_.world, truth.rays, batch.hits(), truth.hits);
      around_.step();
    }
  }

  Record record(const Runner& runner, std::size_t view) const {
    const Entry& entry = *runner.entry;
    const RayBatch& batch = *batches_[view];
    const Query& query = entry.query;
    const Query resolved = around_.world.resolve(batch, query);
    const Variant variant = around_.world.tracer().variant(resolved);
    Record r;
    r.scene = scene();
    r.view = views_[view];
    r.rays = rays_.name;
    r.any = batch.any();
    r.label = entry.label;
    r.method = query.method;
    r.numeric = query.numeric;
    r.runs = resolved.method;
    r.role = entry.role;
    r.knobs = query.knobs;
    r.threshold = entry.threshold;
    r.variant = variant.name();
    r.workgroup = variant.config.workgroup;
    r.subgroup = variant.config.subgroup;
    r.resident_lanes = variant.config.launch == Launch::Persistent ? variant.config.resident_lanes : 0;
    r.ray_count = batch.count();
    r.trace = times_of(runner.trace[view]);
    if (!runner.frame[view].empty()) r.frame = times_of(runner.frame[view]);
    r.counters = runner.counters[view];
    r.check = runner.checks[view];
    r.errors = runner.errors[view];
    r.image_rmse = runner.image_rmse[view];
    return r;
  }

  const Surroundings& around_;
  const Plan& plan_;
  const RaySet& rays_;
  std::vector<Batch> batches_;
  std::vector<std::string> views_;  // of each batch
  std::vector<Runner> sweep_, runners_;
  std::vector<Entry> best_;
  std::uint64_t retraced_ = 0, wrong_ = 0;
  std::mt19937 random_{1};  // for the orders; the seed is fixed so that every run has the same ones
};

}  // namespace

std::uint32_t sweep_repeats(const Plan& plan, const RunOptions& options) {
  return plan.sweeps.empty() ? 0 : std::min(kSweepRepeats, options.repeats);
}

std::size_t steps_of(const Plan& plan, const RaySet& rays, const RunOptions& options, std::size_t views) {
  std::size_t swept = 0;
  for (const Sweep& sweep : plan.sweeps) swept += sweep.entries.size();
  const std::size_t entries = plan.entries.size() + plan.sweeps.size(), dispatches = rays.kind ? 2 : 1;
  return swept + plan.entries.size() * dispatches +
         views * (swept * sweep_repeats(plan, options) +
                  entries * (dispatches * options.repeats + (options.counters ? 1 : 0) + (options.check ? 1 : 0) +
                             (options.verify ? 1 : 0)));
}

Measured measure(const Surroundings& around, const Plan& plan, const RaySet& rays,
                 const std::vector<const View*>& views) {
  BlockRun block(around, plan, rays);
  Measured measured;
  try {
    measured.no_rays = !block.make_batches(views);
    if (!measured.no_rays) block.measure_all();
  } catch (...) {  // the measurements so far are kept
    measured.stopped = std::current_exception();
  }
  measured.records = block.records();
  measured.wrong = block.wrong();
  return measured;
}

}  // namespace ballot::bench
