// Arguments that no memory holds, numbers that are none, and functions of the caller that call back: each is refused
// with a text of one line.
#include <algorithm>
#include <cmath>
#include <limits>

#include "api.h"

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinite = std::numeric_limits<float>::infinity();

/// Expects that a call is refused, by a text of one line that has `part`.
void expect_refused(BallotStatus status, const char* part, BallotStatus expected = BALLOT_ERROR_ARGUMENT) {
  const std::string text = ballot_last_error();
  EXPECT_EQ(status, expected) << part << ": " << text;
  EXPECT_NE(text.find(part), std::string::npos) << text << " has no " << part;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
}

constexpr float kPlace[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// Structs that are taken as they are.
class Refusals : public Api {
 protected:
  Refusals() {
    places_.transforms = kPlace, places_.count = 1;
    out_.t = room_;
    nearest_.distances = room_;
  }
  BallotStatus create(const BallotMesh* meshes, std::size_t count) {
    BallotScene* made = nullptr;
    return ballot_scene_create(device_->handle(), meshes, count, nullptr, nullptr, &made);
  }
  BallotStatus create_instances(const BallotMesh* meshes, std::size_t count, const BallotInstances& places) {
    BallotScene* made = nullptr;
    return ballot_scene_create(device_->handle(), meshes, count, &places, nullptr, &made);
  }

  const ballot::Scene scene_{*device_, {grid_.mesh()}};
  const std::vector<ballot::Ray> rays_ = rays_down(4);
  float room_[4] = {};
  const BallotMesh mesh_ = grid_.mesh();
  BallotInstances places_ = BALLOT_INIT(BallotInstances);
  const BallotRays in_ = ballot_rays(rays_.data(), rays_.size());
  BallotHits out_ = BALLOT_INIT(BallotHits);
  const BallotPoints points_ = ballot_points(grid_.positions.data(), 4);
  BallotNearest nearest_ = BALLOT_INIT(BallotNearest);
  const BallotLists lists_ = BALLOT_INIT(BallotLists);
};

// Strides whose product with the count wraps, negative ones, and those smaller than a record.
TEST_F(Refusals, StridesOfEveryArray) {
  const std::size_t wraps = std::size_t{1} << 62, negative = std::size_t(-12);
  for (const std::size_t stride : {wraps, negative, std::size_t{1} << 61, std::size_t{8}, std::size_t{50}}) {
    auto m = mesh_;
    m.position_stride = stride;
    expect_refused(create(&m, 1), "mesh 0: position_stride is");
    m = mesh_;
    m.normals = m.positions, m.normal_stride = stride;
    expect_refused(create(&m, 1), "mesh 0: normal_stride is");
    auto p = places_;
    p.transform_stride = stride;
    expect_refused(create_instances(&mesh_, 1, p), "transform_stride");
    expect_refused(ballot_scene_set_vertices(scene_.handle(), 0, mesh_.positions, mesh_.vertex_count, stride),
                   "0: stride is");
  }
  const ballot::Scene placed(*device_, {grid_.mesh()}, ballot::instances(kPlace));
  expect_refused(ballot_scene_set_transforms(placed.handle(), nullptr, kPlace, 1, 40), "transforms: stride is 40");
  expect_refused(ballot_scene_set_transforms(placed.handle(), nullptr, kPlace, 1, negative),
                 "transforms: stride is -12");
}

// Columns of rays and points may have any stride that memory has room for.
TEST_F(Refusals, ColumnsThatReachTooFar) {
  const auto refuses = [&](const auto& change, const char* part) {
    auto r = in_;
    change(r.direction);
    const std::string rays = std::string("rays: the ") + part + " of direction ";
    expect_refused(ballot_trace(scene_.handle(), &r, &out_, nullptr, nullptr), rays.c_str());
    BallotJob* job = nullptr;
    expect_refused(ballot_submit(scene_.handle(), &r, &out_, nullptr, &job), rays.c_str());
    expect_refused(ballot_list_crossings(scene_.handle(), &r, &lists_, nullptr, nullptr), rays.c_str());
    auto p = points_;
    change(p.at);
    const std::string points = std::string("points: the ") + part + " of at ";
    expect_refused(ballot_query_points(scene_.handle(), &p, &nearest_, nullptr, nullptr), points.c_str());
  };
  constexpr std::ptrdiff_t kLeast = std::numeric_limits<std::ptrdiff_t>::min();
  for (const std::ptrdiff_t far : {kLeast, kLeast / 2, -(kLeast / 4), std::ptrdiff_t{1} << 46}) {
    refuses([&](BallotColumn& c) { c.stride[0] = far; }, "stride");
    refuses([&](BallotColumn& c) { c.gap = far; }, "stride");
  }
  refuses([](BallotColumn& c) { c.type = 2; }, "type");
  refuses([](BallotColumn& c) { c.data = nullptr; }, "data");
}

// Counts that no memory has.
TEST_F(Refusals, CountsOfEveryArray) {
  for (const std::size_t count : {std::size_t{1} << 62, ~std::size_t{0}}) {
    auto r = in_;
    r.shape[0] = count;
    expect_refused(ballot_trace(scene_.handle(), &r, &out_, nullptr, nullptr), "rays: the shape has");
    r.shape[0] = std::size_t{1} << 46;
    expect_refused(ballot_trace(scene_.handle(), &r, &out_, nullptr, nullptr),
                   "rays: the stride of origin is 32 bytes");
    r = in_, r.shape[1] = count;
    expect_refused(ballot_trace(scene_.handle(), &r, &out_, nullptr, nullptr), "rays: the shape has");
    auto q = points_;
    q.shape[0] = count;
    expect_refused(ballot_query_points(scene_.handle(), &q, &nearest_, nullptr, nullptr), "points: the shape has");
    auto m = mesh_;
    m.vertex_count = count;
    expect_refused(create(&m, 1), "mesh 0: position_stride is 12");
    m = mesh_;
    m.index_count = count / 3 * 3;
    expect_refused(create(&m, 1), "triangles");
    expect_refused(create(&mesh_, count), "meshes: their number is");
    auto p = places_;
    p.count = count;
    expect_refused(create_instances(&mesh_, 1, p), "count is");
    expect_refused(create_instances(&mesh_, count, places_), "meshes: their number is");
    expect_refused(ballot_scene_set_vertices(scene_.handle(), 0, mesh_.positions, count, 0),
                   "but the mesh was made with");
    auto query = BALLOT_INIT(BallotQuery);
    query.knobs = "vote";
    expect_refused(ballot_trace(scene_.handle(), &in_, &out_, &query, nullptr),
                   "knobs: found 'vote'; expected NAME=VALUE");
    BallotBuffer* buffer = nullptr;
    expect_refused(ballot_buffer_create(device_->handle(), BALLOT_RECORD_RAY, count, nullptr, &buffer), "records");
    const ballot::Scene placed(*device_, {grid_.mesh()}, ballot::instances(kPlace));
    expect_refused(ballot_scene_set_transforms(placed.handle(), nullptr, kPlace, count, 0), "records are");
  }
  const std::vector<float> few(9, 1.0f);
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {ballot::mesh(grid_.positions, grid_.indices, 0, few)}); }),
            BALLOT_ERROR_ARGUMENT);
}

