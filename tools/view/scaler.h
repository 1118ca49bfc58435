// Chooses how many pixels are traced while the camera moves, so that a frame takes about as long as asked.
#pragma once

namespace ballot::view {

class Scaler {
 public:
  explicit Scaler(double target_ms) : target_ms_(target_ms) {}

  /// Of width and height, in [kLeast, 1]; a multiple of kStep.
  double scale() const { return scale_; }
  void set_target(double ms) { target_ms_ = ms; }
  double target() const { return target_ms_; }

  /// A frame at scale() took this long: what goes with the pixels that are traced, and what does not. Goes down at once
  /// when frames are too slow, and up only after several that leave ample time, so that the picture does not flicker
  /// between two sizes.
  void measured(double traced_ms, double other_ms);

  static constexpr double kLeast = 0.25, kStep = 1.0 / 16;

 private:
  double target_ms_;
  double scale_ = 1;
  double traced_ms_ = 0, other_ms_ = 0;  // smoothed; 0: nothing was measured at this scale
  int fast_ = 0;                         // frames in a row that left ample time
};

}  // namespace ballot::view
