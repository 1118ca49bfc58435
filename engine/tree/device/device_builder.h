// The builder `device` (engine/tree/host/builders.h): makes the tree of triangles that lie on the device, on the
// device. It also makes trees over the boxes of instances (top_builder.h).
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "engine/tree/device/radix_sort.h"

namespace ballot {

/// What is known of a tree that was built on the device. Its arrays lie there.
struct BuiltTree {
  std::uint32_t triangles = 0;       // in the scene
  std::uint32_t proper = 0;          // triangles with area, which the tree holds
  std::uint32_t pairs = 0;           // pairs of siblings; trees of more than six triangles have one that is not used
  std::uint32_t leaf_texels = 0;     // texels of leaves
  std::uint32_t root = END_OF_TREE;  // child reference: END_OF_TREE, a leaf, or texel 0; over instances any texel
  std::uint32_t depth = 0;           // as BvhStats::depth
  double sah = 0;                    // as BvhStats::sah
  Bounds bounds{};                   // of the triangles with area; zero if there are none
  glm::vec3 origin{0};               // the point that boxes on the device are measured from
  std::uint32_t leaves() const { return (leaf_texels - proper * TRIANGLE_TEXELS) / LEAF_HEADER_TEXELS; }
};

/// Builds trees on a device. It keeps its working memory, about 130 bytes a triangle, for the next build. Belongs to
/// the thread of its Context.
///
/// All passes follow from the number of triangles alone, so the host waits once, before the tree is written: then it
/// knows how large the tree is. No pass waits for other workgroups, and all loops are bounded, whatever the triangles.
///
/// Sources: shaders/build/frame.comp (Morton codes), shaders/lib/build/sort.glsl, shaders/build/cluster.comp (H-PLOC),
/// shaders/build/refit.comp (the climb).
class DeviceBuilder {
 public:
  /// Returns true if the device can run the builder.
  static bool runs_on(const DeviceInfo& device) { return device.shuffle && device.subgroup_size <= 64; }
  /// Returns the most triangles that a build takes there: leaves with a triangle each fit into a buffer.
  static std::uint64_t most_triangles(const DeviceInfo& device);
  /// Throws Error(Work) for more.
  static void check_count(const DeviceInfo& device, std::uint64_t triangles);
  /// Throws Error(Arguments) if the device has no subgroup shuffle or subgroups of more than 64.
  explicit DeviceBuilder(Context& gpu, BuildOver over = BuildOver::Triangles);
  ~DeviceBuilder();
  DeviceBuilder(const DeviceBuilder&) = delete;
  DeviceBuilder& operator=(const DeviceBuilder&) = delete;

  /// Returns a buffer of triangles as build() takes it.
  static Buffer<Triangle> upload(Context& gpu, std::span<const Triangle> triangles);
  /// The same into a buffer of as many triangles.
  static void upload(Context& gpu, std::span<const Triangle> triangles, Buffer<Triangle>& buffer);

  /// Builds a tree of the first `count` triangles. Coordinates are finite and within +-1e12. The triangles must stay as
  /// they are until the last write(). Throws Error(Arguments) if a setting is out of range; Error(Work) if there are
  /// more than most_triangles(), the device has no room, or its driver lost part of the work.
  const BuiltTree& build(const RawBuffer& triangles, std::uint32_t count, const BuildSettings& settings);

  /// Record a refit of the tree of the last build(): its boxes move to the triangles of a buffer, which are as many as
  /// before; the shape of the tree stays. write() may be recorded between the two. end_refit() waits and returns true
  /// if the tree is sound; built() is then that of the new triangles. It returns false if a triangle has gained or lost
  /// its area since the build: then the tree is lost, and what write() wrote with it. `longest` is about the longest
  /// side of the new bounds, so that areas stay in the range of float32. Coordinates and the life of the buffer are as
  /// for build(). Throw Error(Work) if the device fails.
  ///
  /// No pass waits for other workgroups, all loops are bounded, and the result is the same in every run.
  void begin_refit(const RawBuffer& triangles, float longest);
  bool end_refit();

  /// Returns the tree of the last build() or refit.
  const BuiltTree& built() const { return built_; }

  /// Writes the tree of the last build() or refit: pairs in a layout, and leaves of LeafFormat::Vertices. The parts
  /// hold at least pairs * PAIR_TEXELS and leaf_texels texels, and can be written by kernels.
  void write(NodeLayout layout, Padding padding, const BufferPart& pairs, const BufferPart& leaves);

  /// Writes the frontier of pairs that write() has written in a layout: `nodes` nodes for each octant, 64 at most, in
  /// FRONTIER_OCTANTS * 2 * nodes texels that can be written by kernels.
  void write_frontier(NodeLayout layout, const BufferPart& pairs, std::uint32_t nodes, const BufferPart& frontier);

  /// Returns the bits of Morton codes that triangles are sorted by: a multiple of 8.
  static std::uint32_t code_bits(std::uint32_t triangles);

  /// Measurements only: bits of Morton codes other than code_bits().
  void set_code_bits(std::optional<std::uint32_t> bits) { bits_ = bits; }

  /// Device milliseconds of the passes of the last build() and of the writes since. Call it when they have ended.
  const PassMs& build_ms() const { return build_ms_; }
  const PassMs& write_ms() const { return write_ms_; }
  /// The same of the last refit, after end_refit().
  const PassMs& refit_ms() const { return refit_ms_; }

 private:
  friend class TopBuilder;
  struct Memory;
  struct Kernels;
  struct RefitKernels;
  void reserve(std::uint32_t count);
  void record(const RawBuffer& triangles, std::uint32_t count, const BuildSettings& settings);
  void record_codes(const RawBuffer& triangles, std::uint32_t count);
  void record_places(std::uint32_t count);
  void read_state(std::uint32_t count);
  void read_tree(const BuildState& state);
  void read_bounds(const BuildState& state);
  void bind_refit(const RawBuffer& triangles);

  Context& gpu_;
  const BuildOver over_;
  std::unique_ptr<Memory> memory_;
  std::unique_ptr<Kernels> kernels_;
  std::unique_ptr<RefitKernels> refit_kernels_;  // made on first use
  const RawBuffer* triangles_ = nullptr;
  BuildSettings settings_;
  bool has_parents_ = false;  // the tree is prepared for refits
  std::size_t sorted_ = 0;    // index of the buffers that hold the sorted keys
  BuiltTree built_;
  std::uint32_t refused_ = BUILD_NONE;  // BuildState::refused, as it was read last
  PassMs build_ms_, write_ms_, refit_ms_;
  std::optional<std::uint32_t> bits_;
};

}  // namespace ballot
