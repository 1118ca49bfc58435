// A camera that flies and orbits: smooth, and the same at every frame rate. Yaw and pitch about the scene's up (+y).
#pragma once

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include "engine/ballot.h"

namespace ballot::view {

/// What the hands do during one frame.
struct CameraInput {
  glm::dvec3 move{0};             // right, up, back, each in [-1, 1]; the camera's own frame, but up is the scene's
  double look_x = 0, look_y = 0;  // pixels of the mouse, right and down
  double orbit_x = 0, orbit_y = 0;
  bool fast = false;
};

class FlyCamera {
 public:
  /// A scene this wide, scene units, decides how fast one flies.
  explicit FlyCamera(double scene_diagonal) : speed_(scene_diagonal * 0.12) {}

  /// Goes to a view at once, and shows exactly it until the hands move. A rolled view turns upright while one looks.
  void set(const View& view);

  /// The point that orbiting turns about; scene units.
  void set_pivot(const glm::dvec3& pivot) { pivot_ = pivot; }

  /// Moves by `dt` seconds, in [0, 1]. True: the view is another one than before.
  bool update(double dt, const CameraInput& input);

  /// Scene units a second; `factor` > 0.
  double speed() const { return speed_; }
  void change_speed(double factor);

  View view() const;  // called "free" once the hands moved it
  bool untouched() const { return untouched_; }
  glm::dvec3 position() const { return position_; }
  double yaw() const { return yaw_; }
  double pitch() const { return pitch_; }  // radians, within +-89 degrees once the mouse moved it

 private:
  glm::dquat orientation() const;
  void turn(double yaw, double pitch);
  bool ease_angles(double dt);
  bool ease_motion(double dt, const CameraInput& input);

  View exact_;  // shown as it is while untouched_
  bool untouched_ = true;
  double speed_;
  glm::dvec3 position_{0}, velocity_{0}, pivot_{0};
  double yaw_ = 0, pitch_ = 0, roll_ = 0;
  double wanted_yaw_ = 0, wanted_pitch_ = 0, wanted_roll_ = 0;
  bool orbiting_ = false;
};

}  // namespace ballot::view
