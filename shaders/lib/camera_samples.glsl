// Camera rays of listed pixels, the samples of each one behind the other (shared/render.h). Whoever includes this has lib/film.glsl
// and `listed`, the list.
//
// Kernels that need a ray again make it again where they can: a record of 32 bytes takes longer to read.
#include "random.glsl"
#include "camera.glsl"

// Sample s of those at hand of pixel i of those at hand.
Ray camera_ray_of(PrimaryPush camera, uint i, uint s) {
  uvec2 pixel = listed_pixel(listed[camera.first + i]);
  return camera_ray(camera, pixel, pixel.y * camera.width + pixel.x, camera.sample_index + s);
}
