// Kernels of the user by the C and C++ interfaces: what they find is what the built-in answers are.
#include <cstring>

#include "api.h"

namespace {

constexpr const char* kEverything = R"(
readonly buffer Rays { Ray rays[]; };
buffer Hits { Hit hits[]; };
buffer Near { Nearest near[]; };
buffer Counts { uint counts[]; };
uniform float reach;
uniform uvec2 most;
void main(uint index) {
  hits[index] = nearest(rays[index]);
  near[index] = closest(rays[index].origin, reach);
  counts[index] = min(count(rays[index]), most.y) + uint(any(rays[index])) * most.x;
}
)";

class ApiKernels : public Api {
 protected:
  template <class T>
  static std::vector<T> read(const ballot::Array<T>& array) {
    std::vector<T> all(array.size());
    array.read(all);
    return all;
  }
  template <class T>
  static std::size_t different(const std::vector<T>& a, const std::vector<T>& b) {
    std::size_t n = a.size() == b.size() ? 0 : 1;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) n += std::memcmp(&a[i], &b[i], sizeof(T)) != 0;
    return n;
  }

  /// Holds a kernel that asks everything to the built-in answers.
  static void expect_built_in_answers(const ballot::Kernel& kernel, const ballot::Scene& scene) {
    const std::vector<ballot::Ray> rays = rays_down(3000);
    std::vector<ballot::Hit> hits(rays.size());
    scene.trace(rays, hits);
    const std::vector<std::int64_t> counts = scene.count_crossings(rays);
    const std::size_t n = rays.size();
    ballot::Array<ballot::Ray> asked(*device_, n);
    ballot::Array<ballot::Point> points(*device_, n);
    ballot::Array<ballot::Hit> found(*device_, n);
    ballot::Array<ballot::NearestPoint> near(*device_, n), expected(*device_, n);
    ballot::Array<std::uint32_t> counted(*device_, n);
    asked.write(rays);
    std::vector<ballot::Point> at;
    for (const ballot::Ray& r : rays) at.push_back({{r.origin[0], r.origin[1], r.origin[2]}, 2.25f});
    points.write(at);
    scene.nearest(points, {{"nearest", expected}}, n);
    const std::array<std::uint32_t, 2> most{100, 99};
    const ballot::Times times = kernel.run(
        scene, n,
        {{"rays", asked}, {"hits", found}, {"near", near}, {"counts", counted}, {"reach", 2.25f}, {"most", most}});
    EXPECT_GT(times.seconds, 0);
    EXPECT_EQ(different(read(found), hits), 0u);
    EXPECT_EQ(different(read(near), read(expected)), 0u);
    const auto sums = read(counted);
    for (std::size_t i = 0; i < n; ++i)
      ASSERT_EQ(sums[i], std::uint32_t(counts[i]) + 100 * (hits[i].prim != ballot::kMiss)) << i;
  }
};

TEST_F(ApiKernels, FindWhatTheBuiltInAnswersAreAndFollowTheScene) {
  const ballot::Kernel kernel(*device_, kEverything);
  const Grid other(5, 0.5f);
  ballot::Scene flat(*device_, {grid_.mesh(), other.mesh()});
  expect_built_in_answers(kernel, flat);
  std::vector<float> moved = grid_.positions;
  for (std::size_t i = 2; i < moved.size(); i += 3) moved[i] = 0.3f * moved[i - 1];
  move(flat, 0, moved);
  expect_built_in_answers(kernel, flat);
  const std::vector<float> places{1, 0, 0, 0.25f, 0, 1, 0, 0, 0, 0, 1, 0, 0.5f, 0, 0, 0, 0, 1, 0, 0.1f, 0, 0, 1, -1};
  flat.add_instances(ballot::instances(places, std::vector<std::uint32_t>{0, 1}));  // in trees of its own from now on
  flat.commit();
  expect_built_in_answers(kernel, flat);
  ballot::Scene among(*device_, std::vector{grid_.mesh()}, ballot::instances(places));
  expect_built_in_answers(kernel, among);
  std::vector<float> later = places;
  later[3] = -0.25f;
  place(among, later);
  expect_built_in_answers(kernel, among);
  expect_built_in_answers(kernel, flat);
  const std::vector<float> at{0.2f, 0.2f, 1, 0.7f, 0.4f, 0.5f}, radii{0.3f, 0.4f};
  ballot::Scene shapes(*device_, {grid_.mesh(), ballot::shapes("spheres", at, radii), ballot::shapes("boxes", at)});
  expect_built_in_answers(kernel, shapes);
}

