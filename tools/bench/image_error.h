// How far a picture of answers is from the picture of the truth.
#pragma once

#include <span>

#include "engine/ballot.h"

namespace ballot::bench {

/// Root mean square over the rays of the difference of two shades, 0 to 1: the absolute cosine between a ray and the
/// geometric normal of the triangle that it hits, 0 where it misses. One ray a pixel makes it the error of a picture lit
/// from the eye. The spans are of one size, prims are below triangles.size() or NO_HIT; other prims have shade 0.
double image_rmse(std::span<const Triangle> triangles, std::span<const Ray> rays, std::span<const Hit> answers,
                  std::span<const ExactHit> truth);

}  // namespace ballot::bench
