// The tree on a device, in every format that kernels ask for.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "engine/model/features.h"
#include "engine/oracle/oracle_scene.h"
#include "engine/tree/device/double_corners.h"
#include "engine/tree/device/joined_array.h"
#include "engine/tree/device/mesh_arrays.h"
#include "engine/tree/device/shear.h"
#include "engine/tree/device/top_builder.h"
#include "engine/tree/host/forest.h"

namespace ballot {

/// The trees of a scene's meshes on one device, in every format that kernels ask for, and the top-level tree over their
/// instances if there is one. Each array is made when a kernel first asks for it, of all meshes; later only what has
/// changed is written anew.
///
/// Every state of the trees has a generation, a number that no other one of the process has or had. What is derived
/// from a tree (bound buffers, resolved queries, choices of method auto) keeps the generation that it was made from and
/// is made anew once that differs. Belongs to the thread of its Context.
class DeviceTree {
 public:
  using Texels = ballot::Texels;

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
  void move_instances(const MovedTransforms& transforms);
  /// A mesh that gets other triangles, as many, and their tree. `same_shape`: the tree is that of before, refitted.
  struct MeshChange {
    std::size_t mesh;
    MeshTree with;
    bool same_shape;
  };
  /// Forests only: changes meshes and moves the instances, as move_instances() does, which begins a new generation.
  /// Keeps references to the forest's trees and triangles. Throws as move_instances(), and nothing has changed then.
  void change_meshes(std::span<MeshChange> changes, const MovedTransforms& transforms);
  /// Forests only: takes another forest, which begins a new generation. `from` tells of each of its meshes which one of
  /// before it is; none: it is another. What the device has of those stays. Waits for the device. Keeps a reference.
  void take(Forest& forest, std::span<const std::optional<std::uint32_t>> from);
  /// Returns true if the device holds the top-level tree of a forest after a move.
  bool moves_on_device() const;
  /// Measurements and tests only: says where the top-level tree is held from the next move on.
  void set_moves_on_device(bool on_device) { asked_on_device_ = on_device; }
  /// Returns the passes of the last move on the device; null if there was none.
  const TopBuilder* top_builder() const { return top_builder_.get(); }

  /// Returns the forest, or null if this is a single tree. Its instances and tree on the host may be late.
  const Forest* forest() const { return forest_; }

  /// Replaces the tree of a mesh, which begins a new generation. Waits for the device.
  void replace(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts,
               std::shared_ptr<DeviceBuild> built = {});

  /// Moves the arrays of a tree that was built on the device to as many other triangles, where they lie. `bounds` are
  /// those of all of them. Returns false if the tree has to be replaced instead (DeviceBuild::end_refit): the arrays
  /// are lost then. moved() must follow a success. Throws Error(Work) if the device fails.
  bool refit(std::span<const Triangle> triangles, const Bounds& bounds);
  /// The same for the triangles that the DeviceBuild of a mesh has at hand. Of a forest change_meshes() must follow.
  bool refit(const Bounds& bounds, std::size_t mesh = 0);
  /// Begins a new generation for a tree of the same shape whose triangles have moved. Waits for the device. Arrays that
  /// refit() has moved stay; the others are written anew when a kernel asks for them. Keeps references as replace()
  /// does.
  void moved(const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& facts);
  /// Returns true if triangles have moved since the tree was made, as they may do again.
  bool has_moved() const { return meshes_[0].has_moved(); }
  /// Returns what holds the tree of a mesh on the device if it was built there; null if it was not.
  const std::shared_ptr<DeviceBuild>& built(std::size_t mesh = 0) const { return meshes_[mesh].built(); }

  /// MeshArrays::set_host_copy() and may_let_go() of a mesh.
  void set_host_copy(std::size_t mesh, const HostCopy* copy) { meshes_[mesh].set_host_copy(copy); }
  void may_let_go(std::size_t mesh, const HostMesh& host) { meshes_[mesh].may_let_go(host); }
  /// Brings triangles that are late to the host.
  void bring_triangles() const {
    for (const MeshArrays& mesh : meshes_) mesh.triangles();
  }

