// Dispatches of traversal kernels: sized, repeated until no ray is left, recorded between other passes.
#pragma once

#include "engine/trace/kernels.h"
#include "shaders/shared/render.h"

namespace ballot {

struct TraceTimes {
  double device_ms = 0;  // of the traversal dispatches alone
  std::uint32_t dispatches = 0;
  std::uint64_t retraced = 0;  // rays that the driver cut short and that were traced again in pieces (repair.h)
};

/// The ray count of an indirect dispatch: one record of indirect arguments on the device.
struct IndirectRays {
  const Buffer<IndirectArgs>& args;  // made with Access::Indirect
  std::uint32_t index;
};

/// Camera rays that the kernel generates itself, as shaders/rays/primary.comp does: those of one camera for listed
/// pixels.
struct CameraRays {
  const Buffer<PrimaryPush>& cameras;
  std::uint32_t index;  // of the camera
  const Buffer<std::uint32_t>& listed;
  CameraKind kind;
};

/// The number of workgroups for a number of rays: one for every `rays` rays, and `most` at most.
struct RayGroups {
  std::uint32_t rays, most;
};

class Dispatcher {
 public:
  Dispatcher(Context& gpu, DeviceTree& tree, TraceKernels& kernels) : gpu_(gpu), tree_(tree), kernels_(kernels) {}

  /// Traces rays [0, count) from the child reference `root` on and waits. Dispatches again what bounded launches leave.
  /// The result tells how many rays the driver cut short: their hits have prim UNFINISHED. Throws Error(Work) if a
  /// dispatch takes no ray.
  Work run(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, std::uint32_t root,
           TraceTimes& times);
  /// The same from the root of the tree.
  Work run(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, TraceTimes& times);

  /// True if `most` rays at most can be traced by one dispatch that the host need not look at.
  bool can_record(const Variant& variant, std::uint32_t most) const;

  /// Records one dispatch behind all earlier passes; only where can_record() allows it. `done` is told its device
  /// milliseconds.
  void record(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, Context::Done done);
  void record(const Job& job, const CameraRays& rays, Buffer<Hit>& hits, std::uint32_t count, Context::Done done);
  void record(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, const IndirectRays& indirect,
              Context::Done done);
  RayGroups groups_of(const Variant& variant) const;

 private:
  std::uint32_t groups_for(const Variant& variant, std::uint32_t rays) const;
  TracePush push_for(const Job& job, std::uint32_t root) const;
  Work dispatch(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, const TracePush& push, TraceTimes& times);
  void record(const Job& job, Buffer<Hit>& hits, const Context::Record& dispatch, Context::Done done);
  void record_rays(const Job& job, Buffer<Hit>& hits, std::uint32_t count, std::uint32_t camera, Context::Done done);

  Context& gpu_;
  DeviceTree& tree_;
  TraceKernels& kernels_;
};

}  // namespace ballot
