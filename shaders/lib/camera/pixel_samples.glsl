// Which pixel's sample a camera ray is, where pixels are listed: the samples of each one behind the other (shared/render.h). Whoever
// includes this has `listed`, the list.
#include "../shade/film.glsl"
#include "../shade/random.glsl"

struct PixelSample {
  uvec2 pixel;
  uint place;   // in the list and the film
  uint number;  // of the pixel, row by row in the whole picture, and the seed: names it to the random numbers
  uint sample_index;
};

SampleRange samples_of(PrimaryPush camera) {
  return SampleRange(camera.first, camera.together, camera.sample_index, camera.width, camera.seed);
}

// Sample s of those at hand of pixel i of those at hand.
PixelSample pixel_sample(SampleRange range, uint i, uint s) {
  uint place = range.first + i;
  uvec2 pixel = listed_pixel(listed[place]);
  uint number = pixel.y * range.width + pixel.x;
  if (range.seed != 0u) number += hash_word(range.seed);
  return PixelSample(pixel, place, number, range.sample_index + s);
}

// The one that a ray of those at hand is.
PixelSample pixel_sample(SampleRange range, uint ray) {
  return pixel_sample(range, ray / range.together, ray % range.together);
}
