#include "engine/files/ply_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>

#include "engine/core/file.h"
#include "engine/core/memory.h"
#include "engine/core/srgb.h"
#include "engine/files/file_vertices.h"
#include "engine/files/loaders.h"
#include "engine/files/ply_header.h"
#include "engine/files/text_lines.h"
#include "engine/files/text_mark.h"
#include "engine/files/words.h"

namespace ballot {
namespace {

constexpr std::string_view kStrips = "tristrips";
constexpr std::uint32_t kRestart = ~0u;  // begins another strip

/// Reads the numbers behind the header.
class Body {
 public:
  Body(const PlyHeader& header, std::span<const unsigned char> bytes)
      : coding_(header.coding),
        bytes_(bytes.subspan(header.bytes)),
        kept_(bytes_.data()),
        words_({reinterpret_cast<const char*>(bytes_.data()), bytes_.size()}, header.lines + 1) {
    std::uint64_t lines = 0;
    for (const PlyElement& e : header.elements) lines += e.properties.empty() ? 0 : e.count;
    by_lines_ = coding_ == PlyCoding::Text && has_lines(lines);
  }

  double number(const PlyType& type, const PlyElement& element) {
    if (coding_ == PlyCoding::Text) return words_.number<double>(element.name);
    if (bytes_.size() < type.bytes)
      refuse("ends within its elements '{}'; the header promises {}; the file is cut short", element.name,
             element.count);
    std::array<unsigned char, 8> copy;
    std::copy_n(bytes_.begin(), type.bytes, copy.begin());
    if ((coding_ == PlyCoding::Little) != (std::endian::native == std::endian::little))
      std::reverse(copy.begin(), copy.begin() + std::ptrdiff_t(type.bytes));
    bytes_ = bytes_.subspan(type.bytes);
    release();
    return type.read(copy.data());
  }

  /// Returns the length of a list, which the rest of the file can hold.
  std::size_t length(const PlyProperty& property, const PlyElement& element) {
    const double length = number(*property.count, element);
    if (!(length >= 0) || length != std::floor(length) || length > double(bytes_.size()))
      refuse("a list '{}' of element '{}' has {} items; expected a number that the file can hold", property.name,
             element.name, length);
    return std::size_t(length);
  }

  /// Moves behind an element. Some programs write more numbers into a line than the header says.
  void end_element() {
    if (!by_lines_) return;
    more_ = more_ || !trimmed(words_.rest_of_line()).empty();
    words_.skip_line();
  }

  /// Returns true if lines held more than the header says.
  bool left_out() const { return more_; }

  /// Returns the bytes behind the header that have not been read, or of text all of them.
  std::size_t bytes() const { return bytes_.size(); }

  void skip(const PlyProperty& property, const PlyElement& element) {
    const std::size_t count = property.count ? length(property, element) : 1;
    for (std::size_t i = 0; i < count; ++i) number(*property.type, element);
  }

 private:
  /// Returns true if the text has at least `wanted` lines that are not blank: then each element has one of its own.
  bool has_lines(std::uint64_t wanted) const {
    bool blank = true;
    for (std::size_t i = 0; i < bytes_.size() && wanted > 0; ++i) {
      const unsigned char c = bytes_[i];
      if (blank && c > ' ') --wanted;
      blank = c == '\n' || c == '\r' || (blank && c <= ' ');
    }
    return wanted == 0;
  }

  /// Gives back the memory of what has been read.
  void release() {
    constexpr std::ptrdiff_t kTogether = 1 << 20;
    if (bytes_.data() - kept_ < kTogether) return;
    release_pages(std::as_bytes(std::span(kept_, bytes_.data())));
    kept_ = bytes_.data();
  }

