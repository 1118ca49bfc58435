// Rays and points as they lie in memory: any stride, float and double, numbers that stand for all. Answers are those to
// the same questions as packed records, bit for bit.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "api.h"

namespace {

constexpr float kNoEnd = std::numeric_limits<float>::infinity();
using Strides = ballot::Column::Strides;

/// Laid of each of `count` questions in double, `width` of each, somewhere in memory.
class Laid {
 public:
  enum class How { Floats, Doubles, Padded, Backwards, Planar, Unaligned, One };
  static constexpr How kAll[] = {How::Floats, How::Doubles,   How::Padded, How::Backwards,
                                 How::Planar, How::Unaligned, How::One};

  Laid(std::size_t count, std::size_t width, double low, double high, unsigned seed) : count_(count), width_(width) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(low, high);
    for (std::size_t i = 0; i < count * width; ++i) values_.push_back(any(random));
  }
  double& at(std::size_t i, std::size_t axis = 0) { return values_[i * width_ + axis]; }

  /// Lays the numbers out. What lies there before is lost.
  ballot::Column column(How how) {
    using enum How;
    const bool doubles = how == Doubles || how == Padded;
    const auto number = std::ptrdiff_t(doubles ? sizeof(double) : sizeof(float));
    std::ptrdiff_t stride = number * std::ptrdiff_t(width_), step = number, first = 0;
    if (how == Padded) stride += 20;
    if (how == Unaligned) stride += 1, first = 3;
    if (how == Planar) step = number * std::ptrdiff_t(count_), stride = number;
    if (how == Backwards) first = stride * std::ptrdiff_t(count_ - 1), stride = -stride;
    if (how == One) stride = 0;
    memory_.assign(count_ * (width_ * sizeof(double) + 20) + 8, 0x7f);
    for (std::size_t i = 0; i < (how == One ? 1 : count_); ++i)
      for (std::size_t axis = 0; axis < width_; ++axis) {
        char* to = memory_.data() + first + std::ptrdiff_t(i) * stride + std::ptrdiff_t(axis) * step;
        const double value = at(i, axis);
        const auto rounded = float(value);
        std::memcpy(to, doubles ? static_cast<const void*>(&value) : &rounded, std::size_t(number));
      }
    is_one_ = how == One;
    const char* from = memory_.data() + first;
    if (doubles) return {reinterpret_cast<const double*>(from), Strides{stride}, step - number};
    return {reinterpret_cast<const float*>(from), Strides{stride}, step - number};
  }
  /// What a question's number is as float, as it was laid out last.
  float is(std::size_t i, std::size_t axis = 0) { return float(at(is_one_ ? 0 : i, axis)); }

 private:
  std::size_t count_, width_;
  std::vector<double> values_;
  std::vector<char> memory_;
  bool is_one_ = false;
};

template <class T>
void expect_same(const std::vector<T>& a, const std::vector<T>& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(T)), 0);
}

class Sources : public Api {
 protected:
  Sources() {
    for (std::size_t i = 0; i < kCount; ++i) directions_.at(i, 2) = -1 - std::abs(directions_.at(i, 2));
    t_max_.at(3) = 1e300, t_max_.at(4) = std::nan(""), t_max_.at(5) = -1;
    t_min_.at(6) = 5, t_min_.at(7) = -1e300, origins_.at(8, 1) = 1e200, directions_.at(9, 0) = HUGE_VAL;
    origins_.at(10, 2) = 2 + std::ldexp(1.0, -24);
  }
  /// The rays as records, as they were laid out last.
  std::vector<ballot::Ray> records(bool has_t_min, bool has_t_max) {
    std::vector<ballot::Ray> rays(kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        rays[i].origin[axis] = origins_.is(i, axis), rays[i].dir[axis] = directions_.is(i, axis);
      rays[i].t_min = has_t_min ? t_min_.is(i) : 0;
      rays[i].t_max = has_t_max ? t_max_.is(i) : kNoEnd;
    }
    return rays;
  }
  void expect_as_records(const ballot::RayView& view, const std::vector<ballot::Ray>& rays) {
    std::vector<ballot::Hit> expected(kCount), hits(kCount, {7, 7, 7, 7});
    scene_.trace(rays, expected);
    scene_.trace(view, {.hits = hits.data()});
    expect_same(hits, expected);
  }

