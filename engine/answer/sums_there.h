// Sums of weights by what rays end on, in arrays on the device.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/answer/sums.h"
#include "engine/gpu/kernel.h"
#include "engine/gpu/room.h"
#include "shaders/shared/query.h"

namespace ballot {

/// Where triangles belong.
struct SumTable {
  std::vector<std::uint32_t> firsts, meshes;    // of each placement: its first triangle, of all; its mesh
  std::array<std::uint32_t, kSumsBy> counts{};  // of triangles, placements and meshes
};

/// Hits on the device, and what they weigh.
struct WeighedHits {
  const Buffer<Hit>& hits;
  std::uint64_t rays = 0;
  std::uint32_t row = 1;                   // hits of each ray, the first ones; what it lacks are misses
  const Buffer<float>* weights = nullptr;  // of each ray, or one for all; null: each counts as 1
};

/// Where sums go, by SumsBy; null: not wanted. Each has room for an entry more, of rays that miss.
using SumBuffers = std::array<Buffer<double>*, kSumsBy>;

/// Sums up weights, with the bits that SumUnit gives the host. Belongs to the thread of its Context.
class SumWriter {
 public:
  SumWriter(Context& gpu, SumTable table) : gpu_(gpu), table_(std::move(table)) {}

  /// Records the summing behind all earlier passes. `done` is given the device milliseconds of each pass. Throws
  /// Error(Work) if the device has no room.
  void record(const WeighedHits& from, const SumBuffers& to, const Context::Done& done);
  /// Waits, and throws Error(Arguments) if a weight of the last record() was not finite.
  void check(const WeighedHits& from) const;

 private:
  Kernel& kernel_for(SumsBy by, const WeighedHits& from, Buffer<double>& to);
  void run(Kernel& kernel, SumsPush push, std::uint64_t count, const Context::Done& done);

  Context& gpu_;
  SumTable table_;
  std::unique_ptr<Buffer<std::uint32_t>> table_there_;
  std::unique_ptr<Buffer<SumRange>> range_;
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;  // by name
};

/// Returns the sources of all kernels that sum up.
std::vector<KernelSource> sum_sources();

}  // namespace ballot
