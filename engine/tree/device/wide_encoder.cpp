#include "engine/tree/device/wide_encoder.h"

#include "engine/core/error.h"
#include "engine/tree/device/build_memory.h"
#include "engine/tree/formats/collapse.h"

namespace ballot {

namespace {

KernelSource collapse_source(const char* name, const DeviceInfo& device, const TreeFormat& format) {
  Defines defines{{"WIDTH", int(format.width)}};
  if (std::string_view(name) == "collapse_number") defines.emplace_back("SLOTS", int(format.id == TreeFormatId::Bvh8));
  return build_source(name, device, defines);
}

KernelSource place_source(const char* name, const DeviceInfo& device) {
  return build_source(name, device, {{"COLLAPSE", 1}});
}

KernelSource encode_source(const DeviceInfo& device, const TreeFormat& format) {
  return build_source("encode_" + std::string(format.name), device);
}

}  // namespace

/// The working memory of collapses of up to `most` pairs.
struct WideEncoder::Memory {
  std::uint32_t most;
  Buffer<std::uint32_t> parents, arrivals, sums;
  Buffer<float> costs;
  Buffer<CollapseTotals> totals;

  Memory(Context& gpu, std::uint32_t count, std::uint32_t width)
      : most(count),
        parents(gpu, count, Access::Storage, "parents of pairs"),
        arrivals(gpu, count, Access::Storage, "arrivals at pairs"),
        sums(gpu, std::size_t(groups_of(count, BUILD_BLOCK)) * 2, Access::Storage, "needs of blocks of pairs"),
        costs(gpu, std::size_t(count) * width, Access::Storage, "costs of pairs"),
        totals(gpu, 1, Access::Storage, "counts of a wide tree") {}
};

struct WideEncoder::Kernels {
  Kernel begin, plan, nodes, needs, place_blocks, places, number, encode;

