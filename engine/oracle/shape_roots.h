// Where the line of a ray meets the surfaces of shapes, in numbers of any kind N: Dyadic decides every sign, Bounded
// those that its errors leave. Internal to engine/oracle.
//
// Each t is (p + s sqrt(q)) / r, with r above 0 and q not below. N has +, -, *, a constructor from float, and
// the signs of n, of c + m t, and of the difference of two roots: sign_of(n), sign_at(root, c, m), compare(root, root),
// or nothing where they are not sure.
//
// Spheres: |f + t d|^2 = R^2 with f = o - c has the roots (-f.d +- sqrt(R R d.d - |f x d|^2)) / d.d.
// Round cones: with the axis a from end 0, L L = a.a, k = r0 - r1, y = (f + t d).a and rest = L L - k k, the cone that
// touches both spheres is |f + t d|^2 rest - y^2 + 2 r0 k y - r0^2 L L = 0. What lies of it between the circles where
// it touches, from y = r0 k to L L + r1 k, is the rest of the hull's surface. Where rest is not above 0, one sphere
// holds the other.
// All of this surface belongs to the hull, which is convex: so a line enters at the first of all its points there,
// spheres included, and leaves at the last.
#pragma once

#include <array>
#include <optional>

#include "engine/model/shapes.h"
#include "engine/oracle/bounded.h"
#include "engine/oracle/dyadic.h"
#include "shaders/shared/layout.h"

