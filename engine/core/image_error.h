// How far a picture is from a reference, in three measures.
#pragma once

#include "engine/core/image.h"

namespace ballot {

struct ImageError {
  double rmse = 0;    // root of the mean squared difference of R, G, B, linear
  double relmse = 0;  // mean of (difference / (reference + 0.01))^2 over R, G, B
  double flip = 0;  // mean of FLIP at 67 pixels a degree, 0 to 1: how much people notice when flipping between the two
};

/// Of R, G, B of two pictures of one size; pixels are compared by their places in the data windows. Throws Error(Arguments) that
/// names both sizes if they differ, and if a channel is missing.
ImageError image_error(const Image& image, const Image& reference);

/// After Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild, FLIP: A Difference Evaluator for Alternating Images,
/// HPG 2020; colours beyond [0, 1] are clamped. Mean over the pixels. A few seconds a megapixel.
double mean_flip(const Image& image, const Image& reference);

}  // namespace ballot
