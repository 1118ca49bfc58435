// Tests of EXR and PNG: values, channel types, attributes, and files whose headers are wrong.
#include <gtest/gtest.h>
#include <png.h>
#include <signal.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdlib>
#include <string>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/files/image.h"
#include "tests/cpu/needs.h"
#include "tests/temporary.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

class Images : public testing::Test {
 protected:
  static Image sample(std::uint32_t width, std::uint32_t height) {
    Image image{width, height, {}, {}};
    const std::size_t pixels = std::size_t{width} * height;
    for (const char* name : {"R", "G", "B", "A"}) {
      image.channels.push_back({name, Pixel::Half, std::vector<float>(pixels), {}});
    }
    for (const char* name : {"Z", "N.X", "N.Y", "N.Z"}) {
      image.channels.push_back({name, Pixel::Float, std::vector<float>(pixels), {}});
    }
    image.channels.push_back({"prim", Pixel::Uint, {}, std::vector<std::uint32_t>(pixels)});
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
      for (std::size_t i = 0; i < pixels; ++i) {
        if (c < 4)
          image.channels[c].floats[i] = static_cast<float>((i * 31 + c) % 2048) / 16;  // exact in half
        else if (c < 8)
          image.channels[c].floats[i] = std::sin(static_cast<float>(i + c));
        else
          image.channels[c].uints[i] = static_cast<std::uint32_t>(0xFFFFFFFFu - i);
      }
    }
    return image;
  }
  template <class Call>
  static std::string error_of(Call call) {
    try {
      call();
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  }
  std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  const test::TemporaryFolder kept_;
  const fs::path folder_ = kept_.path();
};

