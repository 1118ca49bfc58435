// Closed meshes in numeric mode double: no ray from within misses them or crosses them an even number of times, and
// none from outside an odd number of times, wherever they lie and whatever their size.
//
// BALLOT_LEAK_RAYS gives the number of rays of each mesh, size and place, and has the sums printed.
#include <cstdlib>

#include "solids.h"

namespace leaks {

namespace {

using namespace solids;

/// Rays in double at vertices, edges and faces of a mesh, in turn.
struct Rays {
  std::vector<double> origins, directions;
  /// from(to) tells where a ray at a point starts.
  template <class From>
  Rays(const Solid& solid, std::size_t count, std::mt19937& random, const From& from) {
    std::uniform_real_distribution<double> part(0, 1);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t t = 3 * (random() % (solid.indices.size() / 3));
      const Vec a = solid.at(solid.indices[t]), b = solid.at(solid.indices[t + 1]), c = solid.at(solid.indices[t + 2]);
      Vec to = a;
      if (i % 3 > 0) to = to + part(random) * (b - a);
      if (i % 3 > 1) to = to + part(random) * (c - to);
      const Vec o = from(to), d = to - o;
      origins.insert(origins.end(), o.begin(), o.end());
      directions.insert(directions.end(), d.begin(), d.end());
    }
  }
  ballot::RayView view() const { return {.origins = origins, .directions = directions}; }
};

struct Sums {
  std::size_t rays = 0, leaks = 0, wrong_counts = 0;
};

class Leaks : public Api, public testing::WithParamInterface<std::size_t> {
 protected:
  /// Shoots rays from within and from outside at a mesh of this scale about a place, by two methods.
  static void shoot(const ClosedSolid& closed, double scale, double place, std::size_t count, Sums& sums) {
    const Vec centre{place, -0.7 * place, 0.3 * place};
    Solid solid = closed.solid;
    for (std::size_t i = 0; i < solid.positions.size(); ++i)
      solid.positions[i] = centre[i % 3] + scale * solid.positions[i];
    const ballot::Scene scene(*device_, {solid.mesh()});
    std::mt19937 random(7);
    std::normal_distribution<double> any;
    const Rays within(solid, count, random, [&](const Vec&) { return centre + scale * closed.within; });
    const Rays outside(solid, count / 4, random, [&](const Vec&) {
      return centre + 3 * scale * unit({any(random), any(random), any(random)});
    });
    std::vector<std::uint32_t> prims(count);
    for (const char* method : {"while-while", "bvh4-turns"}) {
      scene.trace(within.view(), {.prims = prims.data()}, {.method = method, .numeric = "double"});
      sums.rays += count;
      sums.leaks += std::size_t(std::ranges::count(prims, ballot::kMiss));
    }
    const auto is_odd = [](std::int64_t n) { return n % 2 != 0; };
    const auto odd = [&](const Rays& rays) {
      return std::size_t(std::ranges::count_if(scene.count_crossings(rays.view(), {.numeric = "double"}), is_odd));
    };
    sums.wrong_counts += count - odd(within) + odd(outside);
  }
};

TEST_P(Leaks, ThereAreNone) {
  const ClosedSolid closed = closed_solids()[GetParam()];
  const char* given = std::getenv("BALLOT_LEAK_RAYS");
  const std::size_t count = given ? std::size_t(std::atoll(given)) : 150;
  Sums sums;
  for (const double scale : {0x1p-40, 0x1p-13, 1.0, 0x1p27, 0x1p40})
    for (const double place : {0.0, 1e3, 1e9}) {
      // Doubles have digits for the mesh there; scenes have coordinates to 1e12.
      if (place * 0x1p-50 > closed.finest * scale || scale + place > 0x1p40) continue;
      const Sums before = sums;
      shoot(closed, scale, place, count, sums);
      EXPECT_EQ(sums.leaks, before.leaks) << "scale " << scale << ", place " << place;
      EXPECT_EQ(sums.wrong_counts, before.wrong_counts) << "scale " << scale << ", place " << place;
    }
  EXPECT_GE(sums.rays, 10 * count);
  if (given)
    std::printf("%s, %zu triangles: %zu rays from within, %zu leaks, %zu wrong numbers of crossings\n", closed.name,
                closed.solid.indices.size() / 3, sums.rays, sums.leaks, sums.wrong_counts);
}

INSTANTIATE_TEST_SUITE_P(Double, Leaks, testing::Range(std::size_t{0}, closed_solids().size()), [](const auto& p) {
  std::string name = closed_solids()[p.param].name;
  std::ranges::replace(name, ' ', '_');
  return name;
});

}  // namespace

}  // namespace leaks
