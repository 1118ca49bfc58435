#include "tools/view/camera.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tools/program/views_file.h"

namespace ballot::view {

namespace {

constexpr double kLookTime = 0.04, kMoveTime = 0.12;  // time constants: seconds after which 1/e of a change is left
constexpr double kRadiansPerPixel = 0.0035;
constexpr double kSteepest = 89.0 / 180 * 3.14159265358979323846;
constexpr double kFast = 4;
constexpr double kStillAngle = 2e-5;  // radians: a hundredth of a pixel

}  // namespace

void FlyCamera::set(const View& view) {
  exact_ = view;
  untouched_ = true;
  velocity_ = glm::dvec3(0);
  orbiting_ = false;
  const glm::dmat4& m = view.world_from_camera;
  const glm::dvec3 up(m[1]), back(m[2]);
  position_ = glm::dvec3(m[3]);
  pitch_ = std::asin(std::clamp(-back.y, -1.0, 1.0));
  // If the camera looks straight up or down, the top of the picture gives the heading.
  const glm::dvec3 level = std::abs(back.y) < 0.999999 ? back : (back.y > 0 ? -up : up);
  yaw_ = std::atan2(level.x, level.z);
  roll_ = 0;
  const glm::dmat3 upright = glm::mat3_cast(orientation());
  roll_ = std::atan2(-glm::dot(up, upright[0]), glm::dot(up, upright[1]));
  wanted_yaw_ = yaw_, wanted_pitch_ = pitch_, wanted_roll_ = roll_;
  pivot_ = position_ - back;
}

glm::dquat FlyCamera::orientation() const {
  return glm::angleAxis(yaw_, glm::dvec3(0, 1, 0)) * glm::angleAxis(pitch_, glm::dvec3(1, 0, 0)) *
         glm::angleAxis(roll_, glm::dvec3(0, 0, 1));
}

View FlyCamera::view() const {
  View view = exact_;
  if (untouched_) return view;
  view.name = "free";
  view.world_from_camera = cli::frame_of(position_, orientation());
  return view;
}

void FlyCamera::change_speed(double factor) { speed_ *= factor; }

void FlyCamera::turn(double yaw, double pitch) {
  wanted_yaw_ += yaw;
  wanted_pitch_ = std::clamp(wanted_pitch_ + pitch, std::min(-kSteepest, pitch_), std::max(kSteepest, pitch_));
  wanted_pitch_ = std::clamp(wanted_pitch_, -kSteepest, kSteepest);
  wanted_roll_ = 0;
}

// The rest of a change decays exponentially, so two half steps are equal to one whole step.
bool FlyCamera::ease_angles(double dt) {
  const double left = std::exp(-dt / kLookTime);
  bool moved = false;
  const auto ease = [&](double& now, double wanted) {
    if (now == wanted) return;
    now = std::abs(now - wanted) < kStillAngle ? wanted : wanted + (now - wanted) * left;
    moved = true;
  };
  ease(yaw_, wanted_yaw_);
  ease(pitch_, wanted_pitch_);
  ease(roll_, wanted_roll_);
  return moved;
}

bool FlyCamera::ease_motion(double dt, const CameraInput& input) {
  const glm::dquat q = orientation();
  const glm::dvec3 right = q * glm::dvec3(1, 0, 0), back = q * glm::dvec3(0, 0, 1);
  glm::dvec3 wanted = right * input.move.x + glm::dvec3(0, input.move.y, 0) + back * input.move.z;
  const double length = glm::length(wanted);
  if (length > 1) wanted /= length;
  wanted *= speed_ * (input.fast ? kFast : 1);
  if (wanted == velocity_ && wanted == glm::dvec3(0)) return false;
  if (length == 0 && glm::length(velocity_) < 1e-3 * speed_) {
    velocity_ = glm::dvec3(0);
    return false;
  }
  // The integral of a velocity that approaches the wanted one exponentially.
  const double left = std::exp(-dt / kMoveTime);
  position_ += wanted * dt + (velocity_ - wanted) * (kMoveTime * (1 - left));
  velocity_ = wanted + (velocity_ - wanted) * left;
  return true;
}

bool FlyCamera::update(double dt, const CameraInput& input) {
  dt = std::clamp(dt, 0.0, 1.0);
  if (input.look_x != 0 || input.look_y != 0) {
    turn(-input.look_x * kRadiansPerPixel, -input.look_y * kRadiansPerPixel);
    orbiting_ = false;
  }
  if (input.orbit_x != 0 || input.orbit_y != 0) {
    turn(-input.orbit_x * kRadiansPerPixel * 2, -input.orbit_y * kRadiansPerPixel * 2);
    orbiting_ = true;
  }
  const glm::dvec3 arm = glm::inverse(orientation()) * (pivot_ - position_);
  const bool turned = ease_angles(dt);
  if (turned && orbiting_) position_ = pivot_ - orientation() * arm;
  const bool moved = ease_motion(dt, input);
  if (turned || moved) untouched_ = false;
  return turned || moved;
}

}  // namespace ballot::view
