// Sums of weights by what rays end on: the bits of sums of whole numbers, whatever the order, the method and the place.
#include <cmath>
#include <cstring>
#include <limits>

#include "api.h"

namespace {

constexpr float kNoWeight = std::numeric_limits<float>::quiet_NaN();

/// Sums by prim, instance and mesh, with the entry of misses.
struct AllSums {
  std::vector<double> by[3];
  explicit AllSums(const ballot::SceneInfo& info)
      : by{std::vector<double>(info.instance_triangles + 1, kNoWeight),
           std::vector<double>(info.instances + 1, kNoWeight), std::vector<double>(info.meshes + 1, kNoWeight)} {}
};

void expect_sums(const AllSums& a, const AllSums& b, const char* what) {
  for (int by = 0; by < 3; ++by) {
    ASSERT_EQ(a.by[by].size(), b.by[by].size());
    EXPECT_EQ(std::memcmp(a.by[by].data(), b.by[by].data(), a.by[by].size() * sizeof(double)), 0) << what << " " << by;
  }
}

/// Weights of all sizes and both signs, of which some are denormal.
std::vector<float> weights_of(std::size_t n, int least, int most) {
  std::mt19937 random(11);
  std::uniform_int_distribution<int> power(least, most);
  std::uniform_real_distribution<float> size(-2, 2);
  std::vector<float> weights(n);
  for (float& w : weights) w = std::ldexp(size(random), power(random));
  return weights;
}

class Sums : public Api {
 protected:
  Sums() : scene_(make()), info_(scene_.info()) {}
  /// Two meshes, one of them twice, another without an instance.
  ballot::Scene make() const {
    const Grid other(5, 0.5f);
    const std::vector<ballot::Mesh> meshes{grid_.mesh(7), other.mesh(9), other.mesh(4)};
    const std::vector<float> transforms{1, 0, 0, 0,    0, 1, 0, 0, 0, 0, 1, 0,  //
                                        1, 0, 0, 0.5f, 0, 1, 0, 0, 0, 0, 1, 0,  //
                                        1, 0, 0, 0,    0, 1, 0, 0, 0, 0, 1, -1};
    const std::vector<std::uint32_t> of{1, 0, 1};
    return ballot::Scene(*device_, meshes, ballot::instances(transforms, of));
  }
  BallotRays rays_of(const std::vector<ballot::Ray>& rays, const std::vector<float>& weights) const {
    BallotRays all = ballot_rays(rays.data(), rays.size());
    if (!weights.empty()) all.weight.data = weights.data(), all.weight.stride[0] = sizeof(float);
    return all;
  }
  AllSums here(const BallotRays& rays, const ballot::Query& query = {}) const {
    AllSums found(info_);
    ballot::Results to;
    to.prim_sums = {found.by[0].data(), found.by[0].size()};
    to.instance_sums = {found.by[1].data(), found.by[1].size()};
    to.mesh_sums = {found.by[2].data(), found.by[2].size()};
    ballot::check(ballot_trace(scene_.handle(), &rays, &to, &query, nullptr));
    return found;
  }
  AllSums there(const std::vector<ballot::Ray>& rays, const std::vector<float>& weights,
                ballot::Query query = {}) const {
    AllSums found(info_);
    ballot::Array<ballot::Ray> in(*device_, rays.size());
    in.write(rays);
    std::vector<ballot::Array<double>> sums;
    for (const auto& one : found.by) sums.emplace_back(*device_, one.size() + 1);  // one record more stays as it is
    for (auto& one : sums) one.write(std::vector<double>(one.size(), 3.5));
    ballot::Array<float> heavy(*device_, std::max<std::size_t>(1, weights.size()));
    if (!weights.empty()) heavy.write(weights), query.weights = heavy;
    scene_.trace(in, {{"prim_sums", sums[0]}, {"instance_sums", sums[1]}, {"mesh_sums", sums[2]}}, rays.size(), query);
    for (int by = 0; by < 3; ++by) {
      std::vector<double> all(sums[by].size());
      sums[by].read(all);
      EXPECT_EQ(all.back(), 3.5);
      found.by[by].assign(all.begin(), all.end() - 1);
    }
    return found;
  }
  /// The sums of hits that are found one by one, by the rule of BallotHits.
  AllSums reference(const std::vector<ballot::Ray>& rays, const std::vector<float>& weights,
                    const ballot::Query& query = {}) const {
    const std::size_t row = std::max(query.first, 1u), n = rays.size() * row;
    std::vector<ballot::Hit> hits(n);
    std::vector<std::uint32_t> instances(n);
    ballot::Results to;
    to.hits = hits.data(), to.instances = instances.data();
    const BallotRays all = rays_of(rays, {});
    ballot::check(ballot_trace(scene_.handle(), &all, &to, &query, nullptr));
    float most = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) most = std::max(most, std::abs(weight(weights, i)));
    const double unit = std::ldexp(1.0, std::max(std::ilogb(most), -126) + int(std::ceil(std::log2(double(n)))) - 61);
    std::vector<std::int64_t> sums[3];
    AllSums found(info_);
    for (int by = 0; by < 3; ++by) sums[by].resize(found.by[by].size());
    const std::vector<std::uint32_t> mesh_of{1, 0, 1};
    for (std::size_t i = 0; i < n; ++i) {
      const auto more = std::int64_t(std::nearbyint(double(weight(weights, i / row)) / unit));
      if (hits[i].prim != ballot::kMiss) {
        sums[0][hits[i].prim] += more, sums[1][instances[i]] += more, sums[2][mesh_of[instances[i]]] += more;
      } else if (i % row == 0) {
        for (auto& s : sums) s.back() += more;
      }
    }
    for (int by = 0; by < 3; ++by)
      for (std::size_t i = 0; i < sums[by].size(); ++i) found.by[by][i] = double(sums[by][i]) * unit;
    return found;
  }
  static float weight(const std::vector<float>& weights, std::size_t i) {
    return weights.empty() ? 1.0f : weights.size() == 1 ? weights[0] : weights[i];
  }

