// Removes noise from pictures by Intel's Open Image Denoise, a library that is loaded at run time.
#pragma once

#include <string>
#include <vector>

#include "engine/files/image.h"

namespace ballot {

/// The colours of a picture and what a denoiser may know of it: rows from the top, three floats a pixel.
struct NoisyPicture {
  std::uint32_t width = 0, height = 0;  // pixels
  std::vector<float> color;             // linear, 0 or more
  std::vector<float> albedo;            // of what is seen first, 0 to 1; averages over a pixel
  std::vector<float> normal;            // of what is seen first, -1 to 1; averages over a pixel
};

/// The library Open Image Denoise 1 or 2, on the CPU. Belongs to one thread.
class Denoiser {
 public:
  /// Opens the library: the file that the environment variable BALLOT_DENOISER names or, without it, the one that the
  /// system's loader finds. Throws Error(Work) that says where it was looked for.
  Denoiser();
  ~Denoiser();
  Denoiser(const Denoiser&) = delete;
  Denoiser& operator=(const Denoiser&) = delete;

  /// Returns the colours without noise: filter "RT" with radiance of any height (hdr). Throws Error(Work) if the
  /// library fails.
  std::vector<float> clean(const NoisyPicture& picture) const;

  /// Returns the library's name and version, such as "Open Image Denoise 1.4.3".
  const std::string& name() const { return name_; }

 private:
  struct Calls;
  void check() const;

  void* library_ = nullptr;
  Calls* calls_ = nullptr;
  void* device_ = nullptr;
  std::string name_;
};

}  // namespace ballot
