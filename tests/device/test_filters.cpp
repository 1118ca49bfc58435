// Filters of questions, and the last crossings of rays: against whole lists.
#include <algorithm>
#include <array>

#include "engine/answer/point_queries.h"
#include "tests/device/crossing_test.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace forests;
using namespace harness;

class Filters : public CrossingTest {
 protected:
  using Lists = std::vector<std::vector<Hit>>;
  using Words = std::vector<std::uint32_t>;

  /// Instances of groups 3, 5 and 9, and shared ones.
  static std::vector<Placement> placements() {
    std::vector<Placement> all = twelve_instances();
    constexpr std::uint32_t kGroups[] = {kSharedGroup, 5, 9, 3, kSharedGroup};
    for (std::size_t i = 0; i < all.size(); ++i) all[i].group = kGroups[i % 5];
    return all;
  }
  /// Words of questions for the filters in `bits`. Triangles to leave out are those of lists.
  static FilterWords words_for(const Lists& lists, std::uint32_t bits) {
    constexpr std::uint32_t kGroups[] = {5, 3, kSharedGroup, 9, 4, 0};
    FilterWords words;
    for (std::size_t i = 0; i < lists.size(); ++i) {
      const std::vector<Hit>& mine = lists[i];
      if (bits >> FILTER_MASK & 1) words.of[FILTER_MASK].push_back(std::uint32_t(i % 5));
      if (bits >> FILTER_EXCLUDED & 1)
        words.of[FILTER_EXCLUDED].push_back(mine.empty() || i % 7 == 0 ? NO_HIT : mine[i % mine.size()].prim);
      if (bits >> FILTER_GROUP & 1) words.of[FILTER_GROUP].push_back(kGroups[i % 6]);
    }
    return words;
  }
  static FilterReaders readers(const FilterWords& words) {
    FilterReaders all;
    for (std::size_t f = 0; f < FILTERS; ++f)
      if (!words.of[f].empty())
        all.of[f] = [&words, f](std::uint64_t first, std::span<std::uint32_t> room) {
          std::copy_n(words.of[f].begin() + std::ptrdiff_t(first), room.size(), room.begin());
        };
    return all;
  }
  /// Returns whether question i keeps a triangle.
  static bool keeps(const FilterWords& words, std::size_t i, std::uint32_t prim, const Words& masks,
                    const Forest* forest) {
    const auto& [mask, excluded, group] = words.of;
    if (!mask.empty() && (mask[i] & masks[prim]) == 0) return false;
    if (!excluded.empty() && excluded[i] == prim) return false;
    if (group.empty() || !forest) return true;
    const std::uint32_t its = forest->group_of(forest->place_of(prim).instance);
    return its == kSharedGroup || its == group[i];
  }
  /// Expects the last crossings of whole lists, the farthest first.
  static void expect_last(RayQueries& queries, const RaySource& source, const Lists& whole, CrossingQuery query) {
    query.last = true;
    for (const std::uint32_t most : {1u, 16u}) {
      const std::vector<Hit> rows = first(queries, source, most, query);
      ASSERT_EQ(rows.size(), whole.size() * most);
      for (std::size_t i = 0; i < whole.size(); ++i) {
        std::vector<Hit> truth = whole[i];
        std::ranges::sort(truth, [](const Hit& a, const Hit& b) { return a.t != b.t ? a.t > b.t : a.prim < b.prim; });
        truth.resize(most, {std::numeric_limits<float>::infinity(), NO_HIT, 0, 0});
        for (std::size_t k = 0; k < most && query.exact; ++k)  // the exact order of what t as reported does not tell
          ASSERT_EQ(rows[i * most + k].t, truth[k].t) << "ray " << i << ", last " << most;
        ASSERT_TRUE(query.exact || std::memcmp(&rows[i * most], truth.data(), most * sizeof(Hit)) == 0)
            << "ray " << i << ", last " << most;
      }
      expect_rows_there(queries, source, most, query, rows);
    }
  }
  static void expect_rows_there(RayQueries& queries, const RaySource& source, std::uint32_t most,
                                const CrossingQuery& query, std::span<const Hit> rows) {
    const RaysThere there(queries.context(), source);
    for (const bool as_gpu : {false, true}) {
      if (as_gpu) StreamRing::of(queries.context()).act_as_gpu(700);
      ArraysThere<Hit> to(queries.context(), 0, rows.size());
      queries.first(there.rays(), most, to.records, query);
      to.expect({}, {}, rows);
    }
    queries.context().stream_ring().reset();
  }
  /// Expects that filters leave out of whole lists what they say; the last of these sets, and none, with culling and in
  /// mode exact too.
  static void expect_filtered(RayQueries& queries, std::span<const Ray> rays, std::size_t triangles,
                              const Forest* forest, std::span<const std::uint32_t> sets) {
    Words masks(triangles);
    for (std::uint32_t i = 0; i < triangles; ++i) masks[i] = 1u << i % 4;
    std::size_t left_out = 0;
    for (const bool exact : {false, true})
      for (const Cull cull : {Cull::None, Cull::Back}) {
        CrossingQuery query{.exact = exact, .cull = cull};
        const Lists whole = lists(queries, rays, query);
        for (const std::uint32_t bits : sets) {
          if ((exact || cull != Cull::None) && bits != 0 && bits != sets.back()) continue;
          SCOPED_TRACE(fmt::format("filters {}, exact {}, cull {}", bits, exact, int(cull)));
          const FilterWords words = words_for(whole, bits);
          Lists truth = whole;
          for (std::size_t i = 0; i < truth.size(); ++i)
            left_out += std::erase_if(truth[i], [&](const Hit& h) { return !keeps(words, i, h.prim, masks, forest); });
          query.triangle_masks = bits & 1 ? std::span<const std::uint32_t>(masks) : std::span<const std::uint32_t>();
          RaySource source = source_of(rays);
          source.filters = readers(words);
          const Lists found = lists(queries, source, query);
          const Words numbers = counts(queries, source, query);
          for (std::size_t i = 0; i < truth.size(); ++i) {
            ASSERT_EQ(prims_of(found[i]), prims_of(truth[i])) << "ray " << i;
            ASSERT_EQ(numbers[i], truth[i].size()) << "ray " << i;
          }
          if (bits != 0 && bits != sets.back()) expect_first(queries, source, truth, query);
          expect_last(queries, source, truth, query);
        }
      }
    EXPECT_GT(left_out, rays.size() / 4);
  }
};

