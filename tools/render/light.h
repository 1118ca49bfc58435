// The options --sky and --lamp: light that is added to the scene's own.
#pragma once

#include <string>
#include <vector>

#include "tools/program/cli.h"

namespace ballot::cli {

struct LightArgs {
  std::string sky = "auto";
  std::vector<std::string> lamps;

  void add_to(CLI::App& app);
  /// Sets the scene's sky and adds the lamps. Sky "auto" is a gradient if `shading` is an integrator that sees
  /// materials, the scene has no light and no unlit material, and no lamp is given. A lamp at "eye" is placed at the
  /// camera of each of the views. Throws Error(Arguments) for a malformed option, and Error(Work) for a picture of the
  /// sky that cannot be used.
  void apply(Scene& scene, const std::vector<const View*>& views, const std::string& shading) const;
};

}  // namespace ballot::cli
