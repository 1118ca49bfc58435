// The plots of a report, which a Python script of tools/ draws with matplotlib.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ballot::bench {

struct Plots {
  std::vector<std::string> files;  // names of the SVG files in the folder
  std::string missing;             // what to install and which command to run then; "" if the plots were drawn
};

/// Draws the plots of the file folder/results into the folder by running tools/script. Throws Error(Work) if the script
/// fails for another reason than missing matplotlib.
Plots draw_plots(const std::filesystem::path& folder, const std::string& script = "plot_bench.py",
                 const std::string& results = "results.json");

/// Returns the section of a report that shows the plots, or says why there are none.
std::string plot_section(const Plots& plots);

}  // namespace ballot::bench
