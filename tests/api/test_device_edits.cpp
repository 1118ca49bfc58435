// Edits by arrays on the device.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "tests/api/api.h"

namespace {

/// A scene of many instances of a small mesh, which matrices of the host or of the device move.
class ApiDeviceEdits : public Api {
 protected:
  static constexpr std::size_t kCount = 1500;  // of instances

  static std::vector<ballot::Matrix> matrices(float step) {
    std::vector<ballot::Matrix> all(kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
      const float x = float(i % 40), y = float(i / 40);
      all[i] = {0.02f, 0, step, 0.15f * x - 3, 0, 0.02f, 0, 0.15f * y - 3, -step, 0, 0.02f, step * x};
    }
    return all;
  }
  static std::span<const float> numbers(const std::vector<ballot::Matrix>& all) {
    return {all[0].data(), 12 * all.size()};
  }
  ballot::Scene make() { return {*device_, {box_.mesh()}, ballot::instances(numbers(matrices(0)))}; }

  static void expect_same(const ballot::Scene& a, const ballot::Scene& b) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> at(-3, 3);
    std::vector<ballot::Ray> rays(3000);
    for (ballot::Ray& r : rays) r = {{at(random), at(random), 4}, 0, {at(random) / 9, at(random) / 9, -1}, INFINITY};
    std::vector<ballot::Hit> hits(rays.size()), truth(rays.size());
    a.trace(rays, {.hits = hits.data()});
    b.trace(rays, {.hits = truth.data()});
    EXPECT_EQ(std::memcmp(hits.data(), truth.data(), hits.size() * sizeof hits[0]), 0);
    EXPECT_GT(std::ranges::count_if(hits, [](const ballot::Hit& h) { return h.prim != ballot::kMiss; }), 30);
    const auto counts = a.count_crossings(rays);
    EXPECT_EQ(counts, b.count_crossings(rays));
    std::vector<float> points(90), distances(30), expected(30);
    for (float& x : points) x = at(random);
    a.nearest(points, {.distances = distances.data()});
    b.nearest(points, {.distances = expected.data()});
    EXPECT_EQ(distances, expected);
  }

  Grid box_{3};
};

TEST_F(ApiDeviceEdits, MatricesMoveAllInstances) {
  ballot::Scene here = make(), there = make();
  const std::vector<ballot::Matrix> first = matrices(0), then = matrices(0.01f);
  ballot::Array<ballot::Matrix> array(*device_, kCount + 5);
  for (const auto* all : {&then, &first, &then}) {
    array.write(*all);
    there.set_transforms(array);
    there.commit();
    place(here, numbers(*all));
    expect_same(there, here);
  }
  EXPECT_EQ(there.instances()[77].transform[3], then[77][3]);
  // Numbers of single instances begin with what the device has.
  array.write(first);
  there.set_transforms(array);
  there.commit();
  there.set_transforms(std::vector<std::uint32_t>{9}, then[9]);
  there.commit();
  std::vector<ballot::Matrix> one = first;
  one[9] = then[9];
  place(here, numbers(one));
  expect_same(there, here);
}

TEST_F(ApiDeviceEdits, MasksOfAllInstances) {
  ballot::Scene here = make(), there = make();
  std::vector<std::uint32_t> numbers_of(kCount), masks(kCount);
  ballot::Array<std::uint32_t> array(*device_, kCount + 3);
  ballot::Array<ballot::Matrix> places(*device_, kCount);
  places.write(matrices(0.01f));
  for (std::uint32_t i = 0; i < kCount; ++i) numbers_of[i] = i;
  const auto expect_same_masked = [&] {
    std::vector<float> down;
    for (std::size_t i = 0; i < 600; ++i) down.insert(down.end(), {0.0101f * float(i) - 3, 0.0087f * float(i) - 3, 4});
    std::vector<std::uint32_t> words(200);
    for (std::uint32_t i = 0; i < 200; ++i) words[i] = i % 4;
    const std::vector<float> at(down.begin(), down.begin() + 600);
    std::vector<ballot::Hit> hits(200), truth(200);
    const ballot::RayView rays{.origins = at, .directions = {0, 0, -1}, .masks = words};
    there.trace(rays, {.hits = hits.data()});
    here.trace(rays, {.hits = truth.data()});
    EXPECT_EQ(std::memcmp(hits.data(), truth.data(), hits.size() * sizeof hits[0]), 0);
    for (std::size_t i = 0; i < kCount; i += 97) EXPECT_EQ(there.instances()[i].mask, masks[i]);
  };
  for (const std::uint32_t least : {1u, 2u, 0u, 1u}) {  // 0 hides instances
    for (std::uint32_t i = 0; i < kCount; ++i) masks[i] = least + i % 3;
    array.write(masks);
    there.set_masks(array);
    there.set_transforms(places);
    there.commit();
    here.set_masks(numbers_of, masks);
    place(here, numbers(matrices(0.01f)));
    expect_same_masked();
  }
  const ballot::Array<std::uint32_t> few(*device_, kCount - 1);
  EXPECT_EQ(code_of([&] { there.set_masks(few); }), BALLOT_ERROR_ARGUMENT);
  there.set_masks(array);
  const std::vector<float> one{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  for (int i = 0; i < 4; ++i) there.add_instances(ballot::instances(one));
  std::string text;
  EXPECT_EQ(code_of([&] { there.commit(); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("1503 records, but the edits make 1504 instances"), std::string::npos) << text;
  expect_same_masked();
}

TEST_F(ApiDeviceEdits, WrongMatricesChangeNothing) {
  ballot::Scene here = make(), there = make();
  std::vector<ballot::Matrix> wrong = matrices(0.01f);
  wrong[1234][5] = NAN;
  ballot::Array<ballot::Matrix> array(*device_, kCount);
  const ballot::Array<ballot::Matrix> few(*device_, kCount - 1);
  array.write(wrong);
  const auto expect_refused = [](const auto& edit, const char* what) {
    std::string text;
    EXPECT_EQ(code_of(edit, &text), BALLOT_ERROR_ARGUMENT) << what;
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  const std::vector<std::uint32_t> third{3}, mask{1};
  there.set_transforms(array);
  expect_refused([&] { there.commit(); }, "instance 1234");
  expect_same(there, here);
  there.set_transforms(array);
  expect_refused([&] { there.set_masks(third, mask); }, "array on the device; commit that before");
  expect_refused([&] { there.set_transforms(third, wrong[0]); }, "array on the device; commit that before");
  there.discard();
  there.set_transforms(third, wrong[3]);
  expect_refused([&] { there.set_transforms(array); }, "commit those before");
  there.discard();
  expect_refused([&] { there.set_transforms(few); }, "1499");
  expect_same(there, here);
}

}  // namespace