TEST_F(Images, ExrKeepsValuesTypesAndAttributes) {
  for (const auto& [width, height] : {std::pair{1u, 1u}, {1u, 40u}, {67u, 1u}, {131u, 70u}}) {
    Image image = sample(width, height);
    image.attributes = {{"scene", "cornell"}, {"spp", 4}, {"seconds", 0.25f}, {"method", ""}};
    std::array<float, 16> matrix{};
    for (std::size_t i = 0; i < 16; ++i) matrix[i] = static_cast<float>(i) + 0.5f;
    image.attributes["worldToCamera"] = matrix;
    write_exr(folder_ / "a.exr", image);
    const Image back = read_exr(folder_ / "a.exr");
    EXPECT_EQ(back.width, width);
    EXPECT_EQ(back.height, height);
    EXPECT_EQ(back.attributes, image.attributes);
    ASSERT_EQ(back.channels.size(), image.channels.size());
    for (const Channel& channel : image.channels) {
      EXPECT_EQ(back.channel(channel.name).type, channel.type) << channel.name;
      EXPECT_EQ(back.channel(channel.name).floats, channel.floats) << channel.name;
      EXPECT_EQ(back.channel(channel.name).uints, channel.uints) << channel.name;
    }
  }
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(Images, HalfIsClampedNotInfinite) {
  Image image{6, 1, {{"R", Pixel::Half, {1e9f, -1e9f, INFINITY, 65504, NAN, 1e-30f}, {}}}, {}};
  write_exr(folder_ / "a.exr", image);
  const auto values = read_exr(folder_ / "a.exr").channel("R").floats;
  EXPECT_EQ(values[0], 65504);
  EXPECT_EQ(values[1], -65504);
  EXPECT_EQ(values[2], 65504);
  EXPECT_EQ(values[3], 65504);
  EXPECT_TRUE(std::isnan(values[4]));
  EXPECT_EQ(values[5], 0);
}

TEST_F(Images, FloatKeepsEveryBitPattern) {
  Image image{4, 1, {{"Z", Pixel::Float, {INFINITY, -0.0f, 1e-42f, 3.4e38f}, {}}}, {}};
  write_exr(folder_ / "a.exr", image);
  const auto values = read_exr(folder_ / "a.exr").channel("Z").floats;
  EXPECT_EQ(values, image.channels[0].floats);
  EXPECT_TRUE(std::signbit(values[1]));
}

TEST_F(Images, MissingChannelListsTheNames) {
  EXPECT_EQ(error_of([&] { (void)sample(1, 1).channel("depth"); }),
            "the image has no channel 'depth'; there are: R, G, B, A, Z, N.X, N.Y, N.Z, prim");
}

TEST_F(Images, ImagesThatDoNotFitTogetherAreRefused) {
  Image image = sample(4, 4);
  image.channels[0].floats.pop_back();
  EXPECT_NE(error_of([&] { write_exr(folder_ / "a.exr", image); }).find("channel R has 15 values, expected 4 x 4"),
            std::string::npos);
  image = sample(4, 4);
  image.channels[1].name = "R";
  EXPECT_NE(error_of([&] { write_exr(folder_ / "a.exr", image); }), "no error");
  image = sample(4, 4);
  image.attributes["compression"] = "none";
  EXPECT_NE(error_of([&] { write_exr(folder_ / "a.exr", image); }), "no error");
  image = sample(4, 4);
  image.attributes["type"] = "none";
  EXPECT_NE(error_of([&] { write_exr(folder_ / "a.exr", image); }), "no error");
  EXPECT_NE(error_of([&] { write_exr(folder_ / "a.exr", Image{}); }), "no error");
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(Images, DamagedExrIsRefusedByName) {
  write_exr(folder_ / "a.exr", sample(64, 64));
  const auto whole = read_file(folder_ / "a.exr");
  const fs::path bad = folder_ / "bad.exr";
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 97) {
    write_file(bad, std::span(whole).first(size));
    EXPECT_TRUE(error_of([&] { read_exr(bad); }).starts_with("cannot read " + bad.string() + ": ")) << size;
  }
  EXPECT_TRUE(error_of([&] { read_exr(folder_ / "none.exr"); }).starts_with("cannot read "));
  EXPECT_TRUE(error_of([&] { read_exr(folder_); }).starts_with("cannot read "));
}

TEST_F(Images, FlippedHeaderBytesNeverCrash) {
  write_exr(folder_ / "a.exr", sample(16, 16));
  const auto whole = read_file(folder_ / "a.exr");
  for (std::size_t i = 0; i < std::min<std::size_t>(whole.size(), 700); i += 2) {
    for (const int value : {0, 0xff}) {
      auto bytes = whole;
      bytes[i] = static_cast<std::byte>(value);
      write_file(folder_ / "bad.exr", bytes);
      error_of([&] { read_exr(folder_ / "bad.exr"); });
    }
  }
}

TEST_F(Images, FullDiskLeavesNothing) {
  const rlim_t limit = 1000;
  rlimit old{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{limit, old.rlim_max};
  const Image image = sample(300, 300);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string exr = error_of([&] { write_exr(folder_ / "a.exr", image); });
  const std::string png = error_of([&] { write_png(folder_ / "a.png", image); });
  ::setrlimit(RLIMIT_FSIZE, &old);
  ::signal(SIGXFSZ, handler);
  EXPECT_EQ(exr, "cannot write " + (folder_ / "a.exr").string() + ": File too large");
  EXPECT_EQ(png, "cannot write " + (folder_ / "a.png").string() + ": File too large");
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(Images, ExrheaderReadsTheFile) {
  BALLOT_NEEDS(std::system("command -v exrheader > /dev/null") == 0, "exrheader is not installed (package openexr)")
  Image image = sample(8, 8);
  image.attributes["view"] = "view0";
  write_exr(folder_ / "a.exr", image);
  const std::string command = fmt::format("exrheader {0}/a.exr > {0}/text", folder_.string());
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto bytes = read_file(folder_ / "text");
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (const char* part : {"R, 16-bit floating-point", "Z, 32-bit floating-point", "N.X, 32-bit floating-point",
                           "prim, 32-bit unsigned integer", "zip, multi-scanline blocks", "\"view0\""}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  }
}

TEST_F(Images, PngHoldsTheSrgbCurve) {
  const std::vector<float> linear = {0, 0.0031308f, 0.21404114f, 0.5f, 1, 7, -1, NAN};
  Image image{8, 1, {}, {}};
  for (const char* name : {"R", "G", "B"}) image.channels.push_back({name, Pixel::Half, linear, {}});
  image.channels[1].floats.assign(8, 0);
  write_png(folder_ / "a.png", image);

  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&png, (folder_ / "a.png").c_str()), 0);
  EXPECT_EQ(png.width, 8u);
  png.format = PNG_FORMAT_RGB;
  std::vector<int> red, green;
  std::vector<png_byte> bytes(PNG_IMAGE_SIZE(png));
  ASSERT_NE(png_image_finish_read(&png, nullptr, bytes.data(), 0, nullptr), 0);
  for (std::size_t i = 0; i < 8; ++i) {
    red.push_back(bytes[3 * i]);
    green.push_back(bytes[3 * i + 1]);
  }
  EXPECT_EQ(red, (std::vector<int>{0, 10, 128, 188, 255, 255, 0, 0}));
  EXPECT_EQ(green, std::vector<int>(8, 0));
}

TEST_F(Images, NeutralToneFollowsItsSpecification) {
  const Tone neutral{.neutral = true}, brighter{.neutral = true, .exposure = 1};
  const auto expect_near = [](const std::array<float, 3>& found, const std::array<float, 3>& expected) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-5f) << c;
  };
  expect_near(toned({0, 0, 0}, neutral), {0, 0, 0});
  expect_near(toned({0.5f, 0.5f, 0.5f}, neutral), {0.46f, 0.46f, 0.46f});
  expect_near(toned({0.04f, 0.04f, 0.04f}, neutral), {0.01f, 0.01f, 0.01f});  // 6.25 x^2 where x is below 0.08
  expect_near(toned({10, 10, 10}, neutral), {0.993898f, 0.993898f, 0.993898f});
  expect_near(toned({4, 0, 0}, neutral), {0.983448f, 0.306368f, 0.306368f});
  expect_near(toned({2, 0, 0}, brighter), {0.983448f, 0.306368f, 0.306368f});
  expect_near(toned({NAN, -1, INFINITY}, neutral), toned({0, 0, 1e6f}, neutral));
  expect_near(toned({2, 0.25f, NAN}, {}), {1, 0.25f, 0});
  Image image = sample(2, 2);
  EXPECT_FALSE(tone_of(image).neutral);
  label_tone(image, brighter);
  EXPECT_TRUE(tone_of(image).neutral);
  EXPECT_EQ(tone_of(image).exposure, 1);
  image.attributes["exposure"] = std::string("much");
  EXPECT_EQ(tone_of(image).exposure, 0);
}

TEST_F(Images, PngErrorsNameTheReason) {
  EXPECT_NE(error_of([&] { write_png(folder_ / "none" / "a.png", sample(2, 2)); }).find("there is no folder"),
            std::string::npos);
  EXPECT_NE(error_of([&] { write_png(folder_ / "a.png", Image{}); }).find("no channel 'R'"), std::string::npos);
  Image image = sample(2, 2);
  image.width = image.height = 0;
  for (Channel& channel : image.channels) channel.floats.clear();
  EXPECT_NE(error_of([&] { write_png(folder_ / "a.png", image); }), "no error");
  EXPECT_EQ(file_count(), 0u);
}

}  // namespace
}  // namespace ballot