TEST_F(Filters, LeaveOutWhatTheySayInOneTree) {
  const shapes::Triangles triangles = shapes::joined(shapes::sphere(2), shapes::soup(300, 0.5f));
  const auto t = make(*gpu_, triangles, {.split_budget = 1});
  RayQueries queries(*gpu_, t->tracer->tree());
  std::vector<Ray> rays = shapes::random_rays(400);
  for (const Ray& r : shapes::edge_rays(triangles, 60, glm::vec3(0, 5, 0))) rays.push_back(r);
  for (const Ray& r : shapes::dead_rays()) rays.push_back(r);
  for (std::size_t i = 0; i < rays.size(); i += 5) rays[i].t_min = -2;
  expect_filtered(queries, rays, triangles.size(), nullptr, std::array{0u, 1u, 2u, 3u});
}

TEST_F(Filters, LeaveOutWhatTheySayAmongInstances) {
  Forest forest = make_forest(three_meshes(), placements());
  ASSERT_TRUE(forest.has_groups());
  DeviceTree tree(*gpu_, forest);
  RayQueries queries(*gpu_, tree);
  const std::vector<Ray> rays = rays_for(forest, 250);
  expect_filtered(queries, rays, forest.triangle_count(), &forest, std::array{0u, 4u, 7u});
}

// Groups stay below nodes of their own where instances move: in a tree that is refitted, and in one that is built anew.
TEST_F(Filters, GroupsFollowInstancesThatMove) {
  Forest forest = make_forest(three_meshes(), placements());
  DeviceTree tree(*gpu_, forest);
  RayQueries queries(*gpu_, tree);
  std::vector<Transform> transforms = forest.transforms();
  for (const float by : {0.01f, 40.f}) {
    for (std::size_t i = 0; i < transforms.size(); ++i) transforms[i].m[0][3] += by * float(i % 3);
    tree.move_instances(transforms);
    const std::vector<Ray> rays = rays_for(forest, 200);
    const Lists whole = lists(queries, rays);
    const FilterWords words = words_for(whole, 1u << FILTER_GROUP);
    RaySource source = source_of(rays);
    source.filters = readers(words);
    const Lists found = lists(queries, source);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      Words truth;
      for (const Hit& h : whole[i])
        if (keeps(words, i, h.prim, {}, &forest)) truth.push_back(h.prim);
      ASSERT_EQ(prims_of(found[i]), truth) << "ray " << i << ", moved by " << by;
    }
  }
}

