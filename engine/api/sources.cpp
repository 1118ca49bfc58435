#include "engine/api/sources.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

namespace ballot::api {

namespace {

constexpr float kNoBound = std::numeric_limits<float>::max();
constexpr float kNoLimit = std::numeric_limits<float>::infinity();
constexpr const char* kAxes[] = {"x", "y", "z"};
static_assert(sizeof(BallotRay) == sizeof(Ray) && sizeof(ProbePoint) == 4 * sizeof(float));

using Pose = std::array<float, kMostNumbers>;

/// Moves a ray. Each product and sum is rounded, in this order, as in shaders/query/made.comp.
void move_ray(const Pose& m, Ray& ray) {
  const glm::vec3 o = ray.origin, d = ray.dir;
  for (int row = 0; row < 3; ++row) {
    const float* r = &m[std::size_t(4 * row)];
    ray.origin[row] = ((r[0] * o.x + r[1] * o.y) + r[2] * o.z) + r[3];
    ray.dir[row] = (r[0] * d.x + r[1] * d.y) + r[2] * d.z;
  }
}

/// Returns what has the tables on a device and makes questions of them; nothing without tables.
template <class Question>
MakeQuestions<Question> maker(Context& gpu, const std::optional<QuestionTables>& tables) {
  if (!tables) return {};
  return [made = std::make_shared<QuestionMaker>(gpu, *tables)](
             std::uint64_t first, std::uint32_t count, const Buffer<Question>& to) { made->record(first, count, to); };
}

}  // namespace

FilterColumns::FilterColumns(const char* what, const Shape& shape, const BallotColumn& masks,
                             const BallotColumn& excluded, const BallotColumn& groups) {
  const auto lane = [&](const char* name, const BallotColumn& given) {
    return Lane(read_column({.what = what, .name = name, .words = true}, shape, given), shape);
  };
  lanes_[FILTER_MASK] = lane("mask", masks);
  lanes_[FILTER_EXCLUDED] = lane("excluded", excluded);
  lanes_[FILTER_GROUP] = lane("group", groups);
}

FilterReaders FilterColumns::readers(const RowOrder& order) const {
  FilterReaders readers;
  for (std::size_t f = 0; f < FILTERS; ++f)
    if (has(f))
      readers.of[f] = [this, f, order](std::uint64_t first, std::span<std::uint32_t> room) {
        order.for_runs(std::size_t(first), room.size(),
                       [&](std::size_t i, std::size_t place, std::size_t n) { read(f, place, room.subspan(i, n)); });
      };
  return readers;
}

void FilterColumns::read(std::size_t filter, std::size_t place, std::span<std::uint32_t> to) const {
  const Lane& lane = lanes_[filter];
  if (!lane.column().data) {
    std::ranges::fill(to, lane.column().own[0]);
    return;
  }
  lane.for_runs(place, to.size(), [&](std::size_t i, std::size_t n, const char* from, std::ptrdiff_t stride) {
    for (const std::size_t end = i + n; i < end; ++i, from += stride) std::memcpy(&to[i], from, sizeof to[i]);
  });
}

PoseColumn::PoseColumn(const Column& column, const Shape& shape) : lane_(column, shape) {
  if (!column.is_given || column.data) return;
  for (unsigned k = 0; k < kMostNumbers; ++k)
    if (!std::isfinite(column.own_number(k)))
      refuse(fmt::format("rays: number {} of the pose is {}; expected finite numbers, which float32 can hold", k,
                         column.own_number(k)));
}

void PoseColumn::move(std::size_t place, std::span<Ray> rays) const {
  Pose pose;
  const Column& c = lane_.column();
  if (!c.data) {
    for (unsigned k = 0; k < kMostNumbers; ++k) pose[k] = c.own_number(k);
    for (Ray& ray : rays) move_ray(pose, ray);
    return;
  }
  lane_.for_runs(place, rays.size(), [&](std::size_t i, std::size_t n, const char* from, std::ptrdiff_t stride) {
    for (std::size_t k = 0; k < n; ++k, from += stride) {
      if (k == 0 || stride)
        for (unsigned number = 0; number < kMostNumbers; ++number) pose[number] = c.number(from, number);
      move_ray(pose, rays[i + k]);
    }
  });
}

RayLanes::RayLanes(const Shape& shape, const std::array<Column, 4>& columns, const Column& pose)
    : origin_(columns[0], shape),
      t_min_(columns[1], shape),
      direction_(columns[2], shape),
      t_max_(columns[3], shape),
      pose_(pose, shape) {}

void RayLanes::read(std::size_t place, std::span<RayInDouble> to) const {
  const std::size_t n = to.size();
  std::ranges::fill(to, RayInDouble{});
  origin_.for_doubles(place, n, [&](std::size_t i, const auto& v) { to[i].origin = {v[0], v[1], v[2]}; });
  direction_.for_doubles(place, n, [&](std::size_t i, const auto& v) { to[i].dir = {v[0], v[1], v[2]}; });
  t_min_.for_doubles(place, n, [&](std::size_t i, const auto& v) { to[i].t_min = v[0]; });
  t_max_.for_doubles(place, n, [&](std::size_t i, const auto& v) { to[i].t_max = v[0]; });
  pose_.for_doubles(place, n, [&](std::size_t i, const auto& m) {
    const auto turned = [&](const glm::dvec3& v) {
      return glm::dvec3(m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
                        m[8] * v.x + m[9] * v.y + m[10] * v.z);
    };
    to[i].origin = turned(to[i].origin) + glm::dvec3(m[3], m[7], m[11]), to[i].dir = turned(to[i].dir);
  });
}

bool RayLanes::any_far(const Recentring& of) const {
  if (pose_ || !(origin_.column().is_double || direction_.column().is_double)) return false;
  const Lane all = origin_.entries();
  std::atomic<bool> any{false};
  for_chunks(all.count(), kChunk, [&](std::size_t begin, std::size_t end) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    glm::dvec3 lo(kInfinity), hi(-kInfinity);
    all.for_doubles(begin, end - begin, [&](std::size_t, const auto& v) {
      for (int axis = 0; axis < 3; ++axis) {
        const double x = v[std::size_t(axis)];
        lo[axis] = x < lo[axis] ? x : lo[axis], hi[axis] = x > hi[axis] ? x : hi[axis];
      }
    });
    if (of.holds(lo, hi)) return;
    all.for_doubles(begin, end - begin, [&](std::size_t, const auto& v) {
      if (of.is_far({v[0], v[1], v[2]})) any = true;
    });
  });
  return any;
}

