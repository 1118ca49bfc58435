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
            .text =
                "buffer Out { float out_of[]; }; readonly buffer Given { vec3 given[]; };  uniform float radius; "
                "uniform uint steps; " +
                text};
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
uint stack[4], top = 3u, node = 0u, push = 0u;
shared float world[1024];
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
  text.text += "\nuniform vec3 take_ray, entry_at;\nuniform float is_dead;\nbuffer Node { uvec4 leaves[]; };";
  EXPECT_EQ(refusal(text), "");
}

TEST_F(UserTexts, MessagesOfTheCompilerNameFileAndLine) {
  UserText text = text_of("// a comment\nvoid main(uint index) {\n  out_of[index] = nothing(1.0);\n}");
  text.file = "dir/ao.glsl";
  text.first_line = 10;
  const std::string message = refusal(text);
  EXPECT_TRUE(has(message, "kernel mine does not compile")) << message;
  EXPECT_TRUE(has(message, "dir/ao.glsl:12: 'nothing'")) << message;
  text = text_of("void main(uint index) {\n  given[index] = vec3(0.0);\n}");
  text.file = "dir/ao.glsl";
  text.first_line = 10;
  EXPECT_TRUE(has(refusal(text), "dir/ao.glsl:11:")) << refusal(text);
  text = text_of("void main(uint index) {\n  out_of[index] = 1.0;\n");  // without its end
  EXPECT_TRUE(has(refusal(text), "kernel.glsl")) << refusal(text);
  text = text_of(
      "bool accept(Hit hit) { return any(Ray(vec3(0), 0, vec3(1), hit.t)); }\n"
      "void main(uint index) { out_of[index] = float(any(Ray(vec3(0), 0, vec3(1), 9))); }");
  EXPECT_TRUE(has(refusal(text), "ecursion")) << refusal(text);
}

TEST_F(UserTexts, WrongOnesAreRefused) {
  const std::string good = "void main(uint index) { out_of[index] = given[index].x * radius; }";
  EXPECT_EQ(refusal(text_of(good)), "");
  EXPECT_TRUE(has(refusal(text_of("")), "void main(uint index)"));
  EXPECT_TRUE(has(refusal(text_of("void main() {}")), "void main(uint index)"));
  EXPECT_TRUE(has(refusal(text_of("// void main(uint index) {}")), "void main(uint index)"));
  EXPECT_TRUE(has(refusal(text_of("\n#include \"a.glsl\"\n" + good)), "#include"));
  EXPECT_TRUE(has(refusal(text_of("\n#version 450\n" + good)), "#version"));
  EXPECT_TRUE(has(refusal(text_of("float ballot_x;" + good)), "ballot_x"));
  const std::pair<const char*, const char*> wrong[] = {
      {"buffer A { float gl_x[]; };", "gl_x"},
      {"buffer A { float nearest[]; };", "'nearest'"},
      {"buffer A { float a__b[]; };", "a__b"},
      {"buffer A { float radius[]; };", "twice"},
      {"\n buffer A { vec3 given[]; };", "kernel.glsl:2: array 'given': the name is declared twice"},
      {"buffer A { vec5 a[]; };", "vec5"},
      {"buffer A { double a[]; };", "'double'; expected float"},
      {"buffer A { float a[3]; };", "expected: buffer NAME { TYPE name[]; };"},
      {"buffer A { float a[]; } b;", "expected: buffer NAME { TYPE name[]; };"},
      {"buffer A { float n; float a[]; };", "expected: buffer NAME { TYPE name[]; };"},
      {"buffer float a[];", "expected: buffer NAME { TYPE name[]; };"},
      {"layout(binding = 3) buffer A { float a[]; };", "layout"},
      {"layout(local_size_x = 8) in;", "layout"},
      {"\n\n#if 0\nbuffer A { float a[]; };\n#endif\n", "#if"},
      {"uniform Hit a;", "'Hit'; expected float"},
      {"uniform vec5 a;", "'vec5'"},
      {"uniform vec3 a, given;", "twice"},
      {"uniform B { float a; };", "expected: uniform TYPE name;"},
      {"uniform float a[3];", "expected: uniform TYPE name;"}};
  for (const auto& [declared, part] : wrong) {
    const UserText text = text_of(declared + good);
    EXPECT_TRUE(has(refusal(text), part)) << declared << "\n" << refusal(text);
  }
  const std::pair<const char*, const char*> modes[] = {{"exact", "exact"}, {"plain", "count()"}, {"none", "none"}};
  for (const auto& [numeric, part] : modes) {
    UserText text = text_of("void main(uint index) { out_of[index] = float(count(Ray(given[0], 0, given[1], 1))); }");
    text.numeric = numeric;
    EXPECT_TRUE(has(refusal(text), part)) << refusal(text);
  }
}

TEST_F(UserTexts, ReadTrianglesOfWholeScenesAlone) {
  const std::string call = "void main(uint index) { out_of[index] = corner(index, 0u).x; }";
  EXPECT_TRUE(has(refusal(text_of(call)), "no triangles to read"));
  EXPECT_EQ(refusal(text_of("vec3 corner(uint prim, uint which) { return vec3(prim + which); }\n" + call)), "");
}

TEST_F(UserTexts, TellWhatTheyDeclare) {
  const UserInputs all = inputs_of(*gpu_, {.text = R"(
struct Cell { vec3 at; uint count; float sums[2]; };
restrict readonly buffer Rays { Ray rays[]; };  // buffer Other { float other[]; };
buffer Cells { Cell cells[]; };
uniform uvec2 size; uniform float near, far;
void main(uint index) { cells[index].count = uint(rays[index].t_min); }
)"});
  ASSERT_EQ(all.arrays.size(), 2u);
  EXPECT_EQ(all.arrays[0].name, "rays");
  EXPECT_EQ(all.arrays[0].type, "Ray");
  EXPECT_FALSE(all.arrays[0].written);
  EXPECT_EQ(all.arrays[0].bytes, 32u);
  EXPECT_EQ(all.arrays[1].type, "Cell");
  EXPECT_TRUE(all.arrays[1].written);
  EXPECT_EQ(all.arrays[1].bytes, 24u);
  ASSERT_EQ(all.numbers.size(), 3u);
  EXPECT_EQ(all.numbers[0].bytes, 8u);
  EXPECT_EQ(all.numbers[2].name, "far");
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
  UserKernel kernel(*gpu_, tree(), {.text = R"(buffer Values { float values[]; };
                       void main(uint index) {
                         values[index] = float(index);
                         values[values.length() + index] = 7.0;
                         values[index + 0x0FFFFFFFu] = values[index + 0x3FFFFFF0u];
                       })"});
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
  UserKernel kernel(*gpu_, tree(), {.name = "long", .text = R"(buffer Sums { uint sums[]; };
                       void main(uint index) {
                         uint sum = 0u;
                         for (uint i = 0u; i < 100000u; ++i) sum += i ^ sum;
                         sums[index] = sum;
                       })"});
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
