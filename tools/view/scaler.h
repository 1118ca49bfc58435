// The control of the render resolution while the camera moves: it keeps a frame's time near a target.
#pragma once

namespace ballot::view {

class Scaler {
 public:
  explicit Scaler(double target_ms) : target_ms_(target_ms) {}

  /// The scale of width and of height, in [kLeast, 1]; a multiple of kStep.
  double scale() const { return scale_; }
  void set_target(double ms) { target_ms_ = ms; }
  double target() const { return target_ms_; }

  /// Takes the time of a frame at scale(), in milliseconds: the part that grows with the number of traced pixels, and
  /// the rest. Lowers the scale at once if frames are too slow. Raises it only after several frames with ample time
  /// left, so that the picture does not flicker between two sizes.
  void measured(double traced_ms, double other_ms);

  static constexpr double kLeast = 0.25, kStep = 1.0 / 16;

 private:
  double target_ms_;
  double scale_ = 1;
  double traced_ms_ = 0, other_ms_ = 0;  // running means; 0: no frame was measured at this scale
  int fast_ = 0;                         // consecutive frames with ample time left
};

}  // namespace ballot::view