// A range that holds no number, and directions and origins that are none, are dead rays: misses. A limit and a view are
// one for the whole call, and refused.
TEST_F(Refusals, NumbersThatAreNone) {
  std::vector<ballot::Ray> dead(8, ballot::Ray{{0.5f, 0.5f, 2}, 0, {0, 0, -1}, 10});
  dead[0].t_min = kNan, dead[1].t_max = kNan, dead[2].t_min = 11, dead[3].dir[2] = 0, dead[4].dir[0] = kNan;
  dead[5].origin[1] = kInfinite, dead[6].t_max = -kInfinite, dead[7].dir[2] = 1e-39f;
  for (const char* numeric : {"watertight", "exact", "plain", "fast"}) {
    std::vector<ballot::Hit> hits(dead.size());
    std::vector<float> t(dead.size());
    scene_.trace(dead, {.hits = hits.data(), .t = t.data()}, {.numeric = numeric});
    for (std::size_t i = 0; i < dead.size(); ++i)
      EXPECT_TRUE(hits[i].prim == ballot::kMiss && hits[i].t == kInfinite && t[i] == kInfinite) << numeric << i;
  }
  EXPECT_EQ(std::ranges::count(scene_.count_crossings(dead), 0u), 8);
  const float point[] = {0.5f, 0.5f, 1};
  float distance = 0;
  for (const float limit : {kNan, -1.0f, -kInfinite}) {
    std::string text;
    EXPECT_EQ(code_of([&] { scene_.nearest({.at = point, .limit = limit}, {.distances = &distance}); }, &text),
              BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find("points: limit is"), std::string::npos) << text;
  }
  for (const double wrong : {std::nan(""), HUGE_VAL, -1.0}) {
    ballot::View view{.eye = {0.5, 0.5, 2}, .target = {0.5, 0.5, 0}};
    view.ymag = wrong;
    EXPECT_EQ(code_of([&] { scene_.render(view, {.width = 8, .height = 8}); }), BALLOT_ERROR_ARGUMENT) << wrong;
    view.ymag = 0, view.yfov = wrong;
    EXPECT_EQ(code_of([&] { scene_.render(view, {.width = 8, .height = 8}); }), BALLOT_ERROR_ARGUMENT) << wrong;
  }
  for (const float wrong : {kNan, kInfinite}) {
    const float place[] = {1, 0, 0, wrong, 0, 1, 0, 0, 0, 0, 1, 0};
    EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {grid_.mesh()}, ballot::instances(place)); }),
              BALLOT_ERROR_ARGUMENT);
  }
}

