// The buffers and kernels that shade primary hits. Internal to engine/render.
#pragma once

#include "engine/render/film/renderer.h"

namespace ballot {

/// The pixels [first, first + pixels) of a film that the device holds at once, and the samples to add to each.
struct Renderer::Chunk {
  std::size_t first;
  std::uint32_t pixels, samples;
};

/// The kernels and buffers of pictures that have the same shading and chunk size.
struct Renderer::Passes {
  std::string shading;
  SceneFeatures features;
  std::uint32_t chunk;       // pixels that the device holds at once
  std::uint64_t generation;  // Context::shader_generation() of the kernels
  bool makes_rays;           // Tracer::makes_rays()
  std::unique_ptr<Buffer<Ray>> rays;
  std::unique_ptr<Buffer<Hit>> hits;
  Buffer<FilmPixel> film;
  Buffer<std::uint32_t> listed;
  std::unique_ptr<Buffer<RayStats>> stats;       // only if counters are requested
  std::unique_ptr<Buffer<PrimaryPush>> cameras;  // only if the traversal kernel makes the rays
  std::unique_ptr<Kernel> primary;               // only if it reads them
  Kernel shade;

  Passes(Context& gpu, std::uint32_t chunk_rays, const std::string& shading_name, bool counts,
         const SceneFeatures& seen, bool makes);
  void make_room(Context& gpu, std::size_t count);
  void make_ray_room(Context& gpu, std::size_t count);
  std::uint64_t bytes() const;
};

}  // namespace ballot