  /// Keeps formats that take long to encode in a folder on disk until the tree changes (tree/formats/encoded_cache.h).
  void keep_in(const std::filesystem::path& folder) {
    for (MeshArrays& mesh : meshes_) mesh.keep_in(folder);
  }

  /// Returns the seconds that queries other than traces took to walk this tree. They add theirs.
  double& walked_s() { return walked_s_; }
  double walked_s() const { return walked_s_; }

  std::uint64_t generation() const { return generation_; }
  /// Returns the tree, which has no nodes if it is the summary of one that was built on the device.
  const Bvh& bvh() const { return forest_ ? forest_->summary() : meshes_[0].bvh(); }
  /// Returns the tree with its nodes. Not for forests.
  const Bvh& whole_bvh() { return meshes_[0].whole_bvh(); }
  /// Returns the triangles of a mesh.
  std::span<const Triangle> triangles(std::size_t mesh = 0) const { return meshes_[mesh].triangles(); }
  /// Returns the facts that kernels are compiled for.
  const TreeFacts& facts() const { return facts_; }

  /// Returns the point that boxes on the device are measured from: ballot::box_origin() of the scene's bounds.
  const glm::vec3& box_origin() const { return box_origin_; }
  /// Returns the largest distance of a ray's origin from box_origin(), along any axis, for which padded boxes are wide
  /// enough. 0: boxes cannot be padded in the tree.
  float padded_reach() const { return padded_reach_; }
  const ShearScale& shear() const { return shear_; }

  /// Says what the vertices are in double; null: those of float32. To be told anew once triangles have changed. Begins
  /// a new generation where that differs.
  void set_doubles(std::shared_ptr<DoubleCorners> doubles);
  const std::shared_ptr<DoubleCorners>& doubles() const { return doubles_; }
  const Texels& double_texels() { return doubles_->texels(gpu_); }
  /// Returns a bound, along an axis, of how far the part of a triangle that a leaf holds is off its vertices in double
  /// beyond what goes with the distance: 0 unless triangles lie in several leaves.
  float doubles_room() const;

  /// Returns the pair tree on the host, as it is uploaded. Not for forests.
  const PairTree& pairs(NodeLayout layout, Padding padding = Padding::Ray) { return meshes_[0].pairs(layout, padding); }
  /// The same as pairs(), of any mesh.
  const PairTree& mesh_pairs(std::size_t mesh, NodeLayout layout, Padding padding) {
    return meshes_[mesh].pairs(layout, padding);
  }

  /// Returns what oracles look at: of each mesh such a tree that is there, in any layout, and all triangles. It and its
  /// copies are valid until the next generation begins.
  const OracleScene& oracle_scene();

  /// Returns the child reference at which traversal begins. It is the same in every format.
  std::uint32_t root();

  /// Returns a way in which kernels can read the arrays: the `wanted` one if the device has buffers of that kind which
  /// are large enough, else another; the wanted one too if none are.
  Fetch fitting_fetch(Fetch wanted) const;

  /// Returns where the arrays are made of a kernel that reads this format and these leaves. Arrays of the device are
  /// its own pairs, what it makes of them, and vertices.
  Source source_of(TreeFormatId id, LeafFormat leaves) const;

  /// Returns true if nodes() and leaves() for such a kernel have nothing to make.
  bool has_pairs(const TreeAccess& access, Source source) const;
  /// Returns the node pairs that a kernel reads.
  const Texels& nodes(const TreeAccess& access, Source source = Source::Host);
  /// Returns the array of a format other than the pairs.
  const Texels& format(TreeFormatId id, const TreeAccess& access, Source source = Source::Host);
  /// Makes the pairs, and begins to encode a format from them on another thread if that takes long. format() waits.
  void prepare(TreeFormatId id, const TreeAccess& access, Source source = Source::Host);
  /// Returns the leaves, which all formats share.
  const Texels& leaves(LeafFormat format, Fetch fetch, Source source = Source::Host);

