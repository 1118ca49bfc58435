// Checks the options of a picture.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/registry.h"
#include "engine/render/data/camera.h"
#include "engine/render/film/renderer.h"

namespace ballot {

const Shading& find_shading(std::string_view name) {
  if (const Shading* shading = find_row(kShadings, name)) return *shading;
  fail(Failure::Arguments, "no shading is called '{}'; there are: {}, {}", name, names_of(kShadings),
       names_of(kIntegrators));
}

void check_options(const RenderOptions& o) {
  check_size(o.width, o.height);
  if (o.spp < 1 || o.spp > 65536) fail(Failure::Arguments, "spp: {} is not between 1 and 65536", o.spp);
  if (!find_integrator(o.shading)) find_shading(o.shading);
  find_heat(o.heat);
  const Window w = o.window();
  if (w.x0 >= w.x1 || w.y0 >= w.y1 || w.x1 > o.width || w.y1 > o.height)
    fail(Failure::Arguments, "crop: pixels {},{} to {},{} are empty or not inside the picture of {}x{}", w.x0, w.y0,
         w.x1, w.y1, o.width, o.height);
  if (o.shard.count < 1 || o.shard.index >= o.shard.count)
    fail(Failure::Arguments, "tiles: part {} of {} is not between 0/1 and (n-1)/n", o.shard.index, o.shard.count);
  if (o.bounces < -1 || o.bounces > 64) fail(Failure::Arguments, "bounces: {} is not between 0 and 64", o.bounces);
  if (!(std::isfinite(o.clamp) && o.clamp >= 0))
    fail(Failure::Arguments, "clamp: {} is not a finite radiance of 0 or more", o.clamp);
  if (!(std::isfinite(o.ao_radius) && o.ao_radius > 0))
    fail(Failure::Arguments, "ao-radius: {} of the scene's diagonal is not above 0", o.ao_radius);
  for (const std::string& aov : o.aovs) find_aov(aov);
  if (o.shard.count > 1 && o.shading == "heat")
    fail(Failure::Arguments, "tiles: shading heat scales its colours by the whole picture; render it in one part");
  if (o.wants("variance") && !find_integrator(o.shading))
    fail(Failure::Arguments, "aov variance: shading '{}' keeps none; take one of: {}", o.shading,
         names_of(kIntegrators));
  if (o.stats && find_integrator(o.shading))
    fail(Failure::Arguments, "stats: shading '{}' traces rays of several kinds; take eyelight, normals or heat",
         o.shading);
}

const Aov& find_aov(std::string_view name) { return find_named(kAovs, name, "AOV"); }

bool RenderOptions::wants(std::string_view aov) const {
  if (aovs.empty()) return find_aov(aov).by_default;
  return std::ranges::find(aovs, aov) != aovs.end();
}

}  // namespace ballot
