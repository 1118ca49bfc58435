// Splits the pixels of a picture and their samples into parts, one per dispatch.
#pragma once

#include <algorithm>
#include <cstdint>

namespace ballot {

/// The pixels [pixel, pixel + pixels), in the film's order, and the samples [sample, sample + samples) of each. The
/// rays of a pixel are consecutive: they are nearly equal, so the rays of a subgroup stay coherent.
struct Part {
  std::uint32_t pixel = 0, pixels = 0, sample = 0, samples = 0;
  std::uint32_t rays() const { return pixels * samples; }
};

/// Returns the largest part for this many pixels and samples. It has at most `most_rays` rays; `most_rays` must be at
/// least 1. It has at most `together` samples per pixel, or more where all pixels still fit into `most_rays`.
inline Part largest_part(std::uint32_t pixels, std::uint32_t samples, std::uint32_t most_rays, std::uint32_t together) {
  if (pixels == 0 || samples == 0) return {};
  const std::uint32_t most = std::min({samples, most_rays, std::max(together, most_rays / pixels)});
  const std::uint32_t turns = (samples + most - 1) / most, each = (samples + turns - 1) / turns;
  return {0, std::min(pixels, most_rays / each), 0, each};
}

/// Calls run(part) for parts that cover all pixels and samples. No part is larger than `largest`. The samples of a
/// pixel come in ascending order.
template <class Run>
void for_parts(std::uint32_t pixels, std::uint32_t samples, const Part& largest, Run run) {
  if (largest.rays() == 0) return;  // nothing to do
  for (std::uint32_t pixel = 0; pixel < pixels; pixel += largest.pixels)
    for (std::uint32_t sample = 0; sample < samples; sample += largest.samples)
      run(Part{pixel, std::min(largest.pixels, pixels - pixel), sample, std::min(largest.samples, samples - sample)});
}

}  // namespace ballot
