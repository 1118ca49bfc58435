// A camera that flies and orbits. Its motion is smooth and the same at every frame rate. Yaw turns about the scene's up
// axis (+y).
#pragma once

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include "engine/scene/device_scene.h"

namespace ballot::view {

/// The user's camera input during one frame.
struct CameraInput {
  glm::dvec3 move{0};  // right, up, back, each in [-1, 1]; in the camera's frame, except that up is the scene's
  double look_x = 0, look_y = 0;  // mouse movement in pixels, right and down; orbit_* too
  double orbit_x = 0, orbit_y = 0;
  bool fast = false;
};

class FlyCamera {
 public:
  /// Sets the flying speed by the length of the scene's diagonal, in scene units.
  explicit FlyCamera(double scene_diagonal) : speed_(scene_diagonal * 0.12) {}

  /// Goes to a view at once and shows exactly this view until the user moves the camera. A rolled view turns upright
  /// when the user looks round.
  void set(const View& view);

  /// Sets the point that the camera orbits about, in scene units.
  void set_pivot(const glm::dvec3& pivot) { pivot_ = pivot; }

  /// Moves the camera by `dt` seconds, clamped to [0, 1]. Returns true if the view has changed.
  bool update(double dt, const CameraInput& input);

  /// The flying speed in scene units per second. change_speed() multiplies it by `factor` > 0.
  double speed() const { return speed_; }
  void change_speed(double factor);

  View view() const;  // its name is "free" once the user has moved the camera
  bool untouched() const { return untouched_; }
  glm::dvec3 position() const { return position_; }
  double yaw() const { return yaw_; }
  double pitch() const { return pitch_; }  // radians; within +-89 degrees once the mouse has moved it

 private:
  glm::dquat orientation() const;
  void turn(double yaw, double pitch);
  bool ease_angles(double dt);
  bool ease_motion(double dt, const CameraInput& input);

  View exact_;  // the view of set(), shown unchanged while untouched_
  bool untouched_ = true;
  double speed_;
  glm::dvec3 position_{0}, velocity_{0}, pivot_{0};
  double yaw_ = 0, pitch_ = 0, roll_ = 0;
  double wanted_yaw_ = 0, wanted_pitch_ = 0, wanted_roll_ = 0;
  bool orbiting_ = false;
};

}  // namespace ballot::view
