// Pictures of viewpoints: primary rays, traversal, shading, film; every pass a dispatch.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "engine/core/image.h"
#include "engine/render/heat.h"
#include "engine/render/scene_data.h"
#include "engine/trace/tracer.h"

namespace ballot {

/// Every shading there is: a line here and a branch of shaders/shade/shade.comp.
struct Shading {
  std::string_view name;
  int value;  // BALLOT_SHADING
  std::string_view summary;
  bool heat = false;  // colours come from the counters (heat.h)
};
inline constexpr Shading kShadings[] = {
    {"eyelight", SHADING_EYELIGHT, "base colour times the cosine to the eye, plus emission"},
    {"normals", SHADING_NORMALS, "shading normal as colour, n / 2 + 1/2"},
    {"heat", SHADING_NORMALS, "how much the traversal works, see --heat; by the instrumented kernel", true},
};
/// Throws Error(Arguments) that lists the shadings there are.
const Shading& find_shading(std::string_view name);

struct RenderOptions {
  std::uint32_t width = 1024, height = 1024;  // 1 to 16384 each
  std::uint32_t spp = 1;                      // 1: through pixel centres; more: jittered, 1 to 65536
  std::string shading = "eyelight";
  std::string heat = "nodes";  // what shading "heat" shows (heat.h)
  bool stats = false;  // channels stats.*, traced by the instrumented kernel, whose times say nothing of the method
  Query query = {};    // want is Nearest
};

/// Throws Error(Arguments) for a size, sample count or shading that render() would refuse.
void check_options(const RenderOptions& options);

struct RenderTimes {
  double generate_ms = 0, trace_ms = 0, shade_ms = 0;  // device time of the passes
  double seconds = 0;                                  // wall time of all
  std::uint64_t rays = 0;                              // pixels times samples
  float heat_top = 0;                                  // what the last colour of a heat map stands for
  double mrays_per_s() const { return trace_ms > 0 ? double(rays) / trace_ms * 1e-3 : 0; }
};

class Renderer {
 public:
  /// Keeps references to all of them.
  Renderer(Context& gpu, Tracer& tracer, SceneData& scene);
  ~Renderer();

  /// Channels R G B A, Z, N.X N.Y N.Z, prim, and where asked for stats.*; without attributes. Throws Error(Arguments) on bad options.
  Image render(const View& view, const RenderOptions& options, RenderTimes* times = nullptr,
               const Progress& progress = {});

 private:
  struct Passes;
  Passes& passes(const RenderOptions& options, std::uint32_t chunk);
  double trace(Passes& passes, std::uint32_t count, const Query& query);
  void trace_sample(Passes& passes, const PrimaryPush& camera, std::uint32_t count, const Query& query,
                    RenderTimes& times);

  Context& gpu_;
  Tracer& tracer_;
  SceneData& scene_;
  std::unique_ptr<Passes> passes_;  // of the last picture
};

}  // namespace ballot
