// Judges float32 answers by a bound of the rounding error of the triangle test.
//
// The test is that of Woop, Benthin, Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013, evaluated in float32
// with unit roundoff u = 2^-24. Subtractions, additions and products are rounded once. Divisions are within 2.5 ulp
// (Vulkan's limit), that is 5u.
//
// Vertices. x = fl(a - fl(s * c)) with a = fl(v - o)[kx] and c = fl(v - o)[kz]. s is the product of a component and a
// reciprocal, |s| <= 1. Let M be the largest |v - o| of the triangle along an axis. a is off by uM. s * c is off by
// u (of c) + 6u (of s) + u (of the product), times M. The difference is at most 2M and rounds by 2uM. Together that is
// 11uM. lateral = 16uM leaves room for terms of second order and for an origin that is moved by a fused rounding.
//
// Edge functions. U = fl(Cx * By - Cy * Bx) moves by lateral * (|Bx| + |By| + |Cx| + |Cy|) + 2 lateral^2 when its
// vertices move by lateral, and by at most 2u (|Cx * By| + |Cy * Bx|) when it is rounded; 4u is used. A triangle is hit
// for certain if all three edge functions lie beyond their error on one side of zero. It is missed for certain if two
// of them lie beyond their error on different sides, or if det is certain and one lies beyond its error on the opposite
// side.
//
// Depth. t = sum(U_i z_i) / sum(U_i). If the U_i are off by e_i, then t is off by sum(e_i |z_i - t|) / |det'|, with
// |det'| >= |det| - sum(e_i). It is not off by more than the triangle's extent in depth, because the weights of a hit
// have one sign. Rounding adds at most 18u max|z|: z by 7u (v - o, 1 / d, product), the sum of products by 3u, det by
// 2u, the quotient by 6u. 20u is used. The same holds for the weights.
//
// Moeller and Trumbore (1997) work with edges in space instead of projected ones. Let the direction have unit depth, so
// |d| <= sqrt(3), let offsets be up to M and edges up to E. The numerators s . (d x e2) and d . (s x e1) round by at
// most 9u of the product of their lengths, which is below 64 u M E. The numerator of the depth, e2 . (s x e1), rounds
// by 64 u M E^2. Unlike Woop's bound, this one does not shrink with the projection: triangles seen edge-on are worse.
//
// Numbers below 2^-126 may be flushed to zero. The small absolute terms allow for that.
//
// Mode double runs the same steps in float64, u = 2^-53, and loses nothing to underflow above 2^-400. What is computed
// here rounds alike, by at most as much, so 2^-52 covers both. Its t, u and v are then rounded to float32 (written()).
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "engine/oracle/in_parallel.h"
#include "engine/oracle/judge_range.h"
#include "engine/oracle/oracle.h"
#include "engine/oracle/ulp.h"
#include "engine/oracle/walker.h"

namespace ballot {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr double kWeightSlack = 1e-5;      // how far u, v and 1 - u - v of any hit may lie outside of [0, 1]
constexpr double kExactWeights = 0x1p-22;  // error of u and v, which a mode that decides exactly divides in float32
constexpr std::size_t kRaysPerJudgeChunk = 4096;
constexpr std::size_t kMaxExamples = 8;

struct SideErrors {
  double side[3], sum;
};

// Returns the length of the longest edge of the sheared triangle, in scene units.
double longest_edge(const RayFrame& ray, const Sight& s) {
  double longest = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const double depth = std::abs(s.z[i] - s.z[j]) * std::abs(ray.d[ray.kz]);
    longest = std::max(longest, std::abs(s.x[i] - s.x[j]) + std::abs(s.y[i] - s.y[j]) + depth);
  }
  return longest;
}

SideErrors side_errors(const RayFrame& ray, const Sight& s) {
  const double u = roundoff(ray), flushed = flush(ray);
  const double lateral = (16 * u + 2 * flushed * std::abs(ray.sz)) * s.reach;
  SideErrors e{{}, 0};
  for (int i = 0; i < 3; ++i) {
    const int b = (i + 1) % 3, c = (i + 2) % 3;
    e.side[i] = lateral * (std::abs(s.x[b]) + std::abs(s.y[b]) + std::abs(s.x[c]) + std::abs(s.y[c]) + 2 * lateral) +
                4 * u * (std::abs(s.x[c] * s.y[b]) + std::abs(s.y[c] * s.x[b])) + 4 * flushed;
    if (ray.arithmetic == Arithmetic::MoellerTrumbore) e.side[i] += 64 * u * s.reach * longest_edge(ray, s);
    e.sum += e.side[i];
  }
  return e;
}

