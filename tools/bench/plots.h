// Plots of a report, drawn by a script of tools/ with matplotlib.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ballot::bench {

struct Plots {
  std::vector<std::string> files;  // SVG, names within the folder
  std::string missing;             // what to install and what to type then; "" if the plots were drawn
};

/// Draws the plots of folder/results into the folder by tools/script. Throws Error(Work) if matplotlib is there and the
/// script fails all the same.
Plots draw_plots(const std::filesystem::path& folder, const std::string& script = "plot_bench.py",
                 const std::string& results = "results.json");

/// The part of a report that shows them, or says why there are none.
std::string plot_section(const Plots& plots);

}  // namespace ballot::bench
