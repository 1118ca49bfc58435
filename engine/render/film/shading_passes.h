// What pictures of the eye's own hits run on; of engine/render alone.
#pragma once

#include "engine/render/film/renderer.h"

namespace ballot {

/// Pixels of a film that are rendered while the device holds them, and samples that each of them is to have more.
struct Renderer::Chunk {
  std::size_t first;
  std::uint32_t pixels, samples;
};

/// Kernels and buffers of pictures that share shading and chunk size.
struct Renderer::Passes {
  std::string shading;
  SceneFeatures features;
  std::uint32_t chunk;
  std::uint64_t generation;  // of the shaders
  bool makes_rays;           // Tracer::makes_rays()
  std::unique_ptr<Buffer<Ray>> rays;
  std::unique_ptr<Buffer<Hit>> hits;
  Buffer<FilmPixel> film;
  Buffer<std::uint32_t> listed;
  std::unique_ptr<Buffer<RayStats>> stats;       // only where counters are asked for
  std::unique_ptr<Buffer<PrimaryPush>> cameras;  // only where traversal makes the rays
  std::unique_ptr<Kernel> primary;               // only where it does not
  Kernel shade;

  Passes(Context& gpu, std::uint32_t chunk_rays, const std::string& shading_name, bool counts,
         const SceneFeatures& seen, bool makes);
  void make_room(Context& gpu, std::size_t count);
  void make_ray_room(Context& gpu, std::size_t count);
  std::uint64_t bytes() const;
};

}  // namespace ballot
