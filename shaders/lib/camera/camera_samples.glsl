// Camera rays of listed pixels. Whoever includes this has `listed`, the list.
//
// Kernels that need a ray again make it again where they can: a record of 32 bytes takes longer to read.
#include "pixel_samples.glsl"
#include "camera.glsl"

Ray camera_ray_of(PrimaryPush camera, PixelSample at) {
  return camera_ray(camera, at.pixel, at.number, at.sample_index);
}
