#include "engine/files/texture.h"

#include <stb/stb_image.h>
#include <webp/decode.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>

#include "engine/core/error.h"
#include "engine/core/memory.h"

namespace ballot {

namespace {

constexpr int kMostPixels = 16384;  // on a side

bool is_webp(std::span<const unsigned char> bytes) {
  return bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
         std::memcmp(bytes.data() + 8, "WEBP", 4) == 0;
}

/// Returns the 32-bit number of a PNG at `at`.
std::uint32_t png_number(std::span<const unsigned char> png, std::size_t at) {
  return std::uint32_t(png[at]) << 24 | std::uint32_t(png[at + 1]) << 16 | std::uint32_t(png[at + 2]) << 8 |
         png[at + 3];
}

/// Inflates the data of a PNG without keeping them. Returns false if they are more than `most` bytes, or damaged.
bool inflates_to(std::span<const unsigned char> png, std::uint64_t most) {
  z_stream stream{};
  if (::inflateInit2(&stream, -MAX_WBITS) != Z_OK) return false;
  std::vector<unsigned char> some(1 << 16);
  std::size_t header = 2;  // of the zlib stream, in the first chunks
  int status = Z_OK;
  for (std::size_t at = 8; status == Z_OK && at + 12 <= png.size();) {
    const std::size_t bytes = std::min<std::size_t>(png_number(png, at), png.size() - at - 8);
    const std::size_t skipped = std::min(header, bytes);
    const bool data = std::memcmp(png.data() + at + 4, "IDAT", 4) == 0;
    if (std::memcmp(png.data() + at + 4, "CgBI", 4) == 0) header = 0;  // Apple's PNG have no header there
    stream.next_in = const_cast<unsigned char*>(png.data()) + at + 8 + (data ? skipped : 0);
    stream.avail_in = data ? static_cast<uInt>(bytes - skipped) : 0;
    if (data) header -= skipped;
    while (status == Z_OK && stream.avail_in > 0 && stream.total_out <= most) {
      stream.next_out = some.data();
      stream.avail_out = static_cast<uInt>(some.size());
      status = ::inflate(&stream, Z_NO_FLUSH);
    }
    at += bytes + 12;
  }
  const bool fits = stream.total_out <= most;
  ::inflateEnd(&stream);
  return fits && (status == Z_OK || status == Z_STREAM_END || status == Z_BUF_ERROR);
}

/// Refuses a PNG of so many pixels whose data inflate to more than these need, where that could be more than there is
/// memory: stb_image inflates all before it compares.
void check_inflated(std::span<const unsigned char> bytes, const std::string& place, std::uint64_t width,
                    std::uint64_t height) {
  constexpr std::uint64_t kDeflated = 1032, kLargest = std::uint64_t{1} << 32;  // the most that a byte inflates to
  if (bytes.size() < 8 || std::memcmp(bytes.data(), "\x89PNG\r\n\x1a\n", 8) != 0) return;
  if (2 * std::min(kDeflated * bytes.size(), kLargest) <= memory_left()) return;
  if (!inflates_to(bytes, 8 * width * height + 16 * height + 64))
    fail(Failure::Work, "{} cannot be decoded: its data are damaged, or not those of {} x {} pixels; export it again",
         place, width, height);
}

}  // namespace

TextureImage decode_image(std::span<const unsigned char> bytes, const std::string& place, bool srgb) {
  if (bytes.empty()) fail(Failure::Work, "{} is empty; expected a PNG or JPEG", place);
  if (bytes.size() > std::size_t(std::numeric_limits<int>::max()))
    fail(Failure::Work, "{} has {} bytes; expected less than 2 GiB", place, bytes.size());
  const int size = int(bytes.size());
  const bool webp = is_webp(bytes);
  int width = 0, height = 0, channels = 0;
  if (webp ? !WebPGetInfo(bytes.data(), bytes.size(), &width, &height)
           : !stbi_info_from_memory(bytes.data(), size, &width, &height, &channels))
    fail(Failure::Work, "{} cannot be decoded: {}; expected a PNG, JPEG or WebP", place,
         webp ? "bad WebP header" : stbi_failure_reason());
  if (width < 1 || height < 1 || width > kMostPixels || height > kMostPixels)
    fail(Failure::Work, "{} has {} x {} pixels; expected 1 to {} on each side; make it smaller", place, width, height,
         kMostPixels);
  const std::uint64_t decoded = std::uint64_t(width) * std::uint64_t(height) * 4;
  // Decoders keep up to 16 bytes a pixel, 20 of 16 bits a channel, and copies of what is encoded.
  const std::uint64_t copies = !webp && stbi_is_16_bit_from_memory(bytes.data(), size) != 0 ? 5 : 4;
  need_memory(copies * decoded + 2 * bytes.size(), fmt::format("{}: an image of {} x {} pixels", place, width, height));
  check_inflated(bytes, place, std::uint64_t(width), std::uint64_t(height));
  TextureImage image{.name = place, .width = std::uint32_t(width), .height = std::uint32_t(height), .srgb = srgb};
  if (webp) {
    image.rgba.resize(decoded);
    if (!WebPDecodeRGBAInto(bytes.data(), bytes.size(), image.rgba.data(), decoded, 4 * width))
      fail(Failure::Work, "{} cannot be decoded: bad or animated WebP data; export it again", place);
    return image;
  }
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load_from_memory(bytes.data(), size, &width, &height, &channels, 4), stbi_image_free);
  if (!pixels) fail(Failure::Work, "{} cannot be decoded: {}; export it again", place, stbi_failure_reason());
  image.rgba.assign(pixels.get(), pixels.get() + decoded);
  return image;
}

}  // namespace ballot
