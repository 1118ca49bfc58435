// A long run of mixed work in one process: the memory of the process and its open files do not grow. It takes
// BALLOT_SOAK_SECONDS, and uses validation layers if BALLOT_SOAK_VALIDATE is set.
#include <malloc.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/images/pictures.h"
#include "tests/temporary.h"

namespace ballot::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kSeconds = 5;
constexpr double kMiB = 1 << 20;
constexpr double kGrowthMiB = 16;  // of noise: caches of the driver and of the allocator

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// What the process holds.
struct Held {
  double resident_mib = 0;
  std::size_t descriptors = 0;
};

Held held() {
  ::malloc_trim(0);
  std::ifstream in("/proc/self/statm");
  double space = 0, resident = 0;
  in >> space >> resident;
  const fs::directory_iterator all("/proc/self/fd");
  return {resident * double(::sysconf(_SC_PAGESIZE)) / kMiB, std::size_t(std::distance(fs::begin(all), fs::end(all)))};
}

std::vector<Ray> some_rays(const Bounds& bounds, std::uint32_t count) {
  std::vector<Ray> rays;
  const glm::vec3 middle = (bounds.lo + bounds.hi) * 0.5f, half = (bounds.hi - bounds.lo) * 0.5f;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float a = 0.61803f * float(i), b = 0.3247f * float(i);
    rays.push_back({middle, 0, half * glm::vec3(std::cos(a), std::sin(b), std::sin(a) * std::cos(b)), 1e30f});
  }
  return rays;
}

/// The kinds of work, one after the other.
class Work {
 public:
  explicit Work(fs::path folder) : folder_(std::move(folder)) {}

  void run(std::size_t turn) {
    if (turn % 16 == 0) context_.reset();
    if (!context_) context_ = DeviceScene::open_device(options());
    DeviceSceneOptions how = options();
    how.context = context_;
    how.build.builder = turn % 4 == 3 ? BuilderId::Device : BuilderId::Balanced;
    const bool dances = turn % 3 == 0;
    DeviceScene world(load_scene(fmt::format("{}/scenes/{}.gltf", BALLOT_SOURCE_DIR, dances ? "dance" : "cornell")),
                      how);
    trace(world, turn);
    render(world, turn);
    if (dances) world.set_time(0, 0.1 * double(turn % 7));
    if (turn % 5 == 1 && !dances) ask(world);
    refuse(world);
    EXPECT_TRUE(context_->messages().empty()) << context_->messages().front();
  }

 private:
  static DeviceSceneOptions options() {
    DeviceSceneOptions o;
    o.validate = std::getenv("BALLOT_SOAK_VALIDATE") != nullptr;
    o.use_cache = false;
    return o;
  }

  static void trace(DeviceScene& world, std::size_t turn) {
    constexpr const char* kMethods[] = {"while-while", "packet", "bvh4", "auto"};
    const std::vector<Ray> rays = some_rays(world.scene().bounds, 500);
    std::vector<Hit> hits(rays.size());
    world.trace(rays, hits, {.want = turn % 2 ? Want::Any : Want::Nearest, .method = kMethods[turn % 4]});
    const auto batch = world.make_batch(world.scene().views[0], find_ray_kind("diffuse"), 16, 16);
    world.trace(*batch, {.method = "while-while"});
  }

  void render(DeviceScene& world, std::size_t turn) const {
    constexpr const char* kShadings[] = {"eyelight", "path", "ao", "heat"};
    const RenderOptions o{.width = 32, .height = 32, .spp = 2, .shading = kShadings[turn % 4]};
    const View& view = world.scene().views[0];
    Film film = world.start_film(o);
    RenderTimes times;
    world.advance(film, view, o, 1, times);
    if (film.stats.empty()) {
      const fs::path file = folder_ / "film.exr";
      write_film(file, film, world.made_of(view, o));
      read_film(file, film, world.made_of(view, o), o.spp);
    }
    world.advance(film, view, o, 1, times);
    write_exr(folder_ / "picture.exr", world.picture(film, view, o, times));
    read_exr(folder_ / "picture.exr");
  }

  /// Points, crossings, and vertices that move.
  static void ask(DeviceScene& world) {
    const std::vector<Ray> rays = some_rays(world.scene().bounds, 200);
    std::vector<ProbePoint> points;
    for (const Ray& r : rays) points.push_back({r.origin + r.dir, INFINITY});
    std::vector<Nearest> answers(points.size());
    world.points().nearest(points, answers);
    std::uint64_t crossings = 0;
    world.rays().list(
        {.count = rays.size(),
         .read =
             [&](std::uint64_t first, std::span<Ray> room) {
               std::copy_n(rays.begin() + std::ptrdiff_t(first), room.size(), room.begin());
             }},
        [&](std::uint64_t, std::span<const std::uint32_t>, std::span<const Hit> hits) { crossings += hits.size(); });
    EXPECT_GT(crossings, 0u);
    UnsetVector<Triangle> moved = world.scene().triangles;
    for (Triangle& t : moved)
      for (glm::vec3& v : t) v += 0.01f;
    world.move(std::move(moved));
  }

  /// Errors, which must not keep anything either.
  void refuse(DeviceScene& world) const {
    EXPECT_THROW(load_scene(folder_ / "missing.gltf"), Error);
    EXPECT_THROW(read_exr(folder_ / "missing.exr"), Error);
    EXPECT_THROW(world.start_film({.width = 0}), Error);
    std::vector<Hit> none;
    const std::vector<Ray> rays(1);
    EXPECT_THROW(world.trace(rays, none), Error);
  }

  fs::path folder_;
  std::shared_ptr<Context> context_;
};

TEST(Soak, MemoryAndDescriptorsStay) {
  const char* given = std::getenv("BALLOT_SOAK_SECONDS");
  const double seconds = given ? std::atof(given) : kSeconds;
  const TemporaryFolder folder;
  const Clock::time_point start = Clock::now();
  std::size_t turns = 0, first = 0;
  Held before;
  {
    Work work(folder.path());
    // Every kind of work has been done, and every kernel compiled, after 480 turns or a third of the time.
    for (; seconds_since(start) < seconds; ++turns) {
      if (first == 0 && (turns == 480 || seconds_since(start) > seconds / 3)) {
        before = held();
        first = turns;
      }
      work.run(turns);
    }
  }
  const Held after = held();
  fmt::print("{} turns in {:.0f} s; from turn {} on {:.1f} to {:.1f} MiB, {} to {} descriptors\n", turns,
             seconds_since(start), first, before.resident_mib, after.resident_mib, before.descriptors,
             after.descriptors);
  EXPECT_LE(after.descriptors, before.descriptors);
#if !defined(__SANITIZE_ADDRESS__)  // which keeps freed memory for a while
  EXPECT_LE(after.resident_mib, before.resident_mib + kGrowthMiB);
#endif
}

}  // namespace
}  // namespace ballot::test
