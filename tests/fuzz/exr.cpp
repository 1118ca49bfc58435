// EXR: pictures, skies and parts of pictures.
#include <ImfThreading.h>

#include <fstream>
#include <iterator>

#include "engine/files/image.h"
#include "engine/files/image_merge.h"
#include "engine/files/make_sky.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

std::string exr(const Image& image) {
  const std::filesystem::path path = put("seed.exr", "");
  write_exr(path, image);
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<std::string> exr_seeds() {
  Image image{.width = 4, .height = 2};
  for (const char* name : {"R", "G", "B"})
    image.channels.push_back({name, Pixel::Half, std::vector<float>(8, 0.5f), {}});
  const std::string sky = exr(image);
  image.channels.push_back({"prim", Pixel::Uint, {}, std::vector<std::uint32_t>(8, 7)});
  image.channels.push_back({"Z", Pixel::Float, std::vector<float>(8, 2), {}});
  image.attributes = {{"part", std::string("0/1")}, {"seconds", 1.0f}, {"film_samples", 4}};
  image.x = image.y = 1;
  image.full_width = image.full_height = 8;
  const std::string part = exr(image);
  // Attributes of types that claim sizes of their own, behind the magic number and the version.
  const std::string two("\2\0\0\0", 4), none(4, '\0');
  const std::string claims = std::string("s\0string\0", 9) + two + "ab" + std::string("v\0stringvector\0\6\0\0\0", 19) +
                             two + "ab" + std::string("p\0preview\0\x8\0\0\0", 14) + none + none +
                             std::string("o\0other\0", 8) + two + "ab";
  return {sky, part, sky.substr(0, 8) + claims + sky.substr(8)};
}

std::vector<std::string> exr_words() {
  return {"channels",
          "chlist",
          "compression",
          "dataWindow",
          "displayWindow",
          "box2i",
          "lineOrder",
          "part",
          "string",
          "seconds",
          "float",
          "tiles",
          "tiledesc",
          "R",
          "G",
          "B",
          "prim",
          "preview",
          "stringvector",
          "floatvector",
          "chlist",
          "box2i",
          std::string("\xff\xff\xff\x7f", 4)};
}

void read_pictures(std::string_view input) {
  Imf::setGlobalThreadCount(0);  // a small picture is read sooner by one thread
  const std::filesystem::path path = put("s.exr", input);
  expect_plain([&] {
    const Image image = read_exr(path);
    expect_plain([&] { merge_parts({{path, image}}, 32); });
  });
  expect_plain([&] { make_sky(path.string()); });
}

}  // namespace

Target exr_target() { return {"exr", Form::Bytes, exr_seeds(), exr_words(), read_pictures, 2048}; }

}  // namespace ballot::fuzz
