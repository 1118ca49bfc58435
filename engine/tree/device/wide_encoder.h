// Encodes wide trees on the device, from pairs that lie there.
#pragma once

#include <optional>

#include "engine/tree/device/build_kernels.h"
#include "engine/tree/formats/formats.h"

namespace ballot {

/// The shape of a wide tree on the device: which pairs are its nodes, and how these hang together. It outlives a refit
/// of the pairs.
struct WideShape {
  std::uint32_t nodes = 0, list_texels = 0;                  // texels of the lists of leaves, in bvh8
  Buffer<std::uint32_t> choices, needs, starts, wide_nodes;  // shaders/shared/build.h
};

/// Collapses pairs into a tree of a collapsed format (formats.h) and writes its nodes. The tree is the one that the
/// host's encoder makes of the same pairs, but for the order of nodes and, in bvh8, equally good slots of children.
/// Keeps its working memory, 24 bytes a pair for bvh4 and 40 for the others. Belongs to the thread of its Context.
///
/// No pass waits for other workgroups, all loops are bounded, and the result is the same in every run.
///
/// Sources: shaders/lib/build/collapse.glsl, shaders/lib/build/slots.glsl.
class WideEncoder {
 public:
  WideEncoder(Context& gpu, TreeFormatId id);
  ~WideEncoder();
  WideEncoder(const WideEncoder&) = delete;
  WideEncoder& operator=(const WideEncoder&) = delete;

  /// Returns the shape of the wide tree of `count` pairs, at least one, in NodeLayout::Interleaved. `longest` is the
  /// longest side of the scene, or near it. Waits for the device, as the size of the tree is not known before. Throws
  /// Error(Work) if the tree has more nodes than its references can number, or the device has no room or fails.
  WideShape collapse(const BufferPart& pairs, std::uint32_t count, float longest);

  /// Returns the texels of a tree of this shape.
  std::size_t texels(const WideShape& shape) const {
    return std::size_t(shape.nodes) * format_.node_texels + (has_lists() ? shape.list_texels : 0);
  }

  /// Writes the tree with the boxes that the pairs have now, to a part of texels(shape) texels with Access::Storage.
  void write(const WideShape& shape, const BufferPart& pairs, const BufferPart& texels);

  /// Device milliseconds of the last collapse() and of the last write(). Call it when they have ended.
  const PassMs& collapse_ms() const { return collapse_ms_; }
  const PassMs& write_ms() const { return write_ms_; }

 private:
  struct Memory;
  struct Kernels;
  bool has_lists() const { return format_.id == TreeFormatId::Bvh8; }
  void record(const BufferPart& pairs, std::uint32_t count, float longest, WideShape& shape);
  void record_places(std::uint32_t count, WideShape& shape);
  std::uint32_t groups(std::uint32_t count) const;

  Context& gpu_;
  const TreeFormat& format_;
  std::unique_ptr<Memory> memory_;
  std::unique_ptr<Kernels> kernels_;
  PassMs collapse_ms_, write_ms_;
};

/// Returns the sources of all kernels of the encoders.
std::vector<KernelSource> encoder_sources(const DeviceInfo& device);

}  // namespace ballot
