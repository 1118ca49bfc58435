// The traversal kernels of a tree: compiled on first use, with the tree's arrays bound.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "engine/trace/variant.h"
#include "engine/tree/device_tree.h"
#include "shaders/shared/variant.h"

namespace ballot {

/// A kernel and the arrays that it reads; null: it reads no such array.
struct TraceKernel {
  std::unique_ptr<Kernel> kernel;
  const DeviceTree::Texels *nodes = nullptr, *format = nullptr, *leaves = nullptr;
  std::uint64_t tree = 0;  // generation of the tree that the arrays are of
};

/// A variant and its kernel. Variants that differ only in their threshold share the kernel.
struct Job {
  Variant variant;
  TraceKernel* kernel;
};

class TraceKernels {
 public:
  TraceKernels(Context& gpu, DeviceTree& tree);

  /// The kernel of a variant for the present tree and the present shaders. The pointer stays valid for the life of this
  /// object; is_current() tells whether the kernel has to be asked for again. Throws Error(Work) if it does not
  /// compile.
  TraceKernel& get(const Variant& variant);
  bool is_current(const TraceKernel& kernel) const;

  /// The work counter that is bound to every kernel.
  Buffer<Work>& work() { return work_; }

 private:
  void bind(TraceKernel& kernel, const Variant& variant);

  Context& gpu_;
  DeviceTree& tree_;
  Buffer<Work> work_;
  std::map<std::string, TraceKernel> kernels_;
};

}  // namespace ballot
