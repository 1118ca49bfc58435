// Samples of the rays of a batch, on which the candidates of method auto race and by which a ray class is found.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/vk/buffer.h"
#include "shaders/shared/layout.h"

namespace ballot {

/// A run of neighbouring rays of a batch.
struct Stretch {
  std::size_t first, count;
};

/// What samples are made of.
struct Sampling {
  std::size_t rays;         // of a sample, at most
  std::size_t stretches;    // of a sample
  std::size_t samples = 1;  // at most
};

/// Returns a sample of a batch of `count` rays: `stretches` runs of neighbours, about `wanted` rays together, spread
/// evenly over the batch. Runs begin at multiples of 64, where tiles and packets begin. It is number `which` of
/// `samples` such samples, which share no rays.
std::vector<Stretch> stretches_of(std::size_t count, std::size_t wanted, std::size_t stretches, std::size_t which = 0,
                                  std::size_t samples = 1);

/// Returns the number of rays in the stretches.
std::size_t size_of(const std::vector<Stretch>& stretches);

/// Copies a sample to the front of a buffer.
void copy_sample(Buffer<Ray>& to, const Buffer<Ray>& rays, const std::vector<Stretch>& stretches);

/// Returns samples of rays [0, count) as copies on the device. They share no rays.
std::vector<Buffer<Ray>> samples_of(Context& gpu, const Buffer<Ray>& rays, std::size_t count, const Sampling& sampling);

}  // namespace ballot
