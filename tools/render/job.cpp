#include "tools/render/job.h"

#include <algorithm>
#include <chrono>

#include "tools/program/interrupt.h"

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kStepSeconds = 4;     // target length of a step: checkpoints come in time, and passes stay large
constexpr double kKeepShare = 0.01;    // most time for copies of the film to the host, as a share
constexpr std::uint32_t kGrowth = 16;  // largest ratio of a step to the one before it: the first one also compiles

/// Returns the samples of the next step, given that a step of `samples` took `seconds`.
std::uint32_t next_step(std::uint32_t samples, double seconds) {
  const double wanted = samples * kStepSeconds / std::max(seconds, 1e-6);
  return std::uint32_t(std::clamp(wanted, 1.0, double(samples) * kGrowth));
}

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

bool can_checkpoint(const Film& film) { return film.stats.empty(); }

fs::path errors_of(const fs::path& exr) { return fs::path(exr).replace_extension(".errors.json"); }

void add_error(DeviceScene& world, Film& film, const View& view, const RenderJob& job, Rendered& done) {
  world.collect(film, done.times);
  RenderTimes times = done.times;
  const Image image = world.picture(film, view, job.options, times);
  done.errors.push_back({film.samples, done.times.seconds, image_error(image, *job.reference)});
}

/// Writes a checkpoint. Returns why it could not be written, such as a full disk; "" if it was.
std::string save(const fs::path& checkpoint, const Film& film, const std::string& made_of) {
  try {
    write_film(checkpoint, film, made_of);
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

/// A copy of a film on the host: what is left of it if the device is lost.
class KeptFilm {
 public:
  /// Copies the film, unless copies would take more than their share of the time, or half of the memory that is left.
  void keep(DeviceScene& world, Film& film, RenderTimes& times) {
    if (!can_checkpoint(film) || kKeepShare * seconds_since(at_) < cost_s_) return;
    const std::uint64_t bytes = film.pixels.size() * sizeof film.pixels[0] + film.moments.size() * sizeof(glm::vec3);
    if (film_.pixels.empty() && bytes > memory_left() / 2) return;
    const Clock::time_point start = Clock::now();
    world.collect(film, times);
    film_ = film;
    cost_s_ = seconds_since(start);
    at_ = Clock::now();
  }
  const Film& film() const { return film_; }

 private:
  Film film_;  // of 0 samples: nothing is kept
  double cost_s_ = 0;
  Clock::time_point at_ = Clock::now();
};

/// The rendering of one view, in steps.
struct Rendering {
  DeviceScene& world;
  const View& view;
  const RenderJob& job;
  fs::path checkpoint;
  Film film{};
  Rendered done{};
  KeptFilm kept{};
  std::uint32_t saved = 0;  // samples in the checkpoint; 0: there is none

  void render(ProgressBar& bar);
  std::uint32_t add_samples(std::uint32_t samples, ProgressBar& bar);
  std::string save();
  [[noreturn]] void stop(const InterruptGuard& interrupt, const std::string& failure) const;
  [[noreturn]] void lose(const DeviceLost& lost);
};

/// Writes a checkpoint. Returns why it could not be written, such as a full disk; "" if it was.
std::string Rendering::save() {
  if (!can_checkpoint(film)) return "pictures with counters have no checkpoints";
  world.collect(film, done.times);
  std::string failure = ::ballot::cli::save(checkpoint, film, world.made_of(view, job.options));
  if (failure.empty()) saved = film.samples;
  return failure;
}

/// Throws Stopped, which says what was kept and how to go on. `failure` says why there is no checkpoint; "" if there is
/// one.
void Rendering::stop(const InterruptGuard& interrupt, const std::string& failure) const {
  const std::string rest = failure.empty()
                               ? fmt::format("{} keeps them; go on with: {}", checkpoint.string(), job.again)
                               : "nothing was kept: " + failure;
  throw Stopped(interrupt.signal(), fmt::format("{} stopped view {}{} after {} of {} samples; {}", interrupt.name(),
                                                view.name, job.rows, film.samples, job.options.spp, rest));
}

/// Makes a checkpoint of what the host has of the film, and throws DeviceLost, which says so too.
void Rendering::lose(const DeviceLost& lost) {
  std::string failure = "the host had no samples yet";
  const bool collected = film.samples == job.options.spp && film.on_device == 0 && can_checkpoint(film);
  const Film& here = collected ? film : kept.film();
  if (here.samples > saved) {
    failure = ::ballot::cli::save(checkpoint, here, world.made_of(view, job.options));
    if (failure.empty()) saved = here.samples;
  }
  const std::string rest =
      saved > 0 ? fmt::format("{} keeps {} of {} samples of view {}{}; go on with: {}", checkpoint.string(), saved,
                              job.options.spp, view.name, job.rows, job.again)
                : fmt::format("of view {}{} nothing was kept: {}", view.name, job.rows, failure);
  throw DeviceLost(fmt::format("{}; {}", lost.what(), rest));
}

/// Adds samples, and notes the error if the next one is due. Returns how many samples the next step should have.
std::uint32_t Rendering::add_samples(std::uint32_t samples, ProgressBar& bar) {
  const Clock::time_point start = Clock::now();
  world.advance_there(film, view, job.options, samples, done.times, [&](double share) { bar.update(share); });
  const std::uint32_t next = next_step(samples, seconds_since(start));
  if (film.samples < job.options.spp) kept.keep(world, film, done.times);  // else the whole film is collected now
  return next;
}

void Rendering::render(ProgressBar& bar) {
  const std::uint32_t spp = job.options.spp;
  const InterruptGuard interrupt;
  Clock::time_point saved_at = Clock::now();
  std::uint32_t step = 1, next_error = std::max(1u, film.samples);
  while (film.samples < spp) {
    std::uint32_t samples = std::min(step, spp - film.samples);
    if (job.reference) samples = std::min(samples, std::max(next_error, film.samples + 1) - film.samples);
    step = add_samples(samples, bar);
    if (job.reference && (film.samples >= next_error || film.samples == spp)) {
      add_error(world, film, view, job, done);
      next_error = 2 * film.samples;
    }
    if (film.samples == spp) break;
    const bool due = job.checkpoint_s > 0 && can_checkpoint(film) && seconds_since(saved_at) >= job.checkpoint_s;
    if (!due && !interrupt.wanted()) continue;
    const std::string failure = save();
    bar.hide();
    if (interrupt.wanted()) stop(interrupt, failure);
    if (!failure.empty()) say_aside("ballot: no checkpoint, but rendering goes on: {}\n", failure);
    saved_at = Clock::now();
  }
  world.collect(film, done.times);
}

}  // namespace

fs::path checkpoint_of(const fs::path& exr) { return fs::path(exr).replace_extension(".checkpoint.exr"); }

Rendered render_job(DeviceScene& world, const View& view, const RenderJob& job, const fs::path& exr) {
  const RenderOptions& o = job.options;
  const fs::path checkpoint = checkpoint_of(exr);
  const Clock::time_point begin = Clock::now();
  Rendering r{world, view, job, checkpoint};
  r.film = world.start_film(o);
  if (job.resume && fs::exists(checkpoint)) {
    if (!can_checkpoint(r.film))
      fail(Failure::Arguments,
           "--resume: pictures with counters (--stats, --shading heat) have no checkpoints; leave it out");
    read_film(checkpoint, r.film, world.made_of(view, o), o.spp);
    r.done.resumed_at = r.saved = r.film.samples;
  }
  r.done.film_s = seconds_since(begin);
  ProgressBar bar("rendering " + view.name + job.rows);
  try {
    r.render(bar);
    const Clock::time_point painted = Clock::now();
    r.done.image = world.picture(r.film, view, o, r.done.times);
    r.done.film_s += seconds_since(painted) + r.done.times.film_s;
  } catch (const DeviceLost& lost) {
    bar.hide();
    r.lose(lost);
  }
  r.done.seconds = seconds_since(begin);
  return std::move(r.done);
}

void finish_job(const fs::path& exr) {
  std::error_code ignored;
  fs::remove(checkpoint_of(exr), ignored);
}

void report_errors(const Rendered& rendered, const fs::path& exr) {
  nlohmann::json json{{"kind", "errors"}, {"picture", exr.filename().string()}, {"records", nlohmann::json::array()}};
  say("  {:>8} {:>10} {:>12} {:>12} {:>8}\n", "samples", "seconds", "RMSE", "relMSE", "FLIP");
  for (const ErrorAt& e : rendered.errors) {
    say("  {:>8} {:>10.3f} {:>12.6f} {:>12.6f} {:>8.4f}\n", e.samples, e.seconds, e.error.rmse, e.error.relmse,
        e.error.flip);
    json["records"].push_back({{"samples", e.samples},
                               {"seconds", e.seconds},
                               {"rmse", e.error.rmse},
                               {"relmse", e.error.relmse},
                               {"flip", e.error.flip}});
  }
  write_file(errors_of(exr), json_text(json, 2), Links::Replace);
  say("  errors over time: {}\n", errors_of(exr).string());
}

}  // namespace ballot::cli
