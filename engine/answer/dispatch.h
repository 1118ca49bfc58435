// Dispatches of traversal kernels: their size, their repetition until no ray is left, and their recording between other
// passes.
#pragma once

#include <functional>
#include <map>
#include <tuple>

#include "engine/answer/kernels.h"
#include "engine/answer/launch_size.h"
#include "shaders/shared/render.h"

namespace ballot {

/// The time that a trace took on the device, and how often it was dispatched.
struct TraceTimes {
  double device_ms = 0;  // traversal dispatches alone
  std::uint32_t dispatches = 0;
  std::uint64_t retraced = 0;  // rays that the driver cut short and that were traced again in pieces (repair.h)

  TraceTimes& operator+=(const TraceTimes& more) {
    device_ms += more.device_ms;
    dispatches += more.dispatches;
    retraced += more.retraced;
    return *this;
  }
};

/// The ray count of an indirect dispatch: one record of indirect arguments on the device.
struct IndirectRays {
  const Buffer<IndirectArgs>& args;  // made with Access::Indirect
  std::uint32_t index;
};

/// Camera rays that the kernel generates itself, as shaders/rays/primary.comp does: the rays of one camera for the
/// listed pixels.
struct CameraRays {
  const Buffer<PrimaryPush>& cameras;
  std::uint32_t index;  // of the camera
  const Buffer<std::uint32_t>& listed;
  CameraKind kind;
};

/// The workgroups of an indirect dispatch: one for every `rays` rays, but `most` at most.
struct RayGroups {
  std::uint32_t rays, most;
};

/// Rays [begin, end) of a buffer.
struct RayRange {
  std::uint32_t begin, end;
};

/// Dispatches the kernels that trace rays in one tree, or in a forest. Belongs to the thread of its Context.
class Dispatcher {
 public:
  /// Keeps references to all arguments.
  Dispatcher(Context& gpu, DeviceTree& tree, TraceKernels& kernels) : gpu_(gpu), tree_(tree), kernels_(kernels) {}

  /// Traces a range of rays, beginning at `from`, and waits. Dispatches in parts that take Context::launch_ms() each,
  /// and again for rays that a bounded launch leaves. Returns the work counter, whose `unfinished` is the number of
  /// rays that the driver cut short; their hits have prim UNFINISHED. Throws Error(Work) if a dispatch takes no ray.
  Work run(const Job& job, const RawBuffer& rays, Buffer<Hit>& hits, RayRange range, const TreePiece& from,
           TraceTimes& times);
  /// The same from the root of the tree.
  Work run(const Job& job, const RawBuffer& rays, Buffer<Hit>& hits, RayRange range, TraceTimes& times);

  /// Returns true if one dispatch can trace up to `most` rays and leaves no result that the host has to read back.
  bool can_record(const Variant& variant, std::uint32_t most) const;

  /// Records one dispatch behind all earlier passes. Call it only if can_record() is true. `done` is given the device
  /// milliseconds.
  void record(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, Context::Done done);
  void record(const Job& job, const CameraRays& rays, Buffer<Hit>& hits, std::uint32_t count, Context::Done done);
  void record(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, const IndirectRays& indirect,
              Context::Done done);
  /// Returns the seconds that the device has spent on dispatches that have ended so far.
  double traced_s() const { return *traced_ms_ * 1e-3; }

  /// Returns how a variant's indirect dispatches divide rays into workgroups.
  RayGroups groups_of(const Variant& variant) const;

 private:
  /// Returns the milliseconds that a launch should take; 0: no matter how long.
  double launch_ms() const;
  LaunchSize& size_of(const Variant& variant) const;
  std::uint32_t groups_for(const Variant& variant, std::uint32_t rays) const;
  TracePushes push_for(const Job& job, const TreePiece& from) const;
  Work dispatch(const Job& job, const RawBuffer& rays, Buffer<Hit>& hits, const TracePushes& push, TraceTimes& times);
  void clear_list(Commands& cmd, const Buffer<std::uint32_t>& list) const;
  std::uint32_t run_doubtful(const Job& job, const RawBuffer& rays, Buffer<Hit>& hits, const TracePushes& pushes,
                             TraceTimes& times);
  /// What the kernels of one recorded trace have in common.
  struct Recorded {
    const Job& job;
    std::uint32_t count, most;                // rays; `count` is 0 if the device knows it
    std::function<void(Kernel&)> bind;        // binds rays and hits
    std::function<void(Commands&)> dispatch;  // of the job's kernel
    TracePushes push;
  };
  void record(const Recorded& recorded, Context::Done done);
  void record_rays(const Job& job, std::uint32_t count, std::uint32_t camera, std::function<void(Kernel&)> bind,
                   Context::Done done);

  Context& gpu_;
  DeviceTree& tree_;
  TraceKernels& kernels_;
  // Passes that have not ended keep these two, too.
  std::shared_ptr<double> traced_ms_ = std::make_shared<double>(0);
  using Sizes = std::map<std::tuple<const Method*, const NumericMode*, Want, Doubtful>, LaunchSize>;
  std::shared_ptr<Sizes> sizes_ = std::make_shared<Sizes>();
};

}  // namespace ballot
