// The worked example of shaders/README.md: the method on that page compiles, runs and is right.

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/device/fixture.h"
#include "tests/device/ray_sets.h"
#include "tests/temporary.h"

namespace ballot {

namespace {

namespace fs = std::filesystem;

std::string manual() {
  std::ifstream in(BALLOT_SOURCE_DIR "/shaders/README.md");
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

/// The code block whose text begins like this.
std::string block_of(const std::string& text, const std::string& fence, const std::string& begin) {
  const std::size_t at = text.find(fence + "\n" + begin);
  if (at == std::string::npos) return "";
  const std::size_t first = at + fence.size() + 1;
  return text.substr(first, text.find("```", first) - first);
}

/// The shaders of the project and the example's, in a folder that BALLOT_SHADERS names while this lives.
class ExampleShaders {
 public:
  explicit ExampleShaders(const std::string& kernel) {
    fs::copy(BALLOT_SOURCE_DIR "/shaders", folder_.path(), fs::copy_options::recursive);
    folder_.write("traverse/steps_first.comp", kernel);
  }

 private:
  const test::TemporaryFolder folder_;
  const test::Variable shaders_{"BALLOT_SHADERS", folder_.path().string()};
};

constexpr Method kExample{.name = "steps-first",
                          .kernel = "traverse/steps_first.comp",
                          .summary = "if-if for the first s steps of a ray, then while-while",
                          .threshold = {.knob = "s",
                                        .unit = Threshold::Count,
                                        .standard = 16,
                                        .what = "steps of a ray before it changes to while-while",
                                        .sweep = sweeps::kEntries}};

/// The rays that the driver let finish, with their hits and the truth about them.
struct Finished {
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  std::vector<OracleHit> truth;
};

Finished finished_of(std::span<const Ray> rays, std::span<const Hit> hits, std::span<const OracleHit> truth) {
  Finished out;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].prim == UNFINISHED) continue;
    out.rays.push_back(rays[i]);
    out.hits.push_back(hits[i]);
    out.truth.push_back(truth[i]);
  }
  return out;
}

class WorkedExample : public DeviceTest {};

TEST_F(WorkedExample, ItsRowIsTheOneThatRunsHere) {
  const std::string row = block_of(manual(), "```cpp", "    {.name = \"steps-first\"");
  ASSERT_FALSE(row.empty());
  for (const std::string& part :
       {fmt::format(".name = \"{}\"", kExample.name), fmt::format(".kernel = \"{}\"", kExample.kernel),
        fmt::format(".summary = \"{}\"", kExample.summary), fmt::format(".knob = \"{}\"", kExample.threshold.knob),
        fmt::format(".standard = {:g}", kExample.threshold.standard),
        fmt::format(".what = \"{}\"", kExample.threshold.what), std::string(".unit = Threshold::Count"),
        std::string(".sweep = sweeps::kEntries")})
    EXPECT_NE(row.find(part), std::string::npos) << part;
}

TEST_F(WorkedExample, FindsWhatTheOracleFinds) {
  const std::string kernel = block_of(manual(), "```glsl", "#version 460");
  ASSERT_FALSE(kernel.empty());
  const ExampleShaders shaders(kernel);
  Context gpu(options());
  const auto t = make(gpu, shapes::soup(1500, 0.2f));
  const std::vector<Ray> rays = shapes::random_rays(500);
  const std::vector<OracleHit> truth = t->oracle->nearest(rays);
  DeviceTree& tree = t->tracer->tree();
  TraceKernels kernels(gpu, tree);
  Dispatcher dispatcher(gpu, tree, kernels);
  Buffer<Ray> on_device(gpu, rays.size(), Access::Storage, "rays");
  Buffer<Hit> found(gpu, rays.size(), Access::Storage, "hits");
  on_device.upload(rays);
  for (const NumericMode& mode : harness::modes_for(gpu.info()))
    for (const Want want : {Want::Nearest, Want::Any}) {
      Variant variant{&kExample, &mode, want, kernel_config_for(kExample, mode, gpu.info())};
      for (const double steps : {0.0, 3.0, 1000.0}) {
        SCOPED_TRACE(fmt::format("{} {} s={}", mode.name, want == Want::Any ? "any" : "nearest", steps));
        variant.config.threshold = steps;
        TraceTimes times;
        const Job job{variant, &kernels.get(variant)};
        const Work work = dispatcher.run(job, on_device, found, {0, std::uint32_t(rays.size())}, times);
        std::vector<Hit> hits(rays.size());
        found.download(hits);
        // An old Mesa cuts walks short, which Tracer would trace again. No other ray may be left out.
        const Finished done = finished_of(rays, hits, truth);
        EXPECT_EQ(done.rays.size() + work.unfinished, rays.size());
        EXPECT_GT(done.rays.size(), rays.size() / 2) << "too few rays are left to judge";
        const Judgement j = t->oracle->judge(done.rays, done.hits, done.truth, want, judged_as(mode));
        EXPECT_EQ(j.errors(), 0u) << fmt::format("{}", fmt::join(j.examples, "\n"));
      }
    }
  expect_silent(gpu);
}

// The headers that follow from the registry of knobs are the ones in the tree.
TEST_F(WorkedExample, HeadersOfKnobsFollowFromTheirRegistry) {
  for (const auto& [name, text] : {std::pair("knobs.h", knobs_header()), {"knobs_guard.h", knobs_guard()}}) {
    std::ifstream in(fmt::format("{}/shaders/shared/{}", BALLOT_SOURCE_DIR, name));
    std::stringstream there;
    there << in.rdbuf();
    EXPECT_EQ(there.str(), text) << "write them by: ballot shaders --headers shaders/shared";
  }
}

}  // namespace

}  // namespace ballot
