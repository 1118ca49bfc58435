// What leaves out triangles by words of rays and points, and the last hits of rays, by the installed library.
#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/api/api.h"

namespace {

using Numbers = std::vector<std::uint32_t>;

class ApiFilters : public Api {
 protected:
  static constexpr std::size_t kRays = 400;

  /// A shared grid at z = 0 and grids of groups 0 to 3 above it, two of each group, all in one place but for z.
  ballot::Scene scene() const {
    std::vector<float> places;
    Numbers groups;
    for (std::uint32_t i = 0; i < 9; ++i) {
      places.insert(places.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.1f * float(i)});
      groups.push_back(i == 0 ? BALLOT_SHARED : (i - 1) % 4);
    }
    return ballot::Scene(*device_, {grid_.mesh()}, ballot::instances(places, {}, {}, 0, groups));
  }
  /// Returns the hits of a list that a ray of a group may have, without one triangle.
  static std::vector<ballot::Hit> kept(const ballot::Lists& all, std::size_t i, const ballot::Scene& scene,
                                       std::uint32_t group, std::uint32_t excluded) {
    std::vector<ballot::Hit> some;
    const auto instances = scene.instances();
    for (std::int64_t k = all.offsets[i]; k < all.offsets[i + 1]; ++k) {
      const ballot::Hit& h = all.hits[std::size_t(k)];
      const auto of = std::ranges::find_if(
          instances, [&](const auto& info) { return h.prim >= info.first && h.prim < info.first + info.triangles; });
      if (h.prim != excluded && (of->group == BALLOT_SHARED || of->group == group)) some.push_back(h);
    }
    return some;
  }
};

TEST_F(ApiFilters, RaysSeeTheirGroupAndWhatIsShared) {
  const ballot::Scene scene = this->scene();
  const std::vector<ballot::Ray> rays = rays_down(kRays);
  const ballot::Lists all = scene.crossings(rays);
  Numbers groups(kRays), excluded(kRays);
  for (std::size_t i = 0; i < kRays; ++i) {
    groups[i] = std::uint32_t(i % 6) == 5 ? BALLOT_SHARED : std::uint32_t(i % 6);
    const auto most = std::size_t(all.counts[i]);
    excluded[i] = most && i % 3 ? all.hits[std::size_t(all.offsets[i]) + i % most].prim : BALLOT_MISS;
  }
  ballot::RayView view = ballot::rays(rays);
  view.groups = groups, view.excluded = excluded;
  ballot::Array<ballot::Ray> there(*device_, kRays);
  ballot::Array<std::uint32_t> of_groups(*device_, kRays), of_excluded(*device_, kRays);
  there.write(rays), of_groups.write(groups), of_excluded.write(excluded);
  ballot::Array<ballot::Hit> to(*device_, 3 * kRays);
  for (const char* numeric : {"watertight", "exact"}) {
    std::vector<ballot::Hit> nearest(kRays), last(2 * kRays), any(kRays), expected;
    scene.trace(view, {.hits = nearest.data()}, {.numeric = numeric});
    scene.trace(view, {.hits = last.data()}, {.numeric = numeric, .last = 2});
    scene.trace(view, {.hits = any.data()}, {.any = true, .numeric = numeric});
    const ballot::Lists lists = scene.crossings(view, {.numeric = numeric});
    EXPECT_EQ(scene.count_crossings(view, {.numeric = numeric}), lists.counts);
    for (std::size_t i = 0; i < kRays; ++i) {
      const std::vector<ballot::Hit> truth = kept(all, i, scene, groups[i], excluded[i]);
      expected.insert(expected.end(), truth.begin(), truth.end());
      ASSERT_EQ(lists.counts[i], std::ssize(truth)) << i;
      ASSERT_EQ(nearest[i].prim, truth.empty() ? BALLOT_MISS : truth[0].prim) << i;
      ASSERT_EQ(any[i].prim == BALLOT_MISS, truth.empty()) << i;
      for (std::size_t k = 0; k < 2; ++k)
        ASSERT_EQ(last[2 * i + k].prim, k < truth.size() ? truth[truth.size() - 1 - k].prim : BALLOT_MISS) << i;
    }
    ASSERT_EQ(lists.hits.size(), expected.size());
    for (std::size_t k = 0; k < expected.size(); ++k) ASSERT_EQ(lists.hits[k].prim, expected[k].prim);
    const ballot::Query query{.numeric = numeric, .excluded = of_excluded, .groups = of_groups};
    scene.trace(there, to, kRays, query);
    EXPECT_TRUE(same(read(to, kRays), nearest));
    ballot::Query of_last = query;
    of_last.last = 2;
    scene.trace(there, to, kRays, of_last);
    EXPECT_TRUE(same(read(to, 2 * kRays), last));
  }
}

