// The kernels of shaders/query/crossings.comp over a tree, with their buffers. Internal to engine/answer.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "engine/answer/query_kernel.h"
#include "engine/answer/ray_queries.h"

namespace ballot {

/// What kernels of crossings are compiled for.
struct CrossingVariant {
  bool lists = false, exact = false, masks = false, alpha = false;
  Cull cull = Cull::None;
  std::uint32_t first = 0;  // a list has the ray's nearest `first` crossings, and may have others; 0: all
  friend auto operator<=>(const CrossingVariant&, const CrossingVariant&) = default;
};

/// Rays of a dispatch, and the mask of each; no masks: all bits.
struct RaySpan {
  std::span<const Ray> rays;
  std::span<const std::uint32_t> masks = {};
};

/// Returns the sources of the kernels of crossings, but for those that read alpha, for a device and a tree with these
/// facts.
std::vector<KernelSource> crossing_sources(const DeviceInfo& device, const TreeFacts& tree);

/// Counts and lists crossings on a tree in which each triangle lies in one leaf. Belongs to the thread of its Context.
class CrossingKernels {
 public:
  /// Keeps references to gpu and scene.
  CrossingKernels(Context& gpu, DeviceTree& scene, SurfaceAlpha alpha)
      : gpu_(gpu), whole_(gpu, scene), alpha_(std::move(alpha)) {}

  /// Follows the scene's tree and, if masks are asked for, takes those of its triangles; none: all bits. Call it before
  /// a query. Throws Error(Arguments) if there are not as many masks as triangles.
  void prepare(bool masks, std::span<const std::uint32_t> triangle_masks);
  DeviceTree& tree() { return whole_.tree(); }
  /// Returns true if some surface of the scene lets rays pass.
  bool has_alpha() const { return !alpha_.defines.empty(); }
  /// Returns the largest number of rays of a dispatch.
  std::uint32_t most(const CrossingVariant& variant);

  /// A piece of the tree that is walked, by a kernel over pairs; none: the whole tree.
  using Below = std::optional<TreePiece>;
  /// Counts the crossings of each ray. Returns how many rays were cut short: their count is UNFINISHED. The count of a
  /// ray that mode exact leaves open is UNSURE.
  std::uint32_t count(const CrossingVariant& variant, const RaySpan& some, std::span<std::uint32_t> found,
                      TraceTimes& times, Below piece = {});
  /// The same for rays and counts on the device: records that, or does it and waits. `masks` are those of the rays.
  std::uint32_t count_there(const CrossingVariant& variant, const Chunk<Ray, std::uint32_t>& chunk,
                            std::span<const std::uint32_t> masks, TraceTimes& times);
  /// Lists crossings. Ray i has the slots from to[i] on and before to[i + 1]; what does not fit is left out. hits()
  /// has the slots, each ray's in no order. list_apart() leaves the slots of the last list() or count_and_list() as
  /// they are.
  std::uint32_t list(const CrossingVariant& variant, const RaySpan& some, std::span<const std::uint32_t> to,
                     std::span<std::uint32_t> found, TraceTimes& times);
  std::uint32_t list_apart(const CrossingVariant& variant, const RaySpan& some, std::span<const std::uint32_t> to,
                           std::span<std::uint32_t> found, TraceTimes& times, Below piece = {});
  /// Counts, sums the counts up on the device, and lists: takes no room that is not used, at the price of a second
  /// walk. Returns false, and lists nothing, if there are more than `most` crossings. `room` has the number of slots of
  /// each ray, 0 for counts that are UNFINISHED or UNSURE; `found` the counts of the second walk.
  bool count_and_list(const CrossingVariant& variant, const RaySpan& some, std::uint32_t most,
                      std::span<std::uint32_t> room, std::span<std::uint32_t> found, TraceTimes& times);
  /// The slots that the last call listed.
  std::span<const Hit> hits() const { return hits_; }

  /// Returns pieces that together hold the tree, each of at most `limit` steps.
  std::vector<TreePiece> pieces(const CrossingVariant& variant, std::uint64_t limit);

 private:
  /// A kernel for whole trees, and one for pieces of them, which is made when the driver first cuts a walk short.
  struct Kernels {
    std::optional<QueryKernel> whole, pieces;
  };
  /// Crossings on the device, and on a GPU a copy of them.
  struct Slots {
    std::unique_ptr<Buffer<Hit>> buffer;
    std::vector<Hit> fetched;
  };
  QueryKernel& kernel(const CrossingVariant& variant, bool pairs);
  void bind_rays(QueryKernel& kernel, const CrossingVariant& variant, const RaySpan& some, bool are_there);
  void bind_masks(QueryKernel& kernel, const CrossingVariant& variant, std::size_t rays,
                  std::span<const std::uint32_t> masks);
  std::uint32_t run(QueryKernel& kernel, Below piece, const CrossingVariant& variant, const RaySpan& some,
                    std::span<std::uint32_t> found, TraceTimes& times, bool are_there = false);
  std::uint32_t list_to(Slots& to, std::uint32_t slots, const CrossingVariant& variant, const RaySpan& some,
                        std::span<std::uint32_t> found, TraceTimes& times, Below piece = {}, bool are_there = false);
  void sum_counts(std::uint32_t count, TraceTimes& times);
  void fetch(Slots& from, std::uint32_t slots);

  Context& gpu_;
  WholeTree whole_;
  SurfaceAlpha alpha_;
  std::map<CrossingVariant, Kernels> kernels_;
  std::unique_ptr<Kernel> sums_;
  std::unique_ptr<Buffer<Ray>> rays_;
  std::unique_ptr<Buffer<std::uint32_t>> ray_masks_, triangle_masks_, counts_, places_, tiles_;
  Slots slots_, apart_;
  std::vector<std::uint32_t> all_bits_, uploaded_;
  std::span<const Hit> hits_;
};

}  // namespace ballot