  const ballot::Scene scene_;
  const ballot::SceneInfo info_;
};

TEST_F(Sums, AreThoseOfWholeNumbers) {
  const auto rays = rays_down(3001);
  const std::vector<float> cases[] = {{},
                                      {0.1f},
                                      weights_of(3001, -3, 3),
                                      weights_of(3001, -140, 120),
                                      weights_of(3001, -150, -125),
                                      std::vector<float>(3001, 0.0f)};
  for (const auto& weights : cases) {
    SCOPED_TRACE(weights.size());
    const AllSums expected = reference(rays, weights);
    BallotRays all = rays_of(rays, weights);
    if (weights.size() == 1) all.weight.stride[0] = 0;
    expect_sums(here(all), expected, "host");
    expect_sums(there(rays, weights), expected, "device");
  }
  const AllSums counts = here(rays_of(rays, {}));
  double sum = 0;
  for (const double count : counts.by[0]) sum += count;
  EXPECT_EQ(sum, 3001);
  EXPECT_GT(counts.by[0].back(), 100);
  EXPECT_EQ(counts.by[2][2], 0);  // a mesh without an instance
}

TEST_F(Sums, DoNotDependOnOrderOrMethod) {
  auto rays = rays_down(20000);
  auto weights = weights_of(rays.size(), -20, 20);
  const AllSums expected = reference(rays, weights);
  for (const char* method : {"while-while", "bvh8", "packet"})
    expect_sums(here(rays_of(rays, weights), {.method = method}), expected, method);
  std::ranges::reverse(rays);
  std::ranges::reverse(weights);
  expect_sums(here(rays_of(rays, weights)), expected, "backwards on the host");
  expect_sums(there(rays, weights), expected, "backwards on the device");
  const std::vector<double> doubles(weights.begin(), weights.end());
  BallotRays rows = rays_of(rays, {});
  rows.shape[0] = 100, rows.shape[1] = 200;  // rays in rows are traced in tiles
  for (BallotColumn* c : {&rows.origin, &rows.direction, &rows.t_min, &rows.t_max})
    c->stride[0] = 200 * std::ptrdiff_t(sizeof(ballot::Ray)), c->stride[1] = sizeof(ballot::Ray);
  rows.weight.data = doubles.data(), rows.weight.type = BALLOT_FLOAT64;
  rows.weight.stride[0] = 200 * sizeof(double), rows.weight.stride[1] = sizeof(double);
  expect_sums(here(rows), expected, "rows");
}