WeightColumn::WeightColumn(const Shape& shape, const BallotColumn& given)
    : lane_(read_column({"rays", "weight"}, shape, given), shape) {}

void WeightColumn::read(std::size_t place, std::span<float> to) const {
  const Column& c = lane_.column();
  if (!c.data) {
    std::ranges::fill(to, c.is_given ? c.own_number(0) : 1.0f);
    return;
  }
  lane_.for_runs(place, to.size(), [&](std::size_t i, std::size_t n, const char* from, std::ptrdiff_t stride) {
    for (const std::size_t end = i + n; i < end; ++i, from += stride) to[i] = c.number(from, 0);
  });
}

std::uint32_t WeightColumn::largest(std::size_t count) const {
  if (!lane_.column().data) count = std::min(count, std::size_t{1});
  const auto largest_of = [&](std::size_t begin, std::size_t end) {
    std::vector<float> some(end - begin);
    read(begin, some);
    std::uint32_t largest = 0;
    for (std::size_t i = 0; i < some.size(); ++i) {
      largest = std::max(largest, SumUnit::size_of(some[i]));
      if (!SumUnit::is_finite(largest)) break;
    }
    return largest;
  };
  const auto larger = [](std::uint32_t a, std::uint32_t b) { return std::max(a, b); };
  const std::uint32_t largest = joined_chunks(count, kChunk, 0u, largest_of, larger);
  if (SumUnit::is_finite(largest)) return largest;
  float weight = 1;
  std::size_t first = 0;
  for (read(0, {&weight, 1}); SumUnit::is_finite(SumUnit::size_of(weight)); read(first, {&weight, 1})) ++first;
  refuse(fmt::format("rays: weight of ray {} is {}; expected finite numbers, which float32 can hold", first, weight));
}

