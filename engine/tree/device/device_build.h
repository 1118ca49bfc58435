// A tree that was built on the device, and stays there until the host asks for it.
#pragma once

#include <map>
#include <optional>

#include "engine/tree/device/device_builder.h"
#include "engine/tree/device/wide_encoder.h"

namespace ballot {

/// A tree that DeviceBuilder made. It keeps the builder's memory, so that the tree can be
/// written in other layouts. Belongs to the thread of its Context.
class DeviceBuild {
 public:
  /// Uploads the triangles and builds their tree. Throws Error as build_bvh() and DeviceBuilder do.
  DeviceBuild(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings);

  /// The same for triangles on the device, which it takes. They are valid as build_bvh() has it.
  DeviceBuild(Context& gpu, Buffer<Triangle> triangles, const BuildSettings& settings);

  /// Returns bounds and statistics, without nodes and references. `largest_leaf` is what the settings allow.
  const Bvh& summary() const { return summary_; }
  /// Returns the tree in the reference form. The first call reads it back.
  const Bvh& bvh();
  const BuiltTree& built() const { return built_; }
  /// True if device arrays of this tree measure boxes from box_origin() of its bounds. On devices without float64 the
  /// rounding of the two may differ.
  bool has_box_origin() const { return built_.origin == box_origin(built_.bounds); }

  /// Return the triangles on the device, and exchange them with as many others, which the tree does not follow yet.
  /// They must be valid as build_bvh() has it.
  const Buffer<Triangle>& triangles() const { return *triangles_; }
  void swap_triangles(Buffer<Triangle>& others) { std::swap(*triangles_, others); }
  /// The same with triangles of the host.
  void upload(std::span<const Triangle> triangles) { DeviceBuilder::upload(gpu_, triangles, *triangles_); }

  /// Record a refit to the triangles at hand (DeviceBuilder::begin_refit). `bounds` are those of all of them. write()
  /// may be called between the two. end_refit() waits. It returns false if the tree is lost: a triangle gained or lost
  /// its area, or has_box_origin() would be false. Then it has to be built anew. Throw Error(Work) if the device fails.
  void begin_refit(const Bounds& bounds);
  bool end_refit();

  /// Builds the tree of the triangles at hand, in the same memory. Throws as the constructor does; the tree is lost
  /// then.
  void rebuild();
  /// The same for any number of other triangles of the host.
  void build(std::span<const Triangle> triangles);

  /// Write the device arrays (DeviceBuilder::write, write_frontier).
  void write(NodeLayout layout, Padding padding, const BufferPart& pairs, const BufferPart& leaves) {
    builder_.write(layout, padding, pairs, leaves);
  }
  void write_frontier(NodeLayout layout, const BufferPart& pairs, std::uint32_t nodes, const BufferPart& frontier) {
    builder_.write_frontier(layout, pairs, nodes, frontier);
  }
  const DeviceBuilder& builder() const { return builder_; }

  /// Returns the encoder of a collapsed format, which takes pairs that write() has written.
  WideEncoder& encoder(TreeFormatId id);
  /// Collapses pairs (WideEncoder::collapse). The tree must not be empty.
  WideShape collapse(TreeFormatId id, const BufferPart& pairs);

 private:
  PairTree download();
  void build_at_hand();

  Context& gpu_;
  BuildSettings settings_;
  DeviceBuilder builder_;
  std::optional<Buffer<Triangle>> triangles_;
  BuiltTree built_;
  Bvh summary_;
  std::optional<Bvh> bvh_;
  std::map<TreeFormatId, WideEncoder> encoders_;  // made on first use
};

/// Builds a tree on the device and reads it back. Throws Error as build_bvh() and DeviceBuilder do.
Bvh build_bvh_on_device(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings = {});

}  // namespace ballot
