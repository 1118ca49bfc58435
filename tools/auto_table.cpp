#include "tools/auto_table.h"

#include <algorithm>

#include "tools/bench/markdown.h"

namespace ballot::cli {

namespace {

std::string speed(const Candidate& c) {
  if (c.put_off_s > 0) return fmt::format("{} (put off, as it takes {:.1f} s to compile)", c.name(), c.put_off_s);
  if (!c.tried) return c.name() + " (not tried yet)";
  return c.mrays_per_s > 0 ? fmt::format("{} {}", c.name(), bench::figure(c.mrays_per_s)) : c.name() + " (cannot run)";
}

/// Returns the candidates that were not chosen and their speeds, for example "while-while 6.8; dynamic-fetch 6.0".
std::string others(const Choice& choice) {
  std::string text;
  for (std::size_t i = 1; i < choice.candidates.size(); ++i) text += (i > 1 ? "; " : "") + speed(choice.candidates[i]);
  return text.empty() ? "no other (the only method for this mode)" : text;
}

nlohmann::json to_json(const Choice& choice) {
  nlohmann::json candidates = nlohmann::json::array();
  for (const Candidate& c : choice.candidates)
    candidates.push_back({{"method", c.method},
                          {"knobs", c.knobs},
                          {"mrays_per_s", c.mrays_per_s},
                          {"tried", c.tried},
                          {"put_off_s", c.put_off_s}});
  return {{"rays", choice.rays},
          {"any", choice.want == Want::Any},
          {"numeric", choice.numeric},
          {"knobs", choice.knobs},
          {"sampled", choice.sampled},
          {"calibration_s", choice.seconds},
          {"remembered", choice.remembered},
          {"candidates", candidates}};
}

}  // namespace

void calibrate(Engine& engine, const std::string& numeric) {
  engine.tracer().choices().clear();
  engine.tracer().choices().try_all = true;
  const std::uint32_t side = engine.device().is_cpu() ? 512 : 1024;
  ProgressBar bar("calibrating");
  double done = 0;
  for (const RayKind& kind : kRayKinds) {
    const auto batch = engine.make_batch(engine.scene().views.front(), kind, side, side);
    engine.resolve(*batch, {.method = std::string(kAuto), .numeric = numeric});
    bar.update(++done / double(std::size(kRayKinds)));
  }
}

nlohmann::json print_choices(const std::vector<Choice>& choices) {
  nlohmann::json json = nlohmann::json::array();
  if (choices.empty()) {
    say("\nauto has chosen nothing yet for this scene on this device. It chooses when many rays of a class are first\n"
        "traced; --calibrate makes it choose now.\n");
    return json;
  }
  say("\nmethods that auto chose for this scene on this device; speeds are Mrays/s on a sample of the rays:\n\n");
  bench::Table table({"rays", "numeric mode", "chosen", "instead of", "Mrays/s", "calibration s"}, 4);
  for (const Choice& c : choices) {
    table.row({c.rays + (c.want == Want::Any ? " (any hit)" : ""), c.numeric, c.chosen().name(), others(c),
               bench::figure(c.chosen().mrays_per_s), fmt::format("{:.2f}", c.seconds)});
    json.push_back(to_json(c));
  }
  say("{}", table.text());
  return json;
}

std::string choice_line(Engine& engine, const Query& query) {
  if (query.method != kAuto) return "";
  const Choice* choice = engine.tracer().choices().find(query);
  if (!choice) return "auto: too few rays to compare methods, so it used its default";
  return fmt::format("auto: {}, {}; {} Mrays/s on a sample, instead of {}", choice->chosen().name(),
                     choice->remembered ? "as chosen before" : fmt::format("chosen in {:.2f} s", choice->seconds),
                     bench::figure(choice->chosen().mrays_per_s), others(*choice));
}

}  // namespace ballot::cli
