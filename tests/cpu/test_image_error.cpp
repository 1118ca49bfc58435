// Tests of image errors whose values are known.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/error.h"
#include "engine/files/image_error.h"

namespace ballot::test {
namespace {

Image flat(std::uint32_t width, std::uint32_t height, float r, float g, float b) {
  Image image{.width = width, .height = height};
  const float values[] = {r, g, b};
  for (std::size_t c = 0; c < 3; ++c)
    image.channels.push_back(
        {std::string(1, "RGB"[c]), Pixel::Float, std::vector<float>(width * height, values[c]), {}});
  return image;
}

TEST(ImageError, OfEqualAndOfFlatPictures) {
  const Image grey = flat(24, 20, 0.5f, 0.5f, 0.5f);
  const ImageError none = image_error(grey, grey);
  EXPECT_EQ(none.rmse, 0);
  EXPECT_EQ(none.relmse, 0);
  EXPECT_EQ(none.flip, 0);
  const ImageError off = image_error(flat(24, 20, 0.75f, 0.5f, 0.5f), grey);
  EXPECT_NEAR(off.rmse, 0.25 / std::sqrt(3.0), 1e-6);
  EXPECT_NEAR(off.relmse, std::pow(0.25 / 0.51, 2) / 3, 1e-6);
}

// The ends of the FLIP scale. By its definition green and blue are 1 apart; black and white are almost that far apart.
TEST(ImageError, FlipHasItsScale) {
  EXPECT_NEAR(mean_flip(flat(12, 12, 0, 1, 0), flat(12, 12, 0, 0, 1)), 1, 1e-3);
  const double ends = mean_flip(flat(12, 12, 0, 0, 0), flat(12, 12, 1, 1, 1));
  EXPECT_GT(ends, 0.9);
  EXPECT_LE(ends, 1);
  EXPECT_LT(mean_flip(flat(12, 12, 0.5f, 0.5f, 0.5f), flat(12, 12, 0.52f, 0.5f, 0.5f)), 0.1);
}

// A lost edge counts for more than the difference of its colours. Noise that is too fine for the eye counts for less.
TEST(ImageError, FlipSeesEdgesAndForgivesFineNoise) {
  Image edge = flat(48, 48, 0.5f, 0.5f, 0.5f), noise = edge;
  for (Channel& c : edge.channels)
    for (std::size_t i = 0; i < c.floats.size(); ++i) c.floats[i] = i % 48 < 24 ? 0.45f : 0.55f;
  for (Channel& c : noise.channels)
    for (std::size_t i = 0; i < c.floats.size(); ++i) c.floats[i] = (i + i / 48) % 2 ? 0.45f : 0.55f;
  const Image grey = flat(48, 48, 0.5f, 0.5f, 0.5f);
  EXPECT_LT(mean_flip(noise, grey), mean_flip(edge, grey));
}

TEST(ImageError, SizesMustAgree) { EXPECT_THROW(image_error(flat(4, 4, 0, 0, 0), flat(4, 5, 0, 0, 0)), Error); }

}  // namespace
}  // namespace ballot::test