RayArray::RayArray(const BallotRays& rays)
    : shape_(read_shape("rays", rays.shape)),
      origin_(read_column({"rays", "origin", 3, true}, shape_, rays.origin)),
      t_min_(read_column({"rays", "t_min"}, shape_, rays.t_min)),
      direction_(read_column({"rays", "direction", 3, true}, shape_, rays.direction)),
      t_max_(read_column({"rays", "t_max"}, shape_, rays.t_max)),
      pose_(read_column({"rays", "pose", kMostNumbers}, shape_, rays.pose)),
      columns_(shape_, {origin_, t_min_, direction_, t_max_}, {0, 0, 0, 0, 0, 0, 0, kNoBound}, kNoBound),
      poses_(pose_, shape_),
      lanes_(shape_, {origin_, t_min_, direction_, t_max_}, pose_),
      filters_("rays", shape_, rays.mask, rays.excluded, rays.group),
      weights_(shape_, rays.weight) {}

void RayArray::read(const RowOrder& order, std::size_t first, std::span<Ray> rays) const {
  auto* records = reinterpret_cast<Columns<8>::Record*>(rays.data());
  for_chunks(rays.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    order.for_runs(first + begin, end - begin, [&](std::size_t i, std::size_t place, std::size_t n) {
      if (recentring_) return recentre(place, rays.subspan(begin + i, n));
      columns_.read(place, n, records + begin + i);
      if (poses_) poses_.move(place, rays.subspan(begin + i, n));
    });
  });
}

void RayArray::ask(const SceneState& scene, bool as_double) {
  Recentring asked = scene.world->recentring();
  if (as_double) asked.stay();
  if (as_double && asked.origin() == glm::dvec3(0)) return;
  if (asked.origin() != glm::dvec3(0) || lanes_.any_far(asked)) recentring_ = asked;
}

/// Reads rays in double and moves them.
void RayArray::recentre(std::size_t place, std::span<Ray> rays) const {
  std::array<RayInDouble, 64> given;
  for (std::size_t i = 0; i < rays.size(); i += given.size()) {
    const std::span some = std::span(given).first(std::min(given.size(), rays.size() - i));
    read_given(place + i, some);
    double moved;
    for (std::size_t k = 0; k < some.size(); ++k) rays[i + k] = recentring_->ray(some[k], moved);
  }
}

bool RayArray::in_double() const {
  const auto is_double = [](const Column& c) { return c.is_double; };
  return recentring_ || std::ranges::any_of(std::array{origin_, t_min_, direction_, t_max_, pose_}, is_double);
}

void RayArray::read_in_double(const RowOrder& order, std::size_t first, std::span<RayInDouble> rays) const {
  const Recentring about = recentring_.value_or(Recentring(glm::dvec3(0), {}));
  for_chunks(rays.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    order.for_runs(first + begin, end - begin, [&](std::size_t i, std::size_t place, std::size_t n) {
      const std::span<RayInDouble> some = rays.subspan(begin + i, n);
      read_given(place, some);
      for (RayInDouble& ray : some) ray = about.about(ray);
    });
  });
}

const Ray* RayArray::in_place(std::size_t first, std::size_t count) const {
  const auto* records = poses_ || recentring_ ? nullptr : columns_.packed();
  if (!records) return nullptr;
  std::atomic<bool> as_they_are{true};
  for_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (records[first + i].back() > kNoBound) as_they_are = false;
  });
  return as_they_are ? reinterpret_cast<const Ray*>(records + first) : nullptr;
}

MakeQuestions<Ray> RayArray::make_there(Context& gpu, const RowOrder& order) const {
  if (recentring_ || StreamRing::of(gpu).is_alone()) return {};
  const TableOf columns[] = {{origin_}, {t_min_}, {direction_}, {t_max_, {kNoBound}, kNoBound}, {pose_}};
  const std::span<const TableOf> all(columns);
  return maker<Ray>(gpu, poses_ ? tables_of(Made::PosedRays, shape_, order, all)
                                : tables_of(Made::Rays, shape_, order, all.first(4)));
}

