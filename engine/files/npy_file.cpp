#include "engine/files/npy_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string_view>
#include <system_error>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/core/parallel.h"

namespace ballot {
namespace {

static_assert(std::endian::native == std::endian::little, "bytes are copied as they are");

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 47;  // of an array
constexpr std::size_t kMaxHeader = 1 << 20;                   // bytes; NumPy itself refuses more than 10 000

std::string shape_text(const std::vector<std::uint64_t>& shape) {
  return shape.size() == 1 ? fmt::format("({},)", shape[0]) : fmt::format("({})", fmt::join(shape, ", "));
}

/// Parses the subset of Python literals that NumPy writes. Every function returns false on text that it does not know.
class HeaderParser {
 public:
  explicit HeaderParser(std::string_view text) : text_(text) {}

  std::optional<NpyHeader> parse() {
    NpyHeader header;
    if (!eat('{')) return std::nullopt;
    while (!eat('}')) {
      std::string key;
      if (!string(key) || !eat(':') || !value(key, header)) return std::nullopt;
      if (!eat(',') && !peek('}')) return std::nullopt;
    }
    skip_space();
    if (!text_.empty() || header.descr.empty() || !header.fortran_order || !header.shape) return std::nullopt;
    return header;
  }

 private:
  static constexpr int kMaxDepth = 16;

  void skip_space() {
    while (!text_.empty() && (text_[0] == ' ' || text_[0] == '\n')) text_.remove_prefix(1);
  }
  bool peek(char c) {
    skip_space();
    return !text_.empty() && text_[0] == c;
  }
  bool eat(char c) {
    if (!peek(c)) return false;
    text_.remove_prefix(1);
    return true;
  }
  bool word(std::string_view expected) {
    skip_space();
    if (!text_.starts_with(expected)) return false;
    text_.remove_prefix(expected.size());
    return true;
  }
  bool string(std::string& out) {
    const char quote = peek('\'') ? '\'' : '"';
    if (!eat(quote)) return false;
    const std::size_t end = text_.find(quote);
    if (end == std::string_view::npos || text_.substr(0, end).find('\\') != std::string_view::npos) return false;
    out = text_.substr(0, end);
    text_.remove_prefix(end + 1);
    return true;
  }
  bool number(std::uint64_t& out) {
    skip_space();
    if (text_.empty() || text_[0] < '0' || text_[0] > '9') return false;
    out = 0;
    while (!text_.empty() && text_[0] >= '0' && text_[0] <= '9') {
      const auto digit = static_cast<std::uint64_t>(text_[0] - '0');
      if (out > (std::numeric_limits<std::uint64_t>::max() - digit) / 10) return false;
      out = out * 10 + digit;
      text_.remove_prefix(1);
    }
    if (!text_.empty() && text_[0] == 'L') text_.remove_prefix(1);  // written by Python 2
    return true;
  }
  bool shape(std::vector<std::uint64_t>& out) {
    if (!eat('(')) return false;
    while (!eat(')')) {
      if (!number(out.emplace_back()) || (!eat(',') && !peek(')'))) return false;
    }
    return true;
  }
  // Parses a dtype: a string, a number (the shape of a field), or a list or tuple of dtypes.
  bool dtype(std::string& out, int depth) {
    if (depth > kMaxDepth) return false;
    if (peek('\'') || peek('"')) {
      std::string name;
      if (!string(name)) return false;
      if (name.starts_with('|') && (name == "|f4" || name == "|f8" || name == "|u4")) name[0] = '<';  // '|': native
      out += "'" + name + "'";
      return true;
    }
    const bool list = peek('[');
    if (list || peek('(')) {
      const char close = list ? ']' : ')';
      out += text_[0];
      text_.remove_prefix(1);
      for (bool first = true; !eat(close); first = false) {
        if (!first) out += ", ";
        if (!dtype(out, depth + 1) || (!eat(',') && !peek(close))) return false;
      }
      out += close;
      return true;
    }
    std::uint64_t count = 0;
    if (!number(count)) return false;
    out += std::to_string(count);
    return true;
  }
  bool value(const std::string& key, NpyHeader& header) {
    if (key == "descr") {
      header.descr.clear();
      return dtype(header.descr, 0);
    }
    if (key == "fortran_order") {
      header.fortran_order = word("True");
      return *header.fortran_order || word("False");
    }
    return key == "shape" && shape(header.shape.emplace());
  }

