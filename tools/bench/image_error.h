// The error of a picture shaded from answers against one shaded from the exact answers.
#pragma once

#include <span>

#include "engine/scene/device_scene.h"

namespace ballot::bench {

/// Returns the root mean square, over the rays, of the difference between the shade of the answer and that of the
/// truth. A shade, 0 to 1, is the absolute cosine between the ray and the geometric normal of the triangle that it
/// hits; 0 for a miss. With one ray per pixel this is the error of a picture lit from the camera. The spans rays,
/// answers and truth have the same size. Prims that the engine's scene lacks have
/// shade 0.
double image_rmse(const DeviceScene& world, std::span<const Ray> rays, std::span<const Hit> answers,
                  std::span<const ExactHit> truth);

}  // namespace ballot::bench
