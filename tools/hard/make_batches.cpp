// Hard cases of batches: numbers of rays that do not fill subgroups, and dead rays, alone and among live ones.
#include "tools/hard/generate.h"

namespace ballot::hard {
namespace {

/// Returns rays that are dead by definition (layout.h). Each is aimed at the floor, so it would hit if it were traced.
std::vector<Ray> dead(const glm::vec3& from) {
  const glm::vec3 down(0, -1, 0);
  std::vector<Ray> rays;
  for (int k = 0; k < 3; ++k)
    for (const float bad : {kNan, kInf, -kInf}) {
      Ray o{from, 0, down, 100}, d = o;
      o.origin[k] = bad;
      d.dir[k] = bad;
      rays.push_back(o);
      rays.push_back(d);
    }
  for (const float bad : {kNan, kInf, -kInf}) {
    rays.push_back({from, bad, down, 100});
    rays.push_back({from, 0, down, bad});
  }
  const float end = from.y;
  for (const auto& [low, high] : {std::pair{5.f, 5.f}, {end, end}, {100.f, 0.f}, {0.f, 0.f}, {0.f, -0.f}})
    rays.push_back({from, low, down, high});
  for (const float none : {0.f, -0.f, -1e-40f, -1e-45f}) rays.push_back({from, 0, {0, none, 0}, 1e30f});
  return rays;
}

}  // namespace

HardScene ray_counts(bool quick) {
  const Triangles mesh = octasphere(4);
  std::vector<HardRays> sets;
  for (const std::size_t count : {1, 2, 3, 5, 7, 9, 15, 17, 31, 33, 63, 65, 127, 129, 1023}) {
    HardRays set{.name = fmt::format("{} rays", count), .closed = true};
    set.rays = at_targets(mesh, count, {0, 0, 0}, 0.5f, 110 + count);
    sets.push_back(std::move(set));
  }
  HardRays scattered{.name = "no two neighbours alike", .closed = true};
  Random random(111);
  for (std::size_t i = 0; i < many(quick); ++i)
    scattered.rays.push_back(
        {random.point(0.5f), 0, random.direction() * power_of_two(int(random.below(60)) - 30), kFar});
  sets.push_back(std::move(scattered));
  return {scene_of("ray-counts", mesh), std::move(sets)};
}

HardScene dead_rays(bool quick) {
  const glm::vec3 from(0.25f, 4, 0.75f);
  const std::uint32_t below = 2 * (4 * 8 + 4);
  HardRays alone{.name = "all dead"}, mixed{.name = "dead among live"};
  const std::vector<Ray> corpses = dead(from);
  Random random(112);
  for (std::size_t i = 0; i < many(quick); ++i) {
    const Ray& corpse = corpses[i % corpses.size()];
    alone.rays.push_back(corpse);
    const bool live = random.flip();
    mixed.rays.push_back(live ? Ray{from, 0, {0, -1, 0}, 100} : corpse);
    mixed.answers.push_back(live ? below : NO_HIT);
  }
  alone.answers = all(alone.rays.size(), NO_HIT);
  HardRays any = mixed;
  any.name = "dead among live, any hit";
  any.want = Want::Any;
  return {scene_of("dead-rays", plane_grid(8, 4, 0)), {std::move(alone), std::move(mixed), std::move(any)}};
}

}  // namespace ballot::hard
