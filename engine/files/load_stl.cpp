// Loads STL, binary or text: flat triangles in file order. Colours and attributes are not read.
#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstring>
#include <string_view>

#include "engine/core/file.h"
#include "engine/core/memory.h"
#include "engine/files/checked_bytes.h"
#include "engine/files/loaders.h"
#include "engine/files/text_mark.h"
#include "engine/files/words.h"

namespace ballot {
namespace {

constexpr std::size_t kHeader = 80, kCount = 84, kRecord = 50;  // bytes: text, text and count, one triangle
static_assert(std::endian::native == std::endian::little, "binary STL is little-endian");

/// Returns the number of triangles that the header of a binary file names.
std::uint32_t count_in(std::span<const unsigned char> bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= kCount) std::memcpy(&count, bytes.data() + kHeader, sizeof count);
  return count;
}

/// Returns true if a word is `wanted`, which is in lower case, in letters of any case.
bool is_word(std::string_view word, std::string_view wanted) {
  return std::ranges::equal(word, wanted,
                            [](unsigned char a, char b) { return std::tolower(a) == static_cast<unsigned char>(b); });
}

/// Returns true if a file is text. Some writers of binary files begin the header with "solid" too, so the length tells,
/// or else control characters: a binary file has zeros in its number of triangles.
/// Throws Flaw on text that is not STL, Error(Work) on UTF-16.
bool is_text(const std::filesystem::path& path, std::span<const unsigned char> bytes, std::string_view& text) {
  if (bytes.size() >= kCount && bytes.size() == kCount + std::size_t{count_in(bytes)} * kRecord) return false;
  text = without_mark(path, text);
  const auto is_control = [](unsigned char c) { return c < ' ' && !std::isspace(c); };
  if (std::ranges::any_of(text.substr(0, 1024), is_control)) return false;
  const std::string_view first = Words(text).next();
  if (is_word(first.substr(0, 5), "solid")) return true;
  if (bytes.size() > kCount)
    refuse("is not STL: it is text that begins with '{}'; expected 'solid', or a binary file", first.substr(0, 40));
  return false;
}

void read_binary(std::span<const unsigned char> bytes, Scene& scene) {
  if (bytes.size() < kCount)
    refuse("is not STL: it has {} bytes; expected a header of {} bytes, or text that begins with 'solid'", bytes.size(),
           kCount);
  const std::size_t count = count_in(bytes);
  const CheckedBytes records =
      CheckedBytes(bytes, "the file").elements(kCount, count, kRecord, kRecord, fmt::format("{} triangles", count));
  if (count > kMaxTriangles) refuse("has {} triangles; expected at most {}; use a smaller scene", count, kMaxTriangles);
  if (const std::size_t rest = bytes.size() - kCount - count * kRecord; rest > 0)
    scene.notes.push_back(fmt::format("{} bytes behind the last triangle were left out.", rest));
  scene.triangles.reserve(count);  // takes memory as it is filled
  constexpr std::size_t kTogether = 1 << 16;
  for (std::size_t t = 0; t < count; ++t) {
    const unsigned char* behind_normal = records[t] + sizeof(glm::vec3);
    std::memcpy(&scene.triangles.emplace_back(), behind_normal, sizeof(Triangle));
    if (t % kTogether == kTogether - 1)
      release_pages(std::as_bytes(bytes.subspan(kCount + (t + 1 - kTogether) * kRecord, kTogether * kRecord)));
  }
}

/// Moves behind the name of a solid: to the next line, or to a facet or an end in this one.
void skip_name(Words& words) {
  const std::string_view line = words.rest_of_line();
  Words ahead = words;
  while (true) {
    const Words here = ahead;
    const std::string_view word = ahead.next();
    if (word.empty() || word.data() >= line.data() + line.size()) return words.skip_line();
    if (!is_word(word, "endsolid") && !(is_word(word, "facet") && is_word(Words(ahead).next(), "normal"))) continue;
    words = here;
    return;
  }
}

void read_text(std::string_view text, Scene& scene) {
  std::vector<glm::vec3> corners;
  bool in_solid = false, in_facet = false;
  Words words(text);
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (is_word(word, "vertex")) {
      glm::vec3 v;
      for (int axis = 0; axis < 3; ++axis) v[axis] = words.number("a vertex");
      corners.push_back(v);
    } else if (is_word(word, "facet")) {
      if (in_facet) words.fail("a facet begins before 'endfacet' of the one before it");
      in_facet = in_solid = true;
    } else if (is_word(word, "endfacet")) {
      if (corners.size() != 3) words.fail("the facet has {} vertices; expected 3", corners.size());
      scene.triangles.push_back({corners[0], corners[1], corners[2]});
      corners.clear();
      in_facet = false;
    } else if (is_word(word, "solid") || is_word(word, "endsolid")) {
      const bool begins = word.size() == 5;
      if (begins && in_solid)
        words.fail("a solid begins before 'endsolid' of the one before it; the file is cut short");
      if (in_facet) words.fail("the solid ends within a facet");
      in_solid = begins;
      skip_name(words);
    }
  }
  if (in_facet || !corners.empty()) words.fail("the file ends within a facet");
  if (in_solid) words.fail("the file ends before 'endsolid'; it is cut short: copy or export it again");
  if (scene.triangles.empty()) refuse("has no facets; expected STL text: facet, outer loop, vertex, ...");
}

}  // namespace

Scene load_stl(const std::filesystem::path& path, const LoadOptions&) {
  const std::vector<std::byte> file = read_file(path);
  const std::span bytes(reinterpret_cast<const unsigned char*>(file.data()), file.size());
  std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  Scene scene;
  if (is_text(path, bytes, text))
    read_text(text, scene);
  else
    read_binary(bytes, scene);
  complete_mesh(scene);
  return scene;
}

}  // namespace ballot
