// Answers about many rays, in parallel. Internal to engine/oracle.
#pragma once

#include <mutex>
#include <span>
#include <vector>

#include "engine/core/parallel.h"
#include "engine/oracle/oracle_scene.h"

namespace ballot {

/// Rays that a thread answers at a time where each may meet many meshes.
inline constexpr std::size_t kRaysOfInstances = 256;

/// Returns the hits of rays. find(some, hits) finds those of a chunk. Calls progress after every chunk, from one thread
/// at a time.
template <class Find>
std::vector<OracleHit> hits_of(std::span<const Ray> rays, std::size_t chunk, const Find& find,
                               const Progress& progress = {}) {
  std::vector<OracleHit> hits(rays.size());
  std::mutex mutex;
  std::size_t done = 0;
  for_chunks(rays.size(), chunk, [&](std::size_t begin, std::size_t end) {
    find(rays.subspan(begin, end - begin), std::span(hits).subspan(begin, end - begin));
    const std::lock_guard lock(mutex);
    done += end - begin;
    if (progress) progress(static_cast<double>(done) / static_cast<double>(rays.size()));
  });
  return hits;
}

}  // namespace ballot
