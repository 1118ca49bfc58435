// The section on the setup: devices, scenes, rays and commands of the runs.
#include <set>

#include "tools/bench/markdown.h"
#include "tools/bench/report.h"
#include "tools/shell_word.h"

namespace ballot::bench {

namespace {

void add_run(std::string& text, const Document& d) {
  std::set<std::string> scenes, kinds, modes;
  for (const Record& r : d.records) {
    scenes.insert(r.scene);
    kinds.insert(r.rays);
    modes.insert(r.numeric);
  }
  const auto list = [](const std::set<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); };
  text += fmt::format("- {}, driver {}, subgroups of {}. Clock: {}. {} x {} pixels, {} repeats interleaved{}{}.\n",
                      d.device, d.driver, d.subgroup_size, d.clock, d.size[0], d.size[1], d.repeats,
                      d.sweep_repeats ? fmt::format(", {} in sweeps", d.sweep_repeats) : "",
                      d.date.empty() ? "" : ", " + d.date);
  if (!d.hard.empty()) text += fmt::format("  Hard cases: {} records.\n", d.hard.size());
  if (!d.records.empty())
    text += fmt::format("  Scenes: {}. Rays: {}. Numeric modes: {}. {} records, commit {}.\n", list(scenes),
                        list(kinds), list(modes), d.records.size(), d.commit);
  if (kinds.contains("ao"))
    text += fmt::format("  Rays of kind ao: {} per hit, of length {:g} times the scene's diagonal.\n", d.ao_rays,
                        d.ao_radius);
  if (d.offset != kDefaultOffset) text += fmt::format("  Origin offset policy of secondary rays: {}.\n", d.offset);
  if (d.partial) text += "  **The run was interrupted: the missing records were not measured.**\n";
  std::string environment;
  for (const auto& [name, value] : d.environment) environment += name + "=" + shell_word(value) + " ";
  text += fmt::format("\n  ```\n  {}{}\n  ```\n", environment, d.command);
}

}  // namespace

std::string runs_text(const std::vector<Document>& documents) {
  std::string text;
  for (const Document& d : documents) add_run(text, d);
  return text;
}

std::string setup_section(const std::vector<Document>& documents, const Arranged& arranged) {
  std::string text = "## What was measured\n\n" + runs_text(documents);
  text +=
      "\nTrace times are of the traversal alone. Mrays/s is the number of rays of all views divided by the sum of the "
      "median\ntimes. A frame lasts from ray generation to film; FPS is the mean over the views of 1000 ms / median. "
      "\"(best)\" is the\nmethod with the threshold that a sweep in the same run found fastest for this scene and ray "
      "kind.\n";
  if (arranged.replaced)
    text += fmt::format("\n{} records were measured twice; the tables show those of the file named last.\n",
                        arranged.replaced);
  return text + "\n";
}

}  // namespace ballot::bench
