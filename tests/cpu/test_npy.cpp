// Tests of .npy files: files that NumPy writes are read; files that it cannot have written are refused with a message
// that names the file.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/files/npy.h"
#include "tests/temporary.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRays = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 8), }";
constexpr const char* kHits =
    "{'descr': [('t', '<f4'), ('prim', '<u4'), ('u', '<f4'), ('v', '<f4')], 'fortran_order': False, 'shape': (1,), }";

class Npy : public testing::Test {
 protected:
  // Writes a file with this header and `bytes` bytes after it.
  void make(const std::string& header, std::size_t bytes, char version = 1) {
    std::string text = std::string("\x93NUMPY") + version + '\0';
    for (int i = 0; i < (version == 1 ? 2 : 4); ++i) text += static_cast<char>(header.size() >> (8 * i) & 255);
    write_file(path_, text + header + std::string(bytes, '\0'));
  }
  void make_text(const std::string& text) { write_file(path_, text); }

  std::string error() const {
    try {
      read_rays(path_);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), Failure::Work);
      const std::string text = e.what();
      EXPECT_TRUE(text.starts_with("cannot read " + path_.string() + ": ")) << text;
      return text;
    }
    return "no error";
  }
  void expect_error(const std::string& part) const {
    EXPECT_NE(error().find(part), std::string::npos) << error() << "\nexpected: " << part;
  }
  const test::TemporaryFolder kept_;
  const fs::path path_ = kept_.path() / "file.npy";
};

bool same(const auto& a, const auto& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0);
}

TEST_F(Npy, RaysComeBackBitForBit) {
  for (const std::size_t count : {0, 1, 7, 1000}) {
    std::vector<Ray> rays(count, Ray{{1, 2, INFINITY}, 0.5f, {-0.0f, 1e-42f, NAN}, 1e30f});
    write_rays(path_, rays);
    EXPECT_EQ((fs::file_size(path_) - count * sizeof(Ray)) % 64, 0u);
    EXPECT_TRUE(same(read_rays(path_), rays));
  }
}

TEST_F(Npy, AnInfiniteEndIsTheLargestFloat) {
  write_rays(path_, std::vector<Ray>{{{1, 2, 3}, 0, {0, 0, 1}, INFINITY}, {{1, 2, 3}, 0, {0, 0, 1}, NAN}});
  const auto rays = read_rays(path_);
  EXPECT_EQ(rays[0].t_max, std::numeric_limits<float>::max());
  EXPECT_TRUE(std::isnan(rays[1].t_max));
}

TEST_F(Npy, RaysWithoutBoundsHaveSixColumns) {
  make("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 6), }", 48);
  auto bytes = read_file(path_);
  const float values[6] = {1, 2, 3, 4, 5, 6};
  std::memcpy(bytes.data() + bytes.size() - sizeof(values), values, sizeof(values));
  write_file(path_, bytes);
  const auto rays = read_rays(path_);
  ASSERT_EQ(rays.size(), 2u);
  EXPECT_TRUE(same(std::vector(rays.begin() + 1, rays.end()),
                   std::vector<Ray>{{{1, 2, 3}, 0, {4, 5, 6}, std::numeric_limits<float>::max()}}));
}

// In Fortran order the first index runs fastest: what numpy.save writes of rays[:, columns].
TEST_F(Npy, FortranOrderIsRead) {
  constexpr std::size_t kCount = 5;
  for (const std::size_t columns : {8, 6}) {
    make(fmt::format("{{'descr': '<f8', 'fortran_order': True, 'shape': ({}, {}), }}", kCount, columns),
         kCount * columns * sizeof(double));
    std::vector<double> values(kCount * columns);
    for (std::size_t i = 0; i < kCount; ++i)
      for (std::size_t k = 0; k < columns; ++k) values[k * kCount + i] = double(10 * i + k);
    auto bytes = read_file(path_);
    std::memcpy(bytes.data() + bytes.size() - values.size() * sizeof(double), values.data(),
                values.size() * sizeof(double));
    write_file(path_, bytes);
    const auto first = [](const Ray& ray) { return ray.origin.x; };
    RayFile part(path_);
    part.choose_part(1, 2);
    std::vector<Ray> some(kCount);
    some.resize(part.read(some));
    ASSERT_EQ(some.size(), 3u);
    EXPECT_EQ(first(some[0]), 20);
    const auto rays = read_rays(path_);
    ASSERT_EQ(rays.size(), kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
      EXPECT_EQ(first(rays[i]), 10 * float(i));
      EXPECT_EQ(rays[i].dir.z, 10 * float(i) + (columns == 8 ? 6 : 5));
    }
  }
}

