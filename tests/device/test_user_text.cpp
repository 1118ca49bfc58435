// What kernels of users may be and may not be: names, arrays, numbers, messages.
#include "engine/core/error.h"
#include "tests/device/forests.h"
#include "tests/device/user_kernels.h"

namespace ballot {
namespace {

class UserTexts : public UserKernelTest {
 protected:
  static void SetUpTestSuite() {
    UserKernelTest::SetUpTestSuite();
    scene_ = make(*gpu_, shapes::sphere(2));
  }
  static void TearDownTestSuite() {
    scene_.reset();
    UserKernelTest::TearDownTestSuite();
  }
  static DeviceTree& tree() { return scene_->tracer->tree(); }

  static std::string refusal(const UserText& text) {
    try {
      UserKernel kernel(*gpu_, tree(), text);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  static UserText text_of(const std::string& text) {
    return {.name = "mine",
            .text = text,
            .arrays = {{"out_of", "float", true}, {"given", "vec3"}},
            .numbers = {{"radius"}, {"steps", "uint"}}};
  }
  static bool has(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

  static inline std::unique_ptr<Traced> scene_;
};

// Names that the library has, too: functions, variables, structs, constants and macros of all kinds.
TEST_F(UserTexts, MayHaveAnyNames) {
  UserText text = over_rays("Hit", "both(rays[index], 0.5)", R"(
#define REACH 0.25
#define NODE_AT(i) (i + 1)
#define larger(a) (2.0 * a)
struct Walker { float best; };  /* void main(uint nothing) */
const float FIRST = 1.0, square = FIRST * max(1.0, 0.5);
uint stack[4], top = 3u, node, push;
shared float world[64];
float smaller(float a, float b) { return a < b ? a : b; }
bool meets(Walker w, float entry) { return w.best > entry; }
float enter_instance;
Hit both(Ray given, float traverse) {
  Walker w = Walker(larger(REACH) + float(NODE_AT(0)));
  float count = smaller(1.0, traverse) * FIRST * square;  // count of nothing
  uint stack_top = top + node + push, live = stack[0];
  enter_instance = count;
  world[gl_LocalInvocationIndex] = enter_instance;
  uint crossed = any(bvec2(false, true)) ? 1u : 0u;
  Hit hit = nearest(given);
  uint n = NODE_AT(0) == 1 && meets(w, world[gl_LocalInvocationIndex]) ? crossed : 9u;
  Nearest near = closest(given.origin);
  if (!any(given) || stack_top != 3u || near.prim == NO_HIT) n = 9u;
  return n == 1u ? hit : Hit(0.0, 7u, 0.0, 0.0);
}
)");
  const std::vector<Ray> rays = shapes::axis_rays(scene_->triangles, 300);
  std::vector<Ray> meeting;
  Answers truth = built_in(*scene_->tracer, rays, {});
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (truth.occluded[i]) meeting.push_back(rays[i]);
  ASSERT_GT(meeting.size(), 100u);
  truth = built_in(*scene_->tracer, meeting, {});
  EXPECT_EQ(different(answers<Hit>(tree(), text, meeting), truth.hits), 0u);
  text.numbers = {{"take_ray", "vec3"}, {"is_dead"}};
  text.arrays.push_back({"leaves", "uvec4"});
  EXPECT_EQ(refusal(text), "");
}

TEST_F(UserTexts, MessagesOfTheCompilerNameFileAndLine) {
  UserText text = text_of("// a comment\nvoid main(uint index) {\n  out_of[index] = nothing(1.0);\n}");
  text.file = "dir/ao.glsl";
  text.first_line = 10;
  const std::string message = refusal(text);
  EXPECT_TRUE(has(message, "kernel mine does not compile")) << message;
  EXPECT_TRUE(has(message, "dir/ao.glsl:12: 'nothing'")) << message;
  text.text = "void main(uint index) {\n  given[index] = vec3(0.0);\n}";
  EXPECT_TRUE(has(refusal(text), "dir/ao.glsl:11:")) << refusal(text);
  text.text = "void main(uint index) {\n  out_of[index] = 1.0;\n";  // without its end
  EXPECT_TRUE(has(refusal(text), "ao.glsl")) << refusal(text);
  text.text =
      "bool accept(Hit hit) { return any(Ray(vec3(0), 0, vec3(1), hit.t)); }\n"
      "void main(uint index) { out_of[index] = float(any(Ray(vec3(0), 0, vec3(1), 9))); }";
  EXPECT_TRUE(has(refusal(text), "ecursion")) << refusal(text);
}

TEST_F(UserTexts, WrongOnesAreRefused) {
  const std::string good = "void main(uint index) { out_of[index] = given[index].x * radius; }";
  EXPECT_EQ(refusal(text_of(good)), "");
  EXPECT_TRUE(has(refusal(text_of("")), "void main(uint index)"));
  EXPECT_TRUE(has(refusal(text_of("void main() {}")), "void main(uint index)"));
  EXPECT_TRUE(has(refusal(text_of("// void main(uint index) {}")), "void main(uint index)"));
  EXPECT_TRUE(has(refusal(text_of("#include \"a.glsl\"\n" + good)), "#include"));
  EXPECT_TRUE(has(refusal(text_of("#version 450\n" + good)), "#version"));
  EXPECT_TRUE(has(refusal(text_of("float ballot_x;" + good)), "ballot_x"));
  const std::pair<UserArray, const char*> arrays[] = {{{"gl_x"}, "gl_x"},
                                                      {{"a b"}, "a b"},
                                                      {{"nearest"}, "nearest"},
                                                      {{"1a"}, "1a"},
                                                      {{""}, "''"},
                                                      {{"radius"}, "twice"},
                                                      {{"given"}, "twice"},
                                                      {{"a", "vec5"}, "vec5"},
                                                      {{"a", "double"}, "double"},
                                                      {{"a", ""}, "''"},
                                                      {{"a__b"}, "a__b"},
                                                      {{"ballot_a"}, "ballot_a"}};
  for (const auto& [array, part] : arrays) {
    UserText text = text_of(good);
    text.arrays.push_back(array);
    EXPECT_TRUE(has(refusal(text), part)) << refusal(text);
  }
  const std::pair<const char*, const char*> modes[] = {{"exact", "exact"}, {"plain", "count()"}, {"none", "none"}};
  for (const auto& [numeric, part] : modes) {
    UserText text = text_of("void main(uint index) { out_of[index] = float(count(Ray(given[0], 0, given[1], 1))); }");
    text.numeric = numeric;
    EXPECT_TRUE(has(refusal(text), part)) << refusal(text);
  }
  UserText text = text_of(good);
  text.numbers.push_back({"a", "Hit"});
  EXPECT_TRUE(has(refusal(text), "'Hit'")) << refusal(text);
}

TEST_F(UserTexts, ArraysAndNumbersAreChecked) {
  UserKernel kernel(*gpu_, tree(), text_of("void main(uint index) { out_of[index] = given[index].x * radius; }"));
  Buffer<float> floats(*gpu_, 100, Access::Storage, "floats");
  const auto refuses = [](const auto& call) {
    try {
      call();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Failure::Arguments);
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(has(refuses([&] { kernel.bind("other", floats); }), "out_of, given"));
  EXPECT_TRUE(has(refuses([&] { kernel.bind("given", floats); }), "12 bytes"));
  EXPECT_TRUE(has(refuses([&] { kernel.set("speed", 1.f); }), "radius, steps"));
  EXPECT_TRUE(has(refuses([&] { kernel.set("radius", 1.0); }), "8 bytes"));
  kernel.bind("out_of", floats);
  EXPECT_TRUE(has(refuses([&] { kernel.run(100); }), "'given' is not bound"));
}

TEST_F(UserTexts, NumbersAreThoseOfEachRun) {
  UserKernel kernel(*gpu_, tree(), text_of("void main(uint index) { out_of[index] += radius * float(steps); }"));
  Buffer<float> sums(*gpu_, 1 << 15, Access::Storage, "sums");
  Buffer<float> given(*gpu_, 30, Access::Storage, "given");
  std::vector<float> zero(sums.size());
  sums.upload(zero);
  kernel.bind("out_of", sums);
  kernel.bind("given", given);
  kernel.set("steps", 3u);
  kernel.set("radius", 0.5f);
  kernel.run(std::uint32_t(sums.size()));
  kernel.run(0);
  TraceTimes times;
  for (const float radius : {1.f, 2.f, 4.f}) {
    kernel.set("radius", radius);
    if (kernel.can_record(std::uint32_t(sums.size())))
      kernel.record(std::uint32_t(sums.size()), times);
    else
      kernel.run(std::uint32_t(sums.size()));
  }
  EXPECT_EQ(std::ranges::count(read(sums), 22.5f), std::ptrdiff_t(sums.size()));
}

TEST_F(UserTexts, IndicesStayWithinArrays) {
  UserKernel kernel(*gpu_, tree(),
                    {.text = R"(void main(uint index) {
                         values[index] = float(index);
                         values[values.length() + index] = 7.0;
                         values[index + 0x0FFFFFFFu] = values[index + 0x3FFFFFF0u];
                       })",
                     .arrays = {{"values", "float", true}}});
  if (!kernel.is_robust()) GTEST_SKIP() << "the device does not keep indices within arrays";
  Buffer<float> values(*gpu_, 4096, Access::Storage, "values");
  const std::vector<float> ones(values.size(), 1);
  values.upload(ones);
  kernel.bind("values", BufferPart(values, 0, 1024 * sizeof(float)));
  kernel.run(1024);
  const auto found = read(values);
  for (std::size_t i = 0; i < found.size(); ++i) ASSERT_EQ(found[i], i < 1024 ? float(i) : 1.f) << i;
}

TEST_F(UserTexts, LoopsRunToTheirEndOrTheRunFails) {
  UserKernel kernel(*gpu_, tree(),
                    {.name = "long",
                     .text = R"(void main(uint index) {
                         uint sum = 0u;
                         for (uint i = 0u; i < 100000u; ++i) sum += i ^ sum;
                         sums[index] = sum;
                       })",
                     .arrays = {{"sums", "uint", true}}});
  Buffer<std::uint32_t> sums(*gpu_, 100, Access::Storage, "sums");
  kernel.bind("sums", sums);
  std::uint32_t sum = 0;
  for (std::uint32_t i = 0; i < 100000; ++i) sum += i ^ sum;
  try {
    kernel.run(100);
    EXPECT_EQ(std::ranges::count(read(sums), sum), 100);
  } catch (const Error& error) {
    EXPECT_TRUE(has(error.what(), "kernel long: 100 of 100 invocations could not be finished")) << error.what();
    EXPECT_TRUE(kernel_config_for(find_method("while-while"), find_numeric("watertight"), gpu_->info()).loops_cut);
  }
}

TEST_F(UserTexts, FollowTheScene) {
  Forest forest = forests::make_forest(forests::three_meshes(), forests::twelve_instances());
  Tracer tracer(*gpu_, forest);
  const std::vector<Ray> rays = shapes::random_rays(500);
  std::vector<ProbePoint> points;
  for (const Ray& r : rays) points.push_back({r.origin, std::numeric_limits<float>::infinity()});
  UserText text = over_rays("Nearest", "both(rays[index])", R"(
Nearest both(Ray ray) {
  Nearest near = closest(ray.origin);
  near.behind = count(ray);
  return near;
})");
  UserKernel kernel(*gpu_, tracer.tree(), text);
  const auto asked = on_device(std::span<const Ray>(rays), "rays");
  Buffer<Nearest> found(*gpu_, rays.size(), Access::Storage, "answers");
  kernel.bind("rays", asked);
  kernel.bind("answers", found);
  std::vector<Transform> moved = forest.transforms();
  for (int step = 0; step < 3; ++step) {
    kernel.run(std::uint32_t(rays.size()));
    Answers truth = built_in(tracer, rays, points);
    for (std::size_t i = 0; i < rays.size(); ++i) truth.near[i].behind = truth.counts[i];
    EXPECT_EQ(different(read(found), truth.near), 0u) << step;
    for (std::size_t i = 0; i < moved.size(); ++i) moved[i].m[i % 3][3] += 0.3f;
    tracer.move_instances(moved);
  }
}

}  // namespace
}  // namespace ballot