  PlyCoding coding_;
  std::span<const unsigned char> bytes_;
  const unsigned char* kept_;  // the first byte that is still in memory
  Words words_;
  bool by_lines_ = false, more_ = false;
};

/// Throws unless the file can hold as many elements as its header names: at least a byte each.
void check_counts(const PlyHeader& header, std::size_t bytes) {
  for (const PlyElement& e : header.elements)
    if (e.count > bytes && !e.properties.empty())
      refuse("names {} elements '{}', but has {} bytes; the file is cut short or its header wrong", e.count, e.name,
             bytes);
}

/// Returns the value of a type that stands for a full colour.
float most_of(const PlyType& type) {
  const bool integer = !type.other_name.starts_with("float");
  return integer && type.bytes == 1 ? 255.0f : integer && type.bytes == 2 ? 65535.0f : 1.0f;
}

void read_vertices(Body& body, const PlyElement& element, PlyFile& file) {
  constexpr std::array kNames{"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "radius"};
  std::array<std::optional<std::size_t>, kNames.size()> wanted;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    wanted[i] = element.find(kNames[i]);
    const char* const of_others = i < 9 ? "diffuse_" : "scalar_";  // older programs, and those with fields of points
    if (i >= 6 && !wanted[i]) wanted[i] = element.find(std::string(of_others) + kNames[i]);
  }
  if (!wanted[0] || !wanted[1] || !wanted[2]) refuse("its vertices have no x, y and z");
  const bool normals = wanted[3] && wanted[4] && wanted[5];
  FileVertices vertices;
  vertices.reserve(element.count);
  if (normals) file.normals.reserve(element.count);
  const bool colors = wanted[6] && wanted[7] && wanted[8] && !element.properties[*wanted[6]].count;
  const float most = colors ? most_of(*element.properties[*wanted[6]].type) : 1;
  const bool radii = wanted[9] && !element.properties[*wanted[9]].count;
  for (std::uint64_t v = 0; v < element.count; ++v) {
    std::array<float, kNames.size()> values{};
    glm::dvec3 at(0);
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      if (element.properties[p].count) {
        body.skip(element.properties[p], element);
        continue;
      }
      const double value = body.number(*element.properties[p].type, element);
      for (std::size_t i = 0; i < values.size(); ++i)
        if (wanted[i] == p) values[i] = float(value);
      for (std::size_t i = 0; i < 3; ++i)
        if (wanted[i] == p) at[int(i)] = value;
    }
    body.end_element();
    for (std::size_t i = 0; i < 3; ++i)
      if (!std::isfinite(values[i]))
        refuse("vertex {} is ({}, {}, {}); expected finite numbers", v, values[0], values[1], values[2]);
    vertices.add(at);
    if (normals) file.normals.emplace_back(values[3], values[4], values[5]);
    if (radii) file.radii.push_back(values[9]);
    if (colors)
      file.colors.emplace_back(linear_of(values[6] / most), linear_of(values[7] / most), linear_of(values[8] / most));
  }
  file.origin = vertices.settle();
  file.vertices = vertices.take();
}

/// Appends the triangles of a strip. Every other one is wound the other way; -1 begins another strip.
void add_strip(std::span<const std::uint32_t> strip, PlyFile& file) {
  std::size_t first = 0;
  for (std::size_t i = 0; i < strip.size(); ++i) {
    if (strip[i] == kRestart) first = i + 1;
    if (strip[i] == kRestart || i < first + 2) continue;
    const bool turned = (i - first) % 2 == 1;
    for (const std::size_t back : {turned ? 1 : 2, turned ? 2 : 1, 0}) file.corners.push_back(strip[i - back]);
    file.face_ends.push_back(std::uint32_t(file.corners.size()));
  }
}

/// Reads the lists of indices of faces or of strips of triangles. The vertices may be read later.
void read_faces(Body& body, const PlyElement& element, PlyFile& file) {
  const bool strips = element.name == kStrips;
  auto list = element.find("vertex_indices");
  if (!list) list = element.find("vertex_index");
  if (!list || !element.properties[*list].count)
    refuse("its elements '{}' have no list 'vertex_indices'", element.name);
  const std::uint64_t likely = std::min<std::uint64_t>(element.count, body.bytes() / 4);  // triangles take 4 and more
  file.corners.reserve(file.corners.size() + 3 * likely);
  file.face_ends.reserve(file.face_ends.size() + likely);
  std::uint64_t small = 0;
  std::vector<std::uint32_t> indices;
  for (std::uint64_t f = 0; f < element.count; ++f) {
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const PlyProperty& property = element.properties[p];
      if (p != *list) {
        body.skip(property, element);
        continue;
      }
      indices.resize(body.length(property, element));
      for (std::uint32_t& to : indices) {
        const double index = body.number(*property.type, element);
        const bool restart = strips && (index == -1 || index == double(kRestart));
        if (!restart && (!(index >= 0) || index >= double(kRestart) || index != std::floor(index)))
          refuse("{} {} names vertex {}; expected a whole number from 0 on", element.name, f, index);
        to = restart ? kRestart : std::uint32_t(index);
      }
      if (strips) {
        add_strip(indices, file);
      } else if (indices.size() < 3) {
        ++small;
      } else {
        file.corners.insert(file.corners.end(), indices.begin(), indices.end());
        file.face_ends.push_back(std::uint32_t(file.corners.size()));
      }
      if (file.corners.size() > 3 * kMaxTriangles)
        refuse("has more than {} corners of faces; use a smaller scene", 3 * kMaxTriangles);
    }
    body.end_element();
  }
  if (small) file.notes.push_back(fmt::format("{} faces of fewer than 3 corners were left out.", small));
}