/// What functions of the caller do during a call.
struct Again {
  const ballot::Scene* scene;
  BallotScene* other;
  BallotJob* job = nullptr;
  std::vector<BallotStatus> found;
  int call() {
    auto info = BALLOT_INIT(BallotSceneInfo);
    found.push_back(ballot_scene_info(scene->handle(), &info));
    found.push_back(ballot_scene_info(other, &info));
    if (job) found.push_back(ballot_job_wait(job, nullptr));
    ballot_job_destroy(std::exchange(job, nullptr));
    ballot_scene_destroy(std::exchange(other, nullptr));  // goes once the call has ended
    return 0;
  }
};

// A call on the device that a function of the caller makes during another one would wait for itself.
TEST_F(Refusals, CallsFromCallbacks) {
  const float point[] = {0.5f, 0.5f, 1};
  std::vector<ballot::Hit> hits(rays_.size());
  for (int kind = 0; kind < 5; ++kind) {
    BallotScene* other = nullptr;
    ASSERT_EQ(ballot_scene_create(device_->handle(), nullptr, 0, nullptr, nullptr, &other), BALLOT_OK);
    Again again{&scene_, other, nullptr, {}};
    const auto progress = [](void* user, double) { return static_cast<Again*>(user)->call(); };
    const BallotRays rays = ballot_rays(rays_.data(), rays_.size());
    const BallotHits to{.hits = hits.data()};
    auto query = BALLOT_INIT(BallotQuery);
    auto lists = BALLOT_INIT(BallotLists);
    auto options = BALLOT_INIT(BallotSceneOptions);
    lists.user = &again;
    query.progress = options.progress = {progress, &again};
    if (kind == 0) {
      EXPECT_EQ(ballot_trace(scene_.handle(), &rays, &to, &query, nullptr), BALLOT_OK);
    } else if (kind == 1) {  // the job waits for itself
      BallotJob* job = nullptr;
      ASSERT_EQ(ballot_submit(scene_.handle(), &rays, &to, &query, &job), BALLOT_OK);
      EXPECT_EQ(ballot_job_wait(job, nullptr), BALLOT_OK);
      ballot_job_destroy(job);
    } else if (kind == 2) {
      lists.take = [](void* user, std::uint64_t, std::size_t, const std::uint32_t*, const BallotHit*) {
        return static_cast<Again*>(user)->call();
      };
      EXPECT_EQ(ballot_list_crossings(scene_.handle(), &rays, &lists, nullptr, nullptr), BALLOT_OK);
    } else if (kind == 3) {
      const BallotPoints points = ballot_points(point, 1);
      auto nearest = BALLOT_INIT(BallotNearest);
      float distance = 0;
      nearest.distances = &distance;
      ASSERT_EQ(ballot_submit(scene_.handle(), &rays, &to, nullptr, &again.job), BALLOT_OK);
      EXPECT_EQ(ballot_query_points(scene_.handle(), &points, &nearest, &query, nullptr), BALLOT_OK);
    } else {
      options.builder = "balanced";
      auto mesh = grid_.mesh();
      BallotScene* made = nullptr;
      EXPECT_EQ(ballot_scene_create(device_->handle(), &mesh, 1, nullptr, &options, &made), BALLOT_OK);
      ballot_scene_destroy(made);
    }
    ASSERT_GE(again.found.size(), 2u) << kind;
    EXPECT_EQ(again.found[0], BALLOT_ERROR_WORK) << kind;
    EXPECT_EQ(again.found[1], BALLOT_ERROR_WORK) << kind;
    if (kind == 3) {
      EXPECT_EQ(again.found[2], BALLOT_ERROR_WORK);
    }
    auto info = BALLOT_INIT(BallotSceneInfo);
    EXPECT_EQ(ballot_scene_info(other, &info), BALLOT_ERROR_CLOSED) << kind;
    EXPECT_EQ(ballot_scene_info(scene_.handle(), &info), BALLOT_OK) << kind;
  }
}

