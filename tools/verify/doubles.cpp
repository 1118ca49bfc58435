#include "tools/verify/doubles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "tools/bench/markdown.h"

namespace ballot::verify {

namespace {

constexpr const char* kMethod = "while-while";

using Long = long double;
using LongVec = std::array<Long, 3>;

LongVec minus(const glm::dvec3& a, const glm::dvec3& b) { return {Long(a.x) - b.x, Long(a.y) - b.y, Long(a.z) - b.z}; }
LongVec cross(const LongVec& a, const LongVec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Long dot(const LongVec& a, const LongVec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Returns t where a ray meets a triangle, negative if it does not: volumes of the tetrahedra of ray and edges.
Long meet(const RayInDouble& ray, const CornersInDouble& t) {
  const LongVec d{ray.dir.x, ray.dir.y, ray.dir.z};
  const std::array<LongVec, 3> v{minus(t[0], ray.origin), minus(t[1], ray.origin), minus(t[2], ray.origin)};
  Long least = 0, most = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Long side = dot(d, cross(v[i], v[(i + 1) % 3]));
    least = std::min(least, side), most = std::max(most, side);
  }
  if (least < 0 && most > 0) return -1;
  const LongVec normal = cross(minus(t[1], t[0]), minus(t[2], t[0]));
  const Long along = dot(normal, d);
  return along == 0 ? -1 : dot(normal, v[0]) / along;
}

Scene scene_of(const std::string& name, std::span<const CornersInDouble> corners, const glm::dvec3& origin) {
  Scene scene;
  scene.name = name;
  scene.origin = origin;
  for (const CornersInDouble& t : corners)
    scene.triangles.push_back({glm::vec3(t[0]), glm::vec3(t[1]), glm::vec3(t[2])});
  finish_scene(scene);
  return scene;
}

double per_second(std::size_t rays, double seconds) { return seconds > 0 ? double(rays) / seconds : 0; }

}  // namespace

DoubleCase::DoubleCase(const HardDoubleCase& hard, DeviceSceneOptions options, bool quick)
    : name_(hard.name), options_(std::move(options)), given_(hard.make(quick)) {
  glm::dvec3 lo = given_.triangles[0][0], hi = lo;
  for (const CornersInDouble& t : given_.triangles)
    for (const glm::dvec3& v : t) lo = glm::min(lo, v), hi = glm::max(hi, v);
  const glm::dvec3 origin = origin_for(lo, hi);
  for (const CornersInDouble& t : given_.triangles) about_.push_back({t[0] - origin, t[1] - origin, t[2] - origin});
  options_.use_cache = false;
  options_.build.keeps_flat = true;
  world_.emplace(scene_of(name_, about_, origin), options_);
  options_.context = world_->context();
  options_.context->set_answers_few(false);  // by the host: kernels are compared
  world_->tracer().tree().set_doubles(std::make_shared<DoubleCorners>(about_, std::vector<std::size_t>{0}, 0.f));
  truth_.resize(given_.rays.size());
  for_chunks(truth_.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) truth_[i] = true_hit(given_.rays[i]);
  });
}

DoubleCase::Found DoubleCase::true_hit(const RayInDouble& ray) const {
  Found best;
  Long nearest = 0;
  for (std::uint32_t prim = 0; prim < given_.triangles.size(); ++prim) {
    const Long t = meet(ray, given_.triangles[prim]);
    if (t >= 0 && (best.prim == NO_HIT || t < nearest)) nearest = t, best = {double(t), prim};
  }
  return best;
}

DoubleRecord DoubleCase::compare(const std::string& way, std::span<const Found> found, double seconds) const {
  DoubleRecord r{.name = name_, .way = way, .rays = found.size(), .rays_per_s = per_second(found.size(), seconds)};
  std::vector<double> errors;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Found &one = found[i], &truth = truth_[i];
    r.other_hits += (one.prim == NO_HIT) != (truth.prim == NO_HIT);
    if (one.prim == NO_HIT || truth.prim == NO_HIT) continue;
    r.other_prims += one.prim != truth.prim;
    errors.push_back(std::abs(one.t - truth.t) * glm::length(given_.rays[i].dir));
  }
  if (errors.empty()) return r;
  std::ranges::sort(errors);
  r.median = errors[errors.size() / 2], r.most = errors.back();
  return r;
}

std::vector<DoubleCase::Found> DoubleCase::trace_in_double(double& seconds) {
  const Recentring recentring = world_->recentring();
  std::vector<RayInDouble> rays;
  for (const RayInDouble& ray : given_.rays) rays.push_back(recentring.about(ray));
  std::vector<Hit> hits(rays.size());
  const Query query{.method = kMethod, .numeric = "double"};
  seconds =
      world_->tracer().trace(stream_of(std::span<const RayInDouble>(rays), std::span(hits)), query).device_ms / 1e3;
  std::vector<Found> found;
  for (std::size_t i = 0; i < hits.size(); ++i)
    found.push_back({hits[i].prim == NO_HIT ? 0 : sight_in_double(rays[i], about_[hits[i].prim]).t, hits[i].prim});
  return found;
}

