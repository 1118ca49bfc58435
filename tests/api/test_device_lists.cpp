// Lists, counts, first hits and hits alone of arrays on the device: each has the bits of what the host gets.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "api.h"

namespace {

class DeviceLists : public Api {
 protected:
  static constexpr std::size_t kRays = 700;

  static std::vector<ballot::Ray> some_rays() {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> at(-1.5f, 1.5f);
    std::vector<ballot::Ray> rays(kRays);
    for (ballot::Ray& r : rays) {
      r = {{0, 0, 0}, 0, {at(random), at(random), -1}, 100};
      for (int k = 0; k < 3; ++k) r.origin[k] = at(random) - 3 * r.dir[k];
    }
    rays[3].dir[0] = std::nanf("");
    return rays;
  }
  /// Triangles in disorder: a mesh, or instances of it with masks.
  static ballot::Scene scene_of(bool instances) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> at(-1, 1);
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    for (std::uint32_t i = 0; i < 120; ++i) {
      for (int k = 0; k < 9; ++k) positions.push_back(at(random));
      indices.insert(indices.end(), {3 * i, 3 * i + 1, 3 * i + 2});
    }
    const ballot::Mesh mesh = ballot::mesh(positions, indices);
    if (!instances) return ballot::Scene(*device_, {mesh});
    const std::vector<float> transforms{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0.4f, -1, 0, 0, 0, 0, 0, 1, 0.2f};
    const std::vector<std::uint32_t> meshes{0, 0}, numbers{0, 1}, masks{1, 6};
    ballot::Scene scene(*device_, {mesh}, ballot::instances(transforms, meshes));
    scene.set_masks(numbers, masks);
    scene.commit();
    return scene;
  }

  struct There {
    There() : counts(*device_, kRays), offsets(*device_, kRays + 1), hits(*device_, 20000) {}
    ballot::ListArrays lists() { return {.counts = counts, .offsets = offsets, .hits = hits}; }
    void expect(const ballot::Lists& truth) const {
      const std::vector<std::uint32_t> numbers = read(counts, kRays);
      EXPECT_EQ(std::vector<std::int64_t>(numbers.begin(), numbers.end()), truth.counts);
      EXPECT_EQ(read(offsets, kRays + 1), truth.offsets);
      EXPECT_TRUE(same(read(hits, truth.hits.size()), truth.hits));
    }
    ballot::Array<std::uint32_t> counts;
    ballot::Array<std::int64_t> offsets;
    ballot::Array<ballot::Hit> hits;
  };
};

TEST_F(DeviceLists, CrossingsAndFirstHitsAreThoseOfTheHost) {
  const std::vector<ballot::Ray> rays = some_rays();
  ballot::Array<ballot::Ray> asked(*device_, kRays);
  asked.write(rays);
  std::vector<std::uint32_t> words(kRays), twos(kRays, 2);
  for (std::size_t i = 0; i < kRays; ++i) words[i] = std::uint32_t(i % 5);
  ballot::Array<std::uint32_t> masks(*device_, kRays), one(*device_, 1);
  masks.write(words);
  const std::vector<std::uint32_t> two{2};
  one.write(two);
  There there;
  for (const bool instances : {false, true}) {
    const ballot::Scene scene = scene_of(instances);
    for (const char* numeric : {"watertight", "exact"})
      for (const char* cull : {"none", "back"})
        for (const int masked : {0, 1, 2})
          for (const std::uint32_t first : {0u, 3u, 20u}) {
            ballot::Query query{.first = first, .numeric = numeric, .cull = cull};
            ballot::RayView view = ballot::rays(rays);
            if (masked == 1) view.masks = words;
            if (masked == 2) view.masks = twos;
            const ballot::Lists truth = scene.crossings(view, query);
            std::vector<ballot::Hit> rows(kRays * std::max(first, 1u));
            scene.trace(view, ballot::Results{.hits = rows.data()}, query);
            if (masked == 1) query.masks = masks;
            if (masked == 2) query.masks = one;
            EXPECT_EQ(scene.crossings(asked, {.counts = there.counts}, kRays, query), truth.hits.size());
            EXPECT_EQ(scene.crossings(asked, there.lists(), kRays, query), truth.hits.size());
            there.expect(truth);
            scene.trace(asked, there.hits, kRays, query);
            EXPECT_TRUE(same(read(there.hits, rows.size()), rows)) << first << " " << masked;
          }
  }
}