void decide_sides(const Sight& s, const SideErrors& e, double u, Range& range) {
  int above = 0, below = 0;
  double absolute = 0;
  for (int i = 0; i < 3; ++i) {
    above += s.side[i] > e.side[i] ? 1 : 0;
    below += s.side[i] < -e.side[i] ? 1 : 0;
    absolute += std::abs(s.side[i]);
  }
  const double det_error = e.sum + 4 * u * absolute;
  range.surely_hit = above == 3 || below == 3;
  range.surely_missed =
      (above > 0 && below > 0) || (s.det > det_error && below > 0) || (s.det < -det_error && above > 0);
}

void bound_values(const RayFrame& ray, const Sight& s, const SideErrors& e, Range& range) {
  const auto [nearest, farthest] = std::minmax({s.z[0], s.z[1], s.z[2]});
  const double largest = std::max(std::abs(nearest), std::abs(farthest));
  const double room = std::abs(s.det) - e.sum;
  const double u = roundoff(ray), least = flush(ray);
  const double flushed = 4 * least * (1 + 1 / std::max(std::abs(s.det), least));
  const double rounding = (20 * u + least * std::abs(ray.d[ray.kz])) * largest + flushed;
  if (room > 0) {
    range.t = std::clamp(s.t(), nearest, farthest);
    double moved = 0;
    for (int i = 0; i < 3; ++i) moved += e.side[i] * std::abs(s.z[i] - range.t);
    range.t_error = std::min(moved / room, farthest - nearest) + rounding;
    if (ray.arithmetic == Arithmetic::MoellerTrumbore) {
      const double edge = longest_edge(ray, s);
      range.t_error += 64 * u * s.reach * edge * edge / (std::abs(ray.d[ray.kz]) * room);
    }
    range.u = s.weight(1);
    range.v = s.weight(2);
    const double largest_weight = std::max({1.0, std::abs(range.u), std::abs(range.v)});
    range.weight_error = (std::max(e.side[1], e.side[2]) + largest_weight * e.sum) / room + 16 * u + flushed;
  } else {
    range.t = (nearest + farthest) / 2;
    range.t_error = (farthest - nearest) / 2 + rounding;
    // If det may have any sign and size, Moeller and Trumbore's t is no mean of the depths of the vertices.
    if (ray.arithmetic == Arithmetic::MoellerTrumbore) range.t_error = kUnbounded;
  }
}

Range woop_range(const RayFrame& ray, const Triangle& triangle) {
  const Sight s(ray, triangle);
  const SideErrors e = side_errors(ray, s);
  Range range;
  decide_sides(s, e, roundoff(ray), range);
  bound_values(ray, s, e, range);
  return range;
}

Range range_of(const RayFrame& ray, const Triangle& triangle) {
  Range range = ray.arithmetic == Arithmetic::WoopAffine ? affine_range(ray, triangle) : woop_range(ray, triangle);
  if (range.t_low() < ray.t_min || range.t_high() > ray.t_max) range.surely_hit = false;
  if (range.t_high() < ray.t_min || range.t_low() > ray.t_max) range.surely_missed = true;
  return range;
}

bool same_vertices(const Triangle& a, const Triangle& b) { return std::memcmp(&a, &b, sizeof(Triangle)) == 0; }

// Returns a range that also allows for the rounding of an answer of mode double to float32.
Range written(Range range, const RayFrame& ray, const Hit& answer) {
  if (!is_double(ray)) return range;
  range.t_error += ulp(answer.t), range.weight_error += kFloatRoundoff;
  return range;
}

// True if the ray surely hits some triangle at a t that is surely less than `t`. An infinite `t` admits any triangle.
bool surely_nearer(const PairTree& bvh, const RayFrame& ray, double t) {
  bool found = false;
  Walker(bvh).walk(ray, std::min(t, ray.t_max), [&](std::uint32_t texel) {
    const Range range = range_of(ray, decode_triangle(bvh, texel));
    found = range.surely_hit && range.t_high() < t;
    return !found;
  });
  return found;
}

