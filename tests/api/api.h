// The fixture of the tests of the installed library: a device, a mesh, rays.
#pragma once

#include <ballot/ballot.h>
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

using ballot::Code;

/// Returns the code of the Error that `call` throws, with its text in `text`; nothing thrown is a failure.
template <class Call>
Code code_of(const Call& call, std::string* text = nullptr) {
  try {
    call();
  } catch (const ballot::Error& error) {
    if (text) *text = error.what();
    EXPECT_FALSE(std::string(error.what()).empty());
    return error.code();
  }
  ADD_FAILURE() << "no error";
  return BALLOT_ERROR_WORK;
}

/// Returns the first records of an array on the device.
template <class T>
std::vector<T> read(const ballot::Array<T>& array, std::size_t count) {
  std::vector<T> all(count);
  array.read(all);
  return all;
}

/// Compares bits.
template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

/// n x n squares in the plane z = 0, over [0, 1]^2.
struct Grid {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
  explicit Grid(std::uint32_t n, float z = 0) {
    for (std::uint32_t y = 0; y <= n; ++y)
      for (std::uint32_t x = 0; x <= n; ++x)
        positions.insert(positions.end(), {float(x) / float(n), float(y) / float(n), z});
    for (std::uint32_t y = 0; y < n; ++y)
      for (std::uint32_t x = 0; x < n; ++x) {
        const std::uint32_t a = y * (n + 1) + x, b = a + n + 1;
        indices.insert(indices.end(), {a, a + 1, b, b, a + 1, b + 1});
      }
  }
  ballot::Mesh mesh(std::uint32_t id = 0) const {
    ballot::Mesh made = ballot::mesh(positions, indices);
    made.id = id;
    return made;
  }
};

inline std::vector<ballot::Ray> rays_down(std::size_t n) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> at(-0.5f, 1.5f);
  std::vector<ballot::Ray> rays(n);
  for (ballot::Ray& r : rays) r = {{at(random), at(random), 2}, 0, {0, 0, -1}, 10};
  return rays;
}

inline bool inside(const ballot::Ray& r) {
  return r.origin[0] >= 0 && r.origin[0] <= 1 && r.origin[1] >= 0 && r.origin[1] <= 1;
}

/// Moves the vertices of a mesh, or all instances, at once.
inline void move(ballot::Scene& scene, std::uint32_t mesh, std::span<const float> positions) {
  scene.set_vertices(mesh, positions);
  scene.commit();
}
inline void place(ballot::Scene& scene, std::span<const float> transforms, std::size_t stride = 0) {
  scene.set_transforms(transforms, stride);
  scene.commit();
}

class Api : public testing::Test {
 protected:
  static void SetUpTestSuite() { device_ = std::make_unique<ballot::Device>("", true); }
  static void TearDownTestSuite() {
    EXPECT_EQ(ballot_device_message_count(device_->handle()), 0u);
    device_.reset();
  }
  static inline std::unique_ptr<ballot::Device> device_;
  const Grid grid_{16};
};
