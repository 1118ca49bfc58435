// Loads STL, binary or text: flat triangles in file order. Colours and attributes are not read.
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>

#include "engine/core/file.h"
#include "engine/core/memory.h"
#include "engine/scene/checked_bytes.h"
#include "engine/scene/loaders.h"
#include "engine/scene/words.h"

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

/// Returns true if a file is text. Some writers of binary files begin the header with "solid" too, so the length tells.
bool is_text(std::span<const unsigned char> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with("solid")) return false;
  return bytes.size() < kCount || bytes.size() != kCount + std::size_t{count_in(bytes)} * kRecord;
}

void read_binary(const std::filesystem::path& path, std::span<const unsigned char> bytes, Scene& scene) {
  if (bytes.size() < kCount)
    fail_in(path, "is not STL: it has {} bytes; expected a header of {} bytes, or text that begins with 'solid'",
            bytes.size(), kCount);
  const std::size_t count = count_in(bytes);
  const CheckedBytes records = CheckedBytes(bytes, path, "the file")
                                   .elements(kCount, count, kRecord, kRecord, fmt::format("{} triangles", count));
  if (count > kMaxTriangles)
    fail_in(path, "has {} triangles; expected at most {}; use a smaller scene", count, kMaxTriangles);
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

void read_text(const std::filesystem::path& path, std::string_view text, Scene& scene) {
  std::vector<glm::vec3> corners;
  Words words(path, text);
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (word == "vertex") {
      glm::vec3 v;
      for (int axis = 0; axis < 3; ++axis) v[axis] = words.number("a vertex");
      corners.push_back(v);
    } else if (word == "endfacet") {
      if (corners.size() != 3) words.fail("the facet has {} vertices; expected 3", corners.size());
      scene.triangles.push_back({corners[0], corners[1], corners[2]});
      corners.clear();
    } else if (word == "solid" || word == "endsolid") {
      words.skip_line();  // the name
    }
  }
  if (!corners.empty()) words.fail("the file ends within a facet");
  if (scene.triangles.empty()) fail_in(path, "has no facets; expected STL text: facet, outer loop, vertex, ...");
}

}  // namespace

Scene load_stl(const std::filesystem::path& path, const LoadOptions&) {
  const std::vector<std::byte> file = read_file(path);
  const std::span bytes(reinterpret_cast<const unsigned char*>(file.data()), file.size());
  Scene scene;
  if (is_text(bytes))
    read_text(path, {reinterpret_cast<const char*>(file.data()), file.size()}, scene);
  else
    read_binary(path, bytes, scene);
  complete_mesh(path, scene);
  return scene;
}

}  // namespace ballot
