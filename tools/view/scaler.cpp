#include "tools/view/scaler.h"

#include <algorithm>
#include <cmath>

namespace ballot::view {

namespace {

constexpr double kSlow = 1.15, kAmple = 0.75;  // shares of the target: above kSlow scale down, below kAmple scale up
constexpr int kPatience = 6;                   // fast frames in a row before scaling up
constexpr double kWeight = 0.4;                // of the newest frame in the running means

}  // namespace

void Scaler::measured(double traced_ms, double other_ms) {
  if (!(traced_ms > 0) || !(other_ms >= 0)) return;
  const double weight = traced_ms_ == 0 ? 1 : kWeight;
  traced_ms_ += weight * (traced_ms - traced_ms_);
  other_ms_ += weight * (other_ms - other_ms_);
  const double ms = traced_ms_ + other_ms_;
  fast_ = ms < kAmple * target_ms_ ? fast_ + 1 : 0;
  const bool slow = ms > kSlow * target_ms_, ample = fast_ >= kPatience;
  if (!slow && !ample) return;
  // The time is proportional to the number of pixels, and so to the square of the scale.
  const double wanted = scale_ * std::sqrt(std::max(0.0, target_ms_ - other_ms_) / traced_ms_);
  double next = std::floor(wanted / kStep) * kStep;
  if (slow) next = std::min(next, scale_ - kStep);
  if (ample) next = std::clamp(next, scale_, scale_ + 4 * kStep);
  next = std::clamp(next, kLeast, 1.0);
  if (next == scale_) return;
  scale_ = next;
  traced_ms_ = other_ms_ = 0;
  fast_ = 0;
}

}  // namespace ballot::view
