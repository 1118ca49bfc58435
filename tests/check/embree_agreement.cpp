// Compares Embree's robust single-ray call with the exact oracle, and says why they differ:
//   ballot_embree_agreement SCENE… [--rays N] [--cases N] [--brute N]
//
// Rays: about N primary rays over all views, N random rays through the scene's box, and N rays at vertices and edges of
// triangles. Each difference counts as an error of Embree or as a tie; the first --cases are printed with their
// reasons.
//
// Two checks show that the oracle is right, without its filter and its tree. First, by exact arithmetic, no ray may hit
// the triangle that Embree names before the oracle's. Second, the first --brute errors are tested against every
// triangle of the scene. Exit code 1 if the oracle is wrong.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <random>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/core/parallel.h"
#include "engine/core/progress.h"
#include "engine/files/load.h"
#include "engine/oracle/errors.h"
#include "tests/check/embree_scene.h"

namespace {

using namespace ballot;
using Clock = std::chrono::steady_clock;

struct Args {
  std::vector<std::string> scenes;
  std::size_t rays = 1'000'000, cases = 4, brute = 20;
};

Args parse(int argc, char** argv) {
  Args args;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    std::size_t* const number = word == "--rays"    ? &args.rays
                                : word == "--cases" ? &args.cases
                                : word == "--brute" ? &args.brute
                                                    : nullptr;
    if (number && i + 1 < argc)
      *number = std::stoul(argv[++i]);
    else if (word.starts_with("--"))
      fail(Failure::Arguments, "unknown option {}, or the number after it is missing", word);
    else
      args.scenes.push_back(word);
  }
  if (args.scenes.empty())
    fail(Failure::Arguments, "usage: ballot_embree_agreement SCENE… [--rays N] [--cases N] [--brute N]");
  return args;
}

/// Traces rays with Embree, one by one, and returns the hits as Ballot's records.
class EmbreeAnswers : public EmbreeScene {
 public:
  using EmbreeScene::EmbreeScene;

  std::vector<Hit> trace(std::span<const Ray> rays) const {
    std::vector<Hit> hits(rays.size());
    for_chunks(rays.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) hits[i] = trace(rays[i]);
    });
    return hits;
  }

 private:
  Hit trace(const Ray& r) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit q{};
    q.ray = {r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, 0, r.t_max, ~0u, 0, 0};
    q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_, &context, &q);
    if (q.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {0, NO_HIT, 0, 0};
    return {q.ray.tfar, q.hit.primID, q.hit.u, q.hit.v};
  }
};

/// Returns about `count` camera rays, through a square picture of each view.
std::vector<Ray> primary_rays(const Scene& scene, std::size_t count) {
  const auto size = static_cast<std::size_t>(std::sqrt(double(count) / double(scene.views.size())));
  std::vector<Ray> rays;
  for (const View& view : scene.views) {
    const glm::dmat4& m = view.world_from_camera;
    const glm::dvec3 right(m[0]), up(m[1]), back(m[2]), eye(m[3]);
    const double h = std::tan(view.yfov / 2);
    for (std::size_t i = 0; i < size * size; ++i) {
      const double x = 2 * (double(i % size) + 0.5) / double(size) - 1;
      const double y = 1 - 2 * (double(i / size) + 0.5) / double(size);
      rays.push_back({glm::vec3(eye), 0, glm::vec3(glm::normalize(right * (x * h) + up * (y * h) - back)), 1e30f});
    }
  }
  return rays;
}

/// Random points of a scene, the same ones in every run.
class Points {
 public:
  explicit Points(const Scene& scene) : scene_(scene) {}
  glm::vec3 in_box() {
    glm::vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = scene_.bounds.lo[k] + (scene_.bounds.hi[k] - scene_.bounds.lo[k]) * share();
    return p;
  }
  /// Returns a vertex of a triangle or a point of one of its edges.
  glm::vec3 on_an_edge() {
    const Triangle& t = scene_.triangles[world_() % scene_.triangles.size()];
    const std::size_t k = world_() % 3;
    return world_() % 2 ? t[k] : t[k] + (t[(k + 1) % 3] - t[k]) * share();
  }

 private:
  float share() { return float(world_() >> 8) * 0x1p-24f; }
  const Scene& scene_;
  std::mt19937 world_{1};
};

/// Holds a scene in Embree and in the oracles, and compares their answers.
class Comparison {
 public:
  Comparison(const Scene& scene, const Args& args)
      : args_(args),
        embree_(scene.triangles),
        bvh_(build_bvh_cached(scene.triangles, {}, cache_folder() / "bvh")),
        device_(encode_pairs(bvh_, scene.triangles, NodeLayout::Interleaved)),
        exact_(device_),
        bound_(device_) {}

