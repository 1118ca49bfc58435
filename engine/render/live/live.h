// A picture that stays on the device and gets better sample by sample: what a window shows.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/render/batch/ray_kinds.h"
#include "engine/render/data/scene_data.h"
#include "engine/render/film/heat.h"
#include "engine/render/film/renderer.h"
#include "engine/trace/tracer.h"

namespace ballot {

struct LiveOptions {
  std::uint32_t width = 1280, height = 720;  // 1 to 16384 each
  std::uint32_t sample_index = 0;            // 0 begins a new picture; else one sample is added to the last one
  std::uint32_t sample_count = 1;            // 1: through pixel centres; more: jittered
  std::string rays = "primary";              // a ray kind: its rays are shown, those from hits once a hit
  std::string shading = "eyelight";          // of what nearest hits find; "heat" is of this kind's rays
  std::string heat = "nodes";
  Query query = {};            // want is the ray kind's
  std::optional<Query> other;  // traces the same rays; its picture is shown from column `split` on
  std::uint32_t split = 0;     // and pixels are marked where the two find different prims
  float ao_radius = 0.05f;     // share of the scene's diagonal
  bool swap_red = false;       // blue in the lowest byte of a pixel, else red
};

/// Device milliseconds of one sample.
struct LiveTimes {
  double generate_ms = 0;             // primary rays, and this kind's from their hits
  double primary_ms = 0;              // tracing primary rays where the kind is another
  double trace_ms = 0, other_ms = 0;  // tracing this kind's rays, by either query
  double shade_ms = 0;                // hits to film and to pixels
  std::uint64_t rays = 0;             // alive, of the kind; of heat maps, those of the first sample
  std::uint64_t different = 0;        // pixels whose prims differ
  float heat_top = 0;                 // what the last colour of a heat map stands for
  double total_ms() const { return generate_ms + primary_ms + trace_ms + other_ms + shade_ms; }
  double mrays_per_s() const { return trace_ms > 0 ? double(rays) / trace_ms * 1e-3 : 0; }
  double other_mrays_per_s() const { return other_ms > 0 ? double(rays) / other_ms * 1e-3 : 0; }
};

/// The primary ray through a pixel's centre and what it hits, traced among the rays of its tile as in the picture.
struct Probe {
  Ray ray{};
  Hit hit{};
  bool counted = false;
  RayStats stats{};  // of the ray, where counted
};

/// Kernels of live pictures alone, for compiling them ahead.
std::vector<KernelSource> live_sources();

class LiveImage {
 public:
  /// Keeps references to all of them.
  LiveImage(Context& gpu, Tracer& tracer, SceneData& scene);
  ~LiveImage();

  /// Adds a sample to the picture, or begins a new one. A sample after the first takes view, size, rays and split of the
  /// one before; changing them is the caller's mistake. Throws Error(Arguments) on bad options, Error(Work) as trace()
  /// does; the picture is then undefined until a new one is begun.
  LiveTimes add_sample(const View& view, const LiveOptions& options);

  /// The picture, 8 bits a channel, sRGB, rows from the top; width * height of the last sample are in use. The buffer
  /// moves only when the picture outgrows it.
  const Buffer<std::uint32_t>& pixels() const { return *pixels_; }

  /// What the pixel's primary ray meets under options.query; `count` asks for the instrumented variant.
  Probe probe(const View& view, const LiveOptions& options, std::uint32_t x, std::uint32_t y, bool count);

 private:
  struct Slice {  // what one dispatch takes of a picture
    std::size_t chunk;
    const SceneFeatures& features;  // as the picture's view shows them
    PrimaryPush camera;
    std::uint32_t count;  // rays
    bool made;            // by the traversal
  };
  struct Sample {
    std::uint32_t number;  // 0 begins the film
    bool second;           // of the query beside the first
    bool shown;            // by the pass that shades it
  };

  void check(const LiveOptions& options) const;
  void make_room(const LiveOptions& options, bool counts);
  Kernel& kernel(const KernelSource& source);
  bool makes_rays(const LiveOptions& options, std::uint32_t count) const;
  glm::vec3 light_of(const View& view);
  void sample_slice(const Slice& slice, const LiveOptions& options, LiveTimes& times);
  TilesPush make_tiles(const TilesPush& tiles, LiveTimes& times);
  void generate_secondary(std::string_view generator, const Slice& slice, const LiveOptions& options, LiveTimes& times);
  void trace_and_shade(const Slice& slice, const Buffer<Ray>* rays, const LiveOptions& options, bool second,
                       std::uint32_t part, LiveTimes& times);
  void trace_slice(const Slice& slice, const Buffer<Ray>* rays, Buffer<Hit>& hits, const LiveOptions& options,
                   const Query& query, double& ms);
  void shade_slice(const Slice& slice, const Buffer<Ray>* rays, const Buffer<Hit>& hits, const LiveOptions& options,
                   const Sample& of, LiveTimes& times);
  void paint_heat(const Slice& slice, const LiveOptions& options, const Query& query, Buffer<LivePixel>& film,
                  std::uint32_t sample, LiveTimes& times);
  void display(const Slice& slice, const LiveOptions& options, LiveTimes& times);

  Context& gpu_;
  Tracer& tracer_;
  SceneData& scene_;
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;  // by name
  std::uint32_t chunk_rays_ = 0;
  std::uint32_t width_ = 0;  // that the starts were made for
  std::unique_ptr<Buffer<Ray>> rays_, secondary_;
  std::unique_ptr<Buffer<Hit>> hits_, secondary_hits_;
  std::unique_ptr<Buffer<RayStats>> stats_;
  std::unique_ptr<Buffer<Start>> starts_;  // one a pixel of a chunk
  std::uint32_t starts_first_ = 0;
  std::unique_ptr<Buffer<std::uint32_t>> tiles_;  // the pixels of a picture's rays
  TilesPush tiles_of_{};                          // which
  Buffer<PrimaryPush> camera_;                    // of the rays that traversal makes
  Buffer<Ray> light_ray_;
  Buffer<Hit> light_hit_, light_seen_;                // the second in the host's memory
  std::vector<Buffer<LivePixel>> film_, other_film_;  // a chunk each
  std::unique_ptr<Buffer<std::uint32_t>> pixels_;
  Buffer<DisplayTotals> totals_, totals_seen_;  // the second in the host's memory
  std::uint64_t counted_ = 0;                   // rays of the last picture that were alive
  glm::vec3 light_{0};
  float heat_top_ = 0;
};

}  // namespace ballot
