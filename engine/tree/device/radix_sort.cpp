#include "engine/tree/device/radix_sort.h"

namespace ballot {

namespace {

Defines key_defines(std::uint32_t bits, bool indirect) {
  return {{"KEY_WORDS", int(key_words(bits))}, {"INDIRECT", int(indirect)}};
}

std::uint32_t tile_keys(const Context& gpu) { return gpu.info().subgroup_size * kBuildSubgroups * BUILD_TILE_KEYS; }

}  // namespace

std::uint32_t RadixSort::tiles(std::uint32_t count) const {
  const std::uint32_t tile = tile_keys(gpu_);
  return count / tile + (count % tile != 0);
}

RadixSort::RadixSort(Context& gpu, std::uint32_t bits, std::uint32_t most, bool indirect)
    : gpu_(gpu),
      bits_(bits),
      counts_(gpu, std::size_t(tiles(most)) * BUILD_DIGITS, Access::Storage, "histograms of digits"),
      totals_(gpu, BUILD_DIGITS, Access::Storage, "sums of digits"),
      histogram_(gpu, build_source("sort_count", gpu.info(), key_defines(bits, indirect))),
      scan_(gpu, build_source("sort_sum", gpu.info(), key_defines(bits, indirect))),
      scatter_(gpu, build_source("sort_move", gpu.info(), key_defines(bits, indirect))) {
  for (Kernel* kernel : {&histogram_, &scan_, &scatter_}) kernel->bind(BIND_BUILD_COUNTS, counts_);
  for (Kernel* kernel : {&scan_, &scatter_}) kernel->bind(BIND_BUILD_TOTALS, totals_);
}

std::size_t RadixSort::record(const SortBuffers& buffers, const KeyCount& count, const Context::Done& done) {
  if (count.most == 0) return 0;
  if (count.args)
    for (Kernel* kernel : {&histogram_, &scan_, &scatter_}) kernel->bind(BIND_BUILD_ARGS, *count.args);
  std::size_t from = 0;
  SortPush push{count.most, tiles(count.most), 0, 1, count.index};
  const auto record = [&](Kernel& kernel, std::uint32_t groups) {
    gpu_.pass(
        kernel.name(), [&](Commands& cmd) { kernel.dispatch(cmd, groups, push); }, done);
  };
  for (; push.shift < bits_; push.shift += 8, push.first = 0, from = 1 - from) {
    histogram_.bind(BIND_BUILD_KEYS, *buffers.keys[from]);
    scatter_.bind(BIND_BUILD_KEYS, *buffers.keys[from]);
    scatter_.bind(BIND_BUILD_PRIMS, *buffers.prims[from]);
    scatter_.bind(BIND_BUILD_KEYS_OUT, *buffers.keys[1 - from]);
    scatter_.bind(BIND_BUILD_PRIMS_OUT, *buffers.prims[1 - from]);
    record(histogram_, push.tiles);
    record(scan_, BUILD_DIGITS);
    record(scatter_, push.tiles);
  }
  return from;
}

}  // namespace ballot
