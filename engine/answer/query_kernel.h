// A kernel of shaders/query over the tree of a scene. Internal to engine/answer.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "engine/answer/kernel_arrays.h"
#include "engine/answer/launch_size.h"
#include "engine/answer/point_queries.h"
#include "engine/answer/ray_queries.h"
#include "engine/answer/repair.h"
#include "engine/answer/variant.h"
#include "engine/gpu/room.h"

namespace ballot {

/// Returns the source of shaders/query/NAME.comp for a device and a tree. It is compiled as the traversal method
/// while-while would be, in mode watertight, so that both read the same arrays.
/// `wide`: as bvh8 would be, over the compressed eight-wide tree.
KernelSource query_source(const std::string& name, const DeviceInfo& device, const TreeFacts& tree,
                          const Defines& defines = {}, bool wide = false);

/// Specialisation constants by id.
using SpecConstants = std::map<std::uint32_t, std::uint32_t>;

/// A kernel whose text is no file (KernelSource::text): what messages call it, and its numeric mode.
struct OwnText {
  std::string text, name;
  std::string_view numeric = kDefaultNumeric;
  bool included = false;  // its calls stand in a program's own shader: CALLED_INCLUDED (shaders/lib/frame/kernel.glsl)
};

/// Returns true if two sources of one text are compiled alike.
bool is_made_from(const KernelSource& a, const KernelSource& b);

/// Returns the source of a kernel with such a text, as if it were shaders/query/NAME.comp.
KernelSource own_source(const std::string& name, const DeviceInfo& device, const TreeFacts& tree,
                        const Defines& defines, const OwnText& own);

/// A kernel with the arrays of a tree or a forest. One invocation answers one query. Belongs to the thread of its
/// Context.
class QueryKernel {
 public:
  /// Keeps references to gpu and tree. Throws Error(Work) if the kernel does not compile. `wide`: it walks the
  /// eight-wide tree. `constants`: in addition to those of every kernel. `own`: a text in the place of the file's.
  QueryKernel(Context& gpu, DeviceTree& tree, std::string name, Defines defines = {}, bool wide = false,
              SpecConstants constants = {}, OwnText own = {});

  bool is_wide() const { return wide_; }
  /// Returns the way in which the kernel reads the tree.
  Fetch fetch() const { return config_.fetch; }

  /// Returns the bytes of an element of each storage buffer that is one array, by binding. Call it after prepare().
  const std::map<std::uint32_t, std::uint32_t>& element_bytes() const { return kernel_->element_bytes(); }

  /// Returns the largest number of queries of one dispatch.
  std::uint32_t most() const;

  /// Binds a buffer, as Kernel::bind(). Call it after each prepare().
  void bind(std::uint32_t binding, const BufferPart& part) { kernel_->bind(binding, part); }
  /// Binds what `binds` knows of. Call it after each prepare().
  void bind(const std::function<void(Kernel&)>& binds) { binds(*kernel_); }
  /// Binds what the kernel reads of surfaces. Call it after each prepare().
  void bind(const SurfaceAlpha& alpha) { alpha.bind(*kernel_); }
  /// Binds push constants of an included text, in a buffer. Call it after each prepare().
  void bind_pushes(const TreePiece& from);
  /// Returns the source that the kernel was made from last.
  const KernelSource& source() const { return source_; }
  /// Returns Vulkan's handles of the kernel's set layout, and of a set of what is bound (Kernel::descriptors()).
  std::pair<std::uint64_t, std::uint64_t> descriptors() { return kernel_->descriptors(); }
  /// Makes or renews the kernel, if the tree or the shaders changed.
  void prepare();
  /// Answers queries [first, first + count) from `from` on, and waits. Returns how many of them the driver cut short.
  /// Adds the time to `times`. They go in launches of a tenth of a second, or less where the device asks for that;
  /// `launched` is called after each with the number of queries so far. It may be empty, and may throw.
  std::uint32_t run(std::uint32_t first, std::uint32_t count, const TreePiece& from, TraceTimes& times,
                    const std::function<void(std::uint32_t)>& launched = {});
  std::uint32_t run(std::uint32_t count, const TreePiece& from, TraceTimes& times) {
    return run(0, count, from, times);
  }

  /// Returns true if one launch answers so many queries soon, and leaves nothing that the host has to look at.
  bool can_record(std::uint32_t count) const;
  /// Records such a launch of queries [first, first + count) behind all earlier passes. Adds the time to `times`, which
  /// must outlive it.
  void record(std::uint32_t first, std::uint32_t count, const TreePiece& from, TraceTimes& times);
  /// Records if it can, else runs. Returns how many queries the driver cut short.
  std::uint32_t answer(std::uint32_t first, std::uint32_t count, const TreePiece& from, TraceTimes& times,
                       const std::function<void(std::uint32_t)>& launched = {});

  /// Returns pieces that together hold the tree, each of at most `limit` steps (repair.h). Not for `wide`.
  std::vector<TreePiece> pieces(std::uint64_t limit) { return pieces_of(tree_, config_.tree_access(), limit); }

 private:
  double launch_ms() const;

  Context& gpu_;
  DeviceTree& tree_;
  std::string name_;
  Defines defines_;
  bool wide_;
  SpecConstants constants_;
  OwnText own_;
  const NumericMode& numeric_;
  KernelConfig config_;
  std::unique_ptr<Kernel> kernel_;
  KernelSource source_;           // that it was made from
  std::uint64_t generation_ = 0;  // of the tree that is bound
  KernelArrays arrays_;
  Buffer<Work> work_;
  std::optional<Buffer<TracePushes>> pushed_;  // of an included text
  LaunchSize size_;
};

/// A tree or a forest in which each triangle lies in one leaf of a tree: the scene's own, or one that is built anew if
/// that has spatial splits. Belongs to the thread of its Context.
class WholeTree {
 public:
  /// Keeps references to both.
  WholeTree(Context& gpu, DeviceTree& scene) : gpu_(gpu), scene_(scene) {}
  /// Follows the scene's tree. Returns true if tree() is another object than before.
  bool update();
  DeviceTree& tree() { return own_ ? *own_ : scene_; }

 private:
  static std::unique_ptr<Forest> whole_forest(const Forest& scene);

  Context& gpu_;
  DeviceTree& scene_;
  std::uint64_t generation_ = 0;  // of the scene's tree that this follows
  std::uint64_t exchanges_ = 0;   // of meshes in the scene's forest until then
  bool dropped_ = false;          // a tree of its own went since update() last returned
  Bvh bvh_;
  std::unique_ptr<Forest> forest_;
  std::unique_ptr<DeviceTree> own_;  // of one of these two
};

}  // namespace ballot