// True if the tree holds a twin of the triangle: the same vertices bit for bit, but a smaller number.
bool has_earlier_twin(const PairTree& bvh, const RayFrame& ray, std::uint32_t prim, const Triangle& triangle) {
  bool found = false;
  const double t_far = ray.t_max;
  Walker(bvh).walk(ray, t_far, [&](std::uint32_t texel) {
    found = decode_prim(bvh, texel) < prim && same_vertices(decode_triangle(bvh, texel), triangle);
    return !found;
  });
  return found;
}

bool wrong_weights(const Hit& answer, const Range& range) {
  const double u = answer.u, v = answer.v;
  const bool inside = u >= -kWeightSlack && v >= -kWeightSlack && u + v <= 1 + kWeightSlack;  // false for NaN
  return !inside || !(std::abs(u - range.u) <= range.weight_error) || !(std::abs(v - range.v) <= range.weight_error);
}

// The verdict on one answer.
struct Opinion {
  Verdict verdict = Verdict::Same;
  double t_error = 0;  // error of t, as a share of its bound
};

// Judges the answer of a mode that decides exactly: it is either the truth or an error.
Opinion judge_exactly(const PairTree& bvh, const RayFrame& ray, const Hit& answer, std::uint32_t texel,
                      const OracleHit& truth, Want want) {
  if (answer.prim == NO_HIT) return {truth.prim == NO_HIT ? Verdict::Same : Verdict::FalseMiss};
  if (truth.prim == NO_HIT) return {Verdict::FalseHit};
  if (texel == NO_HIT || (want == Want::Nearest && answer.prim != truth.prim)) return {Verdict::WrongPrim};
  std::optional<OracleHit> hit = truth;
  if (answer.prim != truth.prim) hit = intersect(ray, decode_triangle(bvh, texel), answer.prim);
  if (!hit) return {Verdict::WrongPrim};
  const double t_error = in_ulps(std::abs(answer.t - hit->t), hit->t);
  const double weight_error = std::max(std::abs(answer.u - hit->u), std::abs(answer.v - hit->v));
  const bool in_interval = answer.t >= ray.t_min && answer.t <= ray.t_max;
  const bool right = in_interval && t_error <= 1 && weight_error <= kExactWeights && !std::isnan(answer.v);
  return {right ? Verdict::Same : Verdict::WrongT, t_error};
}

Opinion judge_miss(const PairTree& bvh, const RayFrame& ray, const OracleHit& truth) {
  if (truth.prim == NO_HIT) return {};
  return {surely_nearer(bvh, ray, kUnbounded) ? Verdict::FalseMiss : Verdict::Tie};
}

Opinion judge_hit(const PairTree& bvh, const RayFrame& ray, const Hit& answer, std::uint32_t texel,
                  const OracleHit& truth, Want want) {
  const Verdict not_this = truth.prim == NO_HIT ? Verdict::FalseHit : Verdict::WrongPrim;
  if (texel == NO_HIT) return {not_this};
  const Triangle triangle = decode_triangle(bvh, texel);
  const Range range = range_of(ray, triangle);
  if (range.surely_missed) return {not_this};
  const bool in_interval = answer.t >= ray.t_min && answer.t <= ray.t_max;
  const Range told = written(range, ray, answer);
  const double difference = std::abs(answer.t - told.t);
  if (!in_interval || !(difference <= told.t_error) || wrong_weights(answer, told)) return {Verdict::WrongT};
  const double share = told.t_error > 0 ? difference / told.t_error : 0;
  if (answer.prim == truth.prim) return {Verdict::Same, share};
  if (truth.prim == NO_HIT) return {Verdict::Tie};
  if (want == Want::Any) return {Verdict::Same, share};
  // Twins have the same t, so the smaller number must win, unless its box may be missed. For WoopAffine, boxes tested
  // by multiply-add may cull one of the twins at that very t. For MoellerTrumbore, a ray along a face of a box may miss
  // it, and boxes of twins may differ in what their layout rounds; a ray that surely hits the twins lies within all
  // faces.
  const bool meets_both =
      ray.arithmetic == Arithmetic::MoellerTrumbore ? range.surely_hit : ray.arithmetic != Arithmetic::WoopAffine;
  if (meets_both && has_earlier_twin(bvh, ray, answer.prim, triangle)) return {Verdict::WrongPrim};
  const double before = is_double(ray) ? std::max(range.t_low(), answer.t - ulp(answer.t)) : double(answer.t);
  return {surely_nearer(bvh, ray, before) ? Verdict::WrongPrim : Verdict::Tie};
}