TEST_F(Sums, FollowTheOptionsOfHits) {
  const auto rays = rays_down(3001);
  const auto weights = weights_of(rays.size(), -3, 3);
  for (const ballot::Query& query : {ballot::Query{.first = 3}, ballot::Query{.first = 20},
                                     ballot::Query{.cull = "back"}, ballot::Query{.numeric = "exact"}}) {
    const AllSums expected = reference(rays, weights, query);
    expect_sums(here(rays_of(rays, weights), query), expected, "host");
    expect_sums(there(rays, weights, query), expected, "device");
  }
}

TEST_F(Sums, OfManyRaysAreThoseOfTheirParts) {
  const auto rays = rays_down((1u << 18) + 1000);  // more than a stream takes at once
  const auto weights = weights_of(rays.size(), -3, 3);
  const AllSums expected = reference(rays, weights);
  expect_sums(here(rays_of(rays, weights)), expected, "host");
  expect_sums(there(rays, weights), expected, "device");
}

TEST_F(Sums, WhatDoesNotFitIsRefused) {
  const auto rays = rays_down(100);
  auto weights = weights_of(100, -3, 3);
  std::string text;
  weights[41] = weights[70] = -HUGE_VALF;
  EXPECT_EQ(code_of([&] { here(rays_of(rays, weights)); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("weight of ray 41 is -inf; expected finite"), text.npos) << text;
  weights[41] = kNoWeight;
  EXPECT_EQ(code_of([&] { there(rays, weights); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("weights: number 41 is nan; expected finite"), text.npos) << text;

  std::vector<double> few(info_.instances);
  ballot::Results to;
  BallotRays all = rays_of(rays, {});
  to.instance_sums = {few.data(), few.size()};
  EXPECT_EQ(ballot_trace(scene_.handle(), &all, &to, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(std::string(ballot_scene_error(scene_.handle())).find("instance_sums has 3 entries; expected 4"),
            std::string::npos);
  all = rays_of(rays, weights);
  to = {};
  EXPECT_EQ(ballot_trace(scene_.handle(), &all, &to, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  BallotLists none;
  EXPECT_EQ(ballot_list_crossings(scene_.handle(), &all, &none, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
}

TEST_F(Sums, OnTheDeviceNeedTheirArrays) {
  ballot::Array<ballot::Ray> in(*device_, 8);
  in.write(rays_down(8));
  ballot::Array<double> sums(*device_, info_.meshes + 1), small(*device_, 2);
  ballot::Array<float> t(*device_, 8), weights(*device_, 8), few(*device_, 7);
  weights.write(std::vector<float>(8, 1.0f)), few.write(std::vector<float>(7, 1.0f));
  const auto refused = [&](std::vector<ballot::Output> to, ballot::Query query, const char* expected) {
    std::string text;
    EXPECT_EQ(code_of([&] { scene_.trace(in, to, 8, query); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(expected), text.npos) << text;
  };
  refused({{"mesh_sums", small}}, {}, "mesh_sums has 2 entries; expected 4");
  refused({{"mesh_sums", t}}, {}, "the buffer of mesh_sums holds other records; expected float64");
  refused({{"t", t}}, {.weights = weights}, "weights are given, but no sums are wanted");
  refused({{"t", weights}, {"mesh_sums", sums}}, {.weights = weights}, "one array is given for weights and an output");
  refused({{"mesh_sums", sums}}, {.weights = few}, "the buffer of weights has 7 records; expected 8");
  EXPECT_EQ(code_of([&] { scene_.submit(in, {{"mesh_sums", sums}}, 8).wait(); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] {
              scene_.trace(in, {{"t", t}, {"mesh_sums", sums}}, 8, {.masks = few});
            }),
            BALLOT_ERROR_ARGUMENT);
}

}  // namespace
