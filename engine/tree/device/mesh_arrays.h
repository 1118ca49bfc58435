// The tree of one mesh, and what is made of it for kernels.
#pragma once

#include <compare>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/model/host_copy.h"
#include "engine/tree/device/device_build.h"
#include "engine/tree/device/tree_access.h"
#include "engine/tree/formats/formats.h"

namespace ballot {

/// The place where arrays are made. Device: what a mesh has there (MeshArrays::built()) is written there; the arrays of
/// other meshes are made on the host all the same. Kernels do not mix arrays of the two: their leaves differ in order.
enum class Source { Host, Device };

/// An array of nodes of a format.
struct NodesKey {
  TreeFormatId id = TreeFormatId::Pair;
  NodeLayout layout = NodeLayout::Interleaved;
  Padding padding = Padding::Ray;
  Fetch fetch = Fetch::Storage;
  Source source = Source::Host;
  auto operator<=>(const NodesKey&) const = default;
};

/// An array of leaves.
struct LeavesKey {
  LeafFormat format = LeafFormat::Vertices;
  Fetch fetch = Fetch::Storage;
  Source source = Source::Host;
  auto operator<=>(const LeavesKey&) const = default;
};

/// What the host has of a mesh.
struct HostMesh {
  Bvh* bvh;
  std::span<Triangle> triangles;
  HostCopy* copy;  // of these two
};

/// Texels that are made for an upload: of memory that stays, or their own.
struct Encoded {
  std::span<const glm::uvec4> texels;
  std::vector<glm::uvec4> own = {};

  explicit Encoded(std::span<const glm::uvec4> kept) : texels(kept) {}
  explicit Encoded(std::vector<glm::uvec4> made) : texels(made), own(std::move(made)) {}
};

/// The tree of one mesh, in the forms that the host has it in, and how it is written on the device. Belongs to the
/// thread of its Context.
class MeshArrays {
 public:
  /// Takes another tree. Keeps references to bvh and triangles. If the tree was `built` on the device, `bvh` may be its
  /// summary: then the tree is read back where the host needs its nodes. Nothing may read the arrays of before.
  void replace(const Bvh& bvh, std::span<const Triangle> triangles, std::shared_ptr<DeviceBuild> built);
  /// Takes triangles that have moved, and the tree of the same shape over them. Keeps references.
  void moved(const Bvh& bvh, std::span<const Triangle> triangles);
  /// Takes the same tree and triangles that lie elsewhere now.
  void refer(const Bvh& bvh, std::span<const Triangle> triangles) { bvh_ = &bvh, triangles_ = triangles; }

  /// Returns a number that differs from those of all other trees, and from those of this one before it moved.
  std::uint64_t revision() const { return revision_; }
  /// Returns true if triangles have moved since the tree was made, as they may do again.
  bool has_moved() const { return has_moved_; }

  /// Has the mesh ask `copy` before it reads its triangles or nodes on the host. Keeps the pointer.
  void set_host_copy(const HostCopy* copy) { copy_ = copy; }
  /// Lets the mesh give back what the host has of its tree and triangles, while the device has it: until copy->bring().
  /// Keeps the references. `bvh` and `triangles` are those of the mesh.
  void may_let_go(const HostMesh& host) { host_ = host; }
  void keep_in(const std::filesystem::path& folder) { cache_ = folder; }

  const Bvh& bvh() const { return *bvh_; }
  /// Returns the tree with its nodes, which may go with the next let_host_go().
  const Bvh& whole_bvh() {
    if (copy_) copy_->bring_briefly();
    return built_ ? built_->bvh() : *bvh_;
  }
  std::span<const Triangle> triangles() const {
    if (copy_) copy_->bring();
    return triangles_;
  }
  const std::shared_ptr<DeviceBuild>& built() const { return built_; }
  /// Returns true if the device writes the arrays of this source.
  bool writes_there(Source source) const { return source == Source::Device && built_; }

  /// Returns the pair tree on the host, as it is uploaded. It stays until the tree changes.
  const PairTree& pairs(NodeLayout layout, Padding padding) { return lend(kept(layout, padding)); }
  /// Returns one of these that is there, in any layout; makes one if none is.
  const PairTree& any_pairs() { return lend(any_kept()); }
  /// Returns the child reference at which traversal begins. It is the same in every format.
  std::uint32_t root();
  /// Frees what was made for uploads alone, unless the tree has changed: then it may change again, and all kernels of
  /// an update share the pairs.
  void let_go();
  /// Gives back what the host has, as may_let_go() allows. `leaves` reads the
  /// leaf blocks of LeafFormat::Vertices that the host has made, which the device has as long as this tree stays.
  void let_host_go(const std::function<std::vector<glm::uvec4>()>& leaves);
  /// Returns true if let_host_go() would do so.
  bool may_go() const;

  /// Begins to encode a format on another thread if that takes long. encode() waits for it.
  void prepare(const NodesKey& key);
  /// Returns the texels of arrays that the host makes. They are valid until let_go(), or until the tree changes.
  Encoded encode(const NodesKey& key);
  Encoded encode(const LeavesKey& key);

  /// Return the number of texels of arrays that the device writes. `pairs` are those of the same layout and padding,
  /// which write() has written.
  std::size_t texels(const NodesKey& key, const BufferPart& pairs);
  std::size_t pair_texels(NodeLayout layout) const;
  std::size_t leaf_texels() const { return built_->built().leaf_texels; }
  /// Have the device write pairs, with the leaves; and another format, from such pairs.
  void write(const NodesKey& key, const BufferPart& pairs, const BufferPart& leaves) {
    built_->write(key.layout, key.padding, pairs, leaves);
  }
  void write_format(const NodesKey& key, const BufferPart& pairs, const BufferPart& to);

 private:
  struct Kept {
    PairTree tree;
    bool lent = false;  // somebody may have a reference
  };
  using KeptPairs = std::map<std::pair<NodeLayout, Padding>, Kept>;

  Kept& kept(NodeLayout layout, Padding padding);
  Kept& any_kept();
  static const PairTree& lend(Kept& kept) {
    kept.lent = true;
    return kept.tree;
  }

  const Bvh* bvh_ = nullptr;
  std::span<const Triangle> triangles_;
  std::shared_ptr<DeviceBuild> built_;  // null unless the tree was built on the device
  const HostCopy* copy_ = nullptr;
  std::optional<HostMesh> host_;
  std::filesystem::path cache_;  // of the first tree; empty: none
  std::uint64_t revision_ = 0;
  bool has_moved_ = false, has_changed_ = false;
  std::vector<Bounds> padded_boxes_;   // made on first use
  std::optional<std::uint32_t> root_;  // of pairs that were made on the host
  KeptPairs pairs_;
  KeptPairs spare_pairs_;                                            // of before moved(), whose memory is used again
  std::map<NodesKey, WideShape> shapes_;                             // of wide trees that the device has written
  std::map<NodesKey, std::future<std::vector<glm::uvec4>>> coming_;  // from prepare(). They read pairs_ until they end
};

/// Returns a number that no other tree of the process has or had.
std::uint64_t next_revision();

}  // namespace ballot
