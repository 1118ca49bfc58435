// Rays that stay on the device with room for their hits, so that they can be traced and timed again and again.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/render/batch/ray_kinds.h"
#include "engine/render/data/scene_data.h"
#include "engine/trace/counters.h"
#include "engine/trace/tracer.h"

namespace ballot {

/// Device milliseconds of the passes of one frame.
struct FrameTimes {
  double generate_ms = 0;  // primary rays, and this kind's from their hits
  double trace_ms = 0;     // of the primary rays, and of this kind's
  double shade_ms = 0;     // of every hit of this kind's rays into a film
  double total_ms() const { return generate_ms + trace_ms + shade_ms; }
};

/// Where a ray from a primary hit comes from.
struct RayStart {
  Ray primary;
  Hit hit;
};

/// Rays on the device. They lie in as many buffers as the device's limits want, each traced by a dispatch of its own.
/// Made by an Engine, which it must not outlive.
class RayBatch {
 public:
  ~RayBatch();

  const std::string& name() const { return name_; }  // of the ray kind, or of foreign rays
  const std::string& view() const { return view_; }  // empty for foreign rays
  Want want() const { return want_; }
  bool any() const { return want_ == Want::Any; }
  std::size_t count() const { return count_; }  // no dead rays of tile padding; 0 where a kind starts at hits: no hit
  const std::string& sort() const { return sort_; }     // as Query::rays takes it
  bool has_frame() const { return frame_ != nullptr; }  // false: foreign rays

  /// Copies of the count() rays, and of the hits of the last trace at the same indices. Before a trace the hits are
  /// undefined.
  std::vector<Ray> rays() const;
  std::vector<Hit> hits() const;

  /// The primary ray and its hit that each ray started from, at the same indices; empty for primary and foreign rays.
  std::vector<RayStart> starts() const;
  /// The prims of those hits alone.
  std::vector<std::uint32_t> start_prims() const;

  /// Fills every hit with this byte, so that records that a trace does not write can be counted.
  void fill_hits(std::uint8_t byte);

 private:
  friend class Batches;
  struct Chunk {
    Buffer<Ray> rays;
    Buffer<Hit> hits;
    std::uint32_t count;
  };
  struct Frame;

  RayBatch(std::string name, std::string view, std::string sort, Want want);
  void add_chunks(Context& gpu, std::size_t count, std::uint32_t most);

  std::string name_, view_, sort_;
  Want want_;
  std::size_t count_ = 0;
  std::vector<Chunk> chunks_;
  std::unique_ptr<Frame> frame_;  // what made the rays
};

/// The point light of kind shadow hangs off the camera, up and to the right, and never behind a wall: on this ray, whose nearest hit
/// says where.
Ray light_ray(const View& view);
glm::vec3 light_at(const View& view, const Hit& hit, const Scene& scene);
glm::vec3 point_light(Tracer& tracer, const Scene& scene, const View& view);

/// Makes batches and runs them. Keeps the kernels that batches share.
class Batches {
 public:
  /// Keeps references to all of them.
  Batches(Context& gpu, Tracer& tracer, SceneData& scene);
  ~Batches();

  // Contracts: engine/ballot.h.
  std::unique_ptr<RayBatch> make(const View& view, const RayKind& kind, std::uint32_t width, std::uint32_t height,
                                 const RayKindOptions& options);
  std::unique_ptr<RayBatch> make(std::string name, std::span<const Ray> rays, Want want);
  TraceTimes trace(RayBatch& batch, Query query);
  FrameTimes frame(RayBatch& batch, Query query);
  Counters count(RayBatch& batch, Query query);
  Query resolve(const RayBatch& batch, Query query);

 private:
  using Chunk = RayBatch::Chunk;
  using Frame = RayBatch::Frame;

  std::uint32_t chunk_rays() const;
  Kernel& generator(const KernelSource& source);
  void make_primaries(RayBatch& batch, const View& view, std::uint32_t width, std::uint32_t height);
  void make_starts(Frame& frame);
  void plan(RayBatch& batch, const RayKind& kind, const RayKindOptions& options);
  double generate_primaries(RayBatch& batch);
  double generate_from_hits(RayBatch& batch);
  double shade(RayBatch& batch);

  Context& gpu_;
  Tracer& tracer_;
  SceneData& scene_;
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;  // by name
};

}  // namespace ballot
