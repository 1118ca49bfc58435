#include "engine/tree/device/build_memory.h"

#include <algorithm>
#include <bit>

#include "engine/core/error.h"
#include "engine/tree/host/build.h"

namespace ballot {

namespace {

/// Returns the state at the start of a build: bounds of nothing.
BuildState empty_state() {
  BuildState state{};
  for (int axis = 0; axis < 3; ++axis) state.lo[axis] = ~0u;
  state.root = BUILD_NONE;
  return state;
}

}  // namespace

/// The kernels for codes of some number of bits.
struct DeviceBuilder::Kernels {
  std::uint32_t bits;
  RadixSort sort;
  Kernel bounds, frame, codes, cluster;
  std::optional<Kernel> needs, place_blocks, places;
  std::map<std::pair<NodeLayout, Padding>, std::unique_ptr<Kernel>> write;
  std::map<NodeLayout, std::unique_ptr<Kernel>> frontier;

  Kernels(Context& gpu, std::uint32_t code_bits, std::uint32_t most, BuildOver over)
      : bits(code_bits),
        sort(gpu, bits, most),
        bounds(gpu, build_source("bounds", gpu.info(), over_define(over))),
        frame(gpu, build_source("frame", gpu.info())),
        codes(gpu, build_source("codes", gpu.info(), key_defines(over))),
        cluster(gpu, build_source("cluster", gpu.info(), key_defines(over), cluster_subgroups(gpu.info()))) {
    if (over == BuildOver::Instances) return;
    needs.emplace(gpu, build_source("needs", gpu.info()));
    place_blocks.emplace(gpu, build_source("place_blocks", gpu.info()));
    places.emplace(gpu, build_source("places", gpu.info()));
  }