  static constexpr std::size_t kCount = 300;
  const ballot::Scene scene_{*device_, {grid_.mesh(), Grid(4, 0.5f).mesh()}};
  Laid origins_{kCount, 3, 0, 1, 1}, directions_{kCount, 3, -0.3, 0.3, 2}, t_min_{kCount, 1, -1, 0.6, 3},
      t_max_{kCount, 1, 0, 3, 4};
};

TEST_F(Sources, EveryLayoutOfEveryColumn) {
  for (const auto of_origins : Laid::kAll)
    for (const auto of_directions : Laid::kAll) {
      const auto of_ends = Laid::kAll[(std::size_t(of_origins) + 2 * std::size_t(of_directions)) % 7];
      SCOPED_TRACE(testing::Message() << int(of_origins) << int(of_directions) << int(of_ends));
      ballot::RayView view{.origins = origins_.column(of_origins), .directions = directions_.column(of_directions)};
      view.shape = {kCount};
      expect_as_records(view, records(false, false));
      view.t_max = t_max_.column(of_ends);
      expect_as_records(view, records(false, true));
      view.t_min = t_min_.column(of_directions);
      expect_as_records(view, records(true, true));
      const auto rays = records(true, true);
      EXPECT_EQ(scene_.count_crossings(view), scene_.count_crossings(rays));
      expect_same(scene_.crossings(view).hits, scene_.crossings(rays).hits);
      std::vector<float> expected(kCount), t(kCount);
      scene_.trace(rays, {.t = expected.data()}, {.any = true});
      scene_.submit(view, {.t = t.data()}, {.any = true}).wait();
      for (std::size_t i = 0; i < kCount; ++i) EXPECT_EQ(t[i] < kNoEnd, expected[i] < kNoEnd) << i;
    }
}

// Rays whose columns share axes but have different ones as the fastest: every origin with every direction, and parts of
// larger arrays.
TEST_F(Sources, AxesOfRays) {
  constexpr std::size_t kRows = 12, kInRow = 25;
  const auto o = origins_.column(Laid::How::Floats), d = directions_.column(Laid::How::Doubles);
  const auto* origins = static_cast<const float*>(o.data);
  const auto* directions = static_cast<const double*>(d.data);
  std::vector<ballot::Ray> rays;
  for (std::size_t row = 0; row < kRows; ++row)
    for (std::size_t k = 0; k < kInRow; ++k)
      rays.push_back({{origins_.is(row, 0), origins_.is(row, 1), origins_.is(row, 2)},
                      0,
                      {directions_.is(k, 0), directions_.is(k, 1), directions_.is(k, 2)},
                      9});
  expect_as_records(
      {.origins = {origins, {12, 0}}, .directions = {directions, {0, 24}}, .t_max = 9, .shape = {kRows, kInRow}}, rays);
  // Every other one of 6 x 10 x 5, the second axis backwards, as eight axes.
  rays.clear();
  for (std::size_t a = 0; a < 6; ++a)
    for (std::size_t b = 0; b < 10; ++b)
      for (std::size_t c = 0; c < 5; ++c) {
        const std::size_t i = a * 50 + (9 - b) * 5 + c;
        rays.push_back({{origins_.is(i, 0), origins_.is(i, 1), origins_.is(i, 2)},
                        0,
                        {directions_.is(b, 0), directions_.is(b, 1), directions_.is(b, 2)},
                        kNoEnd});
      }
  expect_as_records({.origins = {origins + 3 * 45, {600, 0, -60, 0, 0, 12, 0, 0}},
                     .directions = {directions, {0, 0, 24, 0, 0, 0, 0, 0}},
                     .shape = {6, 1, 10, 1, 1, 5, 1, 1}},
                    rays);
}

