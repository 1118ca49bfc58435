#include "engine/answer/dispatch.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "engine/core/parallel.h"

namespace ballot {

namespace {

constexpr std::uint32_t kUnbounded = std::numeric_limits<std::uint32_t>::max();

constexpr std::uint64_t kRecordedUnknown = 1 << 21;  // rays that are recorded though nothing is known of their speed

/// Returns the number of rays that a workgroup takes, or takes first in a persistent launch.
std::uint32_t group_rays(const Variant& v) { return v.config.workgroup * v.rays_per_lane(); }

/// Returns true if the host has to read the work counter after a dispatch: for the next ray of a persistent launch, or
/// for rays that were cut short. Other dispatches do without, as each transfer to or from a GPU would be a wait.
bool reports(const Variant& v) { return v.config.launch == Launch::Persistent || v.config.loops_cut; }

}  // namespace

LaunchSize& Dispatcher::size_of(const Variant& v) const {
  return (*sizes_)[{v.method, v.numeric, v.want, v.config.doubtful}];
}

double Dispatcher::launch_ms() const {
  return gpu_.launch_ms() > 0 || !is_interruptible() ? gpu_.launch_ms() : kInterruptibleLaunch;
}

std::uint32_t Dispatcher::groups_for(const Variant& v, std::uint32_t rays) const {
  const KernelConfig& c = v.config;
  const std::uint32_t packet = c.subgroup * v.rays_per_lane();
  const std::uint32_t packets = (rays + packet - 1) / packet;
  rays = packets * c.subgroup;  // lanes that take these rays, in whole subgroups
  std::uint64_t lanes = rays;
  if (c.launch == Launch::Persistent) {
    // Twice the lanes that all rays need if every subgroup takes all its batches, so that threads which are ahead find
    // more to do. No more lanes than may be resident. Rays that are then left are dispatched again.
    lanes = 2 * ((std::uint64_t(rays) + c.batches - 1) / c.batches);
    if (c.batches == kUnbounded) lanes = rays;
    // A CPU device runs a workgroup on one thread, so that few rays need as many workgroups as there are threads. A
    // subgroup that finds no ray left ends at once.
    if (gpu_.info().is_cpu()) lanes = std::max(lanes, std::min<std::uint64_t>(core_count(), packets) * c.workgroup);
    lanes = std::min<std::uint64_t>(lanes, std::max(c.resident_lanes, c.workgroup));
  }
  return std::uint32_t(std::min<std::uint64_t>((lanes + c.workgroup - 1) / c.workgroup, gpu_.info().max_group_count_x));
}

TracePushes Dispatcher::push_for(const Job& job, const TreePiece& from) const {
  TracePushes pushes = job.kernel->arrays.pushes(tree_, from);
  pushes.trace.max_batches = job.variant.config.batches;
  pushes.trace.threshold = kernel_threshold(job.variant.config, *job.variant.method);
  return pushes;
}

Work Dispatcher::dispatch(const Job& job, const RawBuffer& rays, Buffer<Hit>& hits, const TracePushes& pushes,
                          TraceTimes& times) {
  const TracePush& push = pushes.trace;
  Kernel& kernel = *job.kernel->kernel;
  kernel.bind(BIND_RAYS, rays);
  kernel.bind(BIND_HITS, hits);
  const bool lists = job.variant.config.lists();
  Buffer<std::uint32_t>* list = nullptr;
  if (job.variant.config.doubtful != Doubtful::Decided)
    list = &kernels_.doubtful(lists ? push.ray_end - push.ray_begin : 0);
  if (list) kernel.bind(BIND_DOUBTFUL, *list);
  const bool clears = lists && !kernels_.list_is_empty();
  if (lists) kernels_.list_is_empty() = false;
  Work work{push.ray_begin, 0};
  if (reports(job.variant)) kernels_.work().upload(std::span(&work, 1));
  gpu_.submit(kernel.name(), [&](Commands& cmd) {
    if (clears) clear_list(cmd, *list);
    kernel.dispatch(cmd, groups_for(job.variant, push.ray_end - push.ray_begin), &pushes, push_bytes(tree_));
  });
  const double ms = gpu_.last_ms();
  times.device_ms += ms;
  *traced_ms_ += ms;
  ++times.dispatches;
  if (reports(job.variant)) kernels_.work().download(std::span(&work, 1));
  // A persistent kernel with a limit of batches may leave rays, but it has finished all rays that it took.
  const std::uint32_t next =
      job.variant.config.launch == Launch::Plain ? push.ray_end : std::min(work.next, push.ray_end);
  size_of(job.variant).add(next - push.ray_begin, ms);
  if (lists) work.unfinished += run_doubtful(job, rays, hits, pushes, times);
  return {next, work.unfinished};
}

void Dispatcher::clear_list(Commands& cmd, const Buffer<std::uint32_t>& list) const {
  const IndirectArgs none{0, 1, 1, 0};
  cmd.write(list, none);
  cmd.barrier();
}

/// Traces the rays that a kernel has listed. Returns how many of them the driver cut short.
std::uint32_t Dispatcher::run_doubtful(const Job& job, const RawBuffer& rays, Buffer<Hit>& hits,
                                       const TracePushes& pushes, TraceTimes& times) {
  std::uint32_t listed[sizeof(IndirectArgs) / sizeof(std::uint32_t)];
  kernels_.doubtful(0).download(listed);
  const std::uint32_t count = std::bit_cast<IndirectArgs>(listed).count;
  kernels_.list_is_empty() = count == 0;
  if (count == 0) return 0;
  const Variant taking = job.variant.taking();
  const TreePiece from{pushes.trace.root, pushes.top.mesh_root};
  return run({taking, &kernels_.get(taking)}, rays, hits, {0, count}, from, times).unfinished;
}

Work Dispatcher::run(const Job& job, const RawBuffer& rays, Buffer<Hit>& hits, RayRange range, TraceTimes& times) {
  return run(job, rays, hits, range, {tree_.root()}, times);
}

Work Dispatcher::run(const Job& job, const RawBuffer& rays, Buffer<Hit>& hits, RayRange range, const TreePiece& from,
                     TraceTimes& times) {
  const bool plain = job.variant.config.launch == Launch::Plain;
  const std::uint64_t most = std::uint64_t(gpu_.info().max_group_count_x) * group_rays(job.variant);
  TracePushes pushes = push_for(job, from);
  TracePush& push = pushes.trace;
  push.ray_begin = range.begin;
  const LaunchSize& size = size_of(job.variant);
  Work total{0, 0};
  while (push.ray_begin < range.end) {
    push.ray_end = range.end;
    if (plain && range.end - push.ray_begin > most) push.ray_end = push.ray_begin + std::uint32_t(most);
    if (const double ms = launch_ms(); ms > 0)
      push.ray_end = std::uint32_t(std::min<std::uint64_t>(push.ray_end, push.ray_begin + size.most(ms)));
    const auto [next, unfinished] = dispatch(job, rays, hits, pushes, times);
    total.unfinished += unfinished;
    if (next <= push.ray_begin)
      fail(Failure::Work, "kernel {}: a dispatch traced none of the {} rays left on {}: the driver lost it",
           job.kernel->kernel->name(), range.end - push.ray_begin, gpu_.info().name);
    push.ray_begin = next;
    check_interruption();
  }
  return total;
}

bool Dispatcher::can_record(const Variant& v, std::uint32_t most) const {
  if (v.config.loops_cut) return false;
  const bool listed = v.config.doubtful == Doubtful::Listed;
  const auto is_slow = [&](const Variant& part) {
    const LaunchSize& size = size_of(part);
    const std::uint64_t unknown = gpu_.launch_ms() > 0 ? kRecordedUnknown : 0;  // 0: a first launch tells
    return most > (size.is_known() ? size.most(launch_ms()) : unknown);
  };
  if (launch_ms() > 0 && (is_slow(v) || (listed && is_slow(v.taking())))) return false;
  if (v.config.launch == Launch::Persistent && v.config.batches != kUnbounded) return false;
  if (v.config.launch == Launch::Persistent && !v.config.lists()) return true;
  return most <= std::uint64_t(gpu_.info().max_group_count_x) * group_rays(v);
}

RayGroups Dispatcher::groups_of(const Variant& v) const {
  std::uint32_t most = gpu_.info().max_group_count_x;
  if (v.config.launch == Launch::Persistent) most = groups_for(v, kUnbounded - group_rays(v));
  return {group_rays(v), most};
}

void Dispatcher::record(const Recorded& r, Context::Done done) {
  const Variant& v = r.job.variant;
  const bool counts = reports(v), lists = v.config.lists();
  Buffer<std::uint32_t>* list = lists ? &kernels_.doubtful(r.most) : nullptr;
  if (lists) kernels_.list_is_empty() = false;
  Kernel &kernel = *r.job.kernel->kernel, *taking = lists ? kernels_.get(v.taking()).kernel.get() : nullptr;
  for (Kernel* k : {&kernel, taking})
    if (k) r.bind(*k);
  for (Kernel* k : {&kernel, taking})
    if (list) k->bind(BIND_DOUBTFUL, *list);
  gpu_.pass(
      kernel.name(),
      [&](Commands& cmd) {
        if (counts) cmd.fill(kernels_.work(), 0);
        if (lists) clear_list(cmd, *list);
        if (counts) cmd.barrier();
        r.dispatch(cmd);
        if (!lists) return;
        TracePushes rest = r.push;
        rest.trace.ray_end = kUnbounded;
        cmd.barrier();
        taking->dispatch(cmd, *list, 0, &rest, push_bytes(tree_));
      },
      [spent = traced_ms_, sizes = sizes_, &size = size_of(v), count = r.count, done = std::move(done)](double ms) {
        *spent += ms;
        size.add(count, ms);
        if (done) done(ms);
      });
}

void Dispatcher::record(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, const IndirectRays& indirect,
                        Context::Done done) {
  TracePushes push = push_for(job, {tree_.root()});
  push.trace.ray_end = indirect.index;
  Kernel& kernel = *job.kernel->kernel;
  kernel.bind(BIND_INDIRECT, indirect.args);
  record({.job = job,
          .count = 0,
          .most = std::uint32_t(rays.size()),
          .bind =
              [&](Kernel& k) {
                k.bind(BIND_RAYS, rays);
                k.bind(BIND_HITS, hits);
              },
          .dispatch =
              [&](Commands& cmd) {
                kernel.dispatch(cmd, indirect.args, indirect.index * sizeof(IndirectArgs), &push, push_bytes(tree_));
              },
          .push = push},
         std::move(done));
}

void Dispatcher::record(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count,
                        Context::Done done) {
  record_rays(
      job, count, 0,
      [&](Kernel& k) {
        k.bind(BIND_RAYS, rays);
        k.bind(BIND_HITS, hits);
      },
      std::move(done));
}

void Dispatcher::record(const Job& job, const CameraRays& rays, Buffer<Hit>& hits, std::uint32_t count,
                        Context::Done done) {
  record_rays(
      job, count, rays.index,
      [&](Kernel& k) {
        k.bind(BIND_CAMERAS, rays.cameras);
        k.bind(BIND_LISTED, rays.listed);
        k.bind(BIND_HITS, hits);
      },
      std::move(done));
}

void Dispatcher::record_rays(const Job& job, std::uint32_t count, std::uint32_t camera,
                             std::function<void(Kernel&)> bind, Context::Done done) {
  TracePushes push = push_for(job, {tree_.root()});
  push.trace.ray_end = count;
  push.trace.camera = camera;
  const auto dispatch = [&](Commands& cmd) {
    job.kernel->kernel->dispatch(cmd, groups_for(job.variant, count), &push, push_bytes(tree_));
  };
  record({job, count, count, std::move(bind), dispatch, push}, std::move(done));
}

}  // namespace ballot
