// Hard cases whose coordinates float32 does not hold: far from zero, walls that nearly touch, long rays, tiny parts.
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "tools/hard/generate.h"

namespace ballot::hard {
namespace {

std::size_t many_in_double(bool quick) { return quick ? 501 : 20011; }

/// Returns a number of 53 random bits between two.
double between(Random& random, double lo, double hi) {
  const double high = random.bits() >> 5, low = random.bits() >> 6;
  return lo + (hi - lo) * ((high * 0x1p26 + low) * 0x1p-53);
}
glm::dvec3 direction_in_double(Random& random) {
  const glm::dvec3 d{between(random, -1, 1), between(random, -1, 1), between(random, -1, 1)};
  return glm::normalize(d);
}

/// Returns a point well inside of a triangle.
glm::dvec3 within(Random& random, const CornersInDouble& t) {
  const double u = between(random, 0.05, 0.45), v = between(random, 0.05, 0.45);
  return (1 - u - v) * t[0] + u * t[1] + v * t[2];
}

/// A rotation whose numbers are quotients of small integers, and a place on the earth, in metres.
const glm::dmat3 kTurned = glm::dmat3(-20, 20, 10, 4, -10, 28, 22, 20, 4) / 30.0;
const glm::dvec3 kOnEarth{4248123.456, 856789.123, 4665432.987};

/// Returns a city of 16 m cells in double, with decimals: where vertices meet they are the same.
std::vector<CornersInDouble> city_in_double(bool quick) {
  std::vector<CornersInDouble> all;
  for (const Triangle& t : city(quick ? 24 : 64, 16, {0, 0, 0}, quick ? 20 : 200)) {
    CornersInDouble& c = all.emplace_back(widened(t));
    for (glm::dvec3& v : c) v = 1.0009765625 * v + glm::dvec3(0.1, 0.2, 0.3) * (1 / 3.0);
  }
  return all;
}

/// Returns a city that is turned and moved, and rays at it from so high above.
HardDoubleScene city_at(bool quick, const glm::dmat3& turn, const glm::dvec3& to, double height, double spread) {
  HardDoubleScene made;
  const std::vector<CornersInDouble> city = city_in_double(quick);
  for (const CornersInDouble& t : city)
    made.triangles.push_back({turn * t[0] + to, turn * t[1] + to, turn * t[2] + to});
  Random random(90);
  while (made.rays.size() < many_in_double(quick)) {
    const glm::dvec3 at = within(random, city[random.below(city.size())]);
    const glm::dvec3 from = at + glm::dvec3(between(random, -spread, spread), height, between(random, -spread, spread));
    made.rays.push_back({turn * from + to, 0, turn * glm::normalize(at - from)});
  }
  return made;
}

void add_quad(std::vector<CornersInDouble>& to, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
              const glm::dvec3& d) {
  to.push_back({a, b, c});
  to.push_back({a, c, d});
}

/// Adds a pipe along z: 4 x 16 squares around, by a map of the circle to quotients.
void add_pipe(std::vector<CornersInDouble>& to, const glm::dvec3& centre, double radius, double half) {
  const auto at = [&](int i, double z) {
    const double s = (i % 16) / 16.0, x = (1 - s * s) / (1 + s * s), y = 2 * s / (1 + s * s);
    const int quarter = i / 16 % 4;
    const glm::dvec2 p = quarter == 0   ? glm::dvec2(x, y)
                         : quarter == 1 ? glm::dvec2(-y, x)
                         : quarter == 2 ? glm::dvec2(-x, -y)
                                        : glm::dvec2(y, -x);
    return centre + glm::dvec3(radius * p, z);
  };
  for (int i = 0; i < 64; ++i) add_quad(to, at(i, -half), at(i + 1, -half), at(i + 1, half), at(i, half));
}

}  // namespace

HardDoubleScene utm_in_double(bool quick) {
  return city_at(quick, {1, 0, 0, 0, 0, 1, 0, -1, 0}, {458000.25, 5428000.75, 0}, 1500, 800);
}

HardDoubleScene earth_centred(bool quick) { return city_at(quick, kTurned, kOnEarth, 1500, 800); }

HardDoubleScene satellites(bool quick) { return city_at(quick, kTurned, kOnEarth, 7e5, 3e5); }

HardDoubleScene reactor(bool quick) {
  HardDoubleScene made;
  const double e = 1e3;
  for (int axis = 0; axis < 3; ++axis)
    for (const double end : {-e, e}) {
      const auto at = [&](double a, double b) {
        glm::dvec3 p;
        p[axis] = end, p[(axis + 1) % 3] = a, p[(axis + 2) % 3] = b;
        return p;
      };
      add_quad(made.triangles, at(-e, -e), at(e, -e), at(e, e), at(-e, e));
    }
  const std::size_t walls = made.triangles.size();
  Random random(91);
  for (int pipe = 0; pipe < (quick ? 9 : 49); ++pipe) {
    const int side = quick ? 3 : 7;
    const glm::dvec3 centre(100.1 * (pipe % side - side / 2), 100.1 * (pipe / side - side / 2), 0.3);
    for (const double radius : {1.0, 1 + 1e-6, 40.0, 40 + 1e-6, 40 + 2e-6})
      add_pipe(made.triangles, centre, radius, 400);
  }
  for (int plate = 0; plate < 40; ++plate) {
    const double z = 500 + 1e-6 * ((7 * plate) % 40);  // in no order
    add_quad(made.triangles, {-900, -900, z}, {900, -900, z}, {900, 900, z}, {-900, 900, z});
  }
  while (made.rays.size() < many_in_double(quick)) {
    const glm::dvec3 to = within(random, made.triangles[walls + random.below(made.triangles.size() - walls)]);
    const glm::dvec3 from{between(random, -e, e), between(random, -e, e), between(random, -e, e)};
    made.rays.push_back({from, 0, glm::normalize(to - from)});
  }
  return made;
}

HardDoubleScene long_rays(bool quick) {
  HardDoubleScene made;
  const glm::dvec3 centre{1000.1, 2000.2, 3000.3};
  const Triangles sphere = octasphere(quick ? 4 : 5);
  for (const Triangle& t : sphere) {
    CornersInDouble& c = made.triangles.emplace_back(widened(t));
    for (glm::dvec3& v : c) v = centre + 100.0 * glm::normalize(v);
  }
  Random random(92);
  while (made.rays.size() < many_in_double(quick)) {
    const glm::dvec3 to = within(random, made.triangles[random.below(made.triangles.size())]);
    const glm::dvec3 dir = direction_in_double(random);
    if (std::abs(glm::dot(dir, glm::normalize(to - centre))) < 0.1) continue;  // grazing: 1e9 leaves 1e-7 of a place
    made.rays.push_back({to - 1e9 * dir, 0, dir});
  }
  return made;
}

HardDoubleScene tiny_beside_large(bool quick) {
  HardDoubleScene made;
  Random random(93);
  const std::size_t count = many_in_double(quick) / 4;
  for (std::size_t i = 0; i < count; ++i) {
    const double size = 1e-14 * std::ldexp(1.0, int(random.below(20)));
    const glm::dvec3 at{between(random, -1, 1), between(random, -1, 1), 0};
    made.triangles.push_back({at, at + glm::dvec3(size, 0, 0), at + glm::dvec3(0, size, 0)});
  }
  made.triangles.push_back({glm::dvec3(-1e3, -1e3, -1), glm::dvec3(1e3, -1e3, -1), glm::dvec3(0, 1e3, -1)});
  while (made.rays.size() < many_in_double(quick)) {
    const CornersInDouble& t = made.triangles[random.below(count)];
    const glm::dvec3 to = (t[0] + t[1] + t[2]) / 3.0;
    made.rays.push_back({glm::dvec3(to.x, to.y, between(random, 1, 900)), 0, {0, 0, -1}});
  }
  return made;
}

}  // namespace ballot::hard