/// Notes what would change how a mesh looks, and is not read.
void note_left_out(const PlyHeader& header, PlyFile& file) {
  constexpr std::array<std::string_view, 9> kLookNames{"alpha",     "s",         "t",        "u",        "v",
                                                       "texture_u", "texture_v", "texcoord", "texnumber"};
  std::string found;
  for (const PlyElement& element : header.elements)
    for (const PlyProperty& p : element.properties)
      if (std::ranges::count(kLookNames, p.name) > 0 || (p.name == "red" && element.name != "vertex"))
        found += fmt::format("{}{} of {}", found.empty() ? "" : ", ", p.name, element.name);
  if (!found.empty()) file.notes.push_back(fmt::format("Properties that change the look are not read: {}.", found));
}

/// Throws if a face names a vertex that the file lacks.
void check_corners(const PlyFile& file) {
  const std::size_t count = file.vertices.size();
  const auto beyond = std::ranges::find_if(file.corners, [&](std::uint32_t corner) { return corner >= count; });
  if (beyond == file.corners.end()) return;
  const auto place = std::uint32_t(beyond - file.corners.begin());
  const auto face = std::ranges::upper_bound(file.face_ends, place) - file.face_ends.begin();
  refuse("face {} names vertex {}, but the file has {}", face, *beyond, count);
}

}  // namespace

PlyFile read_ply(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_file(path);
  const std::string_view text = without_mark(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const PlyHeader header = read_ply_header(text);
  check_counts(header, bytes.size());
  const auto is_faces = [](const PlyElement& e) { return e.name == "face" || e.name == kStrips; };
  const auto count_of = [&](auto is) { return std::ranges::count_if(header.elements, is); };
  auto vertices = count_of([](const PlyElement&e) { return e.name == "vertex"; }), faces = count_of(is_faces);
  if (vertices > 1) refuse("has {} elements 'vertex'; expected one", vertices);
  Body body(header, {reinterpret_cast<const unsigned char*>(text.data()), text.size()});
  PlyFile file;
  file.has_faces = faces > 0;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex") {
      read_vertices(body, element, file);
      --vertices;
    } else if (is_faces(element)) {
      read_faces(body, element, file);
      --faces;
    } else if (!element.properties.empty()) {  // else it takes no bytes, however many there are
      for (std::uint64_t i = 0; i < element.count; ++i) {
        for (const PlyProperty& property : element.properties) body.skip(property, element);
        body.end_element();
      }
    }
    if (vertices + faces == 0) break;  // what follows is not needed
  }
  check_corners(file);
  note_left_out(header, file);
  if (body.left_out())
    file.notes.emplace_back("Lines hold more numbers than the header names; those behind were left out.");
  return file;
}

}  // namespace ballot
