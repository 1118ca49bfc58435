#include "engine/answer/reorder.h"

#include <algorithm>
#include <bit>

#include "engine/core/error.h"

namespace ballot {

namespace {

static_assert(sizeof(RayStats) == REORDER_STATS_WORDS * sizeof(std::uint32_t));

KernelSource source_of(const char* name, bool indirect, bool counters = false) {
  return {.name = fmt::format("reorder.{}{}{}", name, indirect ? " indirect=1" : "", counters ? " counters=1" : ""),
          .file = fmt::format("reorder/{}.comp", name),
          .defines = {{"BALLOT_INDIRECT", int(indirect)}, {"BALLOT_COUNTERS", int(counters)}},
          .group_size = REORDER_GROUP};
}

}  // namespace

bool can_reorder(const DeviceInfo& device) { return device.shuffle && device.subgroup_size <= 64; }

void check_can_reorder(const DeviceInfo& device) {
  if (!can_reorder(device))
    fail(Failure::Arguments,
         "knob reorder=1: {} cannot sort rays: that needs subgroup shuffle and subgroups of at most 64 invocations; "
         "leave the knob out",
         device.name);
}

std::vector<KernelSource> reorder_sources() {
  std::vector<KernelSource> all;
  for (const bool indirect : {false, true})
    for (const char* name : {"keys", "gather", "scatter"}) all.push_back(source_of(name, indirect));
  all.push_back(source_of("scatter", false, true));
  return all;
}

Reorder::Kernels::Kernels(Context& gpu, std::uint32_t rays, bool indirect)
    : most(rays),
      sort(gpu, REORDER_KEY_BITS, rays, indirect),
      keys(gpu, source_of("keys", indirect)),
      gather(gpu, source_of("gather", indirect)),
      scatter(gpu, source_of("scatter", indirect)) {}

void Reorder::make_room(std::uint32_t most) {
  if (most <= most_) return;
  const std::uint32_t room = std::bit_ceil(most);
  most_ = 0;  // there is no room if the device has too little memory for one of these
  if (!on_host_) {
    for (auto& keys : keys_) keys.emplace(gpu_, room, Access::Storage, "keys of rays");
    for (auto& order : order_) order.emplace(gpu_, room, Access::Storage, "order of rays");
  }
  rays_.emplace(gpu_, room, Access::Storage, "rays in order");
  hits_.emplace(gpu_, room, Access::Storage, "hits in order");
  stats_.reset();
  most_ = room;
}

void Reorder::make_kernels(bool indirect) {
  std::unique_ptr<Kernels>& kernels = indirect ? indirect_ : direct_;
  if (!kernels || kernels->most < most_) {
    kernels = std::make_unique<Kernels>(gpu_, most_, indirect);
    gpu_.save_pipeline_cache();
  }
  used_ = kernels.get();
}

Buffer<RayStats>& Reorder::stats() {
  if (!stats_) stats_.emplace(gpu_, most_, Access::Storage, "records in order");
  return *stats_;
}

void Reorder::pass(Kernel& kernel, const Context::Done& done) {
  gpu_.pass(
      kernel.name(), [&](Commands& cmd) { kernel.dispatch(cmd, groups_of(push_.count, REORDER_GROUP), push_); }, done);
}

void Reorder::sort(const GivenRays& given, const Bounds& scene, const Context::Done& done) {
  const std::uint32_t count = given.range.end - given.range.begin;
  make_room(count);
  if (on_host_) return sort_on_host(given, scene, done);
  make_kernels(given.indirect != nullptr);
  Kernels& k = *used_;
  push_ = {given.range.begin, count, given.indirect ? given.indirect->index : 0, scene.lo, scene.hi};
  if (given.indirect)
    for (Kernel* kernel : {&k.keys, &k.gather, &k.scatter}) kernel->bind(BIND_REORDER_ARGS, given.indirect->args);
  k.keys.bind(BIND_RAYS, given.rays);
  k.keys.bind(BIND_REORDER_KEYS, *keys_[0]);
  pass(k.keys, done);
  KeyCount keys{count};
  if (given.indirect) keys = {count, &given.indirect->args, given.indirect->index};
  sorted_ = k.sort.record({{&*keys_[0], &*keys_[1]}, {&*order_[0], &*order_[1]}}, keys, done);
  k.gather.bind(BIND_RAYS, given.rays);
  k.gather.bind(BIND_REORDER_ORDER, *order_[sorted_]);
  k.gather.bind(BIND_REORDER_RAYS, *rays_);
  pass(k.gather, done);
}

void Reorder::put_back(Buffer<Hit>& hits, const Context::Done& done, Buffer<RayStats>* stats) {
  if (on_host_) return put_back_on_host(hits, done, stats);
  Kernels& k = *used_;
  if (stats && !k.scatter_counters)
    k.scatter_counters = std::make_unique<Kernel>(gpu_, source_of("scatter", false, true));
  Kernel& kernel = stats ? *k.scatter_counters : k.scatter;
  kernel.bind(BIND_HITS, *hits_);
  kernel.bind(BIND_REORDER_ORDER, *order_[sorted_]);
  kernel.bind(BIND_REORDER_HITS, hits);
  if (stats) {
    kernel.bind(BIND_REORDER_STATS, *stats_);
    kernel.bind(BIND_REORDER_STATS_OUT, *stats);
  }
  pass(kernel, done);
}

}  // namespace ballot
