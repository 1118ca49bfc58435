// How the pixels of a picture and their samples are dealt out to dispatches.
#pragma once

#include <algorithm>
#include <cstdint>

namespace ballot {

/// Pixels [pixel, pixel + pixels), in the film's order, and samples [sample, sample + samples) of each. A pixel's rays lie one behind
/// the other: they are nearly alike, so that those of a subgroup stay together.
struct Part {
  std::uint32_t pixel = 0, pixels = 0, sample = 0, samples = 0;
  std::uint32_t rays() const { return pixels * samples; }
};

/// The largest part of so many pixels and samples: at most `most_rays` rays (at least 1), and `together` samples unless all pixels
/// have room for more.
inline Part largest_part(std::uint32_t pixels, std::uint32_t samples, std::uint32_t most_rays, std::uint32_t together) {
  if (pixels == 0 || samples == 0) return {};
  const std::uint32_t most = std::min({samples, most_rays, std::max(together, most_rays / pixels)});
  const std::uint32_t turns = (samples + most - 1) / most, each = (samples + turns - 1) / turns;
  return {0, std::min(pixels, most_rays / each), 0, each};
}

/// Runs run(part) for parts that cover all of them, no part larger than the largest; the samples of a pixel in their order.
template <class Run>
void for_parts(std::uint32_t pixels, std::uint32_t samples, const Part& largest, Run run) {
  if (largest.rays() == 0) return;  // nothing to do
  for (std::uint32_t pixel = 0; pixel < pixels; pixel += largest.pixels)
    for (std::uint32_t sample = 0; sample < samples; sample += largest.samples)
      run(Part{pixel, std::min(largest.pixels, pixels - pixel), sample, std::min(largest.samples, samples - sample)});
}

}  // namespace ballot
