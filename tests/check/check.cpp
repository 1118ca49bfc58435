// Holds every traversal method to the CPU oracle on given scenes and compares every ray:
//   ballot_check SCENE… [--rays N] [--kinds K,…] [--device D] [--validate] [--quick]
//
// Rays: N random rays through the scene's box, and about N rays of every ray kind over all views.
//
// Each set of rays is traced with every method and vote in every numeric mode, for the closest hit or any hit as the
// ray kind wants it; random rays for both. The hits are judged by the oracle. In the conservative modes they must also
// be equal bit for bit over methods, workgroup and subgroup sizes, kernel configurations and permuted ray order;
// --quick leaves out the kernel configurations. Exit code 1 if anything differs.
#include <cmath>
#include <map>
#include <random>
#include <sstream>

#include "tests/device/harness.h"

namespace {

using namespace ballot;
using namespace ballot::harness;

struct Args {
  std::vector<std::string> scenes;
  std::size_t rays = 200000;
  std::vector<const RayKind*> kinds;
  std::string device;
  bool validate = false, quick = false;
};

/// Parses ray kinds whose names are separated by commas. Throws Error(Arguments) on an unknown name.
std::vector<const RayKind*> kinds_of(const std::string& list) {
  std::vector<const RayKind*> kinds;
  std::istringstream words(list);
  for (std::string word; std::getline(words, word, ',');) kinds.push_back(&find_ray_kind(word));
  return kinds;
}

Args parse(int argc, char** argv) {
  Args args;
  for (const RayKind& kind : kRayKinds) args.kinds.push_back(&kind);
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&] {
      if (++i >= argc) fail(Failure::Arguments, "{} needs a value, found none", word);
      return std::string(argv[i]);
    };
    if (word == "--rays")
      args.rays = std::stoul(value());
    else if (word == "--kinds")
      args.kinds = kinds_of(value());
    else if (word == "--device")
      args.device = value();
    else if (word == "--validate")
      args.validate = true;
    else if (word == "--quick")
      args.quick = true;
    else if (word.starts_with("--"))
      fail(Failure::Arguments, "unknown option {}", word);
    else
      args.scenes.push_back(word);
  }
  if (args.scenes.empty())
    fail(Failure::Arguments, "usage: ballot_check SCENE… [--rays N] [--kinds K,…] [--device D] [--validate] [--quick]");
  return args;
}

/// Returns rays of a kind, from all views one after the other. Each view gets a square picture of such a size that
/// there are about `count` rays in all.
std::vector<Ray> kind_rays(DeviceScene& world, const RayKind& kind, std::size_t count) {
  const RayKindOptions options;
  const std::size_t per_pixel = kind.generators.size() * (kind.rays_per_hit ? kind.rays_per_hit : options.ao_rays);
  const double pixels = double(count) / double(world.scene().views.size() * per_pixel);
  const std::uint32_t size = std::max(8u, std::uint32_t(std::sqrt(pixels) + 0.5));
  std::vector<Ray> all;
  for (const View& view : world.scene().views) {
    const std::vector<Ray> rays = world.make_batch(view, kind, size, size, options)->rays();
    all.insert(all.end(), rays.begin(), rays.end());
  }
  return all;
}

/// Returns rays between random points of the box, the same ones in every run.
std::vector<Ray> random_rays(const Bounds& b, std::size_t count) {
  std::mt19937 world(1);
  const auto point = [&] {
    glm::vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = b.lo[k] + (b.hi[k] - b.lo[k]) * (float(world() >> 8) * 0x1p-24f);
    return p;
  };
  std::vector<Ray> rays;
  while (rays.size() < count) {
    const glm::vec3 from = point(), to = point();
    rays.push_back({from, 0, to - from, 1e30f});
  }
  return rays;
}

/// Traces sets of rays with every query and counts and prints what is wrong.
class Checker {
 public:
  Checker(DeviceScene& world, bool quick)
      : world_(world), quick_(quick), oracle_(world.tracer().pair_tree(NodeLayout::Interleaved)) {
    world_.tracer().prefill = kPattern;
  }
  std::uint64_t problems() const { return problems_; }

  void check(std::string_view name, const std::vector<Ray>& rays, std::span<const Want> wants) {
    if (rays.empty()) {
      fmt::print("  {:<9} no rays: no primary ray hits anything\n", name);
      return;
    }
    const auto truth = oracle_.nearest(rays);
    for (const NumericMode& mode : kNumericModes) {
      std::vector<Hit> reference;
      for (const Want want : wants)
        for (const Query& q : every_method(want, mode.name)) {
          const std::vector<Hit> hits = trace(rays, q);
          judge(name, rays, hits, truth, q);
          if (!mode.conservative || want == Want::Any) continue;
          if (reference.empty())
            reference = hits;
          else
            expect_equal(reference, hits, world_.tracer().variant(q).name());
        }
      if (!reference.empty()) check_invariance(rays, reference, mode.name);
    }
  }

