// The tree on a device, in every format that kernels ask for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <tuple>
#include <vector>

#include "engine/bvh/forest.h"
#include "engine/formats/formats.h"
#include "engine/scene/features.h"
#include "engine/scene/late_vertices.h"
#include "engine/tree/build/device_build.h"
#include "engine/tree/build/top_builder.h"
#include "engine/tree/shear.h"
#include "engine/tree/tree_access.h"
#include "engine/vk/buffer.h"

namespace ballot {

/// The place where the arrays of a kernel were made. Kernels do not mix arrays of the two: their leaves differ in
/// order.
enum class Source { Host, Device };

/// The arrays of one tree on one device. Each is encoded and uploaded when a kernel first asks for it.
///
/// Every state of the tree has a generation, a number that no other tree of the process has or had. What is derived
/// from a tree (bound buffers, resolved queries, choices of method auto) keeps the generation that it was made from and
/// is made anew once that differs. Belongs to the thread of its Context.
class DeviceTree {
 public:
  using Texels = Buffer<glm::uvec4>;

  /// Keeps references to gpu, bvh and triangles. Kernels are compiled for `facts`: those of `bvh`, or more general
  /// ones. If the tree was `built` on the device, `bvh` may be its summary: then the tree is read back where the host
  /// needs its nodes.
  DeviceTree(Context& gpu, const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
             std::shared_ptr<DeviceBuild> built = {});

  /// The arrays of a forest: of all meshes one behind the other, and of the top-level tree. Keeps references.
  DeviceTree(Context& gpu, Forest& forest);

  /// Forests only: moves the instances, one transform each, which begins a new generation. Waits for the device. The
  /// top-level tree is refitted or built on the device where that is quicker (moves_on_device()), else on the host
  /// (Forest::move). Throws as Forest::move() does, and nothing has changed then; Error(Work) if the device fails.
  void move_instances(std::span<const Transform> transforms);
  /// Returns true if the device holds the top-level tree of a forest after a move.
  bool moves_on_device() const;
  /// Measurements and tests only: says where the top-level tree is held from the next move on.
  void set_moves_on_device(bool on_device) { asked_on_device_ = on_device; }
  /// Returns the passes of the last move on the device; null if there was none.
  const TopBuilder* top_builder() const { return top_builder_.get(); }

  /// Returns the forest, or null if this is a single tree. Its instances and tree on the host may be late.
  const Forest* forest() const { return forest_; }

  /// Replaces the tree, which begins a new generation. Waits for the device. Invalidates references to arrays.
  void replace(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
               std::shared_ptr<DeviceBuild> built = {});

  /// Moves the arrays of a tree that was built on the device to as many other triangles, where they lie. `bounds` are
  /// those of all of them. Returns false if the tree has to be replaced instead (DeviceBuild::end_refit): the arrays
  /// are lost then. moved() must follow a success. Throws Error(Work) if the device fails.
  bool refit(std::span<const Triangle> triangles, const Bounds& bounds);
  /// The same for the triangles that the DeviceBuild has at hand.
  bool refit(const Bounds& bounds);
  /// Begins a new generation for a tree of the same shape whose triangles have moved. Waits for the device. Arrays that
  /// refit() has moved stay; the others are made anew when a kernel asks for them. Keeps references as replace() does.
  void moved(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts);
  /// Returns true if triangles have moved since the tree was made, as they may do again.
  bool has_moved() const { return has_moved_; }
  /// Returns what holds the tree on the device if it was built there; null if it was not.
  const std::shared_ptr<DeviceBuild>& built() const { return built_; }

  /// Has the tree ask `late` before it reads triangles on the host. Keeps the pointer.
  void set_late(const LateVertices* late) { late_ = late; }

  /// Keeps formats that take long to encode in a folder on disk until the tree changes (formats/encoded_cache.h).
  void keep_in(const std::filesystem::path& folder) { cache_ = folder; }

  /// Returns the seconds that queries other than traces took to walk this tree. They add theirs.
  double& walked_s() { return walked_s_; }
  double walked_s() const { return walked_s_; }

  std::uint64_t generation() const { return generation_; }
  /// Returns the tree, which has no nodes if it is the summary of one that was built on the device.
  const Bvh& bvh() const { return *bvh_; }
  /// Returns the tree with its nodes.
  const Bvh& whole_bvh() { return built_ ? built_->bvh() : *bvh_; }
  std::span<const Triangle> triangles() const {
    if (late_) late_->bring();
    return triangles_;
  }
  /// Returns the facts that kernels are compiled for.
  const TreeFacts& facts() const { return facts_; }

  /// Returns the point that boxes on the device are measured from: ballot::box_origin() of the scene's bounds.
  const glm::vec3& box_origin() const { return box_origin_; }
  /// Returns the largest distance of a ray's origin from box_origin(), along any axis, for which padded boxes are wide
  /// enough. 0: boxes cannot be padded in the tree.
  float padded_reach() const { return padded_reach_; }
  const ShearScale& shear() const { return shear_; }

  /// Returns the pair tree on the host, as it is uploaded. The oracles walk the one without padding. Not for forests.
  const PairTree& pairs(NodeLayout layout, Padding padding = Padding::Ray);
  /// Returns one of these that is there, in any layout; makes one if none is.
  const PairTree& any_pairs();

  /// Returns the child reference at which traversal begins. It is the same in every format.
  std::uint32_t root();