// Each long call asks its progress function, which can end it; numbers of crossings too.
TEST_F(Refusals, ProgressOfEveryCall) {
  const std::vector<float> points(3 * 40'000, 0.5f);
  std::vector<float> distances(40'000);
  const auto rays = rays_down(40'000);
  int asked = 0;
  double last = 0;
  const auto goes_on = [&](double done) { return ++asked, last = done, true; };
  const auto stops = [](double) { return false; };
  const auto expect_asked = [&](const char* what) {
    EXPECT_GT(std::exchange(asked, 0), 0) << what;
    EXPECT_EQ(std::exchange(last, 0), 1) << what;
  };
  scene_.nearest(points, {.distances = distances.data()}, {.progress = goes_on});
  expect_asked("nearest");
  EXPECT_EQ(scene_.count_crossings(rays, {.progress = goes_on}).size(), rays.size());
  expect_asked("numbers of crossings");
  scene_.crossings(rays, {.first = 3, .progress = goes_on});
  expect_asked("crossings");
  ballot::Scene(*device_, {grid_.mesh()}, {.builder = "balanced", .progress = goes_on});
  expect_asked("a scene");
  EXPECT_EQ(code_of([&] { scene_.nearest(points, {.distances = distances.data()}, {.progress = stops}); }),
            BALLOT_ERROR_INTERRUPTED);
  EXPECT_EQ(code_of([&] { scene_.count_crossings(rays, {.progress = stops}); }), BALLOT_ERROR_INTERRUPTED);
  EXPECT_EQ(code_of([&] { scene_.crossings(rays, {.progress = stops}); }), BALLOT_ERROR_INTERRUPTED);
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {grid_.mesh()}, {.builder = "balanced", .progress = stops}); }),
            BALLOT_ERROR_INTERRUPTED);
}

}  // namespace
