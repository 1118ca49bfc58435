// Pictures of viewpoints: primary rays, traversal, shading, film; every pass a dispatch.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "engine/core/image.h"
#include "engine/render/data/scene_data.h"
#include "engine/render/film/film.h"
#include "engine/render/film/heat.h"
#include "engine/render/film/parts.h"
#include "engine/render/path/waves.h"
#include "engine/trace/tracer.h"

namespace ballot {

/// Every shading of the eye's own hits: a line here and a branch of shaders/lib/shade/shade_hit.glsl. Those that start further rays:
/// integrators.h.
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

/// Kernels of a shading's passes, in their order, but for those of the traversal: what `features` lack is in none of them.
/// `makes_rays`: as Tracer::makes_rays() says.
std::vector<KernelSource> kernels_of(const Shading& shading, const SceneFeatures& features, bool makes_rays);

/// Every group of channels that a picture may have.
struct Aov {
  std::string_view name;
  std::string_view channels;
  bool by_default = true;
};
inline constexpr Aov kAovs[] = {
    {"color", "R G B A: linear Rec.709 and coverage"},
    {"depth", "Z: distance along the ray to what the first sample hits, 0 on a miss"},
    {"normal", "N.X N.Y N.Z: its shading normal, towards the eye"},
    {"prim", "prim: its number"},
    {"samples", "samples: how many the pixel has", false},
    {"variance", "variance.R variance.G variance.B: of the pixel's mean; whitted, path and ao alone", false},
};
/// Throws Error(Arguments) that lists the groups there are.
const Aov& find_aov(std::string_view name);

struct RenderOptions {
  std::uint32_t width = 1024, height = 1024;  // 1 to 16384 each
  std::uint32_t spp = 1;                      // 1: through pixel centres; more: jittered, 1 to 65536
  std::string shading = "eyelight";           // a name of kShadings or kIntegrators
  std::string heat = "nodes";                 // what shading "heat" shows (heat.h)
  bool stats = false;  // channels stats.*, traced by the instrumented kernel, whose times say nothing of the method
  Query query = {};    // want is Nearest
  Window crop = {};    // pixels that are wanted; empty: all
  Shard shard = {};    // the part of them that this picture holds; the others are as misses
  std::vector<std::string> aovs = {};  // names of kAovs; empty: those that are so by default
  std::int32_t bounces = -1;           // of integrators, 0 to 64; -1: as many as the integrator has by itself
  float ao_radius = 0.1f;              // of ambient occlusion: share of the scene's diagonal, above 0
  std::uint32_t seed = 0;              // of the integrators' random numbers
  bool every_feature =
      false;  // kernels but the traversal's as for a scene that has everything: to measure what that costs
  std::uint32_t most_rays = ~0u;  // of the eye, under way at once; fewer where there is no room for so many

  Window window() const { return crop == Window{} ? Window{0, 0, width, height} : crop; }
  bool wants(std::string_view aov) const;
};

/// Throws Error(Arguments) for a size, sample count or shading that render() would refuse.
void check_options(const RenderOptions& options);

struct RenderTimes {
  double generate_ms = 0, trace_ms = 0, shade_ms = 0;  // device time of the passes
  double device_ms = 0;                                // of all passes
  double seconds = 0;                                  // wall time of all
  double film_s = 0;                                   // of that: films to and from the device
  std::uint64_t rays = 0;                              // of all kinds; of a shading pixels times samples
  PassTimes passes = {};                               // what integrators spent on each pass
  float heat_top = 0;                                  // what the last colour of a heat map stands for
  double mrays_per_s() const { return trace_ms > 0 ? double(rays) / trace_ms * 1e-3 : 0; }
};

/// Where the sums of a film are when a step has ended.
enum class Sums { Here, OnDevice };

class Renderer {
 public:
  /// Keeps references to all of them.
  Renderer(Context& gpu, Tracer& tracer, SceneData& scene);
  ~Renderer();

  /// A film without samples. Throws Error(Arguments) on bad options.
  Film start(const RenderOptions& options) const;

  /// Adds up to `samples` samples to every pixel of a film, no more than the options want. Samples may be added in any parts:
  /// the sums are the same. Adds to `times`. Sums that may stay on the device, and a film all of which finds room there, stay until
  /// collect(): till then the film's pixels and moments are out of date, and neither is a copy of it gone on with nor another film.
  void advance(Film& film, const View& view, const RenderOptions& options, std::uint32_t samples, RenderTimes& times,
               const Progress& progress = {}, Sums sums = Sums::Here);
  void collect(Film& film, RenderTimes& times);

  /// The channels of options.aovs, and where asked for stats.*; without attributes. A heat map's scale goes to `times`.
  Image picture(const Film& film, const RenderOptions& options, RenderTimes& times) const;

  /// Bytes on the device for what is under way, without the scene and its tree.
  std::uint64_t bytes() const;

 private:
  struct Passes;
  bool holds(const Film& film) const;
  bool take(const Film& film);
  void download(Film& film, bool waves, std::size_t first, std::size_t count, RenderTimes& times) const;
  void add_totals(const RenderOptions& options, std::uint64_t samples, RenderTimes& times) const;
  Passes& passes(const RenderOptions& options, const SceneFeatures& features, std::uint32_t chunk);
  Sky::Kind sky_kind(const RenderOptions& options) const;
  std::uint32_t most_paths(const Integrator& integrator, const SceneFeatures& features, const RenderOptions& options,
                           std::uint64_t pixels) const;
  struct Chunk;
  Part largest_part_of(const Chunk& chunk, const RenderOptions& options) const;
  bool makes_rays() const;
  void trace_samples(const std::vector<PrimaryPush>& cameras, std::uint32_t i, const Query& query, RenderTimes& times);
  void shade_samples(Film& film, const Chunk& chunk, const PrimaryPush& camera, const RenderOptions& options,
                     RenderTimes& times, const Progress& progress);
  void wave_samples(Film& film, const Chunk& chunk, const PrimaryPush& camera, const SceneFeatures& features,
                    const RenderOptions& options, RenderTimes& times, const Progress& progress);

  Context& gpu_;
  Tracer& tracer_;
  SceneData& scene_;
  Waves waves_;
  std::unique_ptr<Passes> passes_;                 // of the last picture's shading
  std::unique_ptr<Buffer<std::uint32_t>> listed_;  // of the part of an integrator's picture that is under way
  std::unique_ptr<Buffer<FilmPixel>> film_;
  std::unique_ptr<Buffer<glm::vec3>> moments_;
  std::uint64_t held_ = 0, named_ = 0;  // Film::on_device of what the buffers hold; the last name given
  bool held_by_waves_ = false;
};

}  // namespace ballot
