#include "tools/view/scaler.h"

#include <algorithm>
#include <cmath>

namespace ballot::view {

namespace {

constexpr double kSlow = 1.15, kAmple = 0.75;  // of the target: beyond the one go down, below the other up
constexpr int kPatience = 6;                   // frames
constexpr double kWeight = 0.4;                // of the newest frame

}  // namespace

void Scaler::measured(double ms) {
  if (!(ms > 0)) return;
  smooth_ms_ = smooth_ms_ == 0 ? ms : smooth_ms_ + kWeight * (ms - smooth_ms_);
  fast_ = smooth_ms_ < kAmple * target_ms_ ? fast_ + 1 : 0;
  const bool slow = smooth_ms_ > kSlow * target_ms_, ample = fast_ >= kPatience;
  if (!slow && !ample) return;
  // Time goes with the pixels, so with the square of the scale.
  const double wanted = scale_ * std::sqrt(target_ms_ / smooth_ms_);
  double next = std::floor(wanted / kStep) * kStep;
  if (slow) next = std::min(next, scale_ - kStep);
  if (ample) next = std::clamp(next, scale_, scale_ + 4 * kStep);
  next = std::clamp(next, kLeast, 1.0);
  if (next == scale_) return;
  scale_ = next;
  smooth_ms_ = 0;
  fast_ = 0;
}

}  // namespace ballot::view