  /// Compares and prints. Returns how often the oracle is wrong.
  std::size_t compare(std::string_view name, const std::vector<Ray>& rays) {
    ProgressBar bar("exact oracle");
    const ExactCounts before = exact_.counts();
    const auto start = Clock::now();
    const std::vector<ExactHit> truth = exact_.nearest(rays, [&](double done) { bar.update(done); });
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    bar.hide();
    const ExactCounts counts = exact_.counts() - before;
    const std::vector<Hit> answers = embree_.trace(rays);
    const ErrorFigures f = error_figures(exact_, bound_, rays, answers, truth, Want::Nearest, Arithmetic::Woop,
                                         std::max(args_.cases, args_.brute));
    fmt::print(
        "  {:<8} {:>9} rays {:>6} ties {:>6} false misses {:>6} false hits {:>6} wrong prims {:>6} wrong values"
        " ({} within the bound of Woop's test, {} beyond)\n",
        name, f.rays, f.ties, f.false_misses, f.false_hits, f.wrong_prims, f.wrong_values, f.within_bound,
        f.beyond_bound);
    fmt::print("    t off by {:.3g} ulp (median), {:.3g} (p99), {:.3g} (max)\n", f.t_ulp.median, f.t_ulp.p99,
               f.t_ulp.max);
    fmt::print(
        "    oracle: {:.0f} rays/s; {:.1f} triangles a ray; undecided by the filter, of a million tests: {:.2f} "
        "sides, {:.2f} intervals, {:.2f} orders\n",
        double(rays.size()) / seconds, per_ray(counts), per_million(counts.side_failures, counts),
        per_million(counts.interval_failures, counts), per_million(counts.order_failures, counts));
    for (std::size_t i = 0; i < std::min(args_.cases, f.cases.size()); ++i)
      fmt::print("    {}\n", in_words(f.cases[i]));
    return refuted(rays, answers, truth, f);
  }

 private:
  static double per_ray(const ExactCounts& c) {
    return double(c.triangle_tests) / double(std::max<std::uint64_t>(1, c.rays));
  }
  static double per_million(std::uint64_t n, const ExactCounts& c) {
    return 1e6 * double(n) / double(std::max<std::uint64_t>(1, c.triangle_tests));
  }

  /// True if Embree names a triangle that, by exact arithmetic, the ray hits before the oracle's.
  bool beaten(const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    if (answer.prim == NO_HIT || answer.prim == truth.prim || !exact_.hits(ray, answer.prim)) return false;
    if (truth.prim == NO_HIT) return true;
    const std::strong_ordering order = exact_.compare_t(ray, answer.prim, truth.prim);
    return order < 0 || (order == 0 && answer.prim < truth.prim);
  }

  /// Runs and prints both checks of the oracle. Returns how often it is wrong.
  std::size_t refuted(const std::vector<Ray>& rays, const std::vector<Hit>& answers, const std::vector<ExactHit>& truth,
                      const ErrorFigures& f) const {
    std::atomic<std::size_t> better = 0, otherwise = 0;
    for_chunks(rays.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) better += beaten(rays[i], answers[i], truth[i]) ? 1 : 0;
    });
    const std::size_t count = std::min(args_.brute, f.cases.size());
    for_chunks(count, 1, [&](std::size_t i, std::size_t) {
      const ExactHit all = exact_.brute_force(f.cases[i].ray);
      const ExactHit& found = f.cases[i].truth;
      otherwise += all.prim != found.prim || all.t != found.t || all.u != found.u || all.v != found.v ? 1 : 0;
    });
    fmt::print(
        "    by exact arithmetic {} answers of Embree are better than the oracle's; a test of every triangle "
        "refutes the oracle in {} of {} errors of Embree\n",
        better.load(), otherwise.load(), count);
    return better + otherwise;
  }

  const Args& args_;
  EmbreeAnswers embree_;
  Bvh bvh_;
  PairTree device_;
  ExactOracle exact_;
  Oracle bound_;
};

int run(int argc, char** argv) {
  const Args args = parse(argc, argv);
  std::size_t refuted = 0;
  for (const std::string& path : args.scenes) {
    const Scene scene = load_scene(path);
    fmt::print("{}: {} triangles, Embree {}\n", scene.name, scene.triangles.size(), RTC_VERSION_STRING);
    if (scene.triangles.empty()) continue;
    Comparison comparison(scene, args);
    Points points(scene);
    std::vector<Ray> random, edges;
    for (std::size_t i = 0; i < args.rays; ++i) {
      const glm::vec3 from = points.in_box();
      random.push_back({from, 0, points.in_box() - from, 1e30f});
      edges.push_back({from, 0, points.on_an_edge() - from, 1e30f});
    }
    refuted += comparison.compare("primary", primary_rays(scene, args.rays));
    refuted += comparison.compare("random", random);
    refuted += comparison.compare("edges", edges);
  }
  return refuted ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const ballot::Error& e) {
    fmt::print(stderr, "ballot_embree_agreement: {}\n", e.what());
    return int(e.kind());
  } catch (const std::exception& e) {
    fmt::print(stderr, "ballot_embree_agreement: {}\n", e.what());
    return 1;
  }
}
