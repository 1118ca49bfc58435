#include "engine/scene/gltf_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>

#include "engine/core/file.h"
#include "engine/core/json_depth.h"
#include "engine/core/text_mark.h"
#include "engine/scene/gltf_accessor.h"
#include "engine/scene/gltf_compressed.h"
#include "engine/scene/loaders.h"
#include "engine/scene/named_file.h"

namespace ballot {
namespace {

using Bytes = std::vector<std::byte>;

constexpr std::size_t kGlbHeader = 12, kChunkHeader = 8;
constexpr std::uint32_t kMagic = 0x46546C67, kJson = 0x4E4F534A, kBin = 0x004E4942;  // "glTF", "JSON", "BIN\0"

std::uint32_t word(const Bytes& bytes, std::size_t at) {
  std::array<std::uint32_t, 4> b{};
  for (std::size_t i = 0; i < 4; ++i) b[i] = std::to_integer<std::uint32_t>(bytes[at + i]);
  return b[0] | b[1] << 8 | b[2] << 16 | b[3] << 24;
}

/// Checks the lengths in a GLB and returns its JSON chunk. tinygltf checks the lengths too late, or 8 bytes too wide.
std::string_view checked_json_chunk(const std::filesystem::path& path, const Bytes& bytes) {
  if (bytes.size() < kGlbHeader + kChunkHeader)
    fail_in(path, "is cut short: {} bytes, but a GLB header with one chunk takes {}; copy the file again", bytes.size(),
            kGlbHeader + kChunkHeader);
  const std::uint32_t version = word(bytes, 4), length = word(bytes, 8);
  if (version != 2) fail_in(path, "is GLB version {}; expected 2; convert it with a current exporter", version);
  if (length > bytes.size())
    fail_in(path, "is cut short: its header gives {} bytes, the file has {}; copy or export it again", length,
            bytes.size());
  const std::uint64_t json_bytes = word(bytes, kGlbHeader);
  const std::uint64_t json_end = kGlbHeader + kChunkHeader + json_bytes;
  if (word(bytes, kGlbHeader + 4) != kJson) fail_in(path, "its first GLB chunk is not JSON; export it again");
  if (json_end > length)
    fail_in(path, "its JSON chunk ends at byte {}, but the file has {}; export it again", json_end, length);
  if (json_end + kChunkHeader <= length) {
    const std::uint64_t bin_end = json_end + kChunkHeader + word(bytes, json_end);
    if (word(bytes, json_end + 4) == kBin && bin_end > length)
      fail_in(path, "its binary chunk ends at byte {}, but the file has {}; export it again", bin_end, length);
  }
  return {reinterpret_cast<const char*>(bytes.data()) + kGlbHeader + kChunkHeader,
          static_cast<std::size_t>(json_bytes)};
}

bool is_image_name(const std::string& name) {
  std::string extension = std::filesystem::path(name).extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array<std::string_view, 9> kImages{".png", ".jpg", ".jpeg", ".ktx2", ".webp",
                                                    ".dds", ".bmp", ".tga",  ".gif"};
  return std::ranges::find(kImages, extension) != kImages.end();
}

constexpr std::string_view kUnreadable = "cannot read ";  // the start of read_file()'s errors

/// The folder of the scene, as tinygltf gets it, and what may be read.
struct Access {
  const GltfFile& file;
  std::string folder;