TEST_F(ApiKernels, ReadCornersAndPlacesOfWhatTheyHit) {
  const ballot::Kernel kernel(*device_, R"(
readonly buffer Rays { Ray rays[]; };
buffer Off { float off[]; };
buffer Instances { uint instances[]; };
buffer Prims { uint prims[]; };
void main(uint index) {
  Hit hit = nearest(rays[index]);
  vec3 at = rays[index].origin + hit.t * rays[index].dir;
  vec3 a = corner(hit.prim, 0u), b = corner(hit.prim, 1u), c = corner(hit.prim, 2u);
  vec3 seen = a + hit.u * (b - a) + hit.v * (c - a);
  uvec2 where = hit.prim == NO_HIT ? uvec2(NO_HIT) : place(hit.prim);
  off[index] = hit.prim == NO_HIT ? 0.0 : distance(at, seen);
  instances[index] = where.x;
  prims[index] = where.y;
}
)");
  const auto holds = [&](const ballot::Scene& scene, const char* what) {
    SCOPED_TRACE(what);
    const std::vector<ballot::Ray> rays = rays_down(2000);
    std::vector<std::uint32_t> instances(rays.size()), prims(rays.size());
    scene.trace(rays, {.prims = prims.data(), .instances = instances.data()});
    ballot::Array<ballot::Ray> asked(*device_, rays.size());
    ballot::Array<float> off(*device_, rays.size());
    ballot::Array<std::uint32_t> in(*device_, rays.size()), of(*device_, rays.size());
    asked.write(rays);
    kernel.run(scene, rays.size(), {{"rays", asked}, {"off", off}, {"instances", in}, {"prims", of}});
    EXPECT_EQ(different(read(in), instances), 0u);
    EXPECT_EQ(different(read(of), prims), 0u);
    for (const float x : read(off)) ASSERT_LT(x, 1e-5f);
    EXPECT_GT(std::ranges::count(prims, ballot::kMiss), 100);
  };
  const Grid other(5, 0.5f);
  ballot::Scene flat(*device_, {grid_.mesh(), other.mesh(), grid_.mesh()});
  holds(flat, "flat");
  flat.remove_instances(std::vector<std::uint32_t>{1});
  flat.commit();
  holds(flat, "flat, less");
  std::vector<float> moved = grid_.positions;
  for (std::size_t i = 2; i < moved.size(); i += 3) moved[i] = 0.3f * moved[i - 1];
  move(flat, 2, moved);
  holds(flat, "flat, moved");
  const std::vector<float> places{1,    0, 0, 0.25f, 0, 1, 0, 0,    0, 0, 1, 0.2f,
                                  0.5f, 0, 0, 0,     0, 1, 0, 0.1f, 0, 0, 1, 0.9f};
  const std::vector<std::uint32_t> meshes{1, 0}, first{0};
  ballot::Scene among(*device_, std::vector{grid_.mesh(), other.mesh()}, ballot::instances(places, meshes));
  holds(among, "among");
  std::vector<float> later = places;
  later[3] = -0.25f;
  place(among, later);
  holds(among, "among, moved");
  among.remove_instances(first);
  among.commit();
  holds(among, "among, less");
}

TEST_F(ApiKernels, TellWhatTheyDeclare) {
  const ballot::Kernel kernel(*device_, kEverything);
  const std::vector<ballot::InputInfo> inputs = kernel.inputs();
  ASSERT_EQ(inputs.size(), 6u);
  EXPECT_STREQ(inputs[0].name, "rays");
  EXPECT_STREQ(inputs[0].type, "Ray");
  EXPECT_TRUE(inputs[0].is_array && !inputs[0].written && inputs[0].bytes == 32);
  EXPECT_TRUE(inputs[1].is_array && inputs[1].written && inputs[1].bytes == 16);
  EXPECT_STREQ(inputs[5].type, "uvec2");
  EXPECT_TRUE(!inputs[5].is_array && inputs[5].bytes == 8);
}