// Judges an answer about a mesh. `answer` and `truth` have the mesh's own numbers.
Opinion judge_in(const OracleScene& scene, const PlacedMesh& mesh, const Hit& answer, const OracleHit& truth, Want want,
                 Arithmetic arithmetic) {
  const bool missed = answer.prim == NO_HIT;
  if (is_dead(mesh.ray)) return {missed ? Verdict::Same : Verdict::FalseHit};
  RayFrame frame(mesh.ray, mesh.tree.bounds);
  frame.arithmetic = arithmetic;
  const std::uint32_t texel = scene.leaf_texel_of(mesh.mesh, answer.prim);
  if (arithmetic == Arithmetic::Exact) return judge_exactly(mesh.tree, frame, answer, texel, truth, want);
  if (missed) return judge_miss(mesh.tree, frame, truth);
  return judge_hit(mesh.tree, frame, answer, texel, truth, want);
}

// Returns the allowance for a triangle that a leaf of a mesh holds, with t of the mesh's ray.
Allowance allowance_in(const PlacedMesh& mesh, std::uint32_t texel, Arithmetic arithmetic) {
  RayFrame frame(mesh.ray, mesh.tree.bounds);
  frame.arithmetic = arithmetic;
  const Triangle triangle = decode_triangle(mesh.tree, texel);
  const Range range = range_of(frame, triangle);
  if (arithmetic == Arithmetic::Exact) return {{kUnbounded, kUnbounded, kUnbounded}, ulp(range.t)};
  if (arithmetic == Arithmetic::WoopAffine) {
    const double w = range.weight_error;
    return {{std::abs(1 - range.u - range.v) / (2 * w), std::abs(range.u) / w, std::abs(range.v) / w}, range.t_error};
  }
  const Sight sight(frame, triangle);
  const SideErrors errors = side_errors(frame, sight);
  Allowance out{{}, range.t_error};
  for (int i = 0; i < 3; ++i) out.edge[i] = std::abs(sight.side[i]) / errors.side[i];
  return out;
}

bool is_error(Verdict v) { return v != Verdict::Same && v != Verdict::Tie; }

Hit in_mesh(const PlacedMesh& mesh, const Hit& answer) {
  return {answer.t / float(mesh.scale), answer.prim - mesh.first, answer.u, answer.v};
}

// Judges an answer about instances.
Opinion judge_among(const OracleScene& scene, const Ray& ray, const Hit& answer, Want want, Arithmetic arithmetic) {
  constexpr Hit kMiss{std::numeric_limits<float>::infinity(), NO_HIT, 0, 0};
  const bool missed = answer.prim == NO_HIT;
  if (!missed && (is_dead(ray) || !scene.may_have(answer.prim))) return {Verdict::FalseHit};
  if (missed && answer.t != kMiss.t) return {Verdict::WrongT};
  if (is_dead(ray)) return {};
  Opinion opinion;
  const auto add = [&](const PlacedMesh& mesh, const Hit& given) {
    const Opinion one = judge_in(scene, mesh, given, nearest_in(mesh), want, arithmetic);
    if (one.verdict != Verdict::Same && !is_error(opinion.verdict)) opinion.verdict = one.verdict;
    opinion.t_error = std::max(opinion.t_error, one.t_error);
  };
  std::optional<PlacedMesh> named;
  double before = 0;  // t on the scale of object-space rays that no other instance's hit may be before
  if (!missed) {
    named.emplace(scene.mesh_of(ray, answer.prim));
    const Hit given = in_mesh(*named, answer);
    add(*named, given);
    if (is_error(opinion.verdict) || want == Want::Any) return opinion;
    before = double(given.t) - allowance_in(*named, scene.leaf_texel_of(named->mesh, given.prim), arithmetic).t;
    if (arithmetic == Arithmetic::WoopInDouble) before -= ulp(given.t);  // it was rounded to float32
  }
  scene.for_each(ray, [&](PlacedMesh mesh) {
    if (is_error(opinion.verdict) || (named && mesh.first == named->first)) return;
    if (named) mesh.ray.t_max = before;
    add(mesh, kMiss);
    if (opinion.verdict == Verdict::FalseMiss && named) opinion.verdict = Verdict::WrongPrim;
  });
  return opinion;
}

