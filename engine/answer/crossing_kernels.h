// The kernels of shaders/query/crossings.comp over a tree, with their buffers. Internal to engine/answer.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "engine/answer/lists.h"
#include "engine/answer/query_filters.h"
#include "engine/answer/ray_queries.h"

namespace ballot {

/// What kernels of crossings are compiled for.
struct CrossingVariant {
  std::uint32_t lists = LISTS_NONE, row = 0;  // shaders/lib/query/listing.glsl
  bool exact = false, alpha = false, any = false;
  std::uint32_t filters = 0;  // FILTER_..., as bits
  Cull cull = Cull::None;
  std::uint32_t first = 0;  // the ray's nearest `first` crossings; 0: all
  bool last = false;        // the farthest instead
  friend auto operator<=>(const CrossingVariant&, const CrossingVariant&) = default;
};

/// Returns the sources of the kernels of crossings, but for those that read alpha, for a device and a tree with these
/// facts.
std::vector<KernelSource> crossing_sources(const DeviceInfo& device, const TreeFacts& tree);

/// Counts and lists crossings on a tree in which each triangle lies in one leaf. Belongs to the thread of its Context.
class CrossingKernels {
 public:
  /// Keeps references to gpu and scene.
  CrossingKernels(Context& gpu, DeviceTree& scene, SurfaceAlpha alpha)
      : gpu_(gpu), whole_(gpu, scene), alpha_(std::move(alpha)), filters_(gpu) {}

  /// Follows the scene's tree and takes what filters need of it. Call it before a query. Returns and throws as
  /// QueryFilters::take().
  std::uint32_t prepare(std::uint32_t filters, std::span<const std::uint32_t> triangle_masks);
  DeviceTree& tree() { return whole_.tree(); }
  /// Returns true if some surface of the scene lets rays pass.
  bool has_alpha() const { return !alpha_.defines.empty(); }
  /// Returns a kernel, prepared, with all bound that it reads besides rays and their words. `pairs`: it walks pieces of
  /// the tree.
  QueryKernel& kernel(const CrossingVariant& variant, bool pairs);
  /// The words of rays, which are bound by who asks a kernel of a variant with filters.
  QueryFilters& filters() { return filters_; }

  /// Counts the crossings of each ray in a piece of the tree. Returns how many rays were cut short: their count is
  /// UNFINISHED. The count of a ray that mode exact leaves open is UNSURE.
  std::uint32_t count(const CrossingVariant& variant, const ListPart<Ray>& some, std::span<std::uint32_t> found,
                      TraceTimes& times, const TreePiece& piece);
  /// The same in the whole tree for rays and counts on the device: records that, or does it and waits. `words` are
  /// those of the rays.
  std::uint32_t count_there(const CrossingVariant& variant, const Chunk<Ray, std::uint32_t>& chunk,
                            const FilterWords& words, TraceTimes& times);

  /// Returns pieces that together hold the tree, each of at most `limit` steps.
  std::vector<TreePiece> pieces(const CrossingVariant& variant, std::uint64_t limit);

 private:
  /// A kernel for whole trees, and one for pieces of them, which is made when the driver first cuts a walk short.
  struct Kernels {
    std::optional<QueryKernel> whole, pieces;
  };
  Context& gpu_;
  WholeTree whole_;
  SurfaceAlpha alpha_;
  std::map<CrossingVariant, Kernels> kernels_;
  std::unique_ptr<Buffer<Ray>> rays_;
  std::unique_ptr<Buffer<std::uint32_t>> counts_;
  QueryFilters filters_;
};

}  // namespace ballot
