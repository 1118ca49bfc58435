#include "engine/tree/host/refit_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ballot {

void RefitPolicy::built(double seconds, double sah) {
  build_s_ = seconds;
  sah_built_ = sah_ = sah;
  lost_s_ = traced_s_ = 0;
}

void RefitPolicy::refitted(double seconds, double sah) {
  refit_s_ = seconds;
  sah_ = sah;
  last_traced_s_ = traced_s_;
  traced_s_ = 0;
}

void RefitPolicy::traced(double seconds) {
  const double sound = seconds / std::max(decay(), 1.0);
  traced_s_ += sound;
  lost_s_ += seconds - sound;
}

double RefitPolicy::decay() const {
  const double ratio = sah_built_ > 0 ? sah_ / sah_built_ : 1;
  return std::isnan(ratio) ? std::numeric_limits<double>::infinity() : ratio;
}

bool RefitPolicy::wants_build() const { return refit_s_ && lost_s_ >= build_s_ - *refit_s_; }

bool RefitPolicy::regrets_refit() const {
  if (std::isinf(decay())) return true;
  return lost_s_ + last_traced_s_ * (decay() - 1) > build_s_;
}

}  // namespace ballot
