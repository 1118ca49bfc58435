// Tests of small files that claim much: they are refused before memory is taken, whatever reads them.
#include <zlib.h>

#include <fstream>

#include "engine/core/memory.h"
#include "engine/files/image.h"
#include "engine/files/make_sky.h"
#include "engine/files/texture.h"
#include "tests/cpu/gltf_builder.h"

namespace ballot::test {
namespace {

template <class T>
std::string bytes_of(std::initializer_list<T> values) {
  return {reinterpret_cast<const char*>(values.begin()), values.size() * sizeof(T)};
}

std::string attribute(std::string name, std::string type, const std::string& value, std::int64_t claimed = -1) {
  const auto size = static_cast<std::int32_t>(claimed < 0 ? std::int64_t(value.size()) : claimed);
  return name + '\0' + type + '\0' + bytes_of({size}) + value;
}

std::string channel(const std::string& name) { return name + '\0' + bytes_of<std::int32_t>({2, 0, 1, 1}); }

struct Exr {
  std::string extra = {};
  std::array<std::int32_t, 4> window{0, 0, 1, 0};
  std::int32_t version = 2;
  char compression = 0;
  std::size_t behind = 0;  // bytes after the header
};

/// An EXR of a channel Y of float. Its pixels are zeros.
std::string exr(const Exr& e) {
  std::string out = bytes_of({20000630, e.version});
  out += attribute("channels", "chlist", channel("Y") + '\0');
  out += attribute("compression", "compression", std::string(1, e.compression));
  for (const char* name : {"dataWindow", "displayWindow"})
    out += attribute(name, "box2i", bytes_of({e.window[0], e.window[1], e.window[2], e.window[3]}));
  out += attribute("lineOrder", "lineOrder", std::string(1, '\0'));
  out += attribute("pixelAspectRatio", "float", bytes_of({1.0f}));
  out += attribute("screenWindowCenter", "v2f", bytes_of({0.0f, 0.0f}));
  out += attribute("screenWindowWidth", "float", bytes_of({1.0f}));
  out += e.extra + '\0';
  return out + std::string(e.behind, '\0');
}

/// A limit on the memory beyond what the process has now, while a test runs.
class Limit {
 public:
  explicit Limit(std::uint64_t bytes) { set_memory_limit(resident() + bytes); }
  ~Limit() { set_memory_limit(0); }

