// Lists of kernels in which every two settings meet. `ballot shaders` compiles such a list of each method, the device
// tests hold one of all methods to the oracle.
#pragma once

#include <span>
#include <vector>

#include "engine/answer/query.h"
#include "engine/answer/variant.h"

namespace ballot {

/// A kernel of a list: what a query asks of a device, and what decides the code beside it.
struct CoveringKernel {
  Query query;
  Variant variant;  // of the query; with or without counters, camera or indirect count
  const DeviceInfo* device;
  TreeFacts tree;

  KernelSource source() const { return kernel_source(variant, *device, tree); }
};

/// What the kernels of a list are made of. No span is empty.
struct CoveringChoices {
  std::span<const Method> methods = kMethods;
  std::span<const NumericMode> modes = kNumericModes;
  std::span<const DeviceInfo> devices = {};
  bool only_queries = false;  // no indirect counts, no cameras, and one tree: what a query alone decides, and counters
};

/// Returns kernels such that every two settings that some kernel has are those of at least one in the list. Settings
/// are the method, nearest or any hit, the numeric mode, the values of knobs, the device, and the shader's defines.
/// What breaks a kernel seldom needs three. The list is the same in every run; it is found by a greedy search among
/// random kernels (Cohen, Dalal, Fredman and Patton 1997, "The AETG system"). The variants refer to the rows of
/// `choices`. Knob reorder, which no kernel depends on, and thresholds are left out.
std::vector<CoveringKernel> covering_kernels(const CoveringChoices& choices);

}  // namespace ballot