// Rays in rows, which are traced in tiles, and large arrays.
TEST_F(Sources, RowsOfOneOrigin) {
  for (const std::size_t width : {37, 640}) {
    const std::size_t height = 411;
    std::vector<float> directions;
    std::vector<ballot::Ray> rays;
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t x = 0; x < width; ++x) {
        const float dx = float(x) / float(width) - 0.5f, dy = float(y) / float(height) - 0.5f;
        directions.insert(directions.end(), {dx, dy, -1});
        rays.push_back({{0.5f, 0.5f, 2}, 0.25f, {dx, dy, -1}, 10});
      }
    std::vector<ballot::Hit> expected(rays.size()), hits(rays.size());
    scene_.trace(rays, expected);
    const ballot::RayView view{.origins = {0.5f, 0.5f, 2}, .directions = directions, .t_min = 0.25f, .t_max = 10};
    const ballot::Times times = scene_.trace(view, {.hits = hits.data()});
    expect_same(hits, expected);
    EXPECT_GT(times.hits, rays.size() / 3);
    std::vector<ballot::Hit> later(rays.size());
    ballot::Job job = scene_.submit({.origins = {0.5f, 0.5f, 2}, .directions = directions, .t_min = 0.25f, .t_max = 10},
                                    {.hits = later.data()});  // what stands for all is read now
    job.wait();
    expect_same(later, expected);
  }
}

// What float32 arithmetic makes of a ray and a pose, as BallotRays says.
ballot::Ray moved(const ballot::Ray& ray, const std::array<float, 12>& m) {
  ballot::Ray to = ray;
  const auto& o = ray.origin;
  const auto& d = ray.dir;
  for (std::size_t i = 0; i < 3; ++i) {
    const float* r = &m[4 * i];
    to.origin[i] = ((r[0] * o[0] + r[1] * o[1]) + r[2] * o[2]) + r[3];
    to.dir[i] = (r[0] * d[0] + r[1] * d[1]) + r[2] * d[2];
  }
  return to;
}

TEST_F(Sources, PosesOfEveryLayout) {
  Laid poses(kCount, 12, -1, 1, 7);
  poses.at(4, 7) = std::nan("");
  for (const auto how : Laid::kAll) {
    SCOPED_TRACE(int(how));
    const ballot::RayView view{.origins = origins_.column(Laid::How::Padded),
                               .directions = directions_.column(Laid::How::Floats),
                               .t_max = t_max_.column(Laid::How::One),
                               .poses = poses.column(how),
                               .shape = {kCount}};
    std::vector<ballot::Ray> rays = records(false, true);
    for (std::size_t i = 0; i < kCount; ++i) {
      std::array<float, 12> pose;
      for (std::size_t k = 0; k < 12; ++k) pose[k] = poses.is(i, k);
      rays[i] = moved(rays[i], pose);
    }
    expect_as_records(view, rays);
    EXPECT_EQ(scene_.count_crossings(view), scene_.count_crossings(rays));
  }
}

TEST_F(Sources, DirectionsFromPosesAndGrids) {
  std::vector<float> directions, poses;
  std::vector<ballot::Ray> rays;
  for (std::size_t i = 0; i < kCount / 6; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) directions.push_back(directions_.is(i, axis));
  for (std::size_t k = 0; k < 6; ++k) {
    const std::array<float, 12> pose{1, 0, 0, 0.1f * float(k), 0, 1, 0.25f, 0.5f, 0, 0.1f, 1, 2};
    poses.insert(poses.end(), pose.begin(), pose.end());
    for (std::size_t i = 0; i < directions.size(); i += 3)
      rays.push_back(moved({{0, 0, 0}, 0, {directions[i], directions[i + 1], directions[i + 2]}, kNoEnd}, pose));
  }
  expect_as_records(ballot::from_poses(directions, poses), rays);

  const std::vector<float> x{0, 0.25f, 0.5f}, y{0.125f, 1}, z{-1, 0, 1, 2};
  std::vector<float> points, found(24), expected(24);
  for (const float a : x)
    for (const float b : y)
      for (const float c : z) points.insert(points.end(), {a, b, c});
  scene_.nearest(points, {.distances = expected.data()});
  scene_.nearest(ballot::grid(x, y, z), {.distances = found.data()});
  expect_same(found, expected);
  scene_.nearest({.x = 0.25f, .y = 1, .z = z}, {.distances = found.data()});  // one axis, the others one for all
  for (std::size_t i = 0; i < z.size(); ++i) EXPECT_EQ(found[i], expected[12 + i]);
}

