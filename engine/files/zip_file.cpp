#include "engine/files/zip_file.h"

#include <zlib.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/core/memory.h"

namespace ballot {
namespace {

// Signatures and lengths of APPNOTE.TXT, sections 4.3.7, 4.3.12 and 4.3.16.
constexpr std::uint32_t kLocalMark = 0x04034B50, kEntryMark = 0x02014B50, kEndMark = 0x06054B50;
constexpr std::size_t kLocalBytes = 30, kEntryBytes = 46, kEndBytes = 22, kMostComment = 0xFFFF;
constexpr std::uint32_t kStored = 0, kDeflated = 8, kIs64 = 0xFFFFFFFF;

/// Inflates a raw stream of deflate. Returns false unless it fills `to` exactly.
bool inflate_to(const std::byte* from, std::size_t packed, std::vector<std::byte>& to) {
  z_stream stream{};
  if (::inflateInit2(&stream, -MAX_WBITS) != Z_OK) return false;
  stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(from));
  stream.avail_in = static_cast<uInt>(packed);
  Bytef none = 0;
  stream.next_out = to.empty() ? &none : reinterpret_cast<Bytef*>(to.data());
  stream.avail_out = static_cast<uInt>(to.size());
  const int status = ::inflate(&stream, Z_FINISH);
  const bool whole = status == Z_STREAM_END && stream.total_out == to.size();
  ::inflateEnd(&stream);
  return whole;
}

}  // namespace

ZipFile::ZipFile(const std::filesystem::path& path) : path_(path), bytes_(read_file(path)) { read_list(); }

void ZipFile::stop(const std::string& reason) const {
  fail(Failure::Work, "cannot read {}: {}", path_.string(), reason);
}

std::uint32_t ZipFile::number(std::size_t at, std::size_t bytes) const {
  if (at > bytes_.size() || bytes > bytes_.size() - at)
    stop(fmt::format("its list of files ends at byte {}, but it has {}; it is cut short", at + bytes, bytes_.size()));
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value |= std::to_integer<std::uint32_t>(bytes_[at + i]) << (8 * i);
  return value;
}

void ZipFile::read_list() {
  if (bytes_.size() < kEndBytes || number(0, 2) != 0x4B50) stop("it does not begin with \"PK\": not a zip file");
  std::size_t end = bytes_.size() - kEndBytes;
  const std::size_t first = end > kMostComment ? end - kMostComment : 0;
  while (number(end, 4) != kEndMark) {
    if (end == first) stop("it has no list of files at its end; it is cut short");
    --end;
  }
  const std::uint32_t count = number(end + 10, 2);
  std::size_t at = number(end + 16, 4);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (number(at, 4) != kEntryMark) stop(fmt::format("entry {} of its list is damaged", i));
    const std::size_t name = number(at + 28, 2);
    Entry entry{.name = {},
                .method = number(at + 10, 2),
                .flags = number(at + 8, 2),
                .checksum = number(at + 16, 4),
                .packed = number(at + 20, 4),
                .size = number(at + 24, 4),
                .place = number(at + 42, 4)};
    if (entry.packed == kIs64 || entry.size == kIs64 || entry.place == kIs64)
      stop("it has parts of 4 GiB or more; save smaller arrays");
    number(at + kEntryBytes, 0);
    if (name > 0) number(at + kEntryBytes + name - 1, 1);
    entry.name.assign(reinterpret_cast<const char*>(bytes_.data()) + at + kEntryBytes, name);
    at += kEntryBytes + name + number(at + 30, 2) + number(at + 32, 2);
    entries_.push_back(std::move(entry));
  }
}

std::vector<std::string> ZipFile::names() const {
  std::vector<std::string> all;
  for (const Entry& entry : entries_) all.push_back(entry.name);
  return all;
}

std::vector<std::byte> ZipFile::read(const std::string& name) const {
  const auto found = std::ranges::find(entries_, name, &Entry::name);
  if (found == entries_.end()) stop(fmt::format("it has no file '{}'", name));
  const Entry& entry = *found;
  if ((entry.flags & 1) != 0) stop(fmt::format("its file '{}' is encrypted", name));
  if (entry.method != kStored && entry.method != kDeflated)
    stop(fmt::format("its file '{}' is compressed by method {}; expected 0 or 8 (deflate)", name, entry.method));
  if (number(entry.place, 4) != kLocalMark) stop(fmt::format("its file '{}' is damaged", name));
  const std::size_t start = entry.place + kLocalBytes + number(entry.place + 26, 2) + number(entry.place + 28, 2);
  if (start > bytes_.size() || entry.packed > bytes_.size() - start)
    stop(fmt::format("its file '{}' has {} bytes from byte {}, but the zip file has {}", name, entry.packed, start,
                     bytes_.size()));
  need_memory(entry.size, fmt::format("{}: '{}'", path_.string(), name));
  std::vector<std::byte> to;
  if (entry.method == kStored) {
    const auto from = bytes_.begin() + static_cast<std::ptrdiff_t>(start);
    to.assign(from, from + static_cast<std::ptrdiff_t>(entry.packed));
  } else {
    to.resize(entry.size);
    if (!inflate_to(bytes_.data() + start, entry.packed, to)) to.clear();
  }
  const auto* bytes = reinterpret_cast<const Bytef*>(to.data());
  if (to.size() != entry.size || ::crc32_z(0, bytes, to.size()) != entry.checksum)
    stop(fmt::format("its file '{}' is damaged: {} bytes and their checksum were expected", name, entry.size));
  return to;
}

}  // namespace ballot
