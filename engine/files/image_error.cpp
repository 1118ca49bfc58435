#include "engine/files/image_error.h"

#include <cmath>

#include "engine/core/error.h"

namespace ballot {

ImageError image_error(const Image& image, const Image& reference) {
  if (image.width != reference.width || image.height != reference.height)
    fail(Failure::Arguments, "the picture has {} x {} pixels, the reference {} x {}; expected one size", image.width,
         image.height, reference.width, reference.height);
  ImageError error;
  double count = 0;
  for (const char* name : {"R", "G", "B"}) {
    const std::vector<float>&a = image.channel(name).floats, &b = reference.channel(name).floats;
    if (a.size() != b.size()) fail(Failure::Arguments, "channel {} of the reference holds integers", name);
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double off = double(a[i]) - b[i], share = off / (std::abs(double(b[i])) + 0.01);
      error.rmse += off * off;
      error.relmse += share * share;
      ++count;
    }
  }
  error.rmse = std::sqrt(error.rmse / std::max(count, 1.0));
  error.relmse /= std::max(count, 1.0);
  error.flip = mean_flip(image, reference);
  return error;
}

}  // namespace ballot
