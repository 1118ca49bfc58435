// Light that a picture is to have besides the scene's own.
#pragma once

#include <string>
#include <vector>

#include "tools/cli.h"

namespace ballot::cli {

struct LightArgs {
  std::string sky = "auto";
  std::vector<std::string> lamps;

  void add_to(CLI::App& app);
  /// Sets the sky and adds the lamps. Sky "auto" is a gradient for whitted and path where nothing in the scene shines and no lamp
  /// is asked for. A lamp at "eye" is one at the eye of each of the views. Throws Error(Arguments).
  void apply(Scene& scene, const std::vector<const View*>& views, const std::string& shading) const;
};

}  // namespace ballot::cli
