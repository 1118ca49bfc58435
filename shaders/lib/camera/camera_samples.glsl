// Camera rays of listed pixels. The including file declares `listed`, the pixel list.
//
// Kernels that need a camera ray again compute it again where they can, because reading a record of 32 bytes takes
// longer.
#include "pixel_samples.glsl"
#include "camera.glsl"

Ray camera_ray_of(PrimaryPush camera, PixelSample at) {
  return camera_ray(camera, at.pixel, at.number, at.sample_index);
}