TEST_F(DeviceLists, TrianglesWithinRadiiAreThoseOfTheHost) {
  const ballot::Scene scene = scene_of(true);
  const std::vector<ballot::Ray> rays = some_rays();
  std::vector<ballot::Point> points(kRays);
  std::vector<float> at, limits;
  for (std::size_t i = 0; i < kRays; ++i) {
    points[i] = {{rays[i].origin[0], rays[i].origin[1], 0.3f}, i % 9 ? 0.1f * float(i % 9) : -1};
    at.insert(at.end(), points[i].at, points[i].at + 3);
    limits.push_back(points[i].limit);
  }
  ballot::Array<ballot::Point> asked(*device_, kRays);
  asked.write(points);
  const ballot::Lists truth = scene.within({.at = at, .limit = limits});
  There there;
  EXPECT_EQ(scene.within(asked, there.lists(), kRays), truth.hits.size());
  there.expect(truth);
}

TEST_F(DeviceLists, MasksOfPointsAreThoseOfTheHost) {
  const ballot::Scene scene = scene_of(true);
  std::vector<ballot::Point> points(kRays);
  std::vector<float> at;
  std::vector<std::uint32_t> words(kRays), twos(kRays, 2);
  const std::vector<ballot::Ray> rays = some_rays();
  for (std::size_t i = 0; i < kRays; ++i) {
    points[i] = {{rays[i].origin[0], rays[i].origin[1], 0.3f}, 0.4f};
    at.insert(at.end(), points[i].at, points[i].at + 3);
    words[i] = std::uint32_t(i % 5);
  }
  ballot::Array<ballot::Point> asked(*device_, kRays);
  asked.write(points);
  ballot::Array<std::uint32_t> each(*device_, kRays), one(*device_, 1), prims(*device_, kRays), ids(*device_, kRays);
  each.write(words), one.write(std::vector<std::uint32_t>{2});
  ballot::Array<ballot::NearestPoint> nearest(*device_, kRays);
  ballot::Array<float> distances(*device_, kRays), signs(*device_, kRays);
  for (const char* numeric : {"watertight", "exact"})
    for (const bool all : {false, true}) {
      std::vector<ballot::NearestPoint> truth(kRays);
      std::vector<float> far(kRays);
      std::vector<std::uint32_t> numbers(kRays);
      scene.nearest({.at = at, .limit = 0.4f, .masks = all ? twos : words},
                    {.distances = far.data(), .prims = numbers.data(), .nearest = truth.data()}, {.numeric = numeric});
      const ballot::Query query{.numeric = numeric, .masks = all ? one : each};
      scene.nearest(asked, {{"nearest", nearest}}, kRays, query);
      EXPECT_TRUE(same(read(nearest, kRays), truth));
      scene.nearest(asked, {{"distances", distances}, {"prims", prims}}, kRays, query);
      EXPECT_TRUE(same(read(distances, kRays), far));
      EXPECT_TRUE(same(read(prims, kRays), numbers));
      EXPECT_GT(std::ranges::count(numbers, BALLOT_MISS), 20);
      ballot::Lists lists = scene.within({.at = at, .limit = 0.4f, .masks = all ? twos : words});
      There there;
      scene.within(asked, there.lists(), kRays, {.masks = all ? one : each});
      there.expect(lists);
    }
  std::string text;
  EXPECT_EQ(code_of(
                [&] {
                  scene.nearest(asked, {{"signed_distances", signs}}, kRays, {.masks = one});
                },
                &text),
            BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("found masks beside signed_distances"), text.npos) << text;
}

