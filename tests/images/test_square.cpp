// Tests on a square that faces the camera, where every channel of every pixel is known in closed form.
#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

constexpr double kEdge = 1e-5;  // a pixel whose ray passes an edge more closely is not judged

/// Checks every channel of every pixel of a picture of square_scene().
void expect_square(const Picture& p, const View& view) {
  const std::uint32_t width = p.image.width, height = p.image.height;
  std::size_t wrong = 0;
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) {
      const glm::dvec2 at = plane_point(view, x + 0.5, y + 0.5, width, height);
      const glm::dvec2 point = view.orthographic ? at : at * 3.0;
      const double outside = std::max(std::abs(point.x), std::abs(point.y)) - 1;
      if (std::abs(outside) < kEdge) continue;
      const bool hit = outside < 0;
      const double length = view.orthographic ? 1 : std::sqrt(1 + glm::dot(at, at));
      bool right = p.at("A", x, y) == (hit ? 1 : 0) && (p.prim(x, y) != NO_HIT) == hit;
      right = right && std::abs(p.at("Z", x, y) - (hit ? 3 * length : 0)) < 1e-5;
      right = right && glm::length(p.normal(x, y) - glm::vec3(0, 0, hit ? 1 : 0)) < 1e-6f;
      const glm::vec3 seen = hit ? glm::vec3(0.75f, 0.5f, 0.25f) / float(length) : glm::vec3(0);
      right = right && glm::length(p.color(x, y) - seen) < 1e-5f;
      if (hit && std::abs(point.x - point.y) > kEdge) right = right && p.prim(x, y) == (point.y > point.x ? 1u : 0u);
      if (!right && ++wrong <= 3)
        ADD_FAILURE() << "pixel (" << x << ", " << y << ") of " << width << "x" << height << ": A " << p.at("A", x, y)
                      << ", Z " << p.at("Z", x, y) << ", N.Z " << p.at("N.Z", x, y) << ", R " << p.at("R", x, y)
                      << ", prim " << p.prim(x, y) << "; the ray meets the plane at (" << point.x << ", " << point.y
                      << ")";
    }
  EXPECT_EQ(wrong, 0u);
}

TEST(Square, EveryPixelAtEverySize) {
  DeviceScene world(square_scene(), with_validation());
  const View& view = world.scene().views[0];
  for (const auto& [width, height] :
       {std::pair{1u, 1u}, {33u, 7u}, {100u, 50u}, {7u, 65u}, {32u, 32u}, {64u, 96u}, {1u, 40u}}) {
    const Picture p = render(world, view, {.width = width, .height = height});
    ASSERT_EQ(p.image.width, width);
    ASSERT_EQ(p.image.height, height);
    EXPECT_EQ(p.times.rays, width * height);
    expect_square(p, view);
  }
}

TEST(Square, FieldsOfView) {
  DeviceScene world(square_scene(), with_validation());
  View view = world.scene().views[0];
  for (const double yfov : {0.05, 0.7, 2.5}) {
    view.yfov = yfov;
    expect_square(render(world, view, {.width = 45, .height = 31}), view);
  }
}

TEST(Square, Orthographic) {
  DeviceScene world(square_scene(), with_validation());
  View view = world.scene().views[0];
  view.orthographic = true;
  for (const double ymag : {0.5, 1.3, 4.0}) {
    view.ymag = ymag;
    expect_square(render(world, view, {.width = 61, .height = 37}), view);
  }
}

TEST(Square, LargerThanOneChunkOfRays) {
  DeviceScene world(square_scene(), with_validation());
  View view = world.scene().views[0];
  view.yfov = 0.9;  // the second chunk has edges of the square too
  const RenderOptions options{.width = 1100, .height = 1000};
  ASSERT_TRUE(!world.device().is_cpu() || world.tracer().chunk_rays() < options.width * options.height);
  double done = 0;
  const Picture p{world.render(view, options, nullptr,
                               [&](double share) {
                                 EXPECT_GE(share, done);
                                 done = share;
                               }),
                  {}};
  EXPECT_EQ(done, 1);
  EXPECT_TRUE(world.messages().empty());
  expect_square(p, view);
}

TEST(Square, FromBehindTheNormalTurnsToTheEye) {
  Scene scene = square_scene();
  scene.views[0] = view_from({0, 0, -3}, glm::rotate(glm::dmat4(1), glm::radians(180.0), glm::dvec3(0, 1, 0)));
  const Picture p = render(std::move(scene), {.width = 9, .height = 9});
  EXPECT_NEAR(p.at("N.Z", 4, 4), -1, 1e-6);
  EXPECT_NEAR(p.at("Z", 4, 4), 3, 1e-5);
  EXPECT_EQ(p.prim(2, 3), 0u);  // seen from behind, world x grows to the left
}

// Edges of the square cross pixels. The covered area of each pixel is known in closed form.
TEST(Square, SamplesConvergeToCoverage) {
  DeviceScene world(square_scene(), with_validation());
  View view = world.scene().views[0];
  view.orthographic = true;
  view.ymag = 1.61;
  constexpr std::uint32_t kPictureSide = 13;
  const auto overlap = [&](double a, double b) {
    return std::max(0.0, std::min(1.0, b) - std::max(-1.0, a)) / (b - a);
  };
  const auto rms = [&](std::uint32_t spp, double* bias = nullptr) {
    const Picture p = render(world, view, {.width = kPictureSide, .height = kPictureSide, .spp = spp});
    double sum = 0, difference = 0;
    for (std::uint32_t y = 0; y < kPictureSide; ++y)
      for (std::uint32_t x = 0; x < kPictureSide; ++x) {
        const glm::dvec2 lo = plane_point(view, x, y + 1, kPictureSide, kPictureSide),
                         hi = plane_point(view, x + 1, y, kPictureSide, kPictureSide);
        const double error = p.at("A", x, y) - overlap(lo.x, hi.x) * overlap(lo.y, hi.y);
        EXPECT_NEAR(p.at("R", x, y), 0.75 * p.at("A", x, y), 1e-5);
        EXPECT_EQ(p.prim(x, y) == NO_HIT, p.at("Z", x, y) == 0);
        sum += error * error;
        difference += error;
      }
    if (bias) *bias = difference / (kPictureSide * kPictureSide);
    return std::sqrt(sum / (kPictureSide * kPictureSide));
  };
  double bias = 1;
  const double one = rms(1), four = rms(4), many = rms(256, &bias);
  EXPECT_LT(four, 0.75 * one);
  EXPECT_LT(many, 0.25 * four);  // 1 / 8 is expected
  EXPECT_LT(many, 0.03);
  EXPECT_LT(std::abs(bias), 0.005);
}

TEST(Square, TheSamePictureTwice) {
  DeviceScene world(square_scene(), with_validation());
  const View& view = world.scene().views[0];
  const RenderOptions options{.width = 40, .height = 40, .spp = 3};
  const Picture a = render(world, view, options), b = render(world, view, options);
  for (const char* name : {"R", "A", "Z"})
    EXPECT_EQ(a.image.channel(name).floats, b.image.channel(name).floats) << name;
}

}  // namespace
}  // namespace ballot::test