TEST_F(ApiKernels, MessagesOfTheCompilerReachTheUserAsTheyAre) {
  const std::string wrong = "buffer A { float a[]; };\nvoid main(uint index) {\n  a[index] = noise(1.0);\n}";
  std::string text;
  const auto make = [&] {
    const ballot::Kernel kernel(*device_, wrong, {.name = "ao", .file = "dir/ao.glsl", .first_line = 101});
  };
  EXPECT_EQ(code_of(make, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("kernel ao does not compile:\n"), text.npos) << text;
  EXPECT_NE(text.find("\nERROR: dir/ao.glsl:103: 'noise'"), text.npos) << text;
  EXPECT_NE(text.back(), '\n');
  EXPECT_EQ(code_of([&] { ballot::Kernel(*device_, "void main() {}"); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("void main(uint index)"), text.npos) << text;
  EXPECT_EQ(code_of([&] { ballot::Kernel(*device_, kEverything, {.numeric = "plain"}); }, &text),
            BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("numeric mode plain"), text.npos) << text;
}

TEST_F(ApiKernels, WrongInputsAreRefused) {
  const ballot::Kernel kernel(*device_,
                              "readonly buffer A { vec3 a[]; };\nbuffer B { float b[]; };\nuniform vec2 c;\n"
                              "void main(uint index) { b[index] = a[index].x + c.y; }");
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const ballot::Device second("", true);
  const ballot::Array<ballot::Vertex> a(*device_, 10);
  const ballot::Array<float> b(*device_, 10), uneven(*device_, 8), elsewhere(second, 10);
  const std::array<float, 2> c{1, 2};
  const auto refuses = [&](const char* part, std::initializer_list<ballot::Input> inputs, std::size_t count = 10,
                           const ballot::Query& query = {}) {
    std::string text;
    EXPECT_EQ(code_of([&] { kernel.run(scene, count, inputs, query); }, &text), BALLOT_ERROR_ARGUMENT) << part;
    EXPECT_NE(text.find(part), text.npos) << text;
  };
  kernel.run(scene, 10, {{"a", a}, {"b", b}, {"c", c}});
  kernel.run(scene, 0, {{"a", a}, {"b", b}, {"c", c}});
  refuses("array 'a' is given 0 times", {{"b", b}, {"c", c}});
  refuses("number 'c' is given 0 times", {{"a", a}, {"b", b}});
  refuses("array 'b' is given 2 times", {{"a", a}, {"b", b}, {"b", b}, {"c", c}});
  refuses("'d'", {{"a", a}, {"b", b}, {"c", c}, {"d", b}});
  refuses("12 bytes each; found 32 bytes", {{"a", uneven}, {"b", b}, {"c", c}});
  refuses("8 bytes; found 4 bytes", {{"a", a}, {"b", b}, {"c", 1.f}});
  refuses("another device", {{"a", a}, {"b", elsewhere}, {"c", c}});
  refuses("'a'", {{"a", c}, {"b", b}, {"c", c}});
  refuses("'c'", {{"a", a}, {"b", b}, {"c", b}});
  refuses("count is 4294967296", {{"a", a}, {"b", b}, {"c", c}}, std::size_t{1} << 32);
  refuses("any is no option of kernels; expected none", {{"a", a}, {"b", b}, {"c", c}}, 10, {.any = true});
  const ballot::Scene there(second, {grid_.mesh()});
  std::string text;
  EXPECT_EQ(code_of([&] { kernel.run(there, 10, {{"a", a}, {"b", b}, {"c", c}}); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("the scene is on another device"), text.npos) << text;
  EXPECT_EQ(ballot_kernel_create(device_->handle(), nullptr, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(ballot_kernel_run(nullptr, scene.handle(), 1, nullptr, 0, nullptr, nullptr), BALLOT_ERROR_CLOSED);
  const BallotInput neither{.name = "a"};
  EXPECT_EQ(ballot_kernel_run(kernel.handle(), scene.handle(), 1, &neither, 1, nullptr, nullptr),
            BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(std::string(ballot_kernel_error(kernel.handle())).find("expected buffer"), std::string::npos);
}

TEST_F(ApiKernels, EndBetweenLaunchesAndGoInAnyOrder) {
  ballot::Array<float> sums(*device_, 1 << 20);
  double last = 0;
  bool goes_on = true;
  auto progress = [&](double done) {
    EXPECT_GE(done, last);
    last = done;
    return goes_on;
  };
  {
    auto kernel = std::make_unique<ballot::Kernel>(
        *device_,
        "buffer A { float a[]; };\nvoid main(uint index) { a[index] = float(any(Ray(vec3(0.5, 0.5, 1.0), "
        "0.0, vec3(0.0, 0.0, -1.0), 2.0))); }");
    auto scene = std::make_unique<ballot::Scene>(*device_, std::vector{grid_.mesh()});
    kernel->run(*scene, sums.size(), {{"a", sums}}, {.progress = progress});
    EXPECT_EQ(last, 1);
    const auto all = read(sums);
    EXPECT_EQ(std::ranges::count(all, 1.f), std::ptrdiff_t(all.size()));
    goes_on = false, last = 0;
    EXPECT_EQ(code_of([&] {
                kernel->run(*scene, sums.size(), {{"a", sums}}, {.progress = progress});
              }),
              BALLOT_ERROR_INTERRUPTED);
    scene.reset();
    scene = std::make_unique<ballot::Scene>(*device_, std::vector{grid_.mesh()});
    kernel->run(*scene, 10, {{"a", sums}});
    kernel.reset();
    std::vector<ballot::Hit> hits(1);
    scene->trace(rays_down(1), hits);
  }
}

}  // namespace