  std::string_view text_;
};

InputStream open_input(const std::filesystem::path& path) {
  if (path == "-") return {stdin, [](std::FILE*) { return 0; }};
  return open_file(path);
}

}  // namespace

NpyFile::NpyFile(const std::filesystem::path& path) : path_(path), file_(open_input(path)) {
  struct stat info {};
  if (::fstat(::fileno(file_.get()), &info) != 0) stop(std::generic_category().message(errno));
  if (path != "-") left_ = static_cast<std::uint64_t>(info.st_size);
  read_header();
}

NpyFile::NpyFile(std::filesystem::path name, std::vector<std::byte> bytes)
    : path_(std::move(name)), bytes_(std::move(bytes)), left_(bytes_.size()) {
  read_header();
}

std::string NpyFile::found() const {
  return fmt::format("found dtype {}{} of shape {}", header_.descr, *header_.fortran_order ? ", Fortran order," : "",
                     shape_text(*header_.shape));
}

void NpyFile::expect_items(std::uint64_t count, std::uint64_t item_bytes, std::size_t number_bytes) {
  if (left_ && (*left_ % item_bytes != 0 || *left_ / item_bytes != count))
    stop(fmt::format("{}, but {} bytes follow the header where {} items of {} bytes are expected", found(), *left_,
                     count, item_bytes));
  if (!*header_.fortran_order || header_.shape->size() < 2) return;
  if (count > kMostBytes / item_bytes) stop(found() + "; expected an array that memory can hold");
  read_transposed(count * item_bytes, number_bytes);
}

/// Takes the numbers of an array in Fortran order, whose first index runs fastest, as rows.
void NpyFile::read_transposed(std::uint64_t bytes, std::size_t number_bytes) {
  need_memory(2 * bytes, fmt::format("{}: an array in Fortran order", path_.string()));
  const std::uint64_t rows = (*header_.shape)[0], width = rows ? bytes / number_bytes / rows : 0;
  std::vector<std::byte> columns(bytes), in_rows(bytes);
  read(columns.data(), bytes);
  // Numbers of a row lie in the order of its own indices, of which the first runs fastest too.
  const std::vector<std::uint64_t> axes(header_.shape->begin() + 1, header_.shape->end());
  for (std::uint64_t k = 0; k < width; ++k) {
    std::uint64_t place = 0, rest = k;  // of the number in its row: the last index runs fastest
    std::uint64_t step = width;
    for (const std::uint64_t axis : axes) {
      step /= axis;
      place += rest % axis * step;
      rest /= axis;
    }
    for (std::uint64_t row = 0; row < rows; ++row)
      std::memcpy(&in_rows[(row * width + place) * number_bytes], &columns[(k * rows + row) * number_bytes],
                  number_bytes);
  }
  bytes_ = std::move(in_rows);
  file_.reset();
  position_ = 0;
  left_ = bytes;
  header_.fortran_order = false;
}

void NpyFile::read(void* out, std::size_t bytes) {
  if (left_ && bytes > *left_)
    stop(fmt::format("it ends early: {} bytes are left where {} are expected", *left_, bytes));
  if (!left_) {
    if (bytes > 0 && std::fread(out, 1, bytes, file_.get()) != bytes) stop("it ended while it was read");
    return;
  }
  if (!file_) {
    if (bytes > 0) std::memcpy(out, bytes_.data() + position_, bytes);
    position_ += bytes;
    *left_ -= bytes;
    return;
  }
  constexpr std::size_t kPart = 4 << 20;
  for_chunks(bytes, kPart, [&](std::size_t begin, std::size_t end) {
    while (begin < end) {
      const ssize_t got = ::pread(::fileno(file_.get()), static_cast<char*>(out) + begin, end - begin,
                                  static_cast<off_t>(position_ + begin));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) stop(std::generic_category().message(errno));
      if (got == 0) stop("it ended while it was read");
      begin += static_cast<std::size_t>(got);
    }
  });
  position_ += bytes;
  *left_ -= bytes;
}

void NpyFile::skip(std::uint64_t bytes) {
  if (!left_) stop("a part of it cannot be chosen, as it cannot be read from the middle");
  position_ += bytes;
  *left_ -= bytes;
}

void NpyFile::stop(const std::string& reason) const {
  fail(Failure::Work, "cannot read {}: {}", path_ == "-" ? "standard input" : path_.string(), reason);
}

void NpyFile::read_header() {
  std::array<unsigned char, 8> start{};
  if (left_ && *left_ < start.size()) stop(fmt::format("it has {} bytes, too few for a .npy file", *left_));
  read(start.data(), start.size());
  if (std::memcmp(start.data(), kNpyMagic.data(), kNpyMagic.size()) != 0)
    stop("it does not begin with \"\\x93NUMPY\": not a .npy file (an .npz is a zip of them)");
  const int version = start[6];
  if (version < 1 || version > 3 || start[7] != 0)
    stop(fmt::format(".npy version {}.{} is not known; expected 1.0, 2.0 or 3.0", version, int{start[7]}));
  std::uint32_t bytes = 0;
  read(&bytes, version == 1 ? 2 : 4);
  if ((left_ && bytes > *left_) || bytes > kMaxHeader)
    stop(fmt::format("its header claims {} bytes, but {} are left (limit {})", bytes, left_.value_or(bytes),
                     kMaxHeader));
  std::string text(bytes, '\0');
  read(text.data(), text.size());
  const std::optional<NpyHeader> header = HeaderParser(text).parse();
  if (!header) stop("its header is not a dictionary of descr, fortran_order and shape");
  header_ = *header;
}

std::string npy_start(std::string_view descr, const std::string& shape) {
  std::string header = fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': {}, }}", descr, shape);
  constexpr std::size_t prefix = 10;  // magic, version, length
  header.resize((prefix + header.size() + 1 + 63) / 64 * 64 - prefix - 1, ' ');
  header += '\n';
  std::string start(kNpyMagic);
  start += {'\x01', '\x00', char(header.size() & 0xFF), char(header.size() >> 8)};
  return start + header;
}

}  // namespace ballot