  /// Returns the file that tinygltf means: it puts the folder, or else ".", before the name that the scene has. Returns
  /// "" for a file of the working folder. Throws Error(Work) if the scene may not name the file.
  std::filesystem::path resolve(const std::string& joined) const {
    const std::string start = folder.ends_with('/') ? folder : folder + "/";
    if (!joined.starts_with(start)) return {};
    return named_file(file.path, joined.substr(start.size()), file.options.allow_outside, "a buffer");
  }
};

/// Returns file access for tinygltf that never opens an image. A folder counts as absent; read_file() refuses devices
/// and pipes with a reason.
tinygltf::FsCallbacks file_access(const Access& access) {
  tinygltf::FsCallbacks calls{};  // later versions of tinygltf have one more, which may be null
  calls.FileExists = [](const std::string& name, void* data) {
    if (is_image_name(name)) return false;
    std::error_code error;
    const auto status = std::filesystem::status(static_cast<const Access*>(data)->resolve(name), error);
    return std::filesystem::exists(status) && !std::filesystem::is_directory(status);
  };
  calls.ExpandFilePath = [](const std::string& name, void*) { return name; };
  calls.ReadWholeFile = [](std::vector<unsigned char>* out, std::string* error, const std::string& name, void* data) {
    try {
      const Bytes bytes = read_file(static_cast<const Access*>(data)->resolve(name));
      const auto* first = reinterpret_cast<const unsigned char*>(bytes.data());
      out->assign(first, first + bytes.size());
      return true;
    } catch (const Error& e) {
      *error = e.what();
      return false;
    }
  };
  calls.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  };
  calls.user_data = const_cast<Access*>(&access);
  return calls;
}

/// Keeps the bytes of an image in a data URI encoded. An image in a buffer view or in a file of its own is read later,
/// if a material in use needs it (gltf_texture.h): tinygltf does not check the range of the view.
bool keep_encoded(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* data,
                  int size, void*) {
  if (image->bufferView == -1 && image->uri.empty() && data && size > 0) image->image.assign(data, data + size);
  return true;
}

/// Returns an error text of tinygltf as the end of a sentence: without line ends, and without a prefix such as
/// "[json.exception.parse_error.101] ".
std::string tidy(std::string text) {
  if (const auto end = text.find("] "); text.starts_with("[json.exception") && end != std::string::npos)
    text.erase(0, end + 2);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  std::ranges::replace(text, '\n', ' ');
  return text.substr(0, 300);  // a bad data URI would be quoted in full
}

/// Returns a GLB with another JSON chunk.
Bytes with_json(const std::filesystem::path& path, const Bytes& bytes, std::string text) {
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t start = kGlbHeader + kChunkHeader, rest = start + word(bytes, kGlbHeader);
  const std::size_t tail = word(bytes, 8) - rest, length = start + text.size() + tail;
  if (length > std::numeric_limits<std::uint32_t>::max())
    fail_in(path, "has {} bytes; glTF files end at 4 GiB; split the scene into several buffers", length);
  Bytes to(length);
  std::memcpy(to.data(), bytes.data(), start);
  std::memcpy(to.data() + start, text.data(), text.size());
  std::memcpy(to.data() + start + text.size(), bytes.data() + rest, tail);
  const auto put = [&](std::size_t at, std::size_t value) {
    for (std::size_t i = 0; i < 4; ++i) to[at + i] = std::byte(value >> (8 * i) & 0xFF);
  };
  put(8, length);
  put(kGlbHeader, text.size());
  return to;
}

void parse(GltfFile& file, const Bytes& bytes, bool binary, std::string_view json) {
  tinygltf::TinyGLTF reader;
  reader.SetImageLoader(keep_encoded, nullptr);
  std::string error, warning, folder = file.path.parent_path().string();
  if (folder.empty()) folder = ".";
  const Access access{file, folder};
  reader.SetFsCallbacks(file_access(access));
  bool good = false;
  try {
    good = binary ? reader.LoadBinaryFromMemory(&file.model, &error, &warning,
                                                reinterpret_cast<const unsigned char*>(bytes.data()),
                                                static_cast<unsigned>(bytes.size()), folder)
                  : reader.LoadASCIIFromString(&file.model, &error, &warning, json.data(),
                                               static_cast<unsigned>(json.size()), folder);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    // What nlohmann throws tells what is wrong with the file. tinygltf also asks containers for their first element.
    error =
        std::string_view(e.what()).starts_with("[json.exception") ? e.what() : "a buffer or an image of it is empty";
  }
  if (good) return;
  const std::string reason = tidy(error);
  if (const std::string missing = "File not found : "; reason.find(missing) != std::string::npos)
    fail_in(file.path, "its buffer file '{}' was not found; expected it in the scene's folder",
            reason.substr(reason.find(missing) + missing.size()));
  if (const auto at = reason.find(kUnreadable); at != std::string::npos)
    fail_in(file.path, "its buffer file cannot be used: {}", reason.substr(at));
  fail_in(file.path, "is not valid glTF 2.0: {}; export it again", reason.empty() ? "no reason given" : reason);
}

/// Throws on required extensions that Ballot cannot read. Extensions of materials and textures change no triangle, so
/// an unknown one gives only a note.
void check_extensions(GltfFile& file) {
  constexpr std::array<std::string_view, 11> kRead{kMeshopt,
                                                   kDraco,
                                                   "EXT_texture_webp",
                                                   "KHR_mesh_quantization",
                                                   "KHR_materials_emissive_strength",
                                                   "KHR_materials_transmission",
                                                   "KHR_materials_ior",
                                                   "KHR_materials_unlit",
                                                   "KHR_lights_punctual",
                                                   "KHR_texture_transform",
                                                   "EXT_mesh_gpu_instancing"};
  for (const std::string& name : file.model.extensionsRequired) {
    if (std::ranges::find(kRead, name) != kRead.end()) continue;
    if (name.starts_with("KHR_materials_") || name == "KHR_texture_basisu" || name == "EXT_texture_avif") {
      file.notes.push_back(fmt::format("The extension {}, which the file requires, was ignored.", name));
      continue;
    }
    fail_in(file.path, "requires the glTF extension {}, which Ballot cannot read; export it without it", name);
  }
}

}  // namespace