TEST_F(Npy, PartsAreAllRaysOnce) {
  std::vector<Ray> rays(1000);
  for (std::size_t i = 0; i < rays.size(); ++i) rays[i] = {{float(i), 2, 3}, 0, {0, 0, 1}, 1};
  write_rays(path_, rays);
  for (const std::uint64_t parts : {1, 3, 7, 1000, 1001}) {
    std::vector<Ray> all;
    for (std::uint64_t i = 0; i < parts; ++i) {
      RayFile file(path_);
      file.choose_part(i, parts);
      std::vector<Ray> some(file.count() + 5);
      some.resize(file.read(some));
      all.insert(all.end(), some.begin(), some.end());
    }
    EXPECT_TRUE(same(all, rays)) << parts;
  }
}

TEST_F(Npy, HitsComeBackBitForBit) {
  for (const std::size_t count : {0, 1, 1000}) {
    std::vector<Hit> hits(count, Hit{1.5f, NO_HIT, 0.25f, -0.0f});
    write_hits(path_, hits);
    EXPECT_TRUE(same(read_hits(path_), hits));
  }
}

TEST_F(Npy, TrianglesSayTheirShape) {
  write_triangles(path_, UnsetVector<Triangle>(5, Triangle{}));
  const auto bytes = read_file(path_);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  EXPECT_NE(text.find("'descr': '<f4', 'fortran_order': False, 'shape': (5, 3, 3), }"), std::string::npos);
  EXPECT_EQ(bytes.size(), 128u + 5 * 36);
}

TEST_F(Npy, DoublesAreRoundedAndStayFinite) {
  const double values[8] = {1.0 / 3, -1e300, 0, 0, 1, -0.0, 1e-60, 1e300};
  make("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 8), }", 2 * sizeof(values));
  auto bytes = read_file(path_);
  std::memcpy(bytes.data() + bytes.size() - sizeof(values), values, sizeof(values));
  write_file(path_, bytes);
  const auto rays = read_rays(path_);
  ASSERT_EQ(rays.size(), 2u);
  EXPECT_EQ(rays[1].origin.x, static_cast<float>(1.0 / 3));
  EXPECT_EQ(rays[1].origin.y, -std::numeric_limits<float>::max());
  EXPECT_TRUE(std::signbit(rays[1].dir.y));
  EXPECT_EQ(rays[1].dir.z, 0.0f);
  EXPECT_EQ(rays[1].t_max, std::numeric_limits<float>::max());
}

TEST_F(Npy, EveryVersionAndSpellingIsRead) {
  for (const char version : {'\1', '\2', '\3'}) {
    make(kRays, 64, version);
    EXPECT_EQ(read_rays(path_).size(), 2u);
  }
  for (const char* header : {"{\"shape\":(2,8),\"descr\":\"<f4\",\"fortran_order\":False}",
                             "{'descr': '|f4', 'fortran_order': False, 'shape': (2, 8)}  \n",
                             " { 'descr' : '<f4' , 'fortran_order' : False , 'shape' : ( 2L , 8L , ) , } \n"}) {
    make(header, 64);
    EXPECT_EQ(read_rays(path_).size(), 2u) << header;
  }
}

