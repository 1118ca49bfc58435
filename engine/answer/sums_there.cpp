#include "engine/answer/sums_there.h"

#include <algorithm>

#include "engine/core/error.h"

namespace ballot {

namespace {

constexpr std::uint64_t kMost = 1u << 22;  // weights, hits or sums of a dispatch
constexpr std::uint32_t kNone = ~0u;

KernelSource source_of(SumsBy by, bool weights) {
  return {.name = fmt::format("query.sums BALLOT_SUMS={} BALLOT_WEIGHTS={}", int(by), int(weights)),
          .file = "query/sums.comp",
          .defines = {{"BALLOT_SUMS", int(by)}, {"BALLOT_WEIGHTS", int(weights)}},
          .group_size = SUMS_GROUP};
}

}  // namespace

Kernel& SumWriter::kernel_for(SumsBy by, const WeighedHits& from, Buffer<double>& to) {
  const KernelSource source = source_of(by, from.weights != nullptr);
  std::unique_ptr<Kernel>& kernel = kernels_[source.name];
  if (refresh(gpu_, kernel, source)) gpu_.save_pipeline_cache();
  kernel->bind(BIND_HITS, from.hits);
  kernel->bind(BIND_SUMS, to);
  kernel->bind(BIND_SUM_RANGE, *range_);
  if (from.weights) kernel->bind(BIND_WEIGHTS, *from.weights);
  if (!kernel->wants(BIND_PRIM_TABLE)) return *kernel;
  if (!table_there_) {
    std::vector<std::uint32_t> words = table_.firsts;
    words.insert(words.end(), table_.meshes.begin(), table_.meshes.end());
    buffer_for(table_there_, gpu_, words.size(), "placements and meshes of triangles").upload(words);
  }
  kernel->bind(BIND_PRIM_TABLE, *table_there_);
  return *kernel;
}

void SumWriter::run(Kernel& kernel, SumsPush push, std::uint64_t count, const Context::Done& done) {
  const std::uint64_t most = std::min(kMost, std::uint64_t(gpu_.info().max_group_count_x) * std::uint64_t(SUMS_GROUP));
  for (std::uint64_t first = 0; first < count; first += most) {
    push.first = std::uint32_t(first), push.count = std::uint32_t(std::min(most, count - first));
    gpu_.pass(
        kernel.name(), [&](Commands& cmd) { kernel.dispatch(cmd, groups_of(push.count, SUMS_GROUP), push); }, done);
  }
}

void SumWriter::record(const WeighedHits& from, const SumBuffers& to, const Context::Done& done) {
  const std::uint64_t all = from.rays * from.row;
  const bool each = from.weights && from.weights->size() > 1;
  const std::uint32_t largest = from.weights ? 0 : SumUnit::size_of(1);
  buffer_for(range_, gpu_, 1, "range of weights").record_upload(std::vector{SumRange{largest, kNone}});
  bool has_range = !from.weights;
  for (std::size_t by = 0; by < to.size(); ++by) {
    if (!to[by]) continue;
    SumsPush push{.step = SUMS_RANGE,
                  .first = 0,
                  .count = 0,
                  .row = from.row,
                  .entries = table_.counts[by],
                  .placements = std::uint32_t(table_.firsts.size()),
                  .weight_step = each,
                  .lift = std::uint32_t(SumUnit::lift_of(all))};
    const std::uint64_t sums = std::uint64_t{push.entries} + 1;
    Kernel& kernel = kernel_for(SumsBy(by), from, *to[by]);
    gpu_.pass(
        "sums of none", [&](Commands& cmd) { cmd.fill(*to[by], 0, sums * sizeof(double), 0); }, done);
    if (!std::exchange(has_range, true)) run(kernel, push, each ? from.rays : 1, done);
    push.step = SUMS_ADD;
    run(kernel, push, all, done);
    push.step = SUMS_END;
    run(kernel, push, sums, done);
  }
}

void SumWriter::check(const WeighedHits& from) const {
  SumRange range{};
  range_->download(std::span(&range, 1));
  if (range.wrong == kNone) return;
  float weight = 0;
  from.weights->download(std::span(&weight, 1), range.wrong);
  fail(Failure::Arguments, "weights: number {} is {}; expected finite numbers", range.wrong, weight);
}

std::vector<KernelSource> sum_sources() {
  std::vector<KernelSource> sources;
  for (const SumsBy by : {SumsBy::Prim, SumsBy::Instance, SumsBy::Mesh})
    for (const bool weights : {false, true}) sources.push_back(source_of(by, weights));
  return sources;
}

}  // namespace ballot
