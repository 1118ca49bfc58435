// Renders pictures of a view: primary rays, traversal, shading and film. Every pass is a dispatch.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "engine/answer/tracer.h"
#include "engine/files/image.h"
#include "engine/render/data/parts.h"
#include "engine/render/data/scene_data.h"
#include "engine/render/data/shadings.h"
#include "engine/render/film/film.h"
#include "engine/render/film/heat.h"
#include "engine/render/path/waves.h"

namespace ballot {

/// Returns the shading of this name. Throws Error(Arguments) that lists the known names.
const Shading& find_shading(std::string_view name);

/// Returns the kernels of a shading's passes in the order of the passes, without those of the traversal. The kernels
/// contain no code for what `features` lack. `makes_rays` is Tracer::makes_rays().
std::vector<KernelSource> kernels_of(const Shading& shading, const SceneFeatures& features, bool makes_rays);

/// A group of channels that a picture may have.
struct Aov {
  std::string_view name;
  std::string_view channels;
  bool by_default = true;
};
inline constexpr Aov kAovs[] = {
    {"color", "R G B A: linear Rec.709 and coverage"},
    {"depth", "Z: distance along the ray to the hit of the first sample, 0 on a miss"},
    {"normal", "N.X N.Y N.Z: shading normal of that hit, towards the camera"},
    {"prim", "prim: number of the triangle of that hit"},
    {"samples", "samples: number of samples of the pixel", false},
    {"variance", "variance.R variance.G variance.B: variance of the pixel's mean; only of integrators", false},
};
/// Returns the group of this name. Throws Error(Arguments) that lists the known names.
const Aov& find_aov(std::string_view name);

/// The options of a picture; check_options() checks the ranges.
struct RenderOptions {
  std::uint32_t width = 1024, height = 1024;  // pixels, 1 to 16384 each
  std::uint32_t spp = 1;                      // samples per pixel, 1 to 65536; 1: at pixel centres; more: jittered
  std::string shading = "eyelight";           // a name of kShadings or kIntegrators
  std::string heat = "nodes";                 // the quantity that shading "heat" shows (heat.h)
  /// Adds the channels stats.*. The instrumented kernel traces the rays; its times do not represent the method's.
  bool stats = false;
  Query query = {};                    // query.want must be Nearest
  Window crop = {};                    // the requested pixels; empty: all
  Shard shard = {};                    // the tiles of them that this picture holds; other pixels look like misses
  std::vector<std::string> aovs = {};  // names of kAovs; empty: those with by_default
  std::int32_t bounces = -1;           // last path depth of an integrator, 0 to 64; -1: Integrator::last_depth
  float ao_radius = 0.1f;              // of ambient occlusion: share of the scene's diagonal, above 0
  /// Of an integrator's samples: the largest component that counts. A brighter sample is scaled down to it, which
  /// removes single bright pixels and darkens the picture a little. 0: all count as they are.
  float clamp = 0;
  std::uint32_t seed = 0;  // of the integrators' random numbers
  /// Compiles the kernels, except those of the traversal, as for a scene that has every feature: for tests.
  bool every_feature = false;
  std::uint32_t most_rays = ~0u;  // camera rays in flight at once; fewer where memory does not suffice

  Window window() const { return crop == Window{} ? Window{0, 0, width, height} : crop; }
  bool wants(std::string_view aov) const;
};

/// Throws Error(Arguments) for options that render() would refuse.
void check_options(const RenderOptions& options);

/// Bytes of the host's memory for each pixel of a picture.
struct PictureBytes {
  std::uint64_t rendered;  // at most while it is rendered, checkpointed and written; about
  std::uint64_t channels;  // of the finished picture
};
PictureBytes picture_bytes(const RenderOptions& options);

/// The times of a picture.
struct RenderTimes {
  double generate_ms = 0, trace_ms = 0, shade_ms = 0;  // device time of the passes
  double device_ms = 0;                                // device time of all passes
  double seconds = 0;                                  // wall time of everything
  double film_s = 0;                                   // the part of `seconds` that transfers of films take
  std::uint64_t rays = 0;                              // of all kinds; of a shading: pixels times samples
  PassTimes passes = {};                               // the integrators' passes by name
  float heat_top = 0;                                  // the value of the last colour of a heat map
  double mrays_per_s() const { return trace_ms > 0 ? double(rays) / trace_ms * 1e-3 : 0; }
  /// Adds the times of another part of the picture.
  void add(const RenderTimes& part);
};

/// Where the sums of a film are after a step.
enum class Sums { Here, OnDevice };

/// Renders films and turns them into pictures. Belongs to one thread.
class Renderer {
 public:
  /// Keeps references to all arguments.
  Renderer(Context& gpu, Tracer& tracer, SceneData& scene);
  ~Renderer();

  /// Returns a film without samples. Throws Error(Arguments) on bad options.
  Film start(const RenderOptions& options) const;

  /// Adds up to `samples` samples to every pixel of a film, but never more than options.spp in all. The sums do not
  /// depend on how the samples are split over calls. Adds the times of this step to `times`.
  ///
  /// With Sums::OnDevice the sums stay on the device until collect(), if the device has room for the whole film. Until
  /// then the film's pixels and moments are out of date: do not continue a copy of it, and do not render another film.
  /// Throws Error(Arguments) on bad options, and Error(Work) if the sums are no longer on the device.
  void advance(Film& film, const View& view, const RenderOptions& options, std::uint32_t samples, RenderTimes& times,
               const Progress& progress = {}, Sums sums = Sums::Here);

  /// Downloads the sums of a film that are still on the device. Throws Error(Work) if they are no longer there.
  void collect(Film& film, RenderTimes& times);

  /// Returns the channels of options.aovs, and stats.* where requested, without attributes. Writes the scale of a heat
  /// map to `times`.
  Image picture(const Film& film, const RenderOptions& options, RenderTimes& times) const;

  /// Returns about the bytes of all buffers that this renderer will have on the device for these pictures.
  std::uint64_t bytes_for(const View& view, const RenderOptions& options) const;

  /// Returns the bytes of all buffers of this renderer on the device, without the scene and its tree.
  std::uint64_t bytes() const;

 private:
  struct Passes;
  bool holds(const Film& film) const;
  bool take(const Film& film);
  void download(Film& film, bool waves, std::size_t first, std::size_t count, RenderTimes& times) const;
  void add_totals(const RenderOptions& options, std::uint64_t samples, RenderTimes& times) const;
  void prepare_trace(const RenderOptions& options, const SceneFeatures& features, bool counts, std::uint64_t rays);
  Passes& passes(const RenderOptions& options, const SceneFeatures& features, std::uint32_t chunk,
                 std::uint32_t samples);
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
  std::unique_ptr<Passes> passes_;  // of the shading of the last picture
  // The pixels of an integrator's current chunk, and their sums.
  std::unique_ptr<Buffer<std::uint32_t>> listed_;
  std::unique_ptr<Buffer<FilmPixel>> film_;
  std::unique_ptr<Buffer<glm::vec3>> moments_;
  std::uint64_t held_ = 0, named_ = 0;  // Film::on_device of the sums in the buffers, 0: none; the last id given out
  bool held_by_waves_ = false;          // the sums are in film_ and moments_; else in passes_->film
};

}  // namespace ballot