namespace ballot {

template <class N>
struct Root {
  N p, q, r;
  int s = 0;
};

std::optional<int> sign_of(const Dyadic& x);
std::optional<int> sign_at(const Root<Bounded>& root, const Bounded& c, const Bounded& m);
std::optional<int> sign_at(const Root<Dyadic>& root, const Dyadic& c, const Dyadic& m);
std::optional<int> compare(const Root<Bounded>& a, const Root<Bounded>& b);
std::optional<int> compare(const Root<Dyadic>& a, const Root<Dyadic>& b);

/// The points at which a line enters a shape and leaves it, and on which part of the surface: of a capsule end 0, end
/// 1 or the cone (2); of a box the axis of the face. Of a disc they are the same.
template <class N>
struct ShapeEnds {
  Root<N> at[2];
  int part[2] = {0, 0};
};

template <class N>
using VecOf = std::array<N, 3>;

template <class N>
N inner(const VecOf<N>& a, const VecOf<N>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// A line seen from a point: its origin minus the point, and its direction.
template <class N>
struct LineFrom {
  LineFrom(const Ray& ray, const glm::vec4& point) {
    for (int k = 0; k < 3; ++k) {
      from[std::size_t(k)] = N(ray.origin[k]) - N(point[k]);
      dir[std::size_t(k)] = N(ray.dir[k]);
    }
  }
  VecOf<N> from, dir;
};

/// Returns a root of p / r.
template <class N>
Root<N> fraction(const N& p, const N& r, int sign_of_r) {
  const N zero(0.f);
  return sign_of_r > 0 ? Root<N>{p, zero, r, 0} : Root<N>{zero - p, zero, zero - r, 0};
}

/// These return whether the line meets a shape, and where; nothing if a sign is not sure.
template <class N>
std::optional<bool> meet_sphere(const Ray& ray, const glm::vec4& sphere, Root<N> (&at)[2]) {
  const LineFrom<N> line(ray, sphere);
  const VecOf<N>&f = line.from, &d = line.dir;
  const VecOf<N> side{f[1] * d[2] - f[2] * d[1], f[2] * d[0] - f[0] * d[2], f[0] * d[1] - f[1] * d[0]};
  const N a = inner(d, d), b = inner(f, d), radius(sphere.w), q = radius * radius * a - inner(side, side);
  const std::optional<int> sign = sign_of(q);
  if (!sign || *sign < 0) return sign ? std::optional(false) : std::nullopt;
  for (int end = 0; end < 2; ++end) at[end] = {N(0.f) - b, q, a, *sign == 0 ? 0 : 2 * end - 1};
  return true;
}

template <class N>
std::optional<bool> meet_disc(const Ray& ray, const Shape& disc, ShapeEnds<N>& ends) {
  const LineFrom<N> line(ray, disc.a);
  const VecOf<N> normal{N(disc.b.x), N(disc.b.y), N(disc.b.z)};
  const N along = inner(line.dir, normal), ahead = N(0.f) - inner(line.from, normal), radius = N(disc.a.w) * along;
  const std::optional<int> slope = sign_of(along);
  if (!slope || *slope == 0) return slope ? std::optional(false) : std::nullopt;
  VecOf<N> to;
  for (std::size_t k = 0; k < 3; ++k) to[k] = line.from[k] * along + line.dir[k] * ahead;
  const std::optional<int> beyond = sign_of(inner(to, to) - radius * radius);
  if (!beyond) return std::nullopt;
  ends.at[0] = ends.at[1] = fraction(ahead, along, *slope);
  return *beyond <= 0;
}

template <class N>
std::optional<bool> meet_box(const Ray& ray, const Shape& box, ShapeEnds<N>& ends) {
  bool any = false;
  for (int k = 0; k < 3; ++k) {
    const float d = ray.dir[k];
    if (d == 0) {
      if (ray.origin[k] < box.a[k] || ray.origin[k] > box.b[k]) return false;
      continue;
    }
    for (int end = 0; end < 2; ++end) {
      const float plane = (end == 0) == (d > 0) ? box.a[k] : box.b[k];
      const Root<N> at = fraction(N(plane) - N(ray.origin[k]), N(d), d > 0 ? 1 : -1);
      const std::optional<int> order = any ? compare(at, ends.at[end]) : 0;
      if (!order) return std::nullopt;
      if (any && (end == 0 ? *order <= 0 : *order >= 0)) continue;
      ends.at[end] = at;
      ends.part[end] = k;
    }
    any = true;
  }
  const std::optional<int> order = compare(ends.at[0], ends.at[1]);
  return order ? std::optional(*order <= 0) : std::nullopt;
}

/// Points of a line on a surface, each with the part of it.
template <class N>
struct Candidates {
  void add(const Root<N>& root, int on) {
    at[count] = root;
    part[count++] = on;
  }
  Root<N> at[6];
  int part[6];
  std::size_t count = 0;
};

/// The cone of a capsule that touches both its spheres, as a line sees it.
template <class N>
struct ConeNumbers {
  ConeNumbers(const Ray& ray, const Shape& s) {
    const LineFrom<N> line(ray, s.a);
    VecOf<N> axis;
    for (int i = 0; i < 3; ++i) axis[std::size_t(i)] = N(s.b[i]) - N(s.a[i]);
    const N r0(s.a.w), r1(s.b.w), k = r0 - r1, length2 = inner(axis, axis), tilt = r0 * k;
    const N y0 = inner(line.from, axis), y1 = inner(line.dir, axis);
    rest = length2 - k * k;
    a = inner(line.dir, line.dir) * rest - y1 * y1;
    b = inner(line.from, line.dir) * rest - y0 * y1 + tilt * y1;
    c = inner(line.from, line.from) * rest - y0 * y0 + tilt * y0 + tilt * y0 - r0 * r0 * length2;
    after = y0 - tilt;
    before = length2 + r1 * k - y0;
    grows = y1;
    falls = N(0.f) - y1;
  }
  N rest, a, b, c;                // a t t + 2 b t + c = 0
  N after, before, grows, falls;  // a point is between the circles if after + grows t and before + falls t are not < 0
};

/// Adds the points on the cone of a capsule. Returns false if a sign is not sure.
template <class N>
bool add_cone(const ConeNumbers<N>& cone, Candidates<N>& all) {
  const N zero(0.f);
  const std::optional<int> rest = sign_of(cone.rest);
  if (!rest || *rest <= 0) return rest.has_value();
  const auto add = [&](const Root<N>& at) {
    const std::optional<int> first = sign_at(at, cone.after, cone.grows), last = sign_at(at, cone.before, cone.falls);
    const bool beside = (first && *first < 0) || (last && *last < 0);
    if (!beside && first && last) all.add(at, 2);
    return beside || (first && last);
  };
  const std::optional<int> sign = sign_of(cone.a);
  if (!sign) return false;
  if (*sign == 0) {
    const std::optional<int> slope = sign_of(cone.b);
    return slope && (*slope == 0 || add(fraction(zero - cone.c, cone.b + cone.b, *slope)));
  }
  const N q = cone.b * cone.b - cone.a * cone.c;
  const std::optional<int> real = sign_of(q);
  if (!real || *real < 0) return real.has_value();
  for (const int s : {-1, 1}) {
    if (*real == 0 && s > 0) continue;
    Root<N> at = fraction(zero - cone.b, cone.a, *sign);
    at.q = q;
    at.s = *real == 0 ? 0 : s;
    if (!add(at)) return false;
  }
  return true;
}

template <class N>
std::optional<bool> meet_capsule(const Ray& ray, const Shape& s, ShapeEnds<N>& ends) {
  Candidates<N> all;
  for (int end = 0; end < 2; ++end) {
    Root<N> at[2];
    const std::optional<bool> met = meet_sphere<N>(ray, end == 0 ? s.a : s.b, at);
    if (!met) return std::nullopt;
    if (*met) all.add(at[0], end), all.add(at[1], end);
  }
  if (!add_cone(ConeNumbers<N>(ray, s), all)) return std::nullopt;
  for (std::size_t i = 0; i < all.count; ++i)
    for (int end = 0; end < 2; ++end) {
      const std::optional<int> order = i == 0 ? 2 * end - 1 : compare(all.at[i], ends.at[end]);
      if (!order) return std::nullopt;
      if (end == 0 ? *order >= 0 : *order <= 0) continue;
      ends.at[end] = all.at[i];
      ends.part[end] = all.part[i];
    }
  return all.count > 0;
}

/// The same for a shape of any kind but triangles, which something meets (is_nothing()).
template <class N>
std::optional<bool> meet_shape(const Ray& ray, ShapeKind kind, const Shape& s, ShapeEnds<N>& ends) {
  if (kind == ShapeKind::Discs) return meet_disc(ray, s, ends);
  if (kind == ShapeKind::Boxes) return meet_box(ray, s, ends);
  if (kind == ShapeKind::Capsules) return meet_capsule(ray, s, ends);
  return meet_sphere<N>(ray, s.a, ends.at);
}

}  // namespace ballot
