// The example of a user's kernel in shaders/user_kernels.md: it compiles, runs and sees what the built-in kernels see.
#include <fstream>
#include <sstream>

#include "tests/device/user_kernels.h"

namespace ballot {
namespace {

/// The first block of GLSL of the manual.
std::string example() {
  std::ifstream in(BALLOT_SOURCE_DIR "/shaders/user_kernels.md");
  std::stringstream all;
  all << in.rdbuf();
  const std::string text = all.str(), fence = "```glsl\n";
  const std::size_t first = text.find(fence) + fence.size();
  return text.substr(first, text.find("```", first) - first);
}

class UserExample : public UserKernelTest {};

TEST_F(UserExample, SeesWhatTheBuiltInKernelsSee) {
  constexpr std::uint32_t kPoints = 2000, kSamples = 64;
  const auto t = make(*gpu_, shapes::joined(shapes::sphere(3), shapes::moved(shapes::soup(300, 0.3f), {0, 1, 0})));
  std::vector<glm::vec3> positions, normals;
  shapes::Random random(1);
  while (positions.size() < kPoints) {
    const glm::vec3 p = random.point(1);
    if (glm::length(p) < 0.1f) continue;
    normals.push_back(glm::normalize(p));
    positions.push_back(normals.back());
  }
  const std::string text = example(), before = text.substr(0, text.find("void main"));
  const std::string written = "buffer Open { float open[]; };";
  ASSERT_NE(before.find(written), before.npos);
  const std::string rays_text =
      std::string(before).replace(before.find(written), written.size(), "buffer Made { Ray made[]; };") + R"(
void main(uint index) {
  uint point = index / samples;
  made[index] = Ray(positions[point] + 1e-4 * reach * normals[point], 0.0,
                    direction(normals[point], scrambled(index)), reach);
})";
  const auto at = on_device(std::span<const glm::vec3>(positions), "positions");
  const auto about = on_device(std::span<const glm::vec3>(normals), "normals");
  Buffer<float> open(*gpu_, kPoints, Access::Storage, "open");
  Buffer<Ray> made(*gpu_, kPoints * kSamples, Access::Storage, "rays");
  const auto run = [&](const std::string& what, const char* answers, const RawBuffer& to, std::uint32_t count) {
    UserKernel kernel(*gpu_, t->tracer->tree(), {.text = what});
    kernel.bind("positions", at);
    kernel.bind("normals", about);
    kernel.bind(answers, to);
    kernel.set("reach", 2.f);
    kernel.set("samples", kSamples);
    kernel.run(count);
  };
  run(text, "open", open, kPoints);
  run(rays_text, "made", made, kPoints * kSamples);
  std::vector<Hit> hits(kPoints * kSamples);
  t->tracer->trace(read(made), hits, {.want = Want::Any, .method = "while-while"});
  const std::vector<float> found = read(open);
  std::uint32_t unequal = 0, blocked = 0;
  for (std::uint32_t i = 0; i < kPoints; ++i) {
    const auto own = std::span(hits).subspan(i * kSamples, kSamples);
    const auto seen = std::ranges::count_if(own, [](const Hit& h) { return h.prim == NO_HIT; });
    unequal += found[i] != float(seen) / kSamples;
    blocked += seen < kSamples;
  }
  EXPECT_LE(unequal, kPoints / 100);  // directions may round in two ways in two kernels
  EXPECT_GT(blocked, kPoints / 10);
  EXPECT_LE(std::ranges::count(text, '\n'), 35);
}

}  // namespace
}  // namespace ballot