// Judges an answer about a scene.
Opinion judge_one(const OracleScene& scene, const Ray& ray, const Hit& answer, const OracleHit& truth, Want want,
                  Arithmetic arithmetic) {
  if (scene.forest()) return judge_among(scene, ray, answer, want, arithmetic);
  return judge_in(scene, {*scene.trees()[0], {}, in_double(ray)}, answer, truth, want, arithmetic);
}

const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::Same:
      return "same";
    case Verdict::Tie:
      return "tie";
    case Verdict::FalseMiss:
      return "false miss";
    case Verdict::FalseHit:
      return "false hit";
    case Verdict::WrongPrim:
      return "wrong prim";
    case Verdict::WrongT:
      return "wrong t";
  }
  return "?";
}

std::string in_words(std::size_t index, Verdict verdict, const Ray& r, const Hit& a, const OracleHit& truth) {
  const auto prim = [](std::uint32_t p) { return p == NO_HIT ? std::string("a miss") : fmt::format("prim {}", p); };
  return fmt::format(
      "ray {} ({} {} {}, t_min {}, direction {} {} {}, t_max {}): {}: answer is {} at t {}, u {}, v {}; the oracle "
      "says {} at t {}, u {}, v {}",
      index, r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, r.t_max, name_of(verdict),
      prim(a.prim), a.t, a.u, a.v, prim(truth.prim), truth.t, truth.u, truth.v);
}

}  // namespace

void Judgement::add(Verdict verdict) {
  ++rays;
  std::uint64_t* const of[] = {&same, &tie, &false_miss, &false_hit, &wrong_prim, &wrong_t};  // in the order of Verdict
  ++*of[static_cast<int>(verdict)];
}

Allowance Oracle::allowance(const Ray& ray, std::uint32_t prim, Arithmetic arithmetic) const {
  std::uint32_t texel = NO_HIT;
  std::optional<PlacedMesh> mesh;
  if (scene_.may_have(prim)) {
    mesh.emplace(scene_for(arithmetic).mesh_of(ray, prim));
    texel = scene_.leaf_texel_of(mesh->mesh, prim - mesh->first);
  }
  if (texel == NO_HIT) fail(Failure::Arguments, "oracle: no leaf of the hierarchy holds prim {}", prim);
  Allowance allowed = allowance_in(*mesh, texel, arithmetic);
  allowed.t *= mesh->scale;
  return allowed;
}

Verdict Oracle::judge(const Ray& ray, const Hit& answer, const OracleHit& truth, Want want,
                      Arithmetic arithmetic) const {
  return judge_one(scene_for(arithmetic), ray, answer, truth, want, arithmetic).verdict;
}

Verdict Oracle::judge_values(const Ray& ray, const Hit& answer, const OracleHit& own, Want want,
                             Arithmetic arithmetic) const {
  const OracleScene& scene = scene_for(arithmetic);
  const PlacedMesh mesh = scene.mesh_of(ray, answer.prim);
  const OracleHit truth{own.t / mesh.scale, own.prim - mesh.first, own.u, own.v};
  return judge_in(scene, mesh, in_mesh(mesh, answer), truth, want, arithmetic).verdict;
}

Judgement Oracle::judge(std::span<const Ray> rays, std::span<const Hit> answers, std::span<const OracleHit> truth,
                        Want want, Arithmetic arithmetic) const {
  if (rays.size() != answers.size() || rays.size() != truth.size())
    fail(Failure::Arguments, "oracle: {} rays, {} answers and {} truths; their numbers must agree", rays.size(),
         answers.size(), truth.size());
  const OracleScene& scene = scene_for(arithmetic);
  std::vector<Opinion> opinions(rays.size());
  for_chunks(rays.size(), scene.forest() ? kRaysOfInstances : kRaysPerJudgeChunk,
             [&](std::size_t begin, std::size_t end) {
               for (std::size_t i = begin; i < end; ++i)
                 opinions[i] = judge_one(scene, rays[i], answers[i], truth[i], want, arithmetic);
             });
  Judgement sum;
  for (std::size_t i = 0; i < opinions.size(); ++i) {
    sum.add(opinions[i].verdict);
    if (opinions[i].verdict == Verdict::Same) sum.worst_t_error = std::max(sum.worst_t_error, opinions[i].t_error);
    if (is_error(opinions[i].verdict) && sum.examples.size() < kMaxExamples)
      sum.examples.push_back(in_words(i, opinions[i].verdict, rays[i], answers[i], truth[i]));
  }
  return sum;
}

}  // namespace ballot
