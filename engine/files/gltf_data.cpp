#include "engine/files/gltf_data.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "engine/core/file.h"
#include "engine/files/gltf_compressed.h"
#include "engine/files/gltf_json.h"
#include "engine/files/loaders.h"
#include "engine/files/named_file.h"

namespace ballot {
namespace {

using RawBytes = std::vector<unsigned char>;

/// Returns the value of a base64 digit; -1 for other characters. Those of URLs (RFC 4648, 5) count too.
int digit_of(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

/// Decodes base64 with or without padding. White space is read over. Returns nothing if it is none.
std::optional<RawBytes> decoded_base64(std::string_view text) {
  RawBytes bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t word = 0;
  std::size_t digits = 0, padding = 0;
  for (const char c : text) {
    if (std::isspace(static_cast<unsigned char>(c))) continue;
    const int digit = digit_of(c);
    if (c == '=' ? ++padding > 2 : digit < 0 || padding > 0) return std::nullopt;
    if (c == '=') continue;
    word = word << 6 | static_cast<std::uint32_t>(digit);
    if (++digits % 4 == 0)
      for (const int shift : {16, 8, 0}) bytes.push_back(static_cast<unsigned char>(word >> shift & 0xFF));
  }
  if (digits % 4 == 1) return std::nullopt;
  if (digits % 4 >= 2) bytes.push_back(static_cast<unsigned char>(word >> (digits % 4 == 2 ? 4 : 10) & 0xFF));
  if (digits % 4 == 3) bytes.push_back(static_cast<unsigned char>(word >> 2 & 0xFF));
  return bytes;
}

/// Returns a text in lower case.
std::string lower(std::string_view text) {
  std::string to(text);
  std::ranges::transform(to, to.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return to;
}

/// Returns the content of the file that a buffer names.
RawBytes read_buffer_file(const GltfFile& file, const std::string& name) {
  const auto path = named_file(file.path, name, file.options.allow_outside, "a buffer");
  std::error_code error;
  if (!std::filesystem::exists(path, error) || std::filesystem::is_directory(path, error))
    refuse("its buffer file '{}' was not found; expected it in the scene's folder", name);
  std::vector<std::byte> bytes;
  try {
    bytes = read_file(path);
  } catch (const Error& e) {
    refuse("its buffer file cannot be used: {}", e.what());
  }
  const auto* first = reinterpret_cast<const unsigned char*>(bytes.data());
  return {first, first + bytes.size()};
}

/// Reads a buffer: byteLength bytes from where its JSON says.
tinygltf::Buffer read_buffer(const GltfFile& file, const GltfJson& from, const std::string& place,
                             std::optional<std::span<const std::byte>> chunk) {
  tinygltf::Buffer to;
  to.name = text_in(from, "name");
  const std::string uri = text_in(from, "uri");
  const GltfJson* packed = extension_of(from, kMeshopt);
  const GltfJson* fallback = packed ? member(*packed, "fallback") : nullptr;
  if (uri.empty() && fallback && *fallback == true) return to;
  const GltfJson* length = member(from, "byteLength");
  if (!length || !length->is_number_unsigned() || *length == 0)
    refuse("{} has no byteLength; expected a whole number above 0; export it again", place);
  const auto bytes = length->get<std::uint64_t>();
  std::string what = "its data URI";
  if (uri.empty()) {
    if (!chunk) refuse("{} has no uri, and the file no binary chunk; export it again", place);
    const auto* first = reinterpret_cast<const unsigned char*>(chunk->data());
    to.data.assign(first, first + std::min<std::uint64_t>(bytes, chunk->size()));
    what = "the binary chunk";
  } else if (auto data = data_of_uri(uri, place)) {
    to.data = std::move(*data);
  } else {
    const std::string name = decoded_uri(uri);
    to.data = read_buffer_file(file, name);
    what = fmt::format("its file '{}'", name);
  }
  if (to.data.size() < bytes)
    refuse("{} is cut short: its byteLength is {}, but {} has {} bytes; copy or export it again", place, bytes, what,
           to.data.size());
  to.data.resize(bytes);
  return to;
}

/// Reads an image of a data URI, or notes where it is.
tinygltf::Image read_image(const GltfJson& from, const std::string& place, std::size_t views) {
  tinygltf::Image to;
  to.name = text_in(from, "name");
  if (const GltfJson* view = member(from, "bufferView")) {
    to.bufferView = index_in(*view);
    if (to.bufferView < 0 || static_cast<std::size_t>(to.bufferView) >= views)
      refuse("{} names bufferView {}, but the file has {}", place, view->dump(), views);
    return to;
  }
  to.uri = text_in(from, "uri");
  if (to.uri.empty()) refuse("{} has neither a uri nor a bufferView; export it again", place);
  if (auto data = data_of_uri(to.uri, place)) {
    if (data->empty()) refuse("{} is empty: its data URI holds nothing; export it again", place);
    to.image = std::move(*data);
    to.uri.clear();
  }
  return to;
}

}  // namespace

std::optional<RawBytes> data_of_uri(std::string_view uri, const std::string& place) {
  if (lower(uri.substr(0, 5)) != "data:") return std::nullopt;
  const std::size_t comma = uri.find(',');
  if (comma == std::string_view::npos)
    refuse("{} has a data URI without a comma; expected data:[type][;base64],DATA; export it again", place);
  const std::string kind = lower(uri.substr(0, comma));
  std::string_view text = uri.substr(comma + 1);
  std::string decoded;
  if (text.find('%') != std::string_view::npos) text = decoded = decoded_uri(text);
  if (!kind.ends_with(";base64")) return RawBytes(text.begin(), text.end());
  auto bytes = decoded_base64(text);
  if (!bytes) refuse("{} has a data URI that cannot be decoded as base64; export it again", place);
  return bytes;
}

GltfData read_data(const GltfFile& file, const GltfJson& root, std::optional<std::span<const std::byte>> chunk) {
  GltfData data;
  for_each_in(root, "buffers", [&](const GltfJson& buffer, std::size_t i) {
    data.buffers.push_back(read_buffer(file, buffer, label("buffer", i, text_in(buffer, "name")), chunk));
  });
  const GltfJson* views = member(root, "bufferViews");
  for_each_in(root, "images", [&](const GltfJson& image, std::size_t i) {
    data.images.push_back(read_image(image, label("image", i, text_in(image, "name")), views ? views->size() : 0));
  });
  return data;
}

}  // namespace ballot
