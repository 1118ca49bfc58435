// Layout of a header: magic number, version, and then attributes, each its name, its type, its size and its bytes, up
// to an empty name. Texts end in a zero. All numbers are little-endian.
#include "engine/files/exr_header.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "engine/core/memory.h"

namespace ballot {
namespace {

constexpr double kMostPacked = 4096;         // largest accepted compression ratio; deflate reaches 1032
constexpr std::uint64_t kEntryBytes = 1024;  // what OpenEXR and Image keep of an attribute or channel, besides values

[[noreturn]] void reject(const std::string& reason) { throw std::invalid_argument(reason); }

/// The types whose values have one size, with that size: OpenEXR reads so many bytes whatever size the file gives.
struct FixedType {
  std::string_view name;
  std::uint32_t bytes;
};
constexpr FixedType kFixedTypes[] = {{"box2f", 16},
                                     {"box2i", 16},
                                     {"chromaticities", 32},
                                     {"compression", 1},
                                     {"deepImageState", 1},
                                     {"double", 8},
                                     {"envmap", 1},
                                     {"float", 4},
                                     {"int", 4},
                                     {"keycode", 28},
                                     {"lineOrder", 1},
                                     {"m33d", 72},
                                     {"m33f", 36},
                                     {"m44d", 128},
                                     {"m44f", 64},
                                     {"rational", 8},
                                     {"tiledesc", 9},
                                     {"timecode", 8},
                                     {"v2d", 16},
                                     {"v2f", 8},
                                     {"v2i", 8},
                                     {"v3d", 24},
                                     {"v3f", 12},
                                     {"v3i", 12}};

/// What the header of a file says.
struct Claims {
  std::uint64_t file_bytes = 0, header_bytes = 0, entries = 0, channels = 0;
  int compression = 0;
  bool tiled = false;
  double width = 0, height = 0, tile_width = 0, tile_height = 0;  // pixels; 0: not said
};

/// Reads a file and never beyond its end.
class Bounded {
 public:
  Bounded(std::FILE* file, std::uint64_t bytes) : file_(file), left_(bytes) {}

  std::uint64_t left() const { return left_; }

  template <class T>
  T value() {
    T read{};
    if (left_ < sizeof(T) || std::fread(&read, sizeof(T), 1, file_) != 1) reject("its header is cut short");
    left_ -= sizeof(T);
    return read;
  }

  /// Reads a text of at most 255 bytes.
  std::string text() {
    std::string read;
    while (const char c = value<char>()) {
      if (read.size() == 255) reject("a name in its header has more than 255 bytes");
      read += c;
    }
    return read;
  }

  void skip(std::uint64_t bytes) {
    if (bytes > left_ || ::fseeko(file_, static_cast<off_t>(bytes), SEEK_CUR) != 0) reject("its header is cut short");
    left_ -= bytes;
  }

