// Questions that a device makes of tables: bit for bit those that the host reads, and with the same answers.
#include <list>

#include "engine/api/sources.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

using api::RowOrder;

constexpr std::size_t kChunkOfTests = 1500;

/// Numbers in memory: random, of columns of some questions.
class Laid {
 public:
  explicit Laid(unsigned seed) : random_(seed) {}

  /// Returns a column of a shape, the same for all along an axis as often as not, and always along those of `shared`.
  BallotColumn column(const std::size_t (&shape)[BALLOT_AXES], std::size_t numbers, unsigned shared) {
    BallotColumn c{};
    const bool doubles = random_() % 2;
    const std::size_t size = doubles ? sizeof(double) : sizeof(float);
    c.type = doubles ? BALLOT_FLOAT64 : BALLOT_FLOAT32;
    c.gap = random_() % 3 ? 0 : std::ptrdiff_t(random_() % 9);
    std::size_t bytes = numbers * (size + std::size_t(c.gap)) + random_() % 5, negative = 0;
    for (std::size_t a = BALLOT_AXES; a-- > 0;) {
      if (shape[a] == 0 || (shared >> a & 1) || random_() % 3 == 0) continue;
      c.stride[a] = std::ptrdiff_t(bytes);
      if (random_() % 4 == 0) negative += bytes * (shape[a] - 1), c.stride[a] = -c.stride[a];
      bytes *= shape[a];
    }
    std::vector<char>& memory = memory_.emplace_back(bytes + 16);
    c.data = memory.data() + negative;
    fill(c, shape, numbers, 0, static_cast<char*>(memory.data()) + negative);
    return c;
  }
  std::mt19937& random() { return random_; }

 private:
  void fill(const BallotColumn& c, const std::size_t (&shape)[BALLOT_AXES], std::size_t numbers, std::size_t axis,
            char* to) {
    if (axis < BALLOT_AXES && shape[axis]) {
      for (std::size_t i = 0; i < (c.stride[axis] ? shape[axis] : 1); ++i, to += c.stride[axis])
        fill(c, shape, numbers, axis + 1, to);
      return;
    }
    const std::size_t size = c.type == BALLOT_FLOAT64 ? sizeof(double) : sizeof(float);
    for (std::size_t k = 0; k < numbers; ++k, to += size + std::size_t(c.gap)) {
      const double number = any_(random_);
      const auto rounded = float(number);
      std::memcpy(to, size == sizeof(double) ? static_cast<const void*>(&number) : &rounded, size);
    }
  }

  std::mt19937 random_;
  std::uniform_real_distribution<double> any_{-3, 3};
  std::list<std::vector<char>> memory_;
};

class MadeQuestionsTest : public DeviceTest {
 protected:
  void SetUp() override {
    gpu_->stream_ring().reset();
    StreamRing::of(*gpu_).act_as_gpu(kChunkOfTests);
  }
  void TearDown() override {
    gpu_->stream_ring().reset();
    DeviceTest::TearDown();
  }

  /// Expects that chunks which the device makes are those that read(first, room) has. Returns false if it makes none.
  template <class Question, class Read>
  bool same(const MakeQuestions<Question>& make, std::size_t count, const Read& read) {
    if (!make) return false;
    Buffer<Question> there(*gpu_, kChunkOfTests, Access::Storage, "questions");
    for (const std::size_t first : {std::size_t{0}, count / 3, count - 777}) {
      const std::size_t some = std::min(kChunkOfTests - first % 5, count - first);
      std::vector<Question> made(some), here(some);
      make(first, std::uint32_t(some), there);
      there.download(made);
      read(first, std::span(here));
      EXPECT_EQ(std::memcmp(made.data(), here.data(), some * sizeof(Question)), 0) << first;
    }
    return true;
  }
};

/// Returns a shape of some axes that more than 4096 questions have.
void random_shape(std::mt19937& random, std::size_t axes, std::size_t (&shape)[BALLOT_AXES]) {
  std::size_t count = 1;
  for (std::size_t a = 0; a < axes; ++a) count *= shape[a] = axes < 3 ? 70 + random() % 60 : 2 + random() % 5;
  if (count < 5000) shape[random() % axes] *= 5000 / count + 1;
}

TEST_F(MadeQuestionsTest, RaysOfAnyStrides) {
  Laid laid(1);
  std::size_t made = 0;
  for (int trial = 0; trial < 160; ++trial) {
    SCOPED_TRACE(trial);
    std::mt19937& random = laid.random();
    auto rays = BALLOT_INIT(BallotRays);
    const std::size_t axes = 1 + std::size_t(trial) % BALLOT_AXES;
    random_shape(random, axes, rays.shape);
    const unsigned first = 1, rest = ~1u;
    rays.origin = laid.column(rays.shape, 3, random() % 2 ? ~0u : first);
    rays.direction = laid.column(rays.shape, 3, first);
    if (random() % 2) rays.t_min = laid.column(rays.shape, 1, rest);
    if (random() % 2) rays.t_max = laid.column(rays.shape, 1, random() % 2 ? rest : first);
    if (random() % 3) rays.pose = laid.column(rays.shape, 12, random() % 4 ? rest : ~0u);
    const api::RayArray array(rays);
    for (const std::size_t width : {0, 16, 37, 71}) {
      const RowOrder order(array.count(), width);
      made += same<Ray>(array.make_there(*gpu_, order), array.count(),
                        [&](std::size_t at, std::span<Ray> room) { array.read(order, at, room); });
    }
  }
  EXPECT_GT(made, 300u);
}