TEST_F(ApiFilters, PointsToo) {
  const ballot::Scene scene = this->scene();
  std::vector<float> at;
  std::vector<ballot::Point> points;
  Numbers groups, excluded, prims(kRays), there(kRays);
  for (const ballot::Ray& r : rays_down(kRays)) {
    at.insert(at.end(), {r.origin[0], r.origin[1], 0.33f});
    points.push_back({{r.origin[0], r.origin[1], 0.33f}, INFINITY});
    groups.push_back(std::uint32_t(groups.size() % 5));
  }
  excluded.assign(kRays, BALLOT_MISS);
  ballot::Array<ballot::Point> asked(*device_, kRays);
  ballot::Array<std::uint32_t> words(*device_, kRays), to(*device_, kRays), out(*device_, kRays);
  asked.write(points), words.write(groups);
  // The second time without the triangles that were found first.
  for (const bool again : {false, true}) {
    std::vector<float> distances(kRays);
    std::vector<ballot::NearestPoint> found(kRays);
    scene.nearest({.at = at, .excluded = excluded, .groups = groups},
                  {.distances = distances.data(), .prims = prims.data(), .nearest = found.data()});
    out.write(excluded);
    scene.nearest(asked, {{"prims", to}}, kRays, {.excluded = out, .groups = words});
    EXPECT_EQ(read(to, kRays), prims);
    const ballot::Lists near = scene.within({.at = at, .limit = 0.5f, .excluded = excluded, .groups = groups});
    for (std::size_t i = 0; i < kRays; ++i) {
      const auto instance = found[i].prim / 512;
      ASSERT_TRUE(instance == 0 || (instance - 1) % 4 == groups[i]) << i;
      ASSERT_NE(found[i].prim, excluded[i]);
      for (std::int64_t k = near.offsets[i]; k < near.offsets[i + 1]; ++k) {
        const std::uint32_t prim = near.hits[std::size_t(k)].prim;
        ASSERT_TRUE(prim != excluded[i] && (prim / 512 == 0 || (prim / 512 - 1) % 4 == groups[i])) << i;
      }
      if (!again && near.counts[i]) {
        ASSERT_EQ(near.hits[std::size_t(near.offsets[i])].prim, found[i].prim) << i;
      }
      excluded[i] = found[i].prim;
    }
  }
}

// Groups are set by edits: of instances that are there or come, which may have lain in one tree with others.
TEST_F(ApiFilters, GroupsAreEdited) {
  const Grid high(4, 1);
  ballot::Scene scene(*device_, {grid_.mesh(), high.mesh(1)});
  const std::vector<ballot::Ray> ray{{{0.3f, 0.4f, 3}, 0, {0, 0, -1}, 10}};
  const auto t_of = [&](std::uint32_t group) {
    ballot::RayView view = ballot::rays(ray);
    const Numbers words{group};
    view.groups = words;
    ballot::Hit hit;
    scene.trace(view, ballot::Results{.hits = &hit});
    return hit.t;
  };
  EXPECT_EQ(t_of(7), 2);
  scene.set_groups(Numbers{1}, Numbers{8});
  EXPECT_EQ(t_of(7), 2);  // until the commit
  scene.commit();
  EXPECT_EQ(t_of(7), 3);
  EXPECT_EQ(t_of(8), 2);
  EXPECT_EQ(scene.instances()[1].group, 8u);
  EXPECT_EQ(scene.instances()[0].group, BALLOT_SHARED);
  const std::vector<float> place{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 2};
  const auto added = scene.add_instances(ballot::instances(place, Numbers{0}, {}, 0, Numbers{7}));
  scene.commit();
  EXPECT_EQ(t_of(7), 1);
  EXPECT_EQ(t_of(8), 2);
  EXPECT_EQ(t_of(BALLOT_SHARED), 3);
  scene.set_transforms(added, std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 2.5f});
  scene.commit();
  EXPECT_EQ(t_of(7), 0.5f);
  scene.remove_instances(added);
  scene.set_groups(Numbers{0, 1}, Numbers{4, BALLOT_SHARED});
  scene.commit();
  EXPECT_EQ(t_of(7), 2);
  EXPECT_EQ(t_of(4), 2);
}

