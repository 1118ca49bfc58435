// Plots of a report, drawn by tools/plot_bench.py with matplotlib.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ballot::bench {

struct Plots {
  std::vector<std::string> files;  // SVG, names within the folder
  std::string missing;             // what to install and what to type then; "" if the plots were drawn
};

/// Draws the plots of folder/results.json into the folder. Throws Error(Work) if matplotlib is there and the script
/// fails all the same.
Plots draw_plots(const std::filesystem::path& folder);

}  // namespace ballot::bench