  /// Returns a way in which kernels can read the arrays: the `wanted` one if the device has buffers of that kind which
  /// are large enough, else another; the wanted one too if none are.
  Fetch fitting_fetch(Fetch wanted) const;

  /// Returns where the arrays are made of a kernel that reads this format and these leaves. Arrays of the device are
  /// its own pairs, what it makes of them, and vertices.
  Source source_of(TreeFormatId id, LeafFormat leaves) const {
    return built_ && format_of(id).on_device && leaves == LeafFormat::Vertices ? Source::Device : Source::Host;
  }

  /// Returns the node pairs that a kernel reads.
  const Texels& nodes(const TreeAccess& access, Source source = Source::Host);
  /// Returns the array of a format other than the pairs.
  const Texels& format(TreeFormatId id, const TreeAccess& access, Source source = Source::Host);
  /// Makes the pairs, and begins to encode a format from them on another thread if that takes long. format() waits.
  void prepare(TreeFormatId id, const TreeAccess& access, Source source = Source::Host);
  /// Returns the leaves, which all formats share.
  const Texels& leaves(LeafFormat format, Fetch fetch, Source source = Source::Host);

  /// Forests only: return the pair trees of the meshes on the host, the top-level tree with its instances, and the
  /// table of meshes for a kernel that reads these arrays.
  const std::vector<PairTree>& mesh_pairs(NodeLayout layout, Padding padding);
  /// Returns such trees that are there, in any layout; makes them if none are.
  const std::vector<PairTree>& any_mesh_pairs();
  const Texels& top(Fetch fetch);
  /// Returns the top-level tree as the device has it.
  TopTree top_tree();
  const Texels& mesh_table(TreeFormatId id, const TreeAccess& access, LeafFormat leaves);

 private:
  using FormatKey = std::tuple<TreeFormatId, std::uint32_t, NodeLayout, Padding, Fetch, Source>;
  using LeavesKey = std::tuple<LeafFormat, Fetch, Source>;

  using TableKey = std::tuple<TreeFormatId, std::uint32_t, NodeLayout, Padding, Fetch, LeafFormat>;
  /// The first texel of each mesh in an array, and behind these the end of the array.
  using Firsts = std::vector<std::uint32_t>;
  /// The texels of all meshes.
  struct Joined {
    std::vector<glm::uvec4> texels;
    Firsts firsts;
  };

  std::uint64_t largest_bytes() const;
  void describe(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts);
  FormatKey format_key(TreeFormatId id, const TreeAccess& access, Source source) const;
  Joined joined(const char* name, const std::function<std::vector<glm::uvec4>(std::size_t mesh)>& part) const;
  const Texels& forest_nodes(const FormatKey& key);
  void move_on_host(std::span<const Transform> transforms);
  void move_on_device(std::span<const Transform> transforms);
  Texels room_for_top(Fetch fetch, std::size_t texels);
  const Texels& forest_format(const FormatKey& key);
  const Texels& forest_leaves(const LeavesKey& key);
  const Texels& write_nodes(const FormatKey& key);
  const Texels& device_pairs(const FormatKey& key) const;
  const Texels& write_format(const FormatKey& key, const TreeAccess& access);
  void write_frontier(const FormatKey& key, Texels& frontier);
  template <class Key>
  Texels uploaded(std::map<Key, Texels>& spare, const Key& key, std::span<const glm::uvec4> texels, const char* name);
  const Texels& upload(const FormatKey& key, std::span<const glm::uvec4> texels, const char* name);

  Context& gpu_;
  const Bvh* bvh_ = nullptr;
  Forest* forest_ = nullptr;
  std::shared_ptr<DeviceBuild> built_;  // null unless the tree was built on the device
  std::span<const Triangle> triangles_;
  const LateVertices* late_ = nullptr;
  std::filesystem::path cache_;  // of the first tree; empty: none
  TreeFacts facts_;
  std::uint64_t generation_ = 0;
  glm::vec3 box_origin_{0};
  float padded_reach_ = 0;
  ShearScale shear_{};
  std::vector<Bounds> padded_boxes_;  // made on first use
  std::map<std::pair<NodeLayout, Padding>, PairTree> pairs_;
  std::map<FormatKey, Texels> arrays_;
  std::map<LeavesKey, Texels> leaves_;
  std::map<FormatKey, WideShape> shapes_;  // of wide trees that the device has written
  std::set<FormatKey> late_formats_;       // of these, those whose pairs have moved since
  std::map<std::pair<NodeLayout, Padding>, std::vector<PairTree>> mesh_pairs_;  // these five of forests
  std::map<FormatKey, Firsts> firsts_;
  std::map<LeavesKey, Firsts> leaf_firsts_;
  std::map<TableKey, Texels> tables_;
  std::map<Fetch, Texels> tops_;
  std::unique_ptr<TopBuilder> top_builder_;  // null unless the device holds the top-level tree
  std::optional<bool> asked_on_device_;
  bool has_moved_ = false;
  double walked_s_ = 0;
  // Those of the tree before moved(), whose memory is used again.
  std::map<std::pair<NodeLayout, Padding>, PairTree> spare_pairs_;
  std::map<FormatKey, Texels> spare_arrays_;
  std::map<LeavesKey, Texels> spare_leaves_;
  std::map<FormatKey, std::future<std::vector<glm::uvec4>>> coming_;  // from prepare(). They read pairs_ until they end
};

}  // namespace ballot
