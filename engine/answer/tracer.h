// The tracer: finds the hits of rays in one tree on one device.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/answer/auto/chooser.h"
#include "engine/answer/dispatch.h"
#include "engine/answer/reorder.h"
#include "engine/answer/stream.h"
#include "engine/model/recentring.h"
#include "engine/oracle/exact.h"

namespace ballot {

/// Traces rays in one tree on one device. It owns the tree's arrays (DeviceTree), the kernels (TraceKernels), their
/// dispatches (Dispatcher) and what method auto goes by (Chooser). Repair finishes rays that the driver cut short.
/// Reorder sorts the rays of queries with knob reorder=1, whose time counts as time of the trace. Belongs to the thread
/// of its Context.
class Tracer {
 public:
  /// Keeps references to gpu, bvh and triangles. Kernels are compiled for `facts`: those of `bvh`, or more general
  /// ones. `built`: as for DeviceTree.
  Tracer(Context& gpu, const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
         std::shared_ptr<DeviceBuild> built = {});
  /// The same for a forest, to which it keeps a reference. Methods without kernels for instances are refused with
  /// Error(Arguments).
  Tracer(Context& gpu, Forest& forest);
  ~Tracer();
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  /// Replaces the tree. The next trace uses the new one. Keeps references as the constructor does.
  void replace(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
               std::shared_ptr<DeviceBuild> built = {});

  /// Moves the instances of the forest (DeviceTree::move_instances).
  void move_instances(const MovedTransforms& transforms) { tree_.move_instances(transforms); }
  /// Takes another forest (DeviceTree::take).
  void take(Forest& forest, std::span<const std::optional<std::uint32_t>> from);
  /// Tells that the triangles have moved and the tree with them (DeviceTree::moved), or replaces a tree whose triangles
  /// have moved (Chooser::moved).
  void moved(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts);
  void rebuilt(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
               std::shared_ptr<DeviceBuild> built);

  /// Returns the seconds that walks of the tree have taken so far: traces on the device that have ended, and other
  /// queries (DeviceTree::walked_s).
  double walked_s() const { return dispatcher_.traced_s() + tree_.walked_s(); }

  /// Traces rays and writes the hit of each at the same index. Contract: engine/scene/device_scene.h. progress is
  /// called after each chunk of rays.
  TraceTimes trace(std::span<const Ray> rays, std::span<Hit> hits, const Query& query, const Progress& progress = {});

  /// The same for a stream of rays (stream.h), whose number may be unknown.
  TraceTimes trace(const RayStream& stream, const Query& query);

  /// The same for rays in double. Throws Error(Arguments) in numeric modes other than double, or for knob reorder.
  TraceTimes trace(const Stream<RayInDouble, Hit>& stream, const Query& query);
  TraceTimes trace(const Buffer<RayInDouble>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query);

  /// The same on device buffers: rays [0, count) of `rays` to `hits`.
  TraceTimes trace(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query);

  /// The same with the instrumented variant, which also writes one record per ray to `stats`. Throws Error(Arguments)
  /// if `stats` holds fewer than count records. The record of a ray that the driver cut short counts the traversal up
  /// to the cut.
  TraceTimes trace_counted(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                           Buffer<RayStats>& stats);

  /// Returns true if a trace of up to `most` rays can be recorded between other passes: method auto has nothing left to
  /// compare, and the host has no result of the dispatch to read back. query.rays must name the ray class.
  bool can_record(const Query& query, std::uint32_t most) const;

  /// Records a trace if can_record() is true, else traces at once. `done` is given the device milliseconds, as by
  /// Context::pass().
  void record(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query, Context::Done done);

  /// Returns true if kernels should generate camera rays rather than read them. CPU devices read them as fast, and take
  /// seconds to compile one more kernel.
  bool makes_rays() const { return make_rays.value_or(!gpu_.info().is_cpu()); }

  /// Records a trace of rays [0, count) of a camera, which are never reordered. Call it only if can_record() is true.
  void record(const CameraRays& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query, Context::Done done);