int index_in(const tinygltf::Value& value) {
  const double number = value.IsNumber() ? value.GetNumberAsDouble() : -1;
  return number >= 0 && number <= std::numeric_limits<int>::max() && number == std::floor(number)
             ? static_cast<int>(number)
             : -1;
}

std::string label(const char* kind, std::size_t index, const std::string& name) {
  return name.empty() ? fmt::format("{} {}", kind, index) : fmt::format("{} {} ('{}')", kind, index, name);
}

GltfFile read_gltf(const std::filesystem::path& path, const LoadOptions& options) {
  GltfFile file{.path = path, .model = {}, .options = options, .notes = {}};
  const Bytes bytes = read_file(path);
  if (bytes.size() > std::numeric_limits<std::uint32_t>::max())
    fail_in(path, "has {} bytes; glTF files end at 4 GiB; split the scene into several buffers", bytes.size());
  const bool binary = bytes.size() >= 4 && word(bytes, 0) == kMagic;
  std::string_view json{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  if (binary) json = checked_json_chunk(path, bytes);
  json = without_mark(path, json);
  const std::size_t start = json.find_first_not_of(" \t\r\n");
  if (start == std::string_view::npos || json[start] != '{')
    fail_in(path, "is not glTF: expected the word glTF (binary) or '{{' (text) at its start, found '{}'",
            tidy(std::string(json.substr(0, 4))));
  check_json_depth(path, json);  // tinygltf recurses into "extras" without a limit
  const std::optional<std::string> completed = completed_json(json);
  if (!completed)
    parse(file, bytes, binary, json);
  else if (binary)
    parse(file, with_json(path, bytes, *completed), true, {});
  else
    parse(file, bytes, false, *completed);
  if (!file.model.asset.version.starts_with("2"))
    fail_in(path, "is glTF version '{}'; expected 2.0; convert it with a current exporter", file.model.asset.version);
  check_extensions(file);
  decompress(file);
  for (std::size_t i = 0; i < file.model.bufferViews.size(); ++i)
    open_buffer_view(file, static_cast<int>(i), label("bufferView", i, ""));
  return file;
}

}  // namespace ballot
