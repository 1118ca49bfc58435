// The traversal kernels of a tree. They are compiled on first use, and the tree's arrays are bound to them.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "engine/answer/kernel_arrays.h"
#include "engine/answer/variant.h"

namespace ballot {

/// A kernel and the arrays that it reads.
struct TraceKernel {
  std::unique_ptr<Kernel> kernel;
  KernelArrays arrays;
  std::uint64_t tree = 0;  // generation of the tree that the arrays belong to
};

/// A variant and the kernel that runs it. Variants that differ in their threshold alone share a kernel.
struct Job {
  Variant variant;
  TraceKernel* kernel;
};

/// The kernels of all variants that were asked for. Belongs to the thread of its Context.
class TraceKernels {
 public:
  /// Keeps references to both arguments.
  TraceKernels(Context& gpu, DeviceTree& tree);

  /// Returns the kernel of a variant for the present tree and the present shaders. The reference stays valid for the
  /// life of this object. Once is_current() is false, get() has to be called again. Throws Error(Work) if the kernel
  /// does not compile.
  TraceKernel& get(const Variant& variant);
  bool is_current(const TraceKernel& kernel) const;

  /// The work counter that is bound to every kernel.
  Buffer<Work>& work() { return work_; }
  /// The list of rays in doubt: IndirectArgs, then room for at least `rays` numbers. A list that is too small is
  /// replaced, which waits for all passes.
  Buffer<std::uint32_t>& doubtful(std::uint32_t rays);
  /// True if that list is known to be empty, so that it need not be cleared.
  bool& list_is_empty() { return list_is_empty_; }

 private:
  void take_arrays(TraceKernel& kernel, const Variant& variant);
  void bind(TraceKernel& kernel, const Variant& variant);

  Context& gpu_;
  DeviceTree& tree_;
  Buffer<Work> work_;
  std::optional<Buffer<std::uint32_t>> doubtful_;
  bool list_is_empty_ = false;
  std::map<std::string, TraceKernel> kernels_;
};

}  // namespace ballot