TEST_F(MadeQuestionsTest, PointsOfGridsAndOthers) {
  Laid laid(2);
  std::size_t made = 0;
  for (int trial = 0; trial < 80; ++trial) {
    SCOPED_TRACE(trial);
    std::mt19937& random = laid.random();
    auto points = BALLOT_INIT(BallotPoints);
    random_shape(random, 1 + std::size_t(trial) % BALLOT_AXES, points.shape);
    if (trial % 2) {
      points.at = laid.column(points.shape, 3, 1);
    } else {
      points.x = laid.column(points.shape, 1, ~1u), points.y = laid.column(points.shape, 1, ~2u);
      points.z = laid.column(points.shape, 1, ~4u);
    }
    if (random() % 2) points.limit = laid.column(points.shape, 1, random() % 2 ? 1 : ~1u);
    const auto limit_of_all = [&] {
      const auto strides = std::span(points.limit.stride);
      return points.limit.data && std::ranges::all_of(strides, [](std::ptrdiff_t s) { return s == 0; });
    };
    if (limit_of_all()) points.limit = {};
    const api::PointArray array(points);
    made += same<ProbePoint>(array.make_there(*gpu_), array.count(),
                             [&](std::size_t at, std::span<ProbePoint> room) { array.read(at, room); });
  }
  EXPECT_GT(made, 40u);
}

// What rays share is little, or the host sends them as they are.
TEST_F(MadeQuestionsTest, OnlyWhereTheyShareMuch) {
  std::vector<float> numbers(12 * 8192, 1.0f);
  auto rays = BALLOT_INIT(BallotRays);
  rays.shape[0] = 8192;
  rays.origin.data = rays.direction.data = rays.pose.data = numbers.data();
  EXPECT_TRUE(api::RayArray(rays).make_there(*gpu_, {}));
  rays.direction.stride[0] = 12;
  EXPECT_FALSE(api::RayArray(rays).make_there(*gpu_, {}));
  rays.shape[0] = 100, rays.direction.stride[0] = 0;
  EXPECT_FALSE(api::RayArray(rays).make_there(*gpu_, {}));
  gpu_->stream_ring().reset();  // a CPU device reads what the host has
  rays.shape[0] = 8192;
  EXPECT_EQ(bool(api::RayArray(rays).make_there(*gpu_, {})), !gpu_->info().is_cpu());
}