 private:
  std::vector<Hit> trace(const std::vector<Ray>& rays, const Query& q) {
    std::vector<Hit> hits(rays.size());
    const TraceTimes times = world_.trace(rays, hits, q);
    if (const std::size_t n = count_untouched(hits))
      problem("the kernel wrote no hit for {} of {} rays", n, rays.size());
    if (times.retraced) fmt::print("  {} rays retraced in pieces\n", times.retraced);
    return hits;
  }
  void judge(std::string_view name, const std::vector<Ray>& rays, const std::vector<Hit>& hits,
             const std::vector<OracleHit>& truth, const Query& q) {
    const Judgement j = oracle_.judge(rays, hits, truth, q.want, judged_as(find_numeric(q.numeric)));
    fmt::print(
        "  {:<9} {:<7} {:<12} {:<11} {:<5} {} rays: {} same, {} tie, {} false miss, {} false hit, {} wrong prim, {} "
        "wrong t\n",
        name, q.want == Want::Any ? "any" : "nearest", q.method, q.numeric,
        q.knobs.contains("vote") ? q.knobs.at("vote") : "", j.rays, j.same, j.tie, j.false_miss, j.false_hit,
        j.wrong_prim, j.wrong_t);
    if (!j.examples.empty()) fmt::print("    {}\n", j.examples.front());
    problems_ += j.errors();
  }
  void check_invariance(const std::vector<Ray>& rays, const std::vector<Hit>& reference, std::string_view mode) {
    std::size_t runs = 0;
    for (const Method& m : kMethods) {
      std::vector<Knobs> all = every_threshold(m);
      if (!quick_ && !m.chooses)
        for (const CoveringKernel& k : any_two_settings({&m, 1}, world_.device())) all.push_back(k.query.knobs);
      for (const Knobs& k : all) {
        const Query q{Want::Nearest, std::string(m.name), std::string(mode), k};
        expect_equal(reference, trace(rays, q), world_.tracer().variant(q).name());
        ++runs;
      }
    }
    const auto order = scatter_order(rays.size());
    std::vector<Ray> shuffled(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) shuffled[i] = rays[order[i]];
    for (const Method& m : kMethods) {
      const std::vector<Hit> hits = trace(shuffled, {Want::Nearest, std::string(m.name), std::string(mode), {}});
      std::vector<Hit> back(hits.size());
      for (std::size_t i = 0; i < rays.size(); ++i) back[order[i]] = hits[i];
      expect_equal(reference, back, std::string(m.name) + " in permuted order");
      ++runs;
    }
    fmt::print("  {} more runs (sizes, kernel configurations, permuted order) compared bit for bit\n", runs);
  }
  void expect_equal(const std::vector<Hit>& a, const std::vector<Hit>& b, const std::string& what) {
    if (const std::size_t n = count_different(a, b))
      problem("{}: {} hits differ in bits from the first method's", what, n);
  }
  template <class... A>
  void problem(fmt::format_string<A...> text, A&&... args) {
    fmt::print("  PROBLEM: {}\n", fmt::format(text, std::forward<A>(args)...));
    ++problems_;
  }

  DeviceScene& world_;
  bool quick_;
  Oracle oracle_;
  std::uint64_t problems_ = 0;
};

int run(int argc, char** argv) {
  const Args args = parse(argc, argv);
  std::uint64_t problems = 0;
  for (const std::string& scene : args.scenes) {
    DeviceScene world(load_scene(scene),
                      {.device = args.device, .validate = args.validate, .build = {}, .use_cache = true});
    fmt::print("{}: {} triangles on {} ({}), subgroup {} ({} to {})\n", world.scene().name,
               world.scene().triangles.size(), world.device().name, world.device().driver, world.device().subgroup_size,
               world.device().min_subgroup_size, world.device().max_subgroup_size);
    Checker checker(world, args.quick);
    const Want both[] = {Want::Nearest, Want::Any};
    checker.check("random", random_rays(world.scene().bounds, args.rays), both);
    for (const RayKind* kind : args.kinds)
      checker.check(kind->name, kind_rays(world, *kind, args.rays), std::span(&kind->want, 1));
    problems += checker.problems() + world.messages().size();
  }
  fmt::print("{} problems\n", problems);
  return problems ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const ballot::Error& e) {
    fmt::print(stderr, "ballot_check: {}\n", e.what());
    return int(e.kind());
  }
}
