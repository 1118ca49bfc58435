// The sample of a listed pixel that a camera ray belongs to. The samples of a pixel are consecutive (shared/render.h).
// The including file declares `listed`, the pixel list.
#include "../shade/film.glsl"
#include "../shade/random.glsl"

// A sample of a pixel.
struct PixelSample {
  uvec2 pixel;
  uint place;   // in the list and in the film
  uint number;  // stands for the pixel in the random numbers: its number, row by row, plus a hash of the seed
  uint sample_index;
};

SampleRange samples_of(PrimaryPush camera) {
  return SampleRange(camera.first, camera.together, camera.sample_index, camera.width, camera.seed);
}

// Returns sample s of pixel i, both counted within the range.
PixelSample pixel_sample(SampleRange range, uint i, uint s) {
  uint place = range.first + i;
  uvec2 pixel = listed_pixel(listed[place]);
  uint number = pixel.y * range.width + pixel.x;
  if (range.seed != 0u) number += hash_word(range.seed);
  return PixelSample(pixel, place, number, range.sample_index + s);
}

// Returns the sample of ray number `ray` of the range.
PixelSample pixel_sample(SampleRange range, uint ray) {
  return pixel_sample(range, ray / range.together, ray % range.together);
}
