// The picture of a window: it stays on the device and improves with every sample.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/answer/tracer.h"
#include "engine/render/batch/ray_kinds.h"
#include "engine/render/data/scene_data.h"
#include "engine/render/film/heat.h"
#include "engine/render/film/renderer.h"
#include "engine/render/live/live_paths.h"

namespace ballot {

/// The primary ray through a pixel's centre and its hit. It is traced together with the rays of its tile, as in the
/// picture.
struct Probe {
  Ray ray{};
  Hit hit{};
  bool counted = false;
  RayStats stats{};  // counters of the ray, if `counted`
};

/// Returns the kernels that only live pictures use, for compiling them ahead.
std::vector<KernelSource> live_sources();

/// The picture on the device. Belongs to one thread.
class LiveImage {
 public:
  /// Keeps references to all arguments. `origin` is the point of the views' world that is the scene's zero.
  LiveImage(Context& gpu, Tracer& tracer, SceneData& scene, const glm::vec3& origin = glm::vec3(0));
  ~LiveImage();

  const glm::vec3& origin() const { return origin_; }

  /// Adds a sample to the picture, or begins a new one. A sample after the first must have the view, size and rays of
  /// the one before it; this is not checked. Throws Error(Arguments) on bad options, Error(Work) as trace()
  /// does; the picture is then undefined until a new one is begun.
  LiveTimes add_sample(const View& view, const LiveOptions& options);

  /// Returns the picture: 8 bits per channel, sRGB, blue in the lowest byte, rows from the top. The first
  /// width * height pixels, as of the last sample, are in use. The buffer is replaced only when the picture outgrows
  /// it.
  const Buffer<std::uint32_t>& pixels() const { return *pixels_; }

  /// Traces the primary ray of a pixel with options.query. With `count` the instrumented variant traces it.
  /// Throws Error(Arguments) on bad options and if the pixel is not in the picture.
  Probe probe(const View& view, const LiveOptions& options, std::uint32_t x, std::uint32_t y, bool count);

 private:
  /// The rays of a picture that one dispatch takes.
  struct Slice {
    std::size_t chunk;              // index into film_
    const SceneFeatures& features;  // with the kind of camera of the picture's view alone
    PrimaryPush camera;
    std::uint32_t count;  // rays
    bool made;            // the traversal kernel makes the rays
  };

  void check(const LiveOptions& options) const;
  void make_room(const LiveOptions& options, bool counts);
  Kernel& kernel(const KernelSource& source);
  bool makes_rays(const LiveOptions& options, std::uint32_t count) const;
  void make_pixels(const LiveOptions& options);
  LiveTimes add_paths(const View& view, const LiveOptions& options, const Integrator& integrator);
  void sample_slice(const Slice& slice, const LiveOptions& options, LiveTimes& times);
  TilesPush make_tiles(const TilesPush& tiles, LiveTimes& times);
  void generate_secondary(std::string_view generator, const Slice& slice, const LiveOptions& options, LiveTimes& times);
  void trace_and_shade(const Slice& slice, const Buffer<Ray>* rays, const LiveOptions& options, std::uint32_t part,
                       LiveTimes& times);
  void shade_slice(const Slice& slice, const Buffer<Ray>* rays, const Buffer<Hit>& hits, const LiveOptions& options,
                   std::uint32_t sample, bool shown, LiveTimes& times);
  void paint_heat(const Slice& slice, const LiveOptions& options, const Query& query, std::uint32_t sample,
                  LiveTimes& times);

  Context& gpu_;
  Tracer& tracer_;
  SceneData& scene_;
  glm::vec3 origin_;
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;  // by name
  std::uint32_t chunk_rays_ = 0;
  std::uint32_t width_ = 0;  // the picture width that starts_ was made for
  std::unique_ptr<Buffer<Ray>> rays_, secondary_;
  std::unique_ptr<Buffer<Hit>> hits_, secondary_hits_;
  std::unique_ptr<Buffer<RayStats>> stats_;
  std::unique_ptr<Buffer<Start>> starts_;         // one per pixel of a chunk
  std::uint32_t starts_first_ = 0;                // the first ray that starts_ was made for
  std::unique_ptr<Buffer<std::uint32_t>> tiles_;  // the pixels of a picture's rays
  TilesPush tiles_of_{};                          // the picture that tiles_ was made for
  Buffer<PrimaryPush> camera_;                    // of the rays that the traversal kernel makes
  std::vector<Buffer<LivePixel>> film_;           // one buffer per chunk
  std::unique_ptr<LivePaths> paths_;              // of a window that shows an integrator
  std::unique_ptr<Buffer<std::uint32_t>> pixels_;
  Buffer<std::uint32_t> totals_, totals_seen_;  // live rays; totals_seen_ is in host memory
  std::uint64_t counted_ = 0;                   // live rays of the last picture
  glm::vec3 light_{0};
  float heat_top_ = 0;
};

}  // namespace ballot