 private:
  std::FILE* file_;
  std::uint64_t left_;
};

/// Reads the list of channels: a name and 16 bytes each.
void read_channels(Bounded& in, Claims& claims) {
  for (std::string name; !(name = in.text()).empty(); ++claims.channels) {
    in.skip(8);  // type, linearity
    const auto sampling = in.value<std::array<std::int32_t, 2>>();
    if (sampling != std::array<std::int32_t, 2>{1, 1})
      reject(fmt::format("channel {} is subsampled, which is not supported", name));
  }
}

/// Reads the value of an attribute of `size` bytes as far as it claims something. OpenEXR will read just these bytes.
void read_value(Bounded& in, Claims& claims, const std::string& name, const std::string& type, std::uint32_t size) {
  const std::uint64_t end = in.left() - size;
  const auto* fixed = std::ranges::find(kFixedTypes, type, &FixedType::name);
  if (fixed != std::end(kFixedTypes) && fixed->bytes != size)
    reject(fmt::format("its attribute {} is a {} of {} bytes; expected {}", name, type, size, fixed->bytes));
  if (type == "compression" && name == "compression") claims.compression = in.value<std::uint8_t>();
  if (type == "box2i" && name == "dataWindow") {
    const auto window = in.value<std::array<std::int32_t, 4>>();
    claims.width = 1.0 + window[2] - window[0];
    claims.height = 1.0 + window[3] - window[1];
  }
  if (type == "tiledesc" && name == "tiles") {
    const auto tile = in.value<std::array<std::uint32_t, 2>>();
    claims.tile_width = tile[0];
    claims.tile_height = tile[1];
  }
  if (type == "preview") {
    const auto pixels = in.value<std::array<std::uint32_t, 2>>();
    if (4.0 * pixels[0] * pixels[1] + 8 != size)
      reject(fmt::format("its attribute {} claims {} x {} pixels in {} bytes", name, pixels[0], pixels[1], size));
  }
  for (; type == "stringvector" && in.left() > end; ++claims.entries) {
    const auto bytes = in.value<std::uint32_t>();
    if (in.left() < end || bytes > in.left() - end)
      reject(fmt::format("its attribute {} claims a text of {} bytes", name, bytes));
    in.skip(bytes);
  }
  if (type == "chlist") {
    read_channels(in, claims);
    if (in.left() != end) reject(fmt::format("its list of channels has not the {} bytes that it claims", size));
  }
  if (type == "floatvector" ? size % 4 != 0 : type == "idmanifest" && size < 4)
    reject(fmt::format("its attribute {} is a {} of {} bytes", name, type, size));
  if (in.left() < end) reject(fmt::format("its attribute {} is longer than the {} bytes that it claims", name, size));
  in.skip(in.left() - end);
}

Claims read_claims(std::FILE* file) {
  struct stat info {};
  if (::fstat(::fileno(file), &info) != 0) reject("its size is not known");
  Claims claims{.file_bytes = std::uint64_t(info.st_size)};
  Bounded in(file, claims.file_bytes);
  if (claims.file_bytes < 8 || in.value<std::uint32_t>() != 20000630) reject("it does not begin as an EXR file does");
  constexpr std::uint32_t kTiled = 0x200, kDeep = 0x800, kMultiPart = 0x1000;
  const auto version = in.value<std::uint32_t>();
  claims.tiled = (version & kTiled) != 0;
  if ((version & (kDeep | kMultiPart)) != 0) reject("it is a multi-part or deep EXR; expected one flat part");
  for (std::string name; !(name = in.text()).empty(); ++claims.entries) {
    const std::string type = in.text();
    const auto size = in.value<std::uint32_t>();
    if (size > in.left())
      reject(fmt::format("its attribute {} claims {} bytes, but {} are left", name, size, in.left()));
    read_value(in, claims, name, type, size);
  }
  claims.header_bytes = claims.file_bytes - in.left();
  return claims;
}

/// Returns the rows that a chunk of scanlines holds, by compression.
double rows_of_chunk(int compression) {
  constexpr std::array<double, 10> kRows{1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
  return std::size_t(compression) < kRows.size() ? kRows[std::size_t(compression)] : 1;
}

}  // namespace

void check_exr_header(std::FILE* file, const std::filesystem::path& name, bool pixels, int threads) {
  const Claims c = read_claims(file);
  if (!(c.width >= 1 && c.height >= 1)) reject("its data window is empty");
  if (c.channels == 0) reject("it has no channels");
  const double pixel_bytes = 4 * double(c.channels), bytes = double(c.file_bytes);
  const auto fits = [&](double width, double height, const char* what) {
    if (width * height * pixel_bytes > kMostPacked * bytes + (1 << 20))
      reject(fmt::format("its header claims {} of {} x {} pixels of {} bytes, but the file has {} bytes", what, width,
                         height, pixel_bytes, c.file_bytes));
  };
  fits(c.width, c.height, "a picture");
  if (c.tiled && !(c.tile_width >= 1 && c.tile_height >= 1)) reject("its tiles have no size");
  const double chunk_width = c.tiled ? c.tile_width : c.width;
  const double chunk_height = c.tiled ? c.tile_height : std::min(c.height, rows_of_chunk(c.compression));
  if (c.tiled) fits(std::max(c.width, c.tile_width), c.tile_height, "tiles");
  const double chunks = std::ceil(c.width / chunk_width) * std::ceil(c.height / chunk_height);
  if (8 * chunks > bytes)
    reject(fmt::format("its header claims {} chunks, but the file has {} bytes", chunks, c.file_bytes));
  const std::uint64_t header = 4 * c.header_bytes + kEntryBytes * (c.entries + c.channels);
  need_memory(header, fmt::format("{}: its header", name.string()));
  if (!pixels) return;
  const std::string what = fmt::format("{}: a picture of {} x {} pixels", name.string(), c.width, c.height);
  const double picture = c.width * c.height * pixel_bytes;
  need_memory(std::uint64_t(picture), what);
  // OpenEXR decodes two chunks a thread at once, packed and unpacked, and keeps a row of tiles.
  const double at_once = std::min(chunks, 2.0 * std::max(threads, 1));
  const double decoding = 2 * at_once * std::max(c.width, chunk_width) * chunk_height * pixel_bytes;
  need_memory(std::uint64_t(picture + decoding) + header, what + " and its decoding");
}

}  // namespace ballot