TEST_F(DeviceLists, ColumnsHaveRowsOfFirstHitsAndHitsStandAlone) {
  const ballot::Scene scene = scene_of(true);
  const std::vector<ballot::Ray> rays = some_rays();
  ballot::Array<ballot::Ray> asked(*device_, kRays);
  asked.write(rays);
  std::vector<std::uint32_t> prims(2 * kRays), expected, numbers;
  std::vector<ballot::Hit> hits(2 * kRays), alone;
  scene.trace(rays, ballot::Results{.hits = hits.data(), .prims = prims.data()}, {.first = 2});
  for (std::uint32_t i = 0; i < hits.size(); ++i)
    if (hits[i].prim != BALLOT_MISS) alone.push_back(hits[i]), numbers.push_back(i / 2);
  ballot::Array<ballot::Hit> to(*device_, 2 * kRays), some(*device_, 2 * kRays);
  ballot::Array<std::uint32_t> column(*device_, 2 * kRays), of(*device_, 2 * kRays);
  scene.trace(asked, {{"hits", to}, {"prims", column}}, kRays, {.first = 2});
  EXPECT_TRUE(same(read(column, 2 * kRays), prims));
  EXPECT_EQ(scene.compact(to, some, of, 2 * kRays, 2), alone.size());
  EXPECT_TRUE(same(read(some, alone.size()), alone));
  EXPECT_EQ(read(of, alone.size()), numbers);
}

TEST_F(DeviceLists, RefuseWhatDoesNotFit) {
  const ballot::Scene scene = scene_of(false);
  ballot::Array<ballot::Ray> rays(*device_, kRays);
  rays.write(some_rays());
  There there;
  ballot::Array<ballot::Hit> few(*device_, 5);
  ballot::Array<std::uint32_t> words(*device_, kRays - 1);
  const auto expect = [&](const char* part, const auto& call) {
    std::string text;
    EXPECT_EQ(code_of(call, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect("no output", [&] { scene.crossings(rays, {}, kRays); });
  expect("the buffer of hits has 5 records; the lists have",
         [&] { scene.crossings(rays, {.counts = there.counts, .hits = few}, kRays); });
  expect("counts has 700 records; expected 701", [&] { scene.crossings(rays, there.lists(), kRays + 1); });
  expect("offsets has 701 records; expected 702",
         [&] { scene.crossings(rays, {.offsets = there.offsets}, kRays + 1); });
  expect("counts has 699 records", [&] { scene.crossings(rays, {.counts = words}, kRays); });
  expect("masks has 699 records", [&] { scene.crossings(rays, there.lists(), kRays, {.masks = words}); });
  expect("masks on the device are no option of hits",
         [&] { scene.trace(some_rays(), ballot::Results{.hits = nullptr}, {.masks = words}); });
  expect("first", [&] { scene.submit(rays, there.hits, kRays, {.first = 2}); });
  expect("last is no option of jobs", [&] { scene.submit(rays, there.hits, kRays, {.last = 2}); });
  expect("strongest is no option of jobs",
         [&] { scene.submit(rays, there.hits, kRays, {.strongest = 2, .value = "any"}); });
  expect("expected 1 to 2^32 - 2", [&] { scene.crossings(rays, there.lists(), kRays, {.first = 0xFFFFFFFF}); });
  expect("has 5 records; expected 1400", [&] { scene.trace(rays, few, kRays, {.first = 2}); });
  expect("any is 1 and first is set", [&] { scene.trace(rays, there.hits, kRays, {.any = true, .first = 2}); });
  expect("holds other records", [&] {
    const ballot::ListArrays lists = there.lists();
    ballot::check(ballot_list_buffers(scene.handle(), words.handle(), 5, &lists, nullptr, nullptr, nullptr));
  });
  EXPECT_EQ(scene.crossings(rays, there.lists(), 0), 0u);
}

}  // namespace