  Kernels(Context& gpu, const TreeFormat& format)
      : begin(gpu, build_source("collapse_begin", gpu.info())),
        plan(gpu, collapse_source("collapse_plan", gpu.info(), format)),
        nodes(gpu, collapse_source("collapse_nodes", gpu.info(), format)),
        needs(gpu, place_source("needs", gpu.info())),
        place_blocks(gpu, place_source("place_blocks", gpu.info())),
        places(gpu, place_source("places", gpu.info())),
        number(gpu, collapse_source("collapse_number", gpu.info(), format)),
        encode(gpu, encode_source(gpu.info(), format)) {}
};

WideEncoder::WideEncoder(Context& gpu, TreeFormatId id) : gpu_(gpu), format_(format_of(id)) {}

WideEncoder::~WideEncoder() { gpu_.abandon(); }

std::uint32_t WideEncoder::groups(std::uint32_t count) const {
  const std::uint32_t group = gpu_.info().subgroup_size * kBuildSubgroups;
  return std::min(groups_of(count, group), gpu_.info().max_group_count_x);
}

WideShape WideEncoder::collapse(const BufferPart& pairs, std::uint32_t count, float longest) {
  collapse_ms_.clear();
  if (!kernels_) kernels_ = std::make_unique<Kernels>(gpu_, format_);
  if (!memory_ || memory_->most < count) {
    memory_.reset();  // before the new memory, which is larger
    memory_ = std::make_unique<Memory>(gpu_, count, format_.width);
  }
  const auto words = [&](std::size_t n, const char* name) {
    return Buffer<std::uint32_t>(gpu_, n, Access::Storage, name);
  };
  WideShape shape{.choices = words(count, "choices of pairs"),
                  .needs = words(count, "needs of wide nodes"),
                  .starts = words(2 * std::size_t(count), "starts of wide nodes"),
                  .wide_nodes = words(count, "wide nodes")};
  record(pairs, count, longest, shape);
  CollapseTotals totals;
  memory_->totals.download(std::span(&totals, 1));
  check_collapsed(totals.nodes, int(format_.width), format_.most_nodes);
  if (totals.nodes == 0 || totals.nodes > count)
    fail(Failure::Work, "bvh: {} did not finish the wide tree of {} pairs: it has {} nodes; use another method",
         gpu_.info().name, count, totals.nodes);
  shape.nodes = totals.nodes;
  shape.list_texels = totals.list_texels;
  return shape;
}

void WideEncoder::record(const BufferPart& pairs, std::uint32_t count, float longest, WideShape& shape) {
  Memory& m = *memory_;
  Kernels& k = *kernels_;
  for (Kernel* kernel : {&k.begin, &k.plan, &k.nodes, &k.number}) kernel->bind(BIND_BUILD_PAIRS, pairs);
  for (Kernel* kernel : {&k.plan, &k.nodes, &k.number}) kernel->bind(BIND_BUILD_CHOICES, shape.choices);
  for (Kernel* kernel : {&k.begin, &k.plan, &k.nodes}) kernel->bind(BIND_BUILD_PARENTS, m.parents);
  for (Kernel* kernel : {&k.begin, &k.plan}) kernel->bind(BIND_BUILD_ARRIVALS, m.arrivals);
  k.plan.bind(BIND_BUILD_COSTS, m.costs);
  for (Kernel* kernel : {&k.nodes, &k.number}) kernel->bind(BIND_BUILD_NEEDS, shape.needs);
  k.number.bind(BIND_BUILD_STARTS, shape.starts);
  k.number.bind(BIND_BUILD_WIDE_NODES, shape.wide_nodes);
  gpu_.pass("beginning a collapse", [&](Commands& cmd) { cmd.fill(m.parents, BUILD_NONE); });
  const CollapsePush push{count, collapse_unit(longest)};
  record_build(gpu_, k.begin, groups(count), push, "plan", collapse_ms_);
  record_build(gpu_, k.plan, groups(count), push, "plan", collapse_ms_);
  record_build(gpu_, k.nodes, groups(count), push, "nodes", collapse_ms_);
  record_places(count, shape);
  record_build(gpu_, k.number, groups(count), push, "numbers", collapse_ms_);
}

void WideEncoder::record_places(std::uint32_t count, WideShape& shape) {
  Kernels& k = *kernels_;
  for (Kernel* kernel : {&k.needs, &k.place_blocks, &k.places}) {
    kernel->bind(BIND_BUILD_STATE, memory_->totals);
    kernel->bind(BIND_BUILD_COUNTS, memory_->sums);
  }
  for (Kernel* kernel : {&k.needs, &k.places}) kernel->bind(BIND_BUILD_NEEDS, shape.needs);
  k.places.bind(BIND_BUILD_STARTS, shape.starts);
  const PlacePush push{count, groups_of(count, BUILD_BLOCK)};
  record_build(gpu_, k.needs, push.blocks, push, "places", collapse_ms_);
  record_build(gpu_, k.place_blocks, 1, push, "places", collapse_ms_);
  record_build(gpu_, k.places, push.blocks, push, "places", collapse_ms_);
}

void WideEncoder::write(const WideShape& shape, const BufferPart& pairs, const BufferPart& texels) {
  write_ms_.clear();
  Kernel& encode = kernels_->encode;
  encode.bind(BIND_BUILD_PAIRS, pairs);
  encode.bind(BIND_BUILD_CHOICES, shape.choices);
  encode.bind(BIND_BUILD_STARTS, shape.starts);
  encode.bind(BIND_BUILD_WIDE_NODES, shape.wide_nodes);
  if (has_lists()) encode.bind(BIND_BUILD_NEEDS, shape.needs);
  encode.bind(BIND_BUILD_FORMAT, texels);
  record_build(gpu_, encode, groups(shape.nodes), EncodePush{shape.nodes}, "encode", write_ms_);
}

std::vector<KernelSource> encoder_sources(const DeviceInfo& device) {
  std::vector<KernelSource> all{build_source("collapse_begin", device)};
  for (const char* name : {"needs", "place_blocks", "places"}) all.push_back(place_source(name, device));
  for (const TreeFormat& format : kTreeFormats) {
    if (!format.collapsed() || !format.on_device) continue;
    const bool again = format.id == TreeFormatId::Wide8;  // plan and nodes are those of bvh8
    for (const char* name : {"collapse_plan", "collapse_nodes", "collapse_number"})
      if (!again || std::string_view(name) == "collapse_number") all.push_back(collapse_source(name, device, format));
    all.push_back(encode_source(device, format));
  }
  return all;
}

}  // namespace ballot