std::vector<DoubleCase::Found> DoubleCase::trace_moved(const std::string& numeric, double& seconds) {
  const Recentring recentring = world_->recentring();
  std::vector<Ray> rays;
  std::vector<double> moved(given_.rays.size());
  for (const RayInDouble& ray : given_.rays) rays.push_back(recentring.ray(ray, moved[rays.size()]));
  std::vector<Hit> hits(rays.size());
  seconds = world_->trace(rays, hits, {.method = kMethod, .numeric = numeric}).device_ms / 1e3;
  std::vector<Found> found;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    RayInDouble ray = recentring.about(given_.rays[i]);
    ray.origin += moved[i] * ray.dir;
    const bool missed = hits[i].prim == NO_HIT;
    found.push_back(
        {missed ? 0 : t_of(ray, world_->triangle(hits[i].prim), double(hits[i].t)) + moved[i], hits[i].prim});
  }
  return found;
}

DoubleRecord DoubleCase::answer(const std::string& numeric) {
  const bool in_double = find_numeric(numeric).triangle == TRIANGLE_DOUBLE;
  const auto trace = [&](double& spent) { return in_double ? trace_in_double(spent) : trace_moved(numeric, spent); };
  double seconds = 0;
  trace(seconds);  // compiles the kernel
  const std::vector<Found> found = trace(seconds);
  if (!in_double) return compare(numeric, found, seconds);
  DoubleRecord r = compare(numeric, found, seconds);
  const OracleInDouble oracle(world_->tracer().pair_tree(NodeLayout::Interleaved), world_->scene().triangles, about_);
  const Recentring recentring = world_->recentring();
  std::vector<std::uint8_t> unlike(found.size());
  for_chunks(found.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      unlike[i] = oracle.brute_force(recentring.about(given_.rays[i])).prim != found[i].prim;
  });
  r.unlike = std::uint64_t(std::ranges::count(unlike, 1));
  return r;
}

DoubleRecord DoubleCase::answer_rounded() {
  DeviceScene world(scene_of(name_, given_.triangles, glm::dvec3(0)), options_);
  std::vector<Ray> rays;
  for (const RayInDouble& ray : given_.rays) rays.push_back(rounded(ray));
  std::vector<Hit> hits(rays.size());
  world.trace(rays, hits, {.method = kMethod});  // compiles the kernel
  const double seconds = world.trace(rays, hits, {.method = kMethod}).device_ms / 1e3;
  std::vector<Found> found;
  for (const Hit& hit : hits) found.push_back({double(hit.t), hit.prim});
  return compare("float32", found, seconds);
}

DoubleRecord DoubleCase::answer_by_all() {
  const OracleInDouble oracle(world_->tracer().pair_tree(NodeLayout::Interleaved), world_->scene().triangles, about_);
  const Recentring recentring = world_->recentring();
  std::vector<Found> found(given_.rays.size());
  const Timer timer;
  for_chunks(found.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const OracleHit hit = oracle.brute_force(recentring.about(given_.rays[i]));
      found[i] = {hit.t, hit.prim};
    }
  });
  return compare("every triangle in float64", found, timer.seconds());
}

std::string double_table(const std::vector<DoubleRecord>& records) {
  bench::Table table({"hard case in double", "way", "rays", "hit for miss", "other prims", "off: median", "largest",
                      "unlike float64", "Mrays/s"},
                     2);
  for (const DoubleRecord& r : records)
    table.row({r.name, r.way, std::to_string(r.rays), std::to_string(r.other_hits), std::to_string(r.other_prims),
               fmt::format("{:.2g}", r.median), fmt::format("{:.2g}", r.most), std::to_string(r.unlike),
               bench::figure(r.rays_per_s / 1e6)});
  return table.empty() ? "" : table.text();
}

std::vector<DoubleRecord> run_double_cases(const std::vector<std::string>& modes, const DeviceSceneOptions& options,
                                           bool quick, const Progress& progress) {
  std::vector<DoubleRecord> records;
  DeviceSceneOptions with = options;
  const std::span<const HardDoubleCase> cases = hard_double_cases();
  for (std::size_t i = 0; i < cases.size(); ++i) {
    progress(double(i) / double(cases.size()));
    DoubleCase one(cases[i], with, quick);
    with.context = one.context();
    records.push_back(one.answer_rounded());
    for (const std::string& mode : modes)
      if (find_numeric(mode).conservative) records.push_back(one.answer(mode));
    records.push_back(one.answer_by_all());
  }
  return records;
}

}  // namespace ballot::verify
