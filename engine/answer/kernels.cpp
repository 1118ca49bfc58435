#include "engine/answer/kernels.h"

#include <algorithm>
#include <bit>

#include "engine/core/error.h"
#include "shaders/shared/layout.h"

namespace ballot {

TraceKernels::TraceKernels(Context& gpu, DeviceTree& tree)
    : gpu_(gpu), tree_(tree), work_(gpu, 1, Access::Storage, "work counter") {}

Buffer<std::uint32_t>& TraceKernels::doubtful(std::uint32_t rays) {
  constexpr std::uint64_t kArgs = sizeof(IndirectArgs) / sizeof(std::uint32_t);
  if (!doubtful_ || doubtful_->size() < kArgs + rays) {
    doubtful_.reset();
    list_is_empty_ = false;
    doubtful_.emplace(gpu_, kArgs + std::bit_ceil(std::uint64_t{std::max(rays, 1u << 12)}),
                      Access::Storage | Access::Indirect, "rays in doubt");
  }
  return *doubtful_;
}

bool TraceKernels::is_current(const TraceKernel& kernel) const {
  return kernel.tree == tree_.generation() && kernel.kernel->generation() == gpu_.shader_generation();
}

TraceKernel& TraceKernels::get(const Variant& v) {
  // A kernel is compiled for facts of the tree: another depth needs another stack size.
  const TreeFacts& facts = tree_.facts();
  TraceKernel& kernel =
      kernels_[fmt::format("{} subgroup={} depth={} leaf={} far={}", v.kernel_name(), v.config.subgroup, facts.depth,
                           facts.largest_leaf, int(facts.far)) +
               (facts.top_depth ? fmt::format(" top={}", top_entries(facts)) : "") + (facts.large ? " large" : "") +
               (facts.shapes ? fmt::format(" shapes={}", facts.shapes) : "") +
               (reads_doubles(v, facts) ? " doubles" : "")];
  if (kernel.kernel && is_current(kernel)) return kernel;
  const bool other_tree = kernel.tree != tree_.generation();
  if (other_tree) take_arrays(kernel, v);  // before the kernel is waited for, which another thread may be making
  const bool fresh = refresh(gpu_, kernel.kernel, kernel_source(v, gpu_.info(), facts));
  if (fresh || other_tree) bind(kernel, v);
  if (fresh) gpu_.save_pipeline_cache();
  return kernel;
}

void TraceKernels::take_arrays(TraceKernel& k, const Variant& v) {
  const Method& method = *v.method;
  k.tree = tree_.generation();
  // Walks that the driver cut short are repaired from pairs that the host knows (repair.h), by this method if it can
  // begin there.
  const bool repaired_here = v.config.loops_cut && format_of(method.tree).begins_at_pairs();
  const Source source = repaired_here ? Source::Host : tree_.source_of(method.tree, v.numeric->leaves);
  k.arrays = {tree_,
              {method.tree, v.numeric->leaves, v.config.tree_access(), method.reads_pairs(v.config), source,
               v.numeric->triangle == TRIANGLE_DOUBLE}};
}

void TraceKernels::bind(TraceKernel& k, const Variant& v) {
  k.arrays.bind(*k.kernel, v.config.fetch);
  k.kernel->bind(BIND_WORK, work_);
}

}  // namespace ballot