TEST_F(Npy, OtherDtypesAndShapesAreNamed) {
  make("{'descr': '>f4', 'fortran_order': False, 'shape': (2, 8), }", 64);
  expect_error("found dtype '>f4' of shape (2, 8); expected float32 '<f4' or float64 '<f8'");
  make("{'descr': '<i4', 'fortran_order': False, 'shape': (2, 8), }", 64);
  expect_error("found dtype '<i4'");
  make(kHits, 16);
  expect_error("found dtype [('t', '<f4'), ('prim', '<u4'), ('u', '<f4'), ('v', '<f4')] of shape (1,)");
  make("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 8), }", 60);
  expect_error("Fortran order, of shape (2, 8), but 60 bytes follow");
  for (const char* shape : {"(8,)", "()", "(8, 2)", "(2, 8, 1)", "(2, 7)"}) {
    make(fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': {}, }}", shape), 64);
    expect_error(fmt::format("of shape {}; expected shape (n, 8)", shape));
  }
}

TEST_F(Npy, SizeIsHeldAgainstTheFile) {
  for (const std::size_t bytes : {0, 32, 63, 65, 96}) {
    make(kRays, bytes);
    expect_error(fmt::format("but {} bytes follow the header where 2 items of 32 bytes are expected", bytes));
  }
  for (const char* count : {"18446744073709551615", "576460752303423488", "4611686018427387904", "1000000000000"}) {
    make(fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, 8), }}", count), 64);
    expect_error("but 64 bytes follow the header");
  }
}

TEST_F(Npy, HostileHeadersAreRefused) {
  make_text("");
  expect_error("it has 0 bytes, too few");
  make_text("PK\x03\x04 something longer");
  expect_error("not a .npy file");
  make_text(std::string("\x93NUMPY\x04\x00\x00\x00", 10));
  expect_error("version 4.0 is not known");
  make_text(std::string("\x93NUMPY\x01\x00", 8));
  expect_error("it ends early");
  make_text(std::string("\x93NUMPY\x01\x00\xff\xff{'descr'", 18));
  expect_error("its header claims 65535 bytes, but 8 are left");
  make_text(std::string("\x93NUMPY\x02\x00\xff\xff\xff\xff{", 13));
  expect_error("its header claims 4294967295 bytes");
  const std::string good = kRays;
  for (const std::string& header :
       {std::string(), std::string("{"), std::string("{}"), std::string(60000, '('), good + "x", good.substr(1),
        std::string("{'descr': ") + std::string(50000, '['), std::string(5000, '{'),
        std::string("{'descr': '<f4', 'fortran_order': Maybe, 'shape': (2, 8), }"),
        std::string("{'descr': '<f4', 'fortran_order': False, }"), std::string("{'shape': (2, 8), }"),
        std::string("{'descr': '<f4', 'fortran_order': False, 'shape': (2, -8), }"),
        std::string("{'descr': '<f4', 'fortran_order': False, 'shape': (2e9, 8), }"),
        std::string("{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999999, 8), }"),
        std::string("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 8), 'extra': 1}"),
        std::string("{'descr': '<f4', 'fortran_order': False, 'shape': (,), }")}) {
    make(header, 64);
    expect_error("its header is not a dictionary");
  }
}

TEST_F(Npy, EveryTruncationIsAnErrorAndNeverACrash) {
  make(kRays, 64);
  const auto whole = read_file(path_);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    write_file(path_, std::span(whole).first(size));
    EXPECT_NE(error(), "no error") << size;
  }
}

TEST_F(Npy, EveryFlippedByteIsReadOrRefused) {
  make(kRays, 64);
  const auto whole = read_file(path_);
  for (std::size_t i = 0; i < whole.size() - 64; ++i) {
    for (const int value : {0, 0xff, 0x27, 0x28, 0x7b, 0x39}) {
      auto bytes = whole;
      bytes[i] = static_cast<std::byte>(value);
      write_file(path_, bytes);
      error();
    }
  }
}

TEST_F(Npy, HitsOfAnotherDtypeAreRefused) {
  make(kRays, 64);
  EXPECT_THROW(read_hits(path_), Error);
  make(
      "{'descr': [('t', '<f4'), ('prim', '<i4'), ('u', '<f4'), ('v', '<f4')], 'fortran_order': False, 'shape': (1,), }",
      16);
  EXPECT_THROW(read_hits(path_), Error);
  make(kHits, 17);
  EXPECT_THROW(read_hits(path_), Error);
}

TEST_F(Npy, MissingFileFolderAndPipeAreNamed) {
  EXPECT_NE(error().find("No such file"), std::string::npos);
  EXPECT_THROW(read_rays(fs::temp_directory_path()), Error);
  EXPECT_THROW(read_rays("/dev/null"), Error);
  EXPECT_THROW(write_rays("/nowhere/at/all.npy", {}), Error);
}

}  // namespace
}  // namespace ballot
