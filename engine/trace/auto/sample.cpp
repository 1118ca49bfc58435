#include "engine/trace/auto/sample.h"

#include <algorithm>

namespace ballot {

std::vector<Stretch> stretches_of(std::size_t count, std::size_t wanted, std::size_t stretches, std::size_t which,
                                  std::size_t samples) {
  if (count <= wanted) return {{0, count}};
  const std::size_t length = wanted / stretches, last = std::max<std::size_t>(1, stretches * samples - 1);
  std::vector<Stretch> all;
  for (std::size_t i = 0; i < stretches; ++i)
    all.push_back({(count - length) * (i * samples + which) / last / 64 * 64, length});
  return all;
}

std::size_t size_of(const std::vector<Stretch>& stretches) {
  std::size_t size = 0;
  for (const Stretch& s : stretches) size += s.count;
  return size;
}

void copy_sample(Buffer<Ray>& to, const Buffer<Ray>& rays, const std::vector<Stretch>& stretches) {
  std::vector<RawBuffer::Part> parts;
  std::size_t done = 0;
  for (const Stretch& s : stretches) {
    parts.push_back({s.first * sizeof(Ray), done * sizeof(Ray), s.count * sizeof(Ray)});
    done += s.count;
  }
  to.copy_parts(rays, parts);
}

std::vector<Buffer<Ray>> samples_of(Context& gpu, const Buffer<Ray>& rays, std::size_t count,
                                    const Sampling& sampling) {
  const std::size_t number = std::clamp<std::size_t>(count / sampling.rays, 1, sampling.samples);
  std::vector<Buffer<Ray>> samples;
  for (std::size_t i = 0; i < number; ++i) {
    const std::vector<Stretch> stretches = stretches_of(count, sampling.rays, sampling.stretches, i, number);
    samples.emplace_back(gpu, size_of(stretches), Access::Storage, "sampled rays");
    copy_sample(samples.back(), rays, stretches);
  }
  return samples;
}

}  // namespace ballot
