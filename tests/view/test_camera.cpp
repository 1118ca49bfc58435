// Tests of the camera's motion, without a window.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "tools/program/views_file.h"
#include "tools/view/camera.h"

namespace {

using namespace ballot;
using view::CameraInput;
using view::FlyCamera;

View view_at(const glm::dvec3& position, double yaw, double pitch, double roll = 0) {
  View v;
  v.name = "start";
  v.world_from_camera =
      cli::frame_of(position, glm::angleAxis(yaw, glm::dvec3(0, 1, 0)) * glm::angleAxis(pitch, glm::dvec3(1, 0, 0)) *
                                  glm::angleAxis(roll, glm::dvec3(0, 0, 1)));
  return v;
}

/// Flies forward for one second and then rests for one, at a given frame rate.
FlyCamera flown(int frames_per_second) {
  FlyCamera camera(10);
  camera.set(view_at({1, 2, 3}, 0.3, -0.2));
  CameraInput forward, none;
  forward.move = {0, 0, -1};
  for (int i = 0; i < frames_per_second; ++i) camera.update(1.0 / frames_per_second, forward);
  for (int i = 0; i < frames_per_second; ++i) camera.update(1.0 / frames_per_second, none);
  return camera;
}

TEST(Camera, FliesAsFarAtEveryFrameRate) {
  const glm::dvec3 slow = flown(10).position(), fast = flown(1000).position();
  EXPECT_GT(glm::distance(slow, glm::dvec3(1, 2, 3)), 1.0);
  EXPECT_LT(glm::distance(slow, fast), 2e-3 * glm::distance(slow, glm::dvec3(1, 2, 3)));
}

TEST(Camera, TurnsAsFarAtEveryFrameRate) {
  for (const int rate : {5, 60, 1000}) {
    FlyCamera camera(10);
    camera.set(view_at({0, 0, 0}, 0, 0));
    CameraInput look;
    look.look_x = 100;
    camera.update(1.0 / rate, look);
    for (int i = 0; i < rate; ++i) camera.update(1.0 / rate, {});
    EXPECT_NEAR(camera.yaw(), -0.35, 1e-9) << rate;
  }
}

TEST(Camera, NeverRolls) {
  FlyCamera camera(10);
  camera.set(view_at({0, 0, 0}, 0.1, 0.2));
  for (int i = 0; i < 500; ++i) {
    CameraInput hands;
    hands.look_x = 40 * std::sin(i * 0.7), hands.look_y = 60 * std::cos(i * 0.31);
    hands.move = {std::sin(i * 0.2), 0.3, -1};
    camera.update(0.016, hands);
    const glm::dvec3 right(camera.view().world_from_camera[0]), up(camera.view().world_from_camera[1]);
    EXPECT_NEAR(right.y, 0, 1e-12);
    EXPECT_GE(up.y, 0);
  }
}

TEST(Camera, StopsShortOfStraightUp) {
  FlyCamera camera(10);
  camera.set(view_at({0, 0, 0}, 0, 0));
  CameraInput look;
  look.look_y = -1e5;
  camera.update(0.1, look);
  for (int i = 0; i < 100; ++i) camera.update(0.1, {});
  EXPECT_NEAR(camera.pitch(), 89.0 / 180 * 3.14159265358979, 1e-6);
  look.look_y = 10;
  camera.update(0.1, look);  // it responds at once: no motion was stored up beyond the end
  EXPECT_LT(camera.pitch(), 89.0 / 180 * 3.14159265358979 - 0.01);
}

TEST(Camera, ShowsExactlyTheViewItIsGiven) {
  FlyCamera camera(10);
  const View rolled = view_at({1, 2, 3}, 2.0, -0.4, 0.5);
  camera.set(rolled);
  EXPECT_FALSE(camera.update(0.1, {}));
  EXPECT_EQ(camera.view().world_from_camera, rolled.world_from_camera);
  EXPECT_EQ(camera.view().name, "start");
  CameraInput look;
  look.look_x = 1;
  camera.update(0.01, look);
  const glm::dvec3 right(camera.view().world_from_camera[0]);
  EXPECT_GT(std::abs(right.y), 0.2) << "the roll eases out, it does not snap";
  for (int i = 0; i < 100; ++i) camera.update(0.05, {});
  EXPECT_NEAR(camera.view().world_from_camera[0].y, 0, 1e-9);
}

TEST(Camera, LooksStraightDownWithoutSpinning) {
  FlyCamera camera(10);
  const View down = view_at({0, 5, 0}, 0.7, -1.5707963267948966);
  camera.set(down);
  CameraInput forward;
  forward.move = {1, 0, 0};
  camera.update(0.1, forward);
  const glm::dvec3 before(down.world_from_camera[0]), after(camera.view().world_from_camera[0]);
  EXPECT_GT(glm::dot(before, after), 0.999999);
}

TEST(Camera, OrbitsAtTheSameDistance) {
  FlyCamera camera(10);
  camera.set(view_at({0, 1, 8}, 0, 0));
  const glm::dvec3 pivot(1, 0.5, 2);
  camera.set_pivot(pivot);
  const double distance = glm::distance(camera.position(), pivot);
  CameraInput orbit;
  orbit.orbit_x = 30, orbit.orbit_y = 4;
  for (int i = 0; i < 50; ++i) {
    camera.update(0.016, orbit);
    EXPECT_NEAR(glm::distance(camera.position(), pivot), distance, 1e-9);
  }
  EXPECT_GT(std::abs(camera.yaw()), 1.0);
}

TEST(Camera, AnOrthographicViewStaysOneInFlight) {
  View plan = view_at({0, 5, 0}, 0.7, -1.2);
  plan.orthographic = true, plan.ymag = 2.5;
  FlyCamera camera(10);
  camera.set(plan);
  CameraInput input;
  input.move = {1, 0, 0}, input.look_x = 40;
  camera.update(0.1, input);
  EXPECT_NE(camera.view().world_from_camera, plan.world_from_camera);
  EXPECT_TRUE(camera.view().orthographic);
  EXPECT_EQ(camera.view().ymag, 2.5);
}

TEST(Camera, ComesToRest) {
  FlyCamera camera = flown(60);
  for (int i = 0; i < 200; ++i) camera.update(0.016, {});
  EXPECT_FALSE(camera.update(0.016, {}));
}

}  // namespace