// The last ends of shapes have the bits that they have in lists. A shape is left out with both of its ends.
TEST_F(ApiFilters, OfShapes) {
  std::vector<float> at, radii, ends;
  Numbers segments;
  std::mt19937 random(11);
  std::uniform_real_distribution<float> place(-1, 1);
  for (std::uint32_t i = 0; i < 40; ++i) {
    at.insert(at.end(), {place(random), place(random), place(random)});
    radii.push_back(0.1f + 0.1f * float(i % 4));
    if (i % 2) segments.insert(segments.end(), {i - 1, i});
  }
  const ballot::Scene scene(*device_, {ballot::shapes("spheres", at, radii), grid_.mesh(),
                                       ballot::shapes("capsules", at, radii, segments), ballot::shapes("boxes", at)});
  const std::vector<ballot::Ray> rays = rays_down(kRays);
  for (const char* cull : {"none", "back"}) {
    const ballot::Lists all = scene.crossings(rays, {.cull = cull});
    Numbers excluded(kRays, BALLOT_MISS);
    std::vector<ballot::Hit> last(5 * kRays);
    scene.trace(rays, ballot::Results{.hits = last.data()}, {.cull = cull, .last = 5});
    for (std::size_t i = 0; i < kRays; ++i) {
      std::vector<ballot::Hit> truth(all.hits.begin() + all.offsets[i], all.hits.begin() + all.offsets[i + 1]);
      if (!truth.empty()) excluded[i] = truth[truth.size() / 2].prim;
      std::ranges::sort(truth, [](const auto& a, const auto& b) { return a.t != b.t ? a.t > b.t : a.prim < b.prim; });
      truth.resize(5, {INFINITY, BALLOT_MISS, 0, 0});
      ASSERT_EQ(std::memcmp(&last[5 * i], truth.data(), 5 * sizeof(ballot::Hit)), 0) << "ray " << i << ", " << cull;
    }
    ballot::RayView view = ballot::rays(rays);
    view.excluded = excluded;
    const ballot::Lists some = scene.crossings(view, {.cull = cull});
    for (std::size_t i = 0; i < kRays; ++i) {
      std::size_t kept = 0;
      for (auto k = all.offsets[i]; k < all.offsets[i + 1]; ++k) kept += all.hits[std::size_t(k)].prim != excluded[i];
      ASSERT_EQ(std::size_t(some.counts[i]), kept) << i;
    }
  }
}

// Of four sheets one above the other, those of the largest values; of equal ones the upper; without the attribute last.
TEST_F(ApiFilters, TheStrongestByAValue) {
  const float gray[] = {2, 7, 2};
  std::vector<ballot::Attribute> attributes;
  for (const float& g : gray) attributes.push_back(ballot::attribute("gray", {&g, 1}, 1, BALLOT_OF_MESH));
  const Grid sheets[] = {Grid(3, 0.1f), Grid(3, 0.2f), Grid(3, 0.3f), Grid(3, 0.4f)};
  std::vector<ballot::Mesh> meshes;
  for (std::uint32_t i = 0; i < 4; ++i) meshes.push_back(sheets[i].mesh(i));
  for (std::size_t i = 0; i < 3; ++i) meshes[i].attributes = &attributes[i], meshes[i].attribute_count = 1;
  ballot::Scene scene(*device_, meshes);
  const std::vector<ballot::Ray> rays = rays_down(kRays);
  Numbers ids(6 * kRays);
  const ballot::Times times = scene.trace(rays, {.mesh_ids = ids.data()}, {.strongest = 6, .value = "gray"});
  const Numbers order{1, 2, 0, 3, BALLOT_MISS, BALLOT_MISS}, none(6, BALLOT_MISS);
  std::uint64_t hits = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    const bool met = inside(rays[i]);
    hits += met;
    EXPECT_TRUE(std::equal(ids.begin() + 6 * std::ptrdiff_t(i), ids.begin() + 6 * std::ptrdiff_t(i + 1),
                           (met ? order : none).begin()))
        << i;
  }
  EXPECT_EQ(times.hits, hits);
  scene.submit(rays, {.mesh_ids = ids.data()}, {.strongest = 1, .value = "gray"}).wait();
  EXPECT_EQ(std::uint64_t(std::count(ids.begin(), ids.begin() + kRays, 1u)), hits);
}

