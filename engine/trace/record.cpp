// Traces recorded together with what comes before and after them.
#include <limits>

#include "engine/trace/tracer.h"

namespace ballot {

namespace {

constexpr std::uint32_t kUnbounded = std::numeric_limits<std::uint32_t>::max();

/// Rays that a workgroup takes, or begins with.
std::uint32_t group_rays(const Variant& v) { return v.how.workgroup * v.rays_per_lane(); }

}  // namespace

bool Tracer::can_record(const Query& query, std::uint32_t most) const {
  if (!gpu_.batches() || !is_resolved(query, most)) return false;
  const Variant& v = resolved(query).variant;
  if (v.how.loops_cut) return false;
  if (v.how.launch == Launch::Persistent) return v.how.batches == kUnbounded;
  return most <= std::uint64_t(gpu_.info().max_group_count_x) * group_rays(v);
}

RayGroups Tracer::groups_of(const Query& query) const {
  const Variant& v = resolved(query).variant;
  std::uint32_t most = gpu_.info().max_group_count_x;
  if (v.how.launch == Launch::Persistent) most = groups_for(v, kUnbounded - group_rays(v));
  return {group_rays(v), most};
}

void Tracer::record(const Job& job, Buffer<Hit>& hits, const Context::Record& dispatch, Context::Done done) {
  Kernel& kernel = *job.pipeline->kernel;
  kernel.bind(BIND_HITS, hits);
  const bool counts = reports(job.variant);
  gpu_.pass(
      kernel.name(),
      [&](VkCommandBuffer cmd) {
        if (counts) {
          gpu_.vk().CmdFillBuffer(cmd, work_.handle(), 0, VK_WHOLE_SIZE, 0);
          gpu_.memory_barrier(cmd);
        }
        dispatch(cmd);
      },
      std::move(done));
}

void Tracer::record(const Buffer<Ray>& rays, Buffer<Hit>& hits, const IndirectRays& indirect, const Query& query,
                    Context::Done done) {
  const Job job = this->job(query, false, true);
  Kernel& kernel = *job.pipeline->kernel;
  kernel.bind(BIND_RAYS, rays);
  kernel.bind(BIND_INDIRECT, indirect.args);
  TracePush push = push_for(job, pair_tree(job.variant.how).root);
  push.ray_end = indirect.index;
  const auto dispatch = [&](VkCommandBuffer cmd) {
    kernel.dispatch(cmd, indirect.args, indirect.index * sizeof(IndirectArgs), &push, sizeof push);
  };
  record(job, hits, dispatch, std::move(done));
}

void Tracer::record(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                    Context::Done done) {
  if (count == 0 || !can_record(query, count)) {
    done(trace(rays, hits, count, query).device_ms);
    return;
  }
  const Job job = this->job(query);
  job.pipeline->kernel->bind(BIND_RAYS, rays);
  record(job, hits, count, 0, std::move(done));
}

void Tracer::record(const CameraRays& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                    Context::Done done) {
  const Job job = this->job(query, false, false, rays.kind);
  job.pipeline->kernel->bind(BIND_CAMERAS, rays.cameras);
  job.pipeline->kernel->bind(BIND_LISTED, rays.listed);
  record(job, hits, count, rays.index, std::move(done));
}

void Tracer::record(const Job& job, Buffer<Hit>& hits, std::uint32_t count, std::uint32_t camera, Context::Done done) {
  TracePush push = push_for(job, pair_tree(job.variant.how).root);
  push.ray_end = count;
  push.camera = camera;
  const auto dispatch = [&](VkCommandBuffer cmd) {
    job.pipeline->kernel->dispatch(cmd, groups_for(job.variant, count), push);
  };
  record(job, hits, dispatch, std::move(done));
}

}  // namespace ballot
