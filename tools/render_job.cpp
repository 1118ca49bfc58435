#include "tools/render_job.h"

#include <algorithm>
#include <chrono>

#include "tools/bench/plots.h"
#include "tools/interrupt.h"

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kStepSeconds = 4;     // target length of a step: checkpoints come in time, and passes stay large
constexpr std::uint32_t kGrowth = 16;  // largest ratio of a step to the one before it: the first one also compiles

/// Returns the samples of the next step, given that a step of `samples` took `seconds`.
std::uint32_t next_step(std::uint32_t samples, double seconds) {
  const double wanted = samples * kStepSeconds / std::max(seconds, 1e-6);
  return std::uint32_t(std::clamp(wanted, 1.0, double(samples) * kGrowth));
}

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

bool can_checkpoint(const Film& film) { return film.stats.empty(); }

fs::path errors_of(const fs::path& exr) { return fs::path(exr).replace_extension(".errors.json"); }

void add_error(Engine& engine, Film& film, const View& view, const RenderJob& job, Rendered& done) {
  engine.collect(film, done.times);
  RenderTimes times = done.times;
  const Image image = engine.picture(film, view, job.options, times);
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

/// Throws Stopped, which says what was kept and how to go on. `failure` says why there is no checkpoint; "" if there is
/// one.
[[noreturn]] void stop(const InterruptGuard& interrupt, const View& view, const RenderJob& job, const Film& film,
                       const fs::path& checkpoint, const std::string& failure) {
  const std::string kept = failure.empty()
                               ? fmt::format("{} keeps them; go on with: {}", checkpoint.string(), job.again)
                               : "nothing was kept: " + failure;
  throw Stopped(interrupt.signal(), fmt::format("{} stopped view {} after {} of {} samples; {}", interrupt.name(),
                                                view.name, film.samples, job.options.spp, kept));
}

}  // namespace

fs::path checkpoint_of(const fs::path& exr) { return fs::path(exr).replace_extension(".checkpoint.exr"); }

Rendered render_job(Engine& engine, const View& view, const RenderJob& job, const fs::path& exr) {
  const RenderOptions& o = job.options;
  const fs::path checkpoint = checkpoint_of(exr);
  const Clock::time_point begin = Clock::now();
  Rendered done;
  Film film = engine.start_film(o);
  if (job.resume && fs::exists(checkpoint)) {
    if (!can_checkpoint(film))
      fail(Failure::Arguments,
           "--resume: pictures with counters (--stats, --shading heat) have no checkpoints; leave it out");
    read_film(checkpoint, film, engine.made_of(view, o), o.spp);
    done.resumed_at = film.samples;
  }
  done.film_s = seconds_since(begin);
  ProgressBar bar("rendering " + view.name);
  const InterruptGuard interrupt;
  Clock::time_point saved = Clock::now();
  std::uint32_t step = 1, next_error = std::max(1u, film.samples);
  while (film.samples < o.spp) {
    const Clock::time_point start = Clock::now();
    std::uint32_t samples = std::min(step, o.spp - film.samples);
    if (job.reference) samples = std::min(samples, std::max(next_error, film.samples + 1) - film.samples);
    engine.advance_there(film, view, o, samples, done.times, [&](double share) { bar.update(share); });
    step = next_step(samples, seconds_since(start));
    if (job.reference && (film.samples >= next_error || film.samples == o.spp)) {
      add_error(engine, film, view, job, done);
      next_error = 2 * film.samples;
    }
    if (film.samples == o.spp) break;
    const bool due = job.checkpoint_s > 0 && can_checkpoint(film) && seconds_since(saved) >= job.checkpoint_s;
    if (!due && !interrupt.wanted()) continue;
    std::string failure = "pictures with counters have no checkpoints";
    if (can_checkpoint(film)) {
      engine.collect(film, done.times);
      failure = save(checkpoint, film, engine.made_of(view, o));
    }
    bar.hide();
    if (interrupt.wanted()) stop(interrupt, view, job, film, checkpoint, failure);
    if (!failure.empty()) say_aside("ballot: no checkpoint, but rendering goes on: {}\n", failure);
    saved = Clock::now();
  }
  engine.collect(film, done.times);
  const Clock::time_point painted = Clock::now();
  done.image = engine.picture(film, view, o, done.times);
  done.film_s += seconds_since(painted) + done.times.film_s;
  done.seconds = seconds_since(begin);
  return done;
}

void finish_job(const fs::path& exr) {
  std::error_code ignored;
  fs::remove(checkpoint_of(exr), ignored);
}

void report_errors(const Rendered& rendered, const fs::path& exr) {
  nlohmann::json json{{"picture", exr.filename().string()}, {"records", nlohmann::json::array()}};
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
  const fs::path file = errors_of(exr), folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  write_file(file, json_text(json, 2));
  const bench::Plots plots = bench::draw_plots(folder, "plot_render.py", file.filename().string());
  say("  errors over time: {}{}\n", file.string(),
      plots.files.empty() ? "; no plot: " + plots.missing : " and " + (folder / plots.files[0]).string());
}

}  // namespace ballot::cli
