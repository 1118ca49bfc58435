// The error of a picture against a reference, in three measures.
#pragma once

#include "engine/files/image.h"

namespace ballot {

/// The errors of a picture over R, G, B.
struct ImageError {
  double rmse = 0;    // root of the mean squared difference, linear
  double relmse = 0;  // mean of (difference / (|reference| + 0.01))^2
  double flip = 0;    // mean of FLIP at 67 pixels per degree, 0 to 1: the difference seen when flipping between the two
};

/// Returns the errors of two pictures of the same size. Pixels are compared by their positions in the data windows.
/// Throws Error(Arguments) that names both sizes if they differ, and if a channel is missing.
ImageError image_error(const Image& image, const Image& reference);

/// Returns the mean of FLIP over the pixels. Method: Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem,
/// Fairchild, FLIP: A Difference Evaluator for Alternating Images, HPG 2020. Colours are clamped to [0, 1]. Takes a few
/// seconds per megapixel.
double mean_flip(const Image& image, const Image& reference);

}  // namespace ballot