  /// Records a trace whose ray count is in the indirect arguments. These must count workgroups as groups_of() says.
  /// Call it only if can_record() is true.
  void record(const Buffer<Ray>& rays, Buffer<Hit>& hits, const IndirectRays& indirect, const Query& query,
              Context::Done done);
  /// Returns how the indirect dispatches of a query divide rays into workgroups.
  RayGroups groups_of(const Query& query) const { return dispatcher_.groups_of(resolved(query).variant); }

  /// Begins to make the kernel of a query for long batches on another thread. If it cannot be made, the call that needs
  /// it says why.
  void prepare(const Query& query, bool counters = false, CameraKind camera = CameraKind::None);

  /// Return the concrete query that a query runs as (Chooser::resolve).
  Query resolve(const Query& query, std::size_t count = kManyRays) const { return chooser_.resolve(query, count); }
  Query resolve(Query query, const Buffer<Ray>& rays, std::size_t count, std::size_t batch = 0) {
    return chooser_.resolve(std::move(query), rays, count, batch);
  }
  /// Names the class of rays in a query of method auto that names none (Chooser::classify).
  void classify(Query& query, const Questions<Ray>& rays, std::size_t batch = 0) const {
    chooser_.classify(query, rays, batch);
  }

  /// Returns the largest number of rays for one dispatch.
  std::uint32_t chunk_rays() const;

  /// Returns the kernel of a query, compiled on first use, for its name and compile times.
  const Kernel& kernel(const Query& query) { return *job(query).kernel->kernel; }
  /// Returns the variant of a query. For method auto: for long batches.
  Variant variant(const Query& query, bool counters = false) const;

  DeviceTree& tree() { return tree_; }
  /// Returns the pair tree on the host. The oracles walk the one without padding.
  const PairTree& pair_tree(NodeLayout layout, Padding padding = Padding::Ray) { return tree_.pairs(layout, padding); }

  /// Returns true if the host traces the rays of a query, whatever its method (TakesShapes::Host).
  bool traces_here(const Query& query) const { return host_traces(find_numeric(query.numeric), tree_.facts().shapes); }

  /// Tests only: the byte that hits are filled with before a trace of host arrays, so that unwritten records can be
  /// counted.
  std::optional<std::uint8_t> prefill;
  /// Returns true if the host sorts rays for knob reorder.
  bool sorts_on_host() const { return sort_on_host.value_or(gpu_.info().is_cpu()); }

  /// Tests only: the result of sorts_on_host(), whatever the device. Set it before the first trace.
  std::optional<bool> sort_on_host;
  /// Tests only: the result of makes_rays(), whatever the device.
  std::optional<bool> make_rays;

 private:
  TraceTimes trace_here(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count);
  /// A query with its variant and kernels. It is kept, because a frame asks for it thousands of times.
  struct Resolved {
    Query asked;
    Variant variant;
    // plain, counters, indirect, perspective, orthographic, rays in double; null: not used yet
    std::array<TraceKernel*, 6> kernels{};
  };

  /// Returns the resolved query, which is valid until the next call.
  Resolved& resolved(const Query& query) const;
  Job job(const Query& query, bool counters = false, bool indirect = false, CameraKind camera = CameraKind::None);
  KernelConfig config_of(const Query& query) const;
  /// Traces a range of rays by a concrete query, and adds what that took.
  void trace(const Buffer<Ray>& rays, Buffer<Hit>& hits, RayRange range, const Query& query, TraceTimes& times);
  void trace(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, RayRange range, const Query& query,
             TraceTimes& times);
  Job job_in_double(const Query& query);
  void trace_reordered(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, RayRange range, const Query& query,
                       TraceTimes& times, Buffer<RayStats>* stats = nullptr);
  template <class Trace>
  void record_reordered(const GivenRays& given, Buffer<Hit>& hits, Context::Done done, const Trace& trace);

  Context& gpu_;
  DeviceTree tree_;
  TraceKernels kernels_;
  Dispatcher dispatcher_;
  Chooser chooser_;
  std::optional<Reorder> reorder_;    // made on first use
  std::optional<ExactOracle> exact_;  // of the tree's generation exact_of_
  std::uint64_t exact_of_ = 0;
  mutable std::vector<Resolved> resolved_;
  mutable std::uint64_t resolved_by_ = 0;  // the tree's generation of resolved_
};

}  // namespace ballot
