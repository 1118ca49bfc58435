// The arrays of a tree or a forest that a kernel reads, and the push constants that describe them: for kernels of
// traversal and of queries.
#pragma once

#include "engine/gpu/kernel.h"
#include "engine/tree/device/device_tree.h"
#include "shaders/shared/layout.h"
#include "shaders/shared/variant.h"

namespace ballot {

/// Where walks begin: a child reference of the tree. Of a forest it is one of the top-level tree, and the walk of each
/// mesh's tree begins at `mesh_root` or, if that is END_OF_TREE, at its root.
struct TreePiece {
  std::uint32_t root, mesh_root = END_OF_TREE;
};

/// The push constants of a kernel that reads a tree. Kernels of a single tree take the first part alone.
struct TracePushes {
  TracePush trace;
  TopPush top;
};

/// Returns the bytes of TracePushes that kernels of a tree take.
inline std::uint32_t push_bytes(const DeviceTree& tree) {
  return tree.forest() ? sizeof(TracePushes) : sizeof(TracePush);
}

/// What a kernel reads of a tree.
struct TreeReads {
  TreeFormatId format = TreeFormatId::Pair;
  LeafFormat leaves = LeafFormat::Vertices;
  TreeAccess access = {};
  bool pairs = true;  // the pairs themselves, too
  Source source = Source::Host;
  bool in_double = false;  // numeric mode double: vertices in double, if there are some
};

/// The arrays of a tree; null for those that a kernel does not read. They are valid until the tree's next generation.
struct KernelArrays {
  using Texels = DeviceTree::Texels;

  KernelArrays() = default;
  /// Makes those that are not there.
  KernelArrays(DeviceTree& tree, const TreeReads& reads);

  /// Binds the arrays to a kernel that reads them through buffers of this kind.
  void bind(Kernel& kernel, Fetch fetch) const;

  /// Returns the push constants of such a kernel. The caller sets the rest: rays, batches, threshold, camera.
  TracePushes pushes(const DeviceTree& tree, const TreePiece& from) const;

  const Texels *nodes = nullptr, *format = nullptr, *leaves = nullptr;
  const Texels *top = nullptr, *meshes = nullptr;  // of a forest
  const Buffer<glm::vec4>* shapes = nullptr;       // of a forest that has some
  const Texels* doubles = nullptr;                 // of a scene with vertices in double
  bool in_double = false;
};

}  // namespace ballot
