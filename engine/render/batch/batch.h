// Batches of rays that stay on the device together with their hits, so they can be traced and timed repeatedly.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/answer/counters.h"
#include "engine/answer/tracer.h"
#include "engine/render/batch/ray_kinds.h"
#include "engine/render/data/scene_data.h"

namespace ballot {

/// The device milliseconds of the passes of one frame.
struct FrameTimes {
  double generate_ms = 0;  // making the primary rays, and the batch's rays from their hits
  double trace_ms = 0;     // tracing the primary rays and the batch's rays
  double shade_ms = 0;     // shading every hit of the batch's rays into a film
  double total_ms() const { return generate_ms + trace_ms + shade_ms; }
};

/// The primary ray and its hit from which a secondary ray starts.
struct RayStart {
  Ray primary;
  Hit hit;
};

/// Rays on the device with room for their hits. The device's limits may split them into several buffers; each is traced
/// by a dispatch of its own. Made by a DeviceScene, which the batch must not outlive.
class RayBatch {
 public:
  ~RayBatch();

  const std::string& name() const { return name_; }  // the ray kind's name, or the name given to foreign rays
  const std::string& view() const { return view_; }  // the view's name; empty for foreign rays
  Want want() const { return want_; }
  bool any() const { return want_ == Want::Any; }
  /// Returns the number of rays, without dead rays of tile padding. It is 0 for secondary rays if nothing was hit.
  std::size_t count() const { return count_; }
  const std::string& ray_class() const { return ray_class_; }  // the ray class, for Query::rays
  bool has_frame() const { return frame_ != nullptr; }         // false for foreign rays

  /// Return copies of the count() rays, and of the hits of the last trace at the same indices. Before the first trace
  /// the hits are undefined.
  std::vector<Ray> rays() const;
  std::vector<Hit> hits() const;

  /// Returns the primary ray and hit that each ray starts from, at the same indices; empty for primary and foreign
  /// rays.
  std::vector<RayStart> starts() const;
  /// Returns only the prims of those hits.
  std::vector<std::uint32_t> start_prims() const;

  /// Fills every hit record with this byte, so that records that a trace leaves unwritten can be counted.
  void fill_hits(std::uint8_t byte);

 private:
  friend class Batches;
  struct Chunk {
    Buffer<Ray> rays;
    Buffer<Hit> hits;
    std::uint32_t count;
  };
  struct Frame;
  template <class T>
  std::vector<T> download(Buffer<T> Chunk::*records) const;

  RayBatch(std::string name, std::string view, std::string ray_class, Want want);
  void add_chunks(Context& gpu, std::size_t count, std::uint32_t most);

  std::string name_, view_, ray_class_;
  Want want_;
  std::size_t count_ = 0;
  std::vector<Chunk> chunks_;
  std::unique_ptr<Frame> frame_;  // the passes that make the rays; null for foreign rays
};

/// Returns the position of the point light of ray kind "shadow": from the camera up and to the right, and never behind
/// a wall, as the nearest hit of a ray in this direction bounds its distance.
glm::vec3 point_light(Tracer& tracer, const Scene& scene, const View& view);

/// Makes batches and runs them. Keeps the kernels that batches share. Belongs to one thread.
class Batches {
 public:
  /// Keeps references to all arguments.
  Batches(Context& gpu, Tracer& tracer, SceneData& scene);
  ~Batches();

  // The contracts of these functions are in engine/scene/device_scene.h.
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