  Defines key_defines(BuildOver over) const {
    Defines defines{{"KEY_WORDS", int(key_words(bits))}};
    for (const auto& define : over_define(over)) defines.push_back(define);
    return defines;
  }
};

DeviceBuilder::DeviceBuilder(Context& gpu, BuildOver over) : gpu_(gpu), over_(over) {
  const DeviceInfo& d = gpu.info();
  if (!d.shuffle)
    fail(Failure::Arguments, "bvh: builder 'device' needs subgroup shuffle, which {} lacks; use another builder",
         d.name);
  if (d.subgroup_size > 64)
    fail(Failure::Arguments,
         "bvh: builder 'device' needs subgroups of at most 64, those of {} have {}; use another builder", d.name,
         d.subgroup_size);
}

std::uint64_t DeviceBuilder::most_triangles(const DeviceInfo& device) {
  constexpr std::uint64_t kBytes = (LEAF_HEADER_TEXELS + TRIANGLE_TEXELS) * sizeof(glm::uvec4);
  static_assert(kBytes >= BUILD_NODE_TEXELS * sizeof(glm::uvec4) && kBytes >= sizeof(Triangle));
  return std::min<std::uint64_t>(std::min(device.max_storage_range, device.max_allocation) / kBytes, BUILD_INDEX_MASK);
}

void DeviceBuilder::check_count(const DeviceInfo& device, std::uint64_t triangles) {
  const std::uint64_t most = most_triangles(device);
  if (triangles > most)
    fail(Failure::Work,
         "bvh: {} triangles, but builder 'device' takes {} on {}, whose storage buffers have up to {} bytes; use "
         "another builder",
         triangles, most, device.name, device.max_storage_range);
}

DeviceBuilder::~DeviceBuilder() { gpu_.abandon(); }

Buffer<Triangle> DeviceBuilder::upload(Context& gpu, std::span<const Triangle> triangles) {
  Buffer<Triangle> buffer(gpu, triangles.size(), Access::Storage, "triangles of the tree build");
  upload(gpu, triangles, buffer);
  return buffer;
}

void DeviceBuilder::upload(Context& gpu, std::span<const Triangle> triangles, Buffer<Triangle>& buffer) {
  if (gpu.info().float64) {
    buffer.upload(triangles);
    return;
  }
  // The device cannot tell which triangles have no area, unless two vertices are equal.
  UnsetVector<Triangle> marked(triangles.begin(), triangles.end());
  for (Triangle& t : marked)
    if (is_degenerate(t)) t[1] = t[0];
  buffer.upload(std::span<const Triangle>(marked));
}

// 1.5 bits for each doubling of the triangles of a surface put about one triangle into a cell. Four bits less are as
// good: with 24, 32 and 40 bits, the SAH costs of a wavy grid of 10^6 triangles are 64.43, 64.01 and 64.01, those of
// one of 10^7 with 32 and 40 bits 77.12 and 77.46; with 32, 40 and 64 bits, those of sponza, teapot-stadium and
// terrain-utm are equal to 0.1 %. With 24 bits that of sponza (66 454 triangles) is larger by 1.4 %, those of grids of
// 10^4 and 10^5 are equal. Codes of 40 bits instead of 32 take an H200 1.0 ms more for 10^7 triangles, a tenth of all.
std::uint32_t DeviceBuilder::code_bits(std::uint32_t triangles) {
  constexpr std::uint32_t kFew = 1 << 14;
  if (triangles < kFew) return 24;
  const std::uint32_t wanted = 3 * std::uint32_t(std::bit_width(triangles)) / 2;
  return std::clamp((wanted + 3) / 8 * 8, 32u, 64u);  // four bits less, rounded up
}

void DeviceBuilder::reserve(std::uint32_t count) {
  // A top-level tree is small: short codes do, and one kernel.
  const std::uint32_t bits = bits_ ? *bits_ : over_ == BuildOver::Instances ? 32 : code_bits(count);
  const bool fits = memory_ && memory_->most >= count;
  if (!fits) {
    memory_.reset();  // before the new memory, which is larger
    memory_ = std::make_unique<Memory>(gpu_, count, over_);
  }
  if (!fits || kernels_->bits != bits) kernels_ = std::make_unique<Kernels>(gpu_, bits, memory_->most, over_);
}

void DeviceBuilder::record_codes(const RawBuffer& triangles, std::uint32_t count) {
  Memory& m = *memory_;
  Kernels& k = *kernels_;
  for (Kernel* kernel : {&k.bounds, &k.frame, &k.codes}) kernel->bind(BIND_BUILD_STATE, m.state);
  for (Kernel* kernel : {&k.bounds, &k.codes}) kernel->bind(BIND_BUILD_TRIANGLES, triangles);
  k.codes.bind(BIND_BUILD_KEYS_OUT, m.keys[0]);
  const BuildState empty = empty_state();
  gpu_.pass("beginning a tree build", [&](Commands& cmd) {
    cmd.write(m.state, 0, &empty, offsetof(BuildState, refused));
    cmd.fill(m.arrivals, BUILD_NONE);
  });
  const BuildPush push{count, k.bits};
  const std::uint32_t group = gpu_.info().subgroup_size * kBuildSubgroups;
  constexpr std::uint32_t kBoundsGroups = 1024;  // each adds its bounds to the scene's
  record_build(gpu_, k.bounds, std::min(groups_of(count, group), kBoundsGroups), push, "bounds", build_ms_);
  record_build(gpu_, k.frame, 1, push, "bounds", build_ms_);
  record_build(gpu_, k.codes, std::min(groups_of(count, group), gpu_.info().max_group_count_x), push, "codes",
               build_ms_);
}

void DeviceBuilder::record_places(std::uint32_t count) {
  Memory& m = *memory_;
  Kernels& k = *kernels_;
  for (Kernel* kernel : {&*k.needs, &*k.place_blocks, &*k.places}) {
    kernel->bind(BIND_BUILD_STATE, m.state);
    kernel->bind(BIND_BUILD_COUNTS, m.sums);
  }
  for (Kernel* kernel : {&*k.needs, &*k.places}) kernel->bind(BIND_BUILD_NEEDS, m.needs);
  k.places->bind(BIND_BUILD_STARTS, m.starts);
  const PlacePush push{count, groups_of(count, BUILD_BLOCK)};
  record_build(gpu_, *k.needs, push.blocks, push, "places", build_ms_);
  record_build(gpu_, *k.place_blocks, 1, push, "places", build_ms_);
  record_build(gpu_, *k.places, push.blocks, push, "places", build_ms_);
}

void DeviceBuilder::record(const RawBuffer& triangles, std::uint32_t count, const BuildSettings& settings) {
  Memory& m = *memory_;
  Kernels& k = *kernels_;
  record_codes(triangles, count);
  sorted_ = k.sort.record({{&m.keys[0], &m.keys[1]}, {&m.prims[0], &m.prims[1]}}, {count}, added_to(build_ms_, "sort"));
  k.cluster.bind(BIND_BUILD_STATE, m.state);
  k.cluster.bind(BIND_BUILD_TRIANGLES, triangles);
  k.cluster.bind(BIND_BUILD_KEYS, m.keys[sorted_]);
  k.cluster.bind(BIND_BUILD_PRIMS, m.prims[sorted_]);
  k.cluster.bind(BIND_BUILD_CLUSTERS, m.clusters);
  k.cluster.bind(BIND_BUILD_ARRIVALS, m.arrivals);
  k.cluster.bind(BIND_BUILD_NODES, m.nodes);
  k.cluster.bind(BIND_BUILD_NEEDS, m.needs);
  const ClusterPush push{count, settings.max_leaf, settings.traversal_cost, settings.intersection_cost};
  const std::uint32_t group = gpu_.info().subgroup_size * cluster_subgroups(gpu_.info());
  record_build(gpu_, k.cluster, std::min(groups_of(count, group), gpu_.info().max_group_count_x), push, "clusters",
               build_ms_);
  if (over_ == BuildOver::Triangles) record_places(count);
}

void DeviceBuilder::read_state(std::uint32_t count) {
  BuildState s;
  memory_->state.download(std::span(&s, 1));
  built_ = {.triangles = count, .proper = s.proper};
  refused_ = s.refused;
  if (s.proper == 0) return;
  if (s.root == BUILD_NONE)
    fail(Failure::Work, "bvh: {} did not finish the tree of {} {}", gpu_.info().name, s.proper,
         over_ == BuildOver::Triangles ? "triangles; use another builder" : "instances");
  built_.depth = s.depth;
  if (over_ == BuildOver::Triangles)
    read_tree(s);
  else
    built_.root = s.proper == 1 ? LEAF_BIT : (s.root & BUILD_INDEX_MASK) * TOP_NODE_TEXELS;
  read_bounds(s);
}

/// Reads what write() needs to know.
void DeviceBuilder::read_tree(const BuildState& s) {
  const std::uint32_t triangles = (s.root >> BUILD_SIZE_SHIFT) & 7u;
  // A binary tree has a leaf more than inner nodes. One pair of a large tree is not used.
  const std::uint32_t inner = s.pairs - (triangles == BUILD_MANY ? 1 : 0);
  const std::uint64_t texels =
      std::uint64_t(inner + 1) * LEAF_HEADER_TEXELS + std::uint64_t(s.proper) * TRIANGLE_TEXELS;
  if (s.texels != texels)
    fail(Failure::Work,
         "bvh: {} did not finish the tree of {} triangles: its leaves take {} texels, expected {}; use another builder",
         gpu_.info().name, s.proper, s.texels, texels);
  if (texels > std::uint64_t{1} << LEAF_COUNT_SHIFT)
    fail(Failure::Work,
         "bvh: the leaves of {} triangles take {} texels on the device, but a child reference can number "
         "{}; use a smaller scene",
         s.proper, texels, std::uint64_t{1} << LEAF_COUNT_SHIFT);
  built_.pairs = std::max(s.pairs, 1u);
  built_.leaf_texels = s.texels;
  built_.root = s.root >= BUILD_LEAF ? LEAF_BIT | (triangles - 1) << LEAF_COUNT_SHIFT : 0;
}

const BuiltTree& DeviceBuilder::build(const RawBuffer& triangles, std::uint32_t count, const BuildSettings& settings) {
  check_settings(settings);
  check_count(gpu_.info(), count);
  triangles_ = &triangles;
  settings_ = settings;
  has_parents_ = false;
  build_ms_.clear();
  write_ms_.clear();
  built_ = {};
  if (count == 0) return built_;
  reserve(count);
  record(triangles, count, settings);
  read_state(count);
  return built_;
}

void DeviceBuilder::write(NodeLayout layout, Padding padding, const BufferPart& pairs, const BufferPart& leaves) {
  if (built_.proper == 0) return;
  Memory& m = *memory_;
  std::unique_ptr<Kernel>& kernel = kernels_->write[{layout, padding}];
  if (!kernel) kernel = std::make_unique<Kernel>(gpu_, write_source(gpu_.info(), layout, padding));
  kernel->bind(BIND_BUILD_STATE, m.state);
  kernel->bind(BIND_BUILD_TRIANGLES, *triangles_);
  kernel->bind(BIND_BUILD_PRIMS, m.prims[sorted_]);
  kernel->bind(BIND_BUILD_NODES, m.nodes);
  kernel->bind(BIND_BUILD_NEEDS, m.needs);
  kernel->bind(BIND_BUILD_STARTS, m.starts);
  kernel->bind(BIND_BUILD_PAIRS, pairs);
  kernel->bind(BIND_BUILD_LEAVES, leaves);
  const std::uint32_t group = gpu_.info().subgroup_size * kBuildSubgroups;
  record_build(gpu_, *kernel, std::min(groups_of(built_.proper, group), gpu_.info().max_group_count_x),
               WritePush{built_.triangles}, "write", write_ms_);
}

void DeviceBuilder::write_frontier(NodeLayout layout, const BufferPart& pairs, std::uint32_t nodes,
                                   const BufferPart& frontier) {
  if (!kernels_) reserve(1);  // nothing was built: the frontier is empty
  std::unique_ptr<Kernel>& kernel = kernels_->frontier[layout];
  if (!kernel) kernel = std::make_unique<Kernel>(gpu_, frontier_source(gpu_.info(), layout));
  kernel->bind(BIND_BUILD_STATE, memory_->state);
  kernel->bind(BIND_BUILD_PAIRS, pairs);
  kernel->bind(BIND_BUILD_FRONTIER, frontier);
  record_build(gpu_, *kernel, 1, FrontierPush{built_.root, nodes}, "frontier", write_ms_);
}

}  // namespace ballot