TEST_F(ApiFilters, RefuseWhatDoesNotFit) {
  ballot::Scene scene = this->scene();
  const std::vector<ballot::Ray> rays = rays_down(10);
  std::vector<ballot::Hit> hits(200);
  const auto expect = [&](const char* part, const std::function<void()>& call) {
    std::string text;
    EXPECT_EQ(code_of(call, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  const auto trace = [&](const ballot::Query& query) {
    scene.trace(rays, ballot::Results{.hits = hits.data()}, query);
  };
  expect("last is 17; expected 1 to 16", [&] { trace({.last = 17}); });
  expect("last is 4294967295; expected 1 to 16", [&] { trace({.last = 0xFFFFFFFF}); });
  expect("last is set and first is set", [&] { trace({.first = 2, .last = 2}); });
  expect("last is set and any is 1", [&] { trace({.any = true, .last = 2}); });
  expect("strongest is 17; expected 1 to 16", [&] { trace({.strongest = 17, .value = "gray"}); });
  expect("strongest is set and last is set", [&] { trace({.last = 2, .strongest = 2, .value = "gray"}); });
  expect("strongest is set without value", [&] { trace({.strongest = 2}); });
  expect("no mesh has an attribute 'gray'", [&] { trace({.strongest = 2, .value = "gray"}); });
  expect("beside first, last, masks, excluded, groups", [&] { trace({.method = "packet", .last = 2}); });
  expect("last is no option of crossings", [&] { scene.crossings(rays, {.last = 2}); });
  ballot::Array<std::uint32_t> nine(*device_, 9), ten(*device_, 10);
  ballot::Array<float> numbers(*device_, 10);
  ballot::Array<ballot::Ray> there(*device_, 10);
  ballot::Array<ballot::Hit> to(*device_, 10);
  expect("excluded has 9 records; expected 10", [&] { scene.trace(there, to, 10, {.excluded = nine}); });
  expect("groups has 9 records; expected 10", [&] { scene.trace(there, to, 10, {.groups = nine}); });
  expect("the buffer of groups holds other records", [&] { scene.trace(there, to, 10, {.groups = numbers}); });
  expect("excluded on the device are no option of hits", [&] { trace({.excluded = ten}); });
  expect("groups on the device are no option of hits", [&] { trace({.groups = ten}); });
  ballot::RayView view = ballot::rays(rays);
  const std::vector<float> floats(10);
  view.groups = floats;
  expect("rays: the type of group is 0; expected BALLOT_UINT32",
         [&] { scene.trace(view, ballot::Results{.hits = hits.data()}); });
  const Numbers three(3);
  view.groups = {}, view.excluded = three;
  expect("excluded has 3 for 10 rays", [&] { scene.trace(view, ballot::Results{.hits = hits.data()}); });
  std::vector<float> at(30), signs(10);
  const Numbers words(10);
  expect("found group beside signed_distances",
         [&] { scene.nearest({.at = at, .groups = words}, {.signed_distances = signs.data()}); });
  expect("found excluded beside signed_distances",
         [&] { scene.nearest({.at = at, .excluded = words}, {.signed_distances = signs.data()}); });
  expect("cull is no option of points", [&] { scene.nearest(at, {.distances = signs.data()}, {.cull = "back"}); });
  expect("instance 99", [&] { scene.set_groups(Numbers{99}, Numbers{1}); });
  expect("it is named twice", [&] { scene.set_groups(Numbers{1, 1}, Numbers{1, 2}); });
  expect("2 groups", [&] { scene.set_groups(Numbers{1}, Numbers{1, 2}); });
}

}  // namespace