TEST_F(Filters, OfPoints) {
  Forest forest = make_forest(three_meshes(), placements());
  DeviceTree tree(*gpu_, forest);
  PointQueries queries(*gpu_, tree);
  shapes::Random random(5);
  std::vector<ProbePoint> points;
  for (std::size_t i = 0; i < 1200; ++i) points.push_back({random.point(2.5f), i % 4 ? 0.8f : 1e30f});
  const auto within = [&](const PointQuery& query) {
    Lists all;
    InsideStream stream{.most = points.size()};
    stream.next = [&](std::uint64_t first, std::span<ProbePoint> room) {
      std::copy_n(points.begin() + std::ptrdiff_t(first), room.size(), room.begin());
      return room.size();
    };
    queries.within(
        stream,
        [&](std::uint64_t, std::span<const std::uint32_t> counts, std::span<const Within> found) {
          for (const std::uint32_t n : counts) {
            std::vector<Hit>& list = all.emplace_back();
            for (const Within& w : found.first(n)) list.push_back({w.distance, w.prim, 0, 0});
            found = found.subspan(n);
          }
        },
        query);
    return all;
  };
  const Lists whole = within({});
  Words masks(forest.triangle_count());
  for (std::uint32_t i = 0; i < masks.size(); ++i) masks[i] = 1u << i % 4;
  for (const std::uint32_t bits : {2u, 4u, 6u, 7u}) {
    SCOPED_TRACE(bits);
    FilterWords words = words_for(whole, bits);
    for (std::size_t i = 0; i < whole.size() && bits >> FILTER_EXCLUDED & 1; ++i)  // the nearest one
      if (i % 3 && !whole[i].empty()) words.of[FILTER_EXCLUDED][i] = whole[i][0].prim;
    PointQuery query{.filters = readers(words)};
    if (bits & 1) query.triangle_masks = masks;
    Lists truth = whole;
    for (std::size_t i = 0; i < truth.size(); ++i)
      std::erase_if(truth[i], [&](const Hit& h) { return !keeps(words, i, h.prim, masks, &forest); });
    const Lists found = within(query);
    std::vector<Nearest> nearest(points.size()), exact(points.size());
    queries.nearest(points, nearest, query);
    query.exact = true;
    queries.nearest(points, exact, query);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      ASSERT_EQ(prims_of(found[i]), prims_of(truth[i])) << "point " << i;
      ASSERT_EQ(nearest[i].prim == NO_HIT, truth[i].empty()) << "point " << i;
      ASSERT_EQ(exact[i].prim == NO_HIT, truth[i].empty()) << "point " << i;
      ASSERT_TRUE(truth[i].empty() || nearest[i].distance == truth[i][0].t) << "point " << i;
      ASSERT_TRUE(truth[i].empty() || keeps(words, i, nearest[i].prim, masks, &forest)) << "point " << i;
      ASSERT_TRUE(truth[i].empty() || keeps(words, i, exact[i].prim, masks, &forest)) << "point " << i;
    }
    query.sides = true;
    EXPECT_THROW(queries.nearest(points, nearest, query), Error);
  }
}

TEST_F(Filters, RefuseWhatCannotBe) {
  const auto t = make(*gpu_, shapes::grid(2));
  RayQueries queries(*gpu_, t->tracer->tree());
  const std::vector<Ray> rays = shapes::random_rays(10);
  const auto text = [&](std::uint32_t most) {
    try {
      first(queries, source_of(rays), most, {.last = true});
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(text(0), "first crossings: found 0 of each ray; expected at least 1");
  EXPECT_EQ(text(17), "last crossings: found 17 of each ray; expected 1 to 16");
  const RaysThere there(*gpu_, source_of(rays));
  Buffer<std::uint32_t> few(*gpu_, 9, Access::Storage, "few");
  DeviceRays asked = there.rays();
  asked.filters.of[FILTER_EXCLUDED] = &few;
  Buffer<std::uint32_t> to(*gpu_, 10, Access::Storage, "counts");
  EXPECT_THROW(queries.count(asked, to), Error);
}

}  // namespace
}  // namespace ballot