 private:
  static std::uint64_t resident() {
    std::ifstream in("/proc/self/statm");
    std::uint64_t all = 0, resident = 0;
    in >> all >> resident;
    return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  }
};

void refuse_exr(const Exr& e, const std::string& reason) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.exr", exr(e));
  for (const auto& read : {+[](const std::filesystem::path& p) { read_exr(p); },
                           +[](const std::filesystem::path& p) { read_exr_header(p); },
                           +[](const std::filesystem::path& p) { make_sky(p.string()); }})
    expect_error(Failure::Work, {"cannot read " + path.string() + ": " + reason}, [&] { read(path); });
}

TEST(ExrClaims, WhatIsWholeIsRead) {
  const TemporaryFolder folder;
  const std::string offset = bytes_of<std::int32_t>({0, 0}),
                    line = bytes_of<std::int32_t>({0, 8}) + bytes_of({1.0f, 2.0f});
  std::string text = attribute("words", "stringvector", bytes_of({2}) + "ab" + bytes_of({1}) + "c") +
                     attribute("preview", "preview", bytes_of({1, 1, 7})) + attribute("name2", "string", "text") +
                     attribute("mine", "unknowntype", "12345") + attribute("numbers", "floatvector", bytes_of({1.0f}));
  std::string file = exr({.extra = text});
  const auto place = static_cast<std::int32_t>(file.size() + 8);
  file += bytes_of<std::int32_t>({place, 0}) + line;
  const Image image = read_exr(folder.write("a.exr", file));
  EXPECT_EQ(image.channel("Y").floats, (std::vector<float>{1, 2}));
  EXPECT_EQ(std::get<std::string>(image.attributes.at("name2")), "text");
}

TEST(ExrClaims, AttributesLieInTheFile) {
  constexpr std::int64_t kMost = 0x7FFFFFFF;
  for (const char* type : {"string", "floatvector", "stringvector", "preview", "unknowntype", "idmanifest"})
    refuse_exr({.extra = attribute("x", type, "abcdefgh", kMost)}, "its attribute x claims 2147483647 bytes, but ");
  refuse_exr({.extra = attribute("x", "string", "abcdefgh", 0xFFFFFFFF)}, "its attribute x claims 4294967295 bytes");
  refuse_exr({.extra = attribute("x", "stringvector", bytes_of<std::int32_t>({0x7FFFFFFF, 0}))},
             "its attribute x claims a text of 2147483647 bytes");
  refuse_exr({.extra = attribute("x", "preview", bytes_of({30000, 30000, 0}))},
             "its attribute x claims 30000 x 30000 pixels in 12 bytes");
}

// OpenEXR reads 4 bytes of a float, whatever the file says, and would take what follows as the next attribute.
TEST(ExrClaims, NothingHidesInAnAttribute) {
  const std::string hidden = attribute("y", "string", "", 0x7FFFFFFF);
  refuse_exr({.extra = attribute("x", "float", bytes_of({1.0f}) + hidden)}, "its attribute x is a float of ");
  refuse_exr({.extra = attribute("x", "box2i", bytes_of({0, 0, 1, 1}) + hidden)}, "its attribute x is a box2i of ");
  refuse_exr({.extra = attribute("x", "preview", bytes_of({0, 0}) + hidden)}, "its attribute x claims 0 x 0 pixels");
  refuse_exr({.extra = attribute("x", "chlist", '\0' + hidden)}, "its list of channels has not the ");
  refuse_exr({.extra = attribute("x", "floatvector", "ab")}, "its attribute x is a floatvector of 2 bytes");
}

TEST(ExrClaims, PicturesTilesAndTablesAreNotFarLargerThanTheFile) {
  refuse_exr({.window = {0, 0, 1 << 20, 1 << 20}}, "its header claims a picture of 1048577 x 1048577 pixels");
  refuse_exr({.window = {-2147483647, 0, 2147483647, 0}}, "its header claims a picture of 4294967295 x 1 pixels");
  refuse_exr({.window = {0, 0, 0, 99999}}, "its header claims 100000 chunks, but the file has ");
  refuse_exr({.window = {0, 0, -1, 0}}, "its data window is empty");
  const auto tiles = [](std::uint32_t width, std::uint32_t height) {
    return attribute("tiles", "tiledesc", bytes_of({width, height}) + '\0');
  };
  refuse_exr({.extra = tiles(1 << 16, 1 << 16), .version = 0x202}, "its header claims tiles of 65536 x 65536 pixels");
  refuse_exr({.extra = tiles(0, 1), .version = 0x202}, "its tiles have no size");
  refuse_exr({.extra = tiles(1, 1), .window = {0, 0, 299, 299}, .version = 0x202}, "its header claims 90000 chunks");
  refuse_exr({.version = 0x1002}, "it is a multi-part or deep EXR");
}

TEST(ExrClaims, TheLimitHoldsForHeadersAndPictures) {
  const TemporaryFolder folder;
  const auto text = folder.write("text.exr", exr({.extra = attribute("x", "string", std::string(40 << 20, 'x'))}));
  std::string many;
  for (int i = 0; i < 100000; ++i) many += attribute(fmt::format("a{}", i), "int", bytes_of({i}));
  const auto entries = folder.write("entries.exr", exr({.extra = many}));
  const auto large =
      folder.write("large.exr", exr({.window = {0, 0, 4095, 4095}, .compression = 3, .behind = 1 << 20}));
  const Limit limit(32 << 20);
  for (const auto& path : {text, entries})
    expect_error(Failure::Work, {path.string() + ": its header needs about ", "of the limit of"},
                 [&] { read_exr_header(path); });
  expect_error(Failure::Work, {large.string() + ": a picture of 4096 x 4096 pixels needs about "},
               [&] { read_exr(large); });
}

std::string big(std::uint32_t value) {
  return {char(value >> 24), char(value >> 16 & 255), char(value >> 8 & 255), char(value & 255)};
}

std::string chunk(const std::string& type, const std::string& data) {
  const auto crc = ::crc32(0, reinterpret_cast<const Bytef*>((type + data).data()), uInt(type.size() + data.size()));
  return big(std::uint32_t(data.size())) + type + data + big(std::uint32_t(crc));
}

/// A grey PNG of side x side pixels whose data inflate to `bytes` zeros.
std::string png(std::uint32_t side, std::size_t bytes) {
  std::string zeros(bytes, '\0'), packed(::compressBound(bytes), '\0');
  uLongf size = packed.size();
  ::compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(zeros.data()), bytes, 9);
  packed.resize(size);
  const std::string half = packed.substr(0, 1), rest = packed.substr(1);  // the header of the stream lies in two chunks
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", big(side) + big(side) + std::string("\x08\0\0\0\0", 5)) +
         chunk("IDAT", half) + chunk("IDAT", rest) + chunk("IEND", "");
}

TextureImage decode(const std::string& file) {
  return decode_image({reinterpret_cast<const unsigned char*>(file.data()), file.size()}, "image 0", true);
}

TEST(ImageClaims, DataOfAPngAreThoseOfItsPixels) {
  const std::string good = png(64, 64 * 65), bomb = png(1, 200 << 20);
  const Limit limit(32 << 20);
  EXPECT_EQ(decode(good).rgba.size(), 64u * 64 * 4);
  expect_error(Failure::Work, {"image 0 cannot be decoded: its data are damaged, or not those of 1 x 1 pixels"},
               [&] { decode(bomb); });
}

TEST(ImageClaims, PixelsFitIntoTheMemory) {
  const std::string large = png(8192, 8192 * 8193);
  const Limit limit(32 << 20);
  expect_error(Failure::Work, {"image 0: an image of 8192 x 8192 pixels needs about "}, [&] { decode(large); });
}

}  // namespace
}  // namespace ballot::test