TEST_F(Sources, LayoutsOfPoints) {
  Laid points(kCount, 3, -1, 2, 5), limits(kCount, 1, 0.1, 1, 6);
  points.at(3, 1) = 1e200, points.at(4, 0) = std::nan("");
  limits.at(5) = HUGE_VAL, limits.at(6) = -1, limits.at(7) = std::nan("");
  for (const auto how : Laid::kAll) {
    SCOPED_TRACE(int(how));
    ballot::PointView view{.at = points.column(how), .shape = {kCount}};
    std::vector<float> xyz, found(kCount), near(3 * kCount), expected(kCount), expected_near(3 * kCount);
    for (std::size_t i = 0; i < kCount; ++i) xyz.insert(xyz.end(), {points.is(i, 0), points.is(i, 1), points.is(i, 2)});
    scene_.nearest(view, {.distances = found.data(), .points = near.data()});
    scene_.nearest(xyz, {.distances = expected.data(), .points = expected_near.data()});
    expect_same(found, expected);
    expect_same(near, expected_near);
    for (const auto of_limits : {Laid::How::Floats, Laid::How::Padded, Laid::How::One}) {
      view.limit = limits.column(of_limits);
      scene_.nearest(view, {.distances = found.data()});
      for (std::size_t i = 0; i < kCount; ++i)
        EXPECT_EQ(found[i], expected[i] <= limits.is(i) ? expected[i] : kNoEnd) << i;
    }
  }
}

TEST_F(Sources, ViewsThatDoNotFit) {
  const std::vector<float> four(12, 1.0f), three(9, 1.0f);
  float t[4] = {7, 7, 7, 7};
  const auto refused = [&](const ballot::RayView& view, const char* part) {
    std::string text;
    EXPECT_EQ(code_of([&] { scene_.trace(view, {.t = t}); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  refused({.origins = four, .directions = three},
          "rays: directions has 3 for 4 rays; expected as many, or one for all");
  refused({.origins = four, .directions = four, .t_max = three}, "rays: t_max has 9 for 4 rays");
  refused({.origins = four, .directions = four, .shape = {2, 3}}, "rays: origins has 4 for 6 rays");
  refused({.origins = std::span(four).first(5), .directions = four}, "rays: origins has 5 numbers; expected 3 of each");
  refused({.origins = 1, .directions = four}, "rays: origins has 1 numbers; expected 3 of each");
  refused({.origins = four, .directions = {}}, "rays: the data of direction are NULL, but there are 4");
  std::vector<float> pose(12, 1.0f);
  refused({.origins = four, .directions = four, .poses = three}, "rays: poses has 9 numbers; expected 12 of each");
  refused({.origins = four, .directions = four, .poses = std::vector<float>(36)}, "rays: poses has 3 for 4 rays");
  pose[5] = kNoEnd;
  refused({.origins = four, .directions = four, .poses = pose}, "rays: number 5 of the pose is inf; expected finite");
  const auto refused_points = [&](const ballot::PointView& view, const char* part) {
    std::string text;
    EXPECT_EQ(code_of([&] { scene_.nearest(view, {.distances = t}); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  refused_points({.at = four, .limit = three}, "points: limit has 9 for 4 points");
  refused_points({.at = four, .x = 1.0f}, "points: at is given beside x, y and z; expected the one or the others");
  refused_points({.x = three, .z = 1.0f}, "points: the data of y are NULL, but there are 9");
  refused_points({.x = three, .y = std::span(three).first(2), .z = 1.0f}, "points: y has 2 for 9 points");
  EXPECT_EQ(t[0], 7);
  const std::vector<double> none;
  scene_.trace({.origins = four, .directions = four, .shape = {4}}, {.t = t});
  EXPECT_EQ(scene_.trace({.origins = none, .directions = {0, 0, 1}}, {.t = t}).hits, 0u);
}

}  // namespace
