#include "engine/files/ply_header.h"

#include <array>
#include <cstring>

#include "engine/files/text_lines.h"
#include "engine/files/words.h"

namespace ballot {
namespace {

template <class T>
double value_of(const unsigned char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return double(value);
}

constexpr std::array kTypes{
    PlyType{"char", "int8", 1, value_of<std::int8_t>},    PlyType{"uchar", "uint8", 1, value_of<std::uint8_t>},
    PlyType{"short", "int16", 2, value_of<std::int16_t>}, PlyType{"ushort", "uint16", 2, value_of<std::uint16_t>},
    PlyType{"int", "int32", 4, value_of<std::int32_t>},   PlyType{"uint", "uint32", 4, value_of<std::uint32_t>},
    PlyType{"float", "float32", 4, value_of<float>},      PlyType{"double", "float64", 8, value_of<double>},
};

/// Reads the header line by line.
class PlyHeaderParser {
 public:
  explicit PlyHeaderParser(std::string_view text) : text_(text) {}

  PlyHeader run() {
    read_line_end();
    if (trimmed(line()) != "ply") refuse("is not PLY: its first line is not 'ply'; check the file's type");
    bool coded = false;
    while (true) {
      if (header_.bytes >= text_.size()) fail("the file ends before 'end_header'");
      const std::string_view text = line();
      Words words(text, header_.lines);
      const std::string_view keyword = words.next();
      if (keyword == "end_header") break;
      if (keyword == "format") {
        coding(words.next());
        coded = true;
      } else if (keyword == "element") {
        const std::string name(words.next());
        header_.elements.push_back({name, words.number<std::uint64_t>("elements"), {}});
      } else if (keyword == "property") {
        property(words);
      } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
        fail("'{}' is no keyword of a PLY header", keyword.substr(0, 40));
      }
    }
    if (!coded) fail("the header has no format");
    return std::move(header_);
  }

 private:
  template <class... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) const {
    throw Flaw(fmt::format(text, std::forward<Args>(args)...), header_.lines);
  }

  /// Takes CR alone as the end of all lines if the first ends so: data behind the header may begin with a byte like LF.
  void read_line_end() {
    const std::size_t end = text_.find_first_of("\r\n");
    if (end != std::string_view::npos && text_[end] == '\r' && !text_.substr(end).starts_with("\r\n")) line_end_ = '\r';
  }

  std::string_view line() {
    const std::string_view rest = text_.substr(header_.bytes);
    const std::size_t end = std::min(rest.find(line_end_), rest.size());
    header_.bytes += std::min(end + 1, rest.size());
    ++header_.lines;
    return rest.substr(0, end);
  }

  void coding(std::string_view name) {
    if (name == "ascii")
      header_.coding = PlyCoding::Text;
    else if (name == "binary_little_endian")
      header_.coding = PlyCoding::Little;
    else if (name == "binary_big_endian")
      header_.coding = PlyCoding::Big;
    else
      fail("format is '{}'; expected ascii, binary_little_endian or binary_big_endian", name.substr(0, 40));
  }

  const PlyType* type(std::string_view name) const {
    for (const PlyType& t : kTypes)
      if (t.name == name || t.other_name == name) return &t;
    fail("'{}' is no type of a property", name.substr(0, 40));
  }

  void property(Words& words) {
    if (header_.elements.empty()) fail("a property stands before the first element");
    PlyProperty p;
    std::string_view word = words.next();
    if (word == "list") {
      p.count = type(words.next());
      word = words.next();
    }
    p.type = type(word);
    p.name = words.next();
    header_.elements.back().properties.push_back(std::move(p));
  }

  std::string_view text_;
  char line_end_ = '\n';
  PlyHeader header_;
};

}  // namespace

PlyHeader read_ply_header(std::string_view file) { return PlyHeaderParser(file).run(); }

}  // namespace ballot
