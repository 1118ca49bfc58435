// The format is that of numpy.lib.format, versions 1.0 to 3.0.
#include "engine/core/npy.h"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "engine/core/error.h"
#include "engine/core/file.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "bytes are copied as they are");

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr std::size_t kMaxHeader = 1 << 20;  // bytes; NumPy itself refuses more than 10 000
constexpr std::string_view kHitDescr = "[('t', '<f4'), ('prim', '<u4'), ('u', '<f4'), ('v', '<f4')]";

// The contents of a header's dictionary. A dtype is kept as canonical text: "'<f4'", or "[('t', '<f4'), ...]".
struct Header {
  std::string descr;
  std::optional<bool> fortran_order;
  std::optional<std::vector<std::uint64_t>> shape;
};

std::string shape_text(const std::vector<std::uint64_t>& shape) {
  return shape.size() == 1 ? fmt::format("({},)", shape[0]) : fmt::format("({})", fmt::join(shape, ", "));
}

// Parses the subset of Python literals that NumPy writes. Every function returns false on text that it does not know.
class HeaderParser {
 public:
  explicit HeaderParser(std::string_view text) : text_(text) {}

  std::optional<Header> parse() {
    Header header;
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
  bool value(const std::string& key, Header& header) {
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

// An open .npy file, positioned behind its header, which has been checked.
class NpyFile {
 public:
  explicit NpyFile(const fs::path& path) : path_(path), file_(open_file(path)) {
    struct stat info {};
    if (::fstat(::fileno(file_.get()), &info) != 0) stop(std::generic_category().message(errno));
    left_ = static_cast<std::uint64_t>(info.st_size);
    read_header();
  }

  const Header& header() const { return header_; }
  std::string found() const {
    return fmt::format("found dtype {}{} of shape {}", header_.descr, *header_.fortran_order ? ", Fortran order," : "",
                       shape_text(*header_.shape));
  }

  /// Throws unless exactly `count` items of `item_bytes` bytes follow.
  void expect_items(std::uint64_t count, std::uint64_t item_bytes) const {
    if (left_ % item_bytes == 0 && left_ / item_bytes == count) return;
    stop(fmt::format("{}, but {} bytes follow the header where {} items of {} bytes are expected", found(), left_,
                     count, item_bytes));
  }

  void read(void* out, std::size_t bytes) {
    if (bytes > left_) stop(fmt::format("it ends early: {} bytes are left where {} are expected", left_, bytes));
    if (bytes > 0 && std::fread(out, 1, bytes, file_.get()) != bytes) stop("it ended while it was read");
    left_ -= bytes;
  }

  [[noreturn]] void stop(const std::string& reason) const {
    fail(Failure::Work, "cannot read {}: {}", path_.string(), reason);
  }

 private:
  void read_header() {
    std::array<unsigned char, 8> start{};
    if (left_ < start.size()) stop(fmt::format("it has {} bytes, too few for a .npy file", left_));
    read(start.data(), start.size());
    if (std::memcmp(start.data(), kMagic.data(), kMagic.size()) != 0) {
      stop("it does not begin with \"\\x93NUMPY\": not a .npy file (an .npz is a zip of them)");
    }
    const int version = start[6];
    if (version < 1 || version > 3 || start[7] != 0) {
      stop(fmt::format(".npy version {}.{} is not known; expected 1.0, 2.0 or 3.0", version, int{start[7]}));
    }
    std::uint32_t bytes = 0;
    read(&bytes, version == 1 ? 2 : 4);
    if (bytes > left_ || bytes > kMaxHeader) {
      stop(fmt::format("its header claims {} bytes, but {} are left (limit {})", bytes, left_, kMaxHeader));
    }
    std::string text(bytes, '\0');
    read(text.data(), text.size());
    const std::optional<Header> header = HeaderParser(text).parse();
    if (!header) {
      stop("its header is not a dictionary of descr, fortran_order and shape");
    }
    header_ = *header;
  }

  fs::path path_;
  InputStream file_;
  std::uint64_t left_ = 0;
  Header header_;
};

float to_float(double value) {
  constexpr double limit = std::numeric_limits<float>::max();
  if (std::isinf(value) || std::isnan(value)) return static_cast<float>(value);
  return static_cast<float>(std::clamp(value, -limit, limit));
}

void write_array(const fs::path& path, std::string_view descr, const std::string& shape,
                 std::span<const std::byte> bytes) {
  std::string header = fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': {}, }}", descr, shape);
  constexpr std::size_t prefix = 10;  // magic, version, length
  header.resize((prefix + header.size() + 1 + 63) / 64 * 64 - prefix - 1, ' ');
  header += '\n';
  const auto length = static_cast<std::uint16_t>(header.size());
  write_atomically(path, [&](const fs::path& temporary) {
    OutputFile out(temporary, path);
    out.write(kMagic.data(), kMagic.size());
    out.write("\x01\x00", 2);
    out.write(&length, 2);
    out.write(header.data(), header.size());
    out.write(bytes.data(), bytes.size());
    out.close();
  });
}

}  // namespace

std::vector<Ray> read_rays(const fs::path& path) {
  NpyFile file(path);
  const Header& header = file.header();
  const bool wide = header.descr == "'<f8'";
  if (!wide && header.descr != "'<f4'") {
    file.stop(file.found() +
              "; expected float32 '<f4' or float64 '<f8' of shape (n, 8); "
              "convert with numpy.ascontiguousarray(a, '<f4')");
  }
  if (header.shape->size() != 2 || (*header.shape)[1] != 8) {
    file.stop(file.found() + "; expected shape (n, 8): origin x y z, t_min, direction x y z, t_max");
  }
  if (*header.fortran_order) {
    file.stop(file.found() + "; expected C order: save numpy.ascontiguousarray(a)");
  }
  const std::uint64_t count = (*header.shape)[0];
  file.expect_items(count, wide ? 8 * sizeof(double) : sizeof(Ray));
  std::vector<Ray> rays(count);
  if (!wide) {
    file.read(rays.data(), count * sizeof(Ray));
    return rays;
  }
  for (Ray& ray : rays) {
    std::array<double, 8> d{};
    file.read(d.data(), sizeof(d));
    ray = {{to_float(d[0]), to_float(d[1]), to_float(d[2])},
           to_float(d[3]),
           {to_float(d[4]), to_float(d[5]), to_float(d[6])},
           to_float(d[7])};
  }
  return rays;
}

void write_rays(const fs::path& path, std::span<const Ray> rays) {
  write_array(path, "'<f4'", fmt::format("({}, 8)", rays.size()), std::as_bytes(rays));
}

void write_hits(const fs::path& path, std::span<const Hit> hits) {
  write_array(path, kHitDescr, fmt::format("({},)", hits.size()), std::as_bytes(hits));
}

std::vector<Hit> read_hits(const fs::path& path) {
  NpyFile file(path);
  const Header& header = file.header();
  if (header.descr != kHitDescr || header.shape->size() != 1) {
    file.stop(fmt::format("{}; expected dtype {} of shape (n,)", file.found(), kHitDescr));
  }
  const std::uint64_t count = (*header.shape)[0];
  file.expect_items(count, sizeof(Hit));
  std::vector<Hit> hits(count);
  file.read(hits.data(), count * sizeof(Hit));
  return hits;
}

void write_triangles(const fs::path& path, std::span<const Triangle> triangles) {
  write_array(path, "'<f4'", fmt::format("({}, 3, 3)", triangles.size()), std::as_bytes(triangles));
}

}  // namespace ballot