/// A scene of the C interface, and all answers to rays and points there.
class MadeAnswers : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(ballot_device_open(nullptr, &device_), BALLOT_OK);
    const Triangles triangles = shapes::sphere(4);
    auto mesh = BALLOT_INIT(BallotMesh);
    mesh.positions = &triangles[0][0].x, mesh.vertex_count = 3 * triangles.size();
    ASSERT_EQ(ballot_scene_create(device_, &mesh, 1, nullptr, nullptr, &scene_), BALLOT_OK);
    Context& gpu = *api::use(device_)->gpu;
    gpu.set_answers_few(false);
  }
  void TearDown() override { ballot_scene_destroy(scene_), ballot_device_close(device_); }

  using Query = BallotQuery;
  static Query asked(const char* method, const char* numeric, std::uint32_t first = 0) {
    auto query = BALLOT_INIT(BallotQuery);
    query.method.text = method, query.numeric.text = numeric, query.first = first;
    return query;
  }
  /// Hits, counts and lists of rays as bytes.
  std::vector<char> of_rays(const BallotRays& rays, std::size_t count) {
    std::vector<char> all;
    for (const Query& query : {asked(nullptr, nullptr), asked("while-while", "exact"), asked(nullptr, nullptr, 2)}) {
      std::vector<BallotHit> found(count * std::max(query.first, 1u));
      auto hits = BALLOT_INIT(BallotHits);
      hits.hits = found.data();
      EXPECT_EQ(ballot_trace(scene_, &rays, &hits, &query, nullptr), BALLOT_OK) << ballot_scene_error(scene_);
      add(all, found);
    }
    for (const Query& query : {asked(nullptr, nullptr), asked(nullptr, "exact")})
      for (const bool listed : {false, true}) {
        std::vector<std::int64_t> counts(count);
        std::vector<BallotHit> found;
        auto lists = BALLOT_INIT(BallotLists);
        lists.counts = counts.data(), lists.user = &found;
        if (listed) lists.take = &take;
        EXPECT_EQ(ballot_list_crossings(scene_, &rays, &lists, &query, nullptr), BALLOT_OK);
        add(all, counts), add(all, found);
      }
    return all;
  }
  std::vector<char> of_points(const BallotPoints& points, std::size_t count) {
    std::vector<char> all;
    for (const Query& query : {asked(nullptr, nullptr), asked(nullptr, "exact")}) {
      std::vector<float> distances(count), places(3 * count);
      std::vector<std::uint8_t> inside(count);
      auto nearest = BALLOT_INIT(BallotNearest);
      nearest.signed_distances = distances.data(), nearest.points = places.data(), nearest.inside = inside.data();
      EXPECT_EQ(ballot_query_points(scene_, &points, &nearest, &query, nullptr), BALLOT_OK);
      add(all, distances), add(all, places), add(all, inside);
    }
    std::vector<std::int64_t> counts(count);
    std::vector<BallotHit> found;
    auto lists = BALLOT_INIT(BallotLists);
    lists.counts = counts.data(), lists.user = &found, lists.take = &take;
    EXPECT_EQ(ballot_list_within(scene_, &points, &lists, nullptr, nullptr), BALLOT_OK);
    add(all, counts), add(all, found);
    return all;
  }
  /// Expects the same of the host's questions and of those that the device makes. `makes(gpu)`: it does.
  template <class Ask, class Makes>
  void expect_same(const Ask& ask, const Makes& makes) {
    Context& gpu = *api::use(device_)->gpu;
    const std::vector<char> here = ask();
    StreamRing::of(gpu).act_as_gpu(kChunkOfTests);
    EXPECT_TRUE(makes(gpu));
    const std::vector<char> there = ask();
    gpu.stream_ring().reset();
    EXPECT_TRUE(here == there);
  }

  BallotDevice* device_ = nullptr;
  BallotScene* scene_ = nullptr;

 private:
  static int take(void* user, std::uint64_t, std::size_t count, const std::uint32_t* counts, const BallotHit* hits) {
    auto& all = *static_cast<std::vector<BallotHit>*>(user);
    for (std::size_t i = 0; i < count; hits += counts[i++]) all.insert(all.end(), hits, hits + counts[i]);
    return 0;
  }
  template <class T>
  static void add(std::vector<char>& to, const std::vector<T>& from) {
    const auto* bytes = reinterpret_cast<const char*>(from.data());
    to.insert(to.end(), bytes, bytes + from.size() * sizeof(T));
  }
};

TEST_F(MadeAnswers, ToACameraFromPoses) {
  constexpr std::size_t kPoses = 5, kHeight = 33, kWidth = 51;
  std::vector<float> directions;
  for (std::size_t y = 0; y < kHeight; ++y)
    for (std::size_t x = 0; x < kWidth; ++x)
      directions.insert(directions.end(), {float(x) / kWidth - 0.5f, float(y) / kHeight - 0.5f, 1});
  std::vector<double> poses;  // turned about y, so that they look at the sphere from around it
  for (std::size_t k = 0; k < kPoses; ++k) {
    const double c = std::cos(1.25 * double(k)), s = std::sin(1.25 * double(k));
    poses.insert(poses.end(), {c, 0, s, -2 * s, 0, 1, 0, 0.1, -s, 0, c, -2 * c});
  }
  poses[12 + 5] = std::nan("");  // a pose whose rays are dead
  const float origin[3]{};
  auto rays = BALLOT_INIT(BallotRays);
  rays.shape[0] = kPoses, rays.shape[1] = kHeight, rays.shape[2] = kWidth;
  rays.origin.data = origin, rays.direction.data = directions.data(), rays.pose.data = poses.data();
  rays.direction.stride[1] = 12 * kWidth, rays.direction.stride[2] = 12;
  rays.pose.stride[0] = 96, rays.pose.type = BALLOT_FLOAT64;
  expect_same([&] { return of_rays(rays, kPoses * kHeight * kWidth); },
              [&](Context& gpu) { return bool(api::RayArray(rays).make_there(gpu, {})); });
}

TEST_F(MadeAnswers, ToAGrid) {
  constexpr std::size_t kX = 23, kY = 17, kZ = 19;
  std::vector<float> axis(kX);
  for (std::size_t i = 0; i < kX; ++i) axis[i] = -1.1f + 0.1f * float(i);
  const float limit = 0.7f;
  auto points = BALLOT_INIT(BallotPoints);
  points.shape[0] = kX, points.shape[1] = kY, points.shape[2] = kZ;
  points.x.data = points.y.data = points.z.data = axis.data(), points.limit.data = &limit;
  points.x.stride[0] = points.y.stride[1] = points.z.stride[2] = sizeof(float);
  expect_same([&] { return of_points(points, kX * kY * kZ); },
              [&](Context& gpu) { return bool(api::PointArray(points).make_there(gpu)); });
}

}  // namespace
}  // namespace ballot
