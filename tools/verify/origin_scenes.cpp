#include "tools/verify/origin_scenes.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

namespace ballot::verify {

namespace {

using glm::dvec3;

/// Collects the triangles and views of a scene that is given with extent 1 about the origin, and moves them to the
/// wanted size and position.
class OriginPlace {
 public:
  OriginPlace(const char* name, double size, double distance)
      : size_(size), centre_(glm::normalize(dvec3(0.61, 0.47, 0.64)) * (distance * size)) {
    scene_.name = name;
  }

  void triangle(const dvec3& a, const dvec3& b, const dvec3& c) {
    scene_.triangles.push_back({glm::vec3(at(a)), glm::vec3(at(b)), glm::vec3(at(c))});
  }

  void quad(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d) {
    triangle(a, b, c);
    triangle(a, c, d);
  }

  void view(const char* name, const dvec3& eye, const dvec3& target, const dvec3& up, double yfov) {
    View view;
    view.name = name;
    view.yfov = yfov;
    view.world_from_camera = glm::inverse(glm::lookAt(eye, target, up));
    view.world_from_camera[3] = glm::dvec4(at(eye), 1);
    scene_.views.push_back(view);
  }

  Scene take() {
    finish_scene(scene_);
    return std::move(scene_);
  }

 private:
  dvec3 at(const dvec3& p) const { return centre_ + p * size_; }

  double size_;
  dvec3 centre_;
  Scene scene_;
};

void divided(OriginPlace& place, const dvec3& a, const dvec3& b, const dvec3& c, int levels) {
  if (levels == 0) return place.triangle(a * 0.5, b * 0.5, c * 0.5);
  const dvec3 ab = glm::normalize(a + b), bc = glm::normalize(b + c), ca = glm::normalize(c + a);
  divided(place, a, ab, ca, levels - 1);
  divided(place, ab, b, bc, levels - 1);
  divided(place, ca, bc, c, levels - 1);
  divided(place, ab, bc, ca, levels - 1);
}

Scene sphere(double size, double distance) {
  OriginPlace place("sphere", size, distance);
  for (const double x : {-1., 1.})
    for (const double y : {-1., 1.})
      for (const double z : {-1., 1.}) divided(place, {x, 0, 0}, {0, y, 0}, {0, 0, z}, 4);
  place.view("inside", {0.05, 0.1, 0.2}, {-0.2, -0.1, -0.3}, {0, 1, 0}, 2.2);
  return place.take();
}

/// Adds a side of a box as n x n quads, rotated by `turn` so that no coordinate is a round number.
void side(OriginPlace& place, const glm::dmat3& turn, int axis, double where, int n) {
  const auto at = [&](int i, int j) {
    dvec3 p;
    p[axis] = where, p[(axis + 1) % 3] = double(i) / n - 0.5, p[(axis + 2) % 3] = double(j) / n - 0.5;
    return turn * p;
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) place.quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
}

/// Makes a closed box around the camera. Above its floor are folds of 7 to 70 degrees, and plates of two sheets with a
/// gap of 1e-2 to 1e-6, into which refracted rays go.
Scene creases(double size, double distance) {
  OriginPlace place("creases", size, distance);
  const glm::dmat3 turn(glm::rotate(glm::dmat4(1), 0.3, glm::normalize(dvec3(1, 2, 3))));
  for (int axis = 0; axis < 3; ++axis)
    for (const double where : {-0.5, 0.5}) side(place, turn, axis, where, 4);
  const auto quad = [&](const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d) {
    place.quad(turn * a, turn * b, turn * c, turn * d);
  };
  double x = -0.45;
  for (const double half : {0.01, 0.03, 0.06, 0.12}) {  // half the width of a fold that is 0.17 deep and opens upwards
    const double low = -0.45, high = low + 0.17;
    quad({x, high, -0.4}, {x, high, 0}, {x + half, low, 0}, {x + half, low, -0.4});
    quad({x + half, low, -0.4}, {x + half, low, 0}, {x + 2 * half, high, 0}, {x + 2 * half, high, -0.4});
    x += 2 * half + 0.02;
  }
  x = -0.45;
  for (const double gap : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    for (const double y : {-0.3, -0.3 - gap}) quad({x, y, 0.05}, {x + 0.15, y, 0.05}, {x + 0.15, y, 0.4}, {x, y, 0.4});
    x += 0.17;
  }
  place.view("down", turn * dvec3(0, 0.42, 0), turn * dvec3(0, -0.5, -0.01), turn * dvec3(0, 0, 1), 1.6);
  place.view("folds", turn * dvec3(-0.15, 0.1, -0.2), turn * dvec3(-0.15, -0.5, -0.21), turn * dvec3(0, 0, 1), 0.8);
  return place.take();
}

/// Makes rough ground of strips along x, two triangles each. The strips in the middle, at which the views look, are
/// 1e-5 and 1e-7 wide.
Scene slivers(double size, double distance) {
  OriginPlace place("slivers", size, distance);
  std::mt19937 random(7);
  std::vector<double> rows;  // z of the strips' borders on one side of the middle
  for (double z = 0; z < 0.5;) {
    rows.push_back(z);
    z += z < 5e-6 ? 1e-7 : z < 5e-4 ? 1e-5 : 3e-3;
  }
  std::vector<double> z;
  for (std::size_t i = rows.size(); i-- > 1;) z.push_back(-rows[i]);
  z.insert(z.end(), rows.begin(), rows.end());
  const auto height = [&](double width) { return width * (double(random() % 1000) / 1000 - 0.5); };
  dvec3 left(-0.5, 0, z[0]), right(0.5, 0, z[0]);
  for (std::size_t i = 1; i < z.size(); ++i) {
    const double width = z[i] - z[i - 1];
    const dvec3 next_left(-0.5, height(width), z[i]), next_right(0.5, height(width), z[i]);
    place.quad(left, right, next_right, next_left);
    left = next_left, right = next_right;
  }
  place.view("wide", {0.1, 0.7, 0.1}, {0, 0, 0}, {0, 0, 1}, 1.0);
  place.view("narrow", {0.1, 0.5, 0.2}, {0.003, 0, 0}, {0, 0, 1}, 1.5e-3);
  place.view("narrowest", {0.1, 0.5, 0.2}, {0.003, 0, 0}, {0, 0, 1}, 1.5e-5);
  return place.take();
}

constexpr OriginScene kScenes[] = {
    {"sphere", "a closed sphere of 2048 triangles, from inside", sphere},
    {"creases", "a closed box with folds of 7 to 70 degrees and gaps of 1e-2 to 1e-6 of its size", creases},
    {"slivers", "rough ground of triangles that are up to 1e7 times longer than wide", slivers},
};

}  // namespace

std::span<const OriginScene> origin_scenes() { return kScenes; }

}  // namespace ballot::verify
