// Tests of lib/numeric/products.glsl: differences of products have exact signs and full relative precision, for each
// value of knob `products` that the device supports.
#include <bit>
#include <cmath>
#include <set>

#include "shaders/shared/knobs.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

using Factors = glm::vec4;  // of the difference x * y - z * w

/// Returns factors whose products nearly cancel, and some random ones. The two products have factors of the same
/// number, off by up to two ulps, or the same factors swapped.
std::vector<Factors> nearly_equal_products(std::size_t count) {
  shapes::Random random(7);
  const auto neighbour = [&](float x) {
    return std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) + std::uint32_t(random.below(5)) - 2u);
  };
  std::vector<Factors> all;
  for (std::size_t i = 0; i < count; ++i) {
    const float scale = std::ldexp(1.f, int(random.below(80)) - 40), x = random.in(1, 4) * scale, y = random.in(-3, 5);
    const float ratio = i % 3 ? 1 : random.in(0.3f, 3);
    const Factors near{x, y, neighbour(x * ratio), neighbour(y / ratio)};
    all.push_back(i % 5 ? near : Factors{x, y, y, x});
    if (i % 7 == 0) all.back() = {x, y, random.in(-4, 4) * scale, random.in(-4, 4)};
  }
  return all;
}

/// Computes the differences of products on the device.
std::vector<float> run(Context& gpu, Products how, const std::vector<Factors>& factors) {
  Kernel kernel(gpu, {.name = "products",
                      .file = "../tests/device/shaders/products.comp",
                      .defines = {{"BALLOT_PRODUCTS", int(how)}},
                      .constants = {},
                      .group_size = 64});
  Buffer<Factors> in(gpu, factors.size(), Access::Storage, "factors");
  Buffer<float> out(gpu, factors.size(), Access::Storage, "differences");
  in.upload(factors);
  kernel.bind(0, in);
  kernel.bind(1, out);
  gpu.submit("products", [&](Commands& cmd) {
    kernel.dispatch(cmd, std::uint32_t(factors.size() / 64), nullptr, 0);
    cmd.barrier();
  });
  std::vector<float> differences(factors.size());
  out.download(differences);
  return differences;
}

/// Expects that only differences below zero have a sign bit. With Products::Fma, lib/numeric/triangle_watertight.glsl
/// looks at the sign bit alone.
void expect_unsigned_zeros(Context& gpu) {
  const float values[] = {0.0f, -0.0f, 1.0f, -1.0f, 3.0f, -0x1p-80f, 0x1p-80f, 0x1p-126f};
  std::vector<Factors> factors;
  for (const float x : values)
    for (const float y : values)
      for (const float z : values)
        for (const float w : values) factors.emplace_back(x, y, z, w);
  const std::vector<float> differences = run(gpu, ballot::Products::Fma, factors);
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const Factors f = factors[i];
    EXPECT_TRUE(!std::signbit(differences[i]) || double(f.x) * f.y < double(f.z) * f.w)
        << f.x << " * " << f.y << " - " << f.z << " * " << f.w << " on " << gpu.info().name;
  }
}

class ProductsTest : public DeviceTest {};

// Also tests the value that the tuning table chooses for this device. It may rely on an fma() that rounds once.
TEST_F(ProductsTest, KeepTheExactSign) {
  Context& gpu = *gpu_;
  std::set<ballot::Products> ways{ballot::Products::Split,
                                  kernel_config_for(kMethods[0], find_numeric(kDefaultNumeric), gpu.info()).products};
  if (gpu.info().float64) ways.insert(ballot::Products::Float64);
  const std::vector<Factors> factors = nearly_equal_products(64 * 2000);
  for (const ballot::Products how : ways) {
    const std::vector<float> differences = run(gpu, how, factors);
    std::size_t wrong_sign = 0, imprecise = 0;
    for (std::size_t i = 0; i < factors.size(); ++i) {
      const Factors f = factors[i];
      const double exact = double(f.x) * f.y - double(f.z) * f.w;  // in double, only the subtraction rounds
      wrong_sign += (differences[i] > 0) != (exact > 0) || (differences[i] < 0) != (exact < 0);
      imprecise += std::abs(differences[i] - exact) > 0x1p-23 * std::abs(exact);
    }
    EXPECT_EQ(wrong_sign, 0u) << "BALLOT_PRODUCTS " << int(how) << " on " << gpu.info().name;
    EXPECT_EQ(imprecise, 0u) << "BALLOT_PRODUCTS " << int(how) << " on " << gpu.info().name;
    if (how == ballot::Products::Fma) expect_unsigned_zeros(gpu);
  }
}

}  // namespace
}  // namespace ballot