  /// Frees what the host has made for uploads alone, and what it has of meshes that the device has
  /// (MeshArrays::let_go(), let_host_go()). To be called when a kernel has its arrays.
  void let_go();

  /// Forests only: return the top-level tree with its instances, and the table of meshes for a kernel that reads these
  /// arrays.
  const Texels& top(Fetch fetch);
  /// Returns the top-level tree as the device has it.
  TopTree top_tree();
  /// Returns what kernels read of shapes (shaders/shared/shapes.h). For facts().shapes alone.
  const Buffer<glm::vec4>& shapes();
  const Texels& mesh_table(TreeFormatId id, const TreeAccess& access, LeafFormat leaves, Source source = Source::Host);

 private:
  using TableKey = std::tuple<TreeFormatId, TreeAccess, LeafFormat, Source>;
  using MeshRow = std::array<glm::uvec4, MESH_TEXELS>;  // shaders/lib/tree/meshes.glsl
  struct Table {
    Texels texels;
    std::uint64_t generation;
    std::vector<MeshRow> rows;
    std::vector<std::uint64_t> revisions;  // of each mesh, that its row is of
  };

  std::uint64_t largest_bytes() const;
  void describe(const TreeFacts& facts);
  void begin_generation();
  void number_generation();
  void take_facts();
  void exchange(std::size_t mesh, MeshTree& with);
  float least_reach() const;
  JoinedArray& array_of(const NodesKey& key);
  JoinedArray& leaves_of(const LeavesKey& key);
  /// A mesh whose content in an array is of an earlier revision, and what is to be uploaded; nothing if the device
  /// writes it.
  struct Stale {
    std::size_t mesh;
    std::optional<Encoded> encoded;
  };
  bool is_stale(const JoinedArray& array) const;
  template <class Key, class Size>
  std::vector<Stale> make_room(JoinedArray& array, const Key& key, const Size& texels_there);
  template <class Write>
  void follow(JoinedArray& array, const std::vector<Stale>& stale, const Write& write_there);
  void follow_pairs(JoinedArray& array, const NodesKey& key);
  void follow_format(JoinedArray& array, const NodesKey& key);
  const JoinedArray* leaves_there(std::size_t mesh) const;
  void set_refitted(std::size_t mesh);
  void write_table(const TableKey& key, Table& table);
  void move_on_host(const MovedTransforms& transforms);
  void move_on_device(const MovedTransforms& transforms);
  Texels room_for_top(Fetch fetch, std::size_t texels);

  Context& gpu_;
  Forest* forest_ = nullptr;
  std::vector<MeshArrays> meshes_;
  TreeFacts facts_;
  std::uint64_t generation_ = 0;
  std::shared_ptr<DoubleCorners> doubles_;
  std::optional<OracleScene> oracle_scene_;  // of this generation
  glm::vec3 box_origin_{0};
  float padded_reach_ = 0;
  ShearScale shear_{};
  std::map<NodesKey, JoinedArray> arrays_;
  std::map<LeavesKey, JoinedArray> leaves_;
  std::map<std::size_t, std::vector<JoinedArray*>> refitted_;  // of each mesh, by the last refit()
  std::map<TableKey, Table> tables_;                           // these of forests
  std::map<Fetch, Texels> tops_;
  std::optional<Buffer<glm::vec4>> shapes_;  // made on first use
  std::uint64_t shapes_of_ = 0;              // Forest::exchanges() of them
  std::unique_ptr<TopBuilder> top_builder_;  // null unless the device holds the top-level tree
  std::optional<bool> asked_on_device_;
  double walked_s_ = 0;
};

}  // namespace ballot