PointArray::PointArray(const BallotPoints& points, bool needs_limit)
    : shape_(read_shape("points", points.shape)),
      at_(read_column({"points", "at", 3, !points.x.data && !points.y.data && !points.z.data}, shape_, points.at)),
      limit_(read_column({"points", "limit", 1, needs_limit}, shape_, points.limit)),
      columns_(shape_, {at_, limit_}, {0, 0, 0, kNoLimit}, kNoLimit),
      filters_("points", shape_, points.mask, points.excluded, points.group),
      at_lane_(at_, shape_) {
  const BallotColumn* const given[] = {&points.x, &points.y, &points.z};
  const bool by_axes = std::ranges::any_of(given, [](const BallotColumn* c) { return c->data; });
  if (by_axes && points.at.data) refuse("points: at is given beside x, y and z; expected the one or the others");
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    axes_[k] = by_axes ? read_column({"points", kAxes[k], 1, true}, shape_, *given[k]) : at_;
    if (by_axes) {
      lanes_[k] = Lane(axes_[k], shape_);
      continue;
    }
    axes_[k].numbers = 1, axes_[k].own[0] = at_.own[k];
    if (at_.data) axes_[k].data += std::ptrdiff_t(k) * at_.step;
  }
  const float limit = columns_.common()[3];
  if (!(needs_limit ? limit >= 0 : limit > 0))
    refuse(fmt::format("points: limit is {}; expected a distance {}", limit,
                       needs_limit ? "that is not below 0" : "above 0, or none"));
}

void PointArray::read(std::uint64_t first, std::span<ProbePoint> points) const {
  auto* records = reinterpret_cast<Columns<4>::Record*>(points.data());
  for_chunks(points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    const std::size_t place = std::size_t(first) + begin, n = end - begin;
    columns_.read(place, n, records + begin);
    if (origin_ != glm::dvec3(0)) return recentre(place, points.subspan(begin, n));
    for (int axis = 0; axis < 3; ++axis) {
      const Lane& lane = lanes_[std::size_t(axis)];
      const Column& c = lane.column();
      if (c.is_given && !c.data)
        for (std::size_t i = begin; i < end; ++i) points[i].at[axis] = c.own_number(0);
      if (!c.data) continue;
      lane.for_runs(place, n, [&](std::size_t i, std::size_t some, const char* from, std::ptrdiff_t stride) {
        for (ProbePoint& point : points.subspan(begin + i, some)) point.at[axis] = c.number(from, 0), from += stride;
      });
    }
  });
}

void PointArray::ask(const SceneState& scene) { origin_ = scene.world->scene_facts().origin; }

void PointArray::read_given(std::uint64_t first, std::span<glm::dvec3> points) const {
  at_lane_.for_doubles(std::size_t(first), points.size(), [&](std::size_t i, const auto& v) {
    points[i] = {v[0], v[1], v[2]};
  });
  for (int axis = 0; axis < 3; ++axis)
    lanes_[std::size_t(axis)].for_doubles(std::size_t(first), points.size(),
                                          [&](std::size_t i, const auto& v) { points[i][axis] = v[0]; });
}

/// Reads points in double and counts them from the scene's origin.
void PointArray::recentre(std::uint64_t first, std::span<ProbePoint> points) const {
  std::array<glm::dvec3, 64> given;
  for (std::size_t i = 0; i < points.size(); i += given.size()) {
    const std::span some = std::span(given).first(std::min(given.size(), points.size() - i));
    read_given(first + i, some);
    for (std::size_t k = 0; k < some.size(); ++k) points[i + k].at = glm::vec3(some[k] - origin_);
  }
}

MakeQuestions<ProbePoint> PointArray::make_there(Context& gpu) const {
  if (origin_ != glm::dvec3(0) || StreamRing::of(gpu).is_alone()) return {};
  const TableOf columns[] = {{axes_[0]}, {axes_[1]}, {axes_[2]}, {limit_, {kNoLimit}}};
  return maker<ProbePoint>(gpu, tables_of(Made::Points, shape_, RowOrder(), columns));
}

}  // namespace ballot::api
