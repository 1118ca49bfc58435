// Kernels of users with accept(): what it sees, and what its answers do.
#include "tests/device/forests.h"
#include "tests/device/user_kernels.h"

namespace ballot {
namespace {

constexpr const char* kOdd = "bool accept(Hit hit) { return hit.prim % 2u == 1u; }";
/// Adds up what accept() sees, and refuses it.
constexpr const char* kSum = R"(
uint seen = 0u;
bool accept(Hit hit) {
  seen += (hit.prim + 1u) * 2654435761u ^ floatBitsToUint(hit.t) ^ floatBitsToUint(hit.u) * 3u;
  return false;
}
)";

class UserHooks : public UserKernelTest {
 protected:
  static std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x); }
  /// What kSum adds up over all crossings.
  static std::vector<std::uint32_t> sums_of(const std::vector<std::vector<Hit>>& lists) {
    std::vector<std::uint32_t> sums;
    for (const auto& list : lists) {
      std::uint32_t sum = 0;
      for (const Hit& h : list) sum += (h.prim + 1) * 2654435761u ^ bits(h.t) ^ bits(h.u) * 3;
      sums.push_back(sum);
    }
    return sums;
  }
};

// The answers without the even triangles are those of a scene without them.
TEST_F(UserHooks, LeaveOutWhatTheyRefuse) {
  const shapes::Triangles all = shapes::soup(2000, 0.2f);
  shapes::Triangles odd;
  for (std::size_t i = 1; i < all.size(); i += 2) odd.push_back(all[i]);
  const auto t = make(*gpu_, all, {.split_budget = 1}), without = make(*gpu_, odd);
  ASSERT_GT(t->bvh.stats.references, all.size());
  std::vector<Ray> rays = shapes::random_rays(3000);
  Answers truth = built_in(*without->tracer, rays, {});
  for (Hit& hit : truth.hits)
    if (hit.prim != NO_HIT) hit.prim = 2 * hit.prim + 1;
  DeviceTree& tree = t->tracer->tree();
  EXPECT_EQ(different(answers<Hit>(tree, over_rays("Hit", "nearest(rays[index])", kOdd), rays), truth.hits), 0u);
  EXPECT_EQ(
      different(answers<std::uint32_t>(tree, over_rays("uint", "uint(any(rays[index]))", kOdd), rays), truth.occluded),
      0u);
  EXPECT_EQ(different(answers<std::uint32_t>(tree, over_rays("uint", "count(rays[index])", kOdd), rays), truth.counts),
            0u);
  const Answers whole = built_in(*t->tracer, rays, {});
  EXPECT_GT(different(whole.hits, truth.hits), 300u);
}

TEST_F(UserHooks, SeeEachCrossingOnce) {
  const auto t = make(*gpu_, shapes::soup(2000, 0.2f), {.split_budget = 1});
  Forest forest = forests::make_forest(forests::three_meshes(), forests::twelve_instances());
  Tracer among(*gpu_, forest);
  const std::vector<Ray> rays = shapes::random_rays(2000);
  for (Tracer* tracer : {t->tracer.get(), &among}) {
    RayQueries queries(*gpu_, tracer->tree());
    const std::vector<std::uint32_t> truth = sums_of(lists(queries, rays));
    for (const char* call : {"count", "any"}) {
      const std::string answer = fmt::format("uint({}(rays[index])) * 0u + seen", call);
      const auto sums = answers<std::uint32_t>(tracer->tree(), over_rays("uint", answer, kSum), rays);
      EXPECT_EQ(different(sums, truth), 0u) << call;
    }
  }
}

// A ray goes on from what it met, without an offset.
TEST_F(UserHooks, PassOverWhatARayCameFrom) {
  const auto t = make(*gpu_, shapes::soup(1000, 0.3f));
  RayQueries queries(*gpu_, t->tracer->tree());
  const std::vector<Ray> rays = shapes::random_rays(1000);
  const auto lists = this->lists(queries, rays);
  UserText text = over_rays("uint", "steps(rays[index])", R"(
uint from = NO_HIT;
bool accept(Hit hit) { return hit.prim != from; }
uint steps(Ray ray) {
  uint count = 0u;
  for (Hit hit = nearest(ray); hit.prim != NO_HIT; hit = nearest(ray)) {
    ++count;
    from = hit.prim;
    ray.t_min = hit.t;
  }
  return count;
})");
  const auto steps = answers<std::uint32_t>(t->tracer->tree(), text, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(steps[i], lists[i].size()) << i;
}

}  // namespace
}  // namespace ballot
