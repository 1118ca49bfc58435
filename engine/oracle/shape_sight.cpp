#include "engine/oracle/shape_sight.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "engine/oracle/filter_box.h"
#include "engine/oracle/oracle.h"

namespace ballot {
namespace {

constexpr double kBeyondAll = std::numeric_limits<double>::infinity();

Bounded number_of(const Root<Bounded>& root) {
  if (root.s == 0) return root.p / root.r;
  const Bounded part = square_root(root.q);
  return (root.s > 0 ? root.p + part : root.p - part) / root.r;
}

/// Returns the sign of a + s sqrt(q).
int sign_of(const Dyadic& a, int s, const Dyadic& q) {
  const int sign = a.sign();
  if (s == 0 || q.sign() == 0 || sign == s) return sign;
  return sign == 0 ? s : sign * (a * a - q).sign();
}

/// Returns the t of a root as a double, rounded to the nearest or its neighbour.
double as_double(const Root<Dyadic>& root) {
  if (root.s == 0) return quotient(root.p, root.r);
  const Dyadic part = square_root(root.q), with = root.s > 0 ? part : Dyadic() - part;
  if (root.p.sign() * root.s >= 0) return quotient(root.p + with, root.r);
  // (p + s sqrt(q)) (p - s sqrt(q)) = p p - q, so that nothing cancels.
  return quotient(root.p * root.p - root.q, (root.p - with) * root.r);
}

}  // namespace

std::optional<int> sign_of(const Dyadic& x) { return x.sign(); }

std::optional<int> sign_at(const Root<Bounded>& root, const Bounded& c, const Bounded& m) {
  return sign_of(c + m * number_of(root));
}

std::optional<int> sign_at(const Root<Dyadic>& root, const Dyadic& c, const Dyadic& m) {
  return sign_of(c * root.r + m * root.p, root.s * m.sign(), m * m * root.q);
}

std::optional<int> compare(const Root<Bounded>& a, const Root<Bounded>& b) {
  return sign_of(number_of(a) - number_of(b));
}

/// The sign of A + s sqrt(Q) + s' sqrt(Q'): where A and the roots differ in sign, that of A A - Q - Q' -
/// 2 s s' sqrt(Q Q') decides.
std::optional<int> compare(const Root<Dyadic>& a, const Root<Dyadic>& b) {
  const Dyadic apart = a.p * b.r - b.p * a.r;
  const Dyadic q = a.s ? b.r * b.r * a.q : Dyadic(), other = b.s ? a.r * a.r * b.q : Dyadic();
  const int s = a.s, t = -b.s, sign = apart.sign();
  const int roots = s == 0 || t == 0 ? s + t : s == t ? s : s * (q - other).sign();
  if (sign == 0 || roots == 0 || sign == roots) return sign == 0 ? roots : sign;
  const Dyadic both = q * other;
  return sign * sign_of(apart * apart - q - other, -s * t, both + both + both + both);
}

ShapeSight::ShapeSight(const Ray& ray, ShapeKind kind, const Shape& shape) : ray_(&ray), kind_(kind), shape_(&shape) {
  met_ = is_nothing(kind, shape) ? std::optional(false) : meet_shape(ray, kind, shape, ends_);
  has_ends_ = met_ == true;
  for (int end = 0; end < 2; ++end) {
    const Bounded t = has_ends_ ? number_of(ends_.at[end]) : Bounded(0, kBeyondAll);
    const bool known = t.error < kBeyondAll;
    t_[end] = known ? Interval{t.low(), t.high()} : Interval{-kBeyondAll, kBeyondAll};
  }
}

const ShapeEnds<Dyadic>& ShapeSight::exact() {
  if (!exact_) {
    exact_ = std::make_unique<ShapeEnds<Dyadic>>();
    met_ = meet_shape(*ray_, kind_, *shape_, *exact_);
  }
  return *exact_;
}

bool ShapeSight::meets() {
  if (met_) return *met_;
  exact();
  for (int end = 0; *met_ && end < 2; ++end) {
    const double t = as_double(exact_->at[end]);
    t_[end] = {std::nextafter(t, -kBeyondAll), std::nextafter(t, kBeyondAll)};
  }
  return *met_;
}

bool ShapeSight::within(int end) {
  const Interval& t = t_[end];
  if (t.high < ray_->t_min || t.low > ray_->t_max) return false;
  if (t.low >= ray_->t_min && t.high <= ray_->t_max) return true;
  const Root<Dyadic>& root = exact().at[end];
  const auto side_of = [&](float bound) { return *sign_at(root, Dyadic() - Dyadic(bound), Dyadic(1.f)); };
  return side_of(ray_->t_min) >= 0 && side_of(ray_->t_max) <= 0;
}

std::strong_ordering ShapeSight::compare_t(ShapeSight& a, int end, ShapeSight& b, int other) {
  if (a.t_[end].high < b.t_[other].low) return std::strong_ordering::less;
  if (a.t_[end].low > b.t_[other].high) return std::strong_ordering::greater;
  return *compare(a.exact().at[end], b.exact().at[other]) <=> 0;
}

double ShapeSight::number(int end) {
  const Interval& t = t_[end];
  if (float(t.low) == float(t.high) && t.low != 0) return 0.5 * t.low + 0.5 * t.high;
  return as_double(exact().at[end]);
}

glm::dvec3 ShapeSight::normal(int end) {
  if (kind_ == ShapeKind::Discs) return shape_->b;
  const int part = has_ends_ ? ends_.part[end] : exact().part[end];
  if (kind_ == ShapeKind::Boxes) {
    glm::dvec3 normal(0);
    normal[part] = (end == 1) == (ray_->dir[part] > 0) ? 1 : -1;
    return normal;
  }
  const glm::dvec3 centre(part == 1 ? shape_->b : shape_->a);
  const glm::dvec3 at = glm::dvec3(ray_->origin) - centre + number(end) * glm::dvec3(ray_->dir);
  if (part != 2) return at;
  const glm::dvec3 axis = glm::dvec3(shape_->b) - glm::dvec3(shape_->a);
  const double r0 = shape_->a.w, k = r0 - shape_->b.w, rest = glm::dot(axis, axis) - k * k;
  return at * rest - axis * (glm::dot(at, axis) - r0 * k);
}

glm::dvec2 octahedral_of(const glm::dvec3& v) {
  glm::dvec2 p = glm::dvec2(v) / (std::abs(v.x) + std::abs(v.y) + std::abs(v.z));
  if (v.z < 0) p = (1.0 - glm::abs(glm::dvec2(p.y, p.x))) * glm::dvec2(p.x < 0 ? -1 : 1, p.y < 0 ? -1 : 1);
  return p * 0.5 + 0.5;
}

OracleHit nearest_shape(const PlacedMesh& mesh, std::optional<std::uint32_t> prim) {
  const Ray ray = rounded(mesh.ray);  // exactly, as the rays of shapes are of float32
  if (is_dead(ray)) return {};
  std::optional<ShapeSight> best;
  int best_end = 0;
  OracleHit hit;
  double t_far = ray.t_max;
  const auto test = [&](std::uint32_t i) {
    if (i == hit.prim) return;
    ShapeSight sight(ray, mesh.kind, mesh.shapes[i]);
    if (!sight.meets()) return;
    int end = 0;
    while (end < sight.ends() && !sight.within(end)) ++end;
    if (end == sight.ends()) return;
    if (best) {
      const std::strong_ordering order = ShapeSight::compare_t(sight, end, *best, best_end);
      if (order > 0 || (order == 0 && i > hit.prim)) return;
    }
    best.emplace(std::move(sight));
    best_end = end;
    hit.prim = i;
    t_far = std::min(t_far, best->t(end).high);
  };
  if (prim) {
    test(*prim);
  } else {
    Walker(mesh.tree).walk(FilterRay(ray), t_far, [&](std::uint32_t texel) {
      test(decode_prim(mesh.tree, texel));
      return true;
    });
  }
  if (!best) return {};
  hit.t = best->number(best_end);
  const glm::dvec2 uv = octahedral_of(best->normal(best_end));
  hit.u = uv.x;
  hit.v = uv.y;
  return hit;
}

}  // namespace ballot
