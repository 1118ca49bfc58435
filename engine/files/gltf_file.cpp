#include "engine/files/gltf_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

#include "engine/core/file.h"
#include "engine/core/shown.h"
#include "engine/files/gltf_accessor.h"
#include "engine/files/gltf_compressed.h"
#include "engine/files/gltf_convert.h"
#include "engine/files/gltf_data.h"
#include "engine/files/gltf_json.h"
#include "engine/files/loaders.h"
#include "engine/files/text_mark.h"

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

/// The parts of a file.
struct FileParts {
  std::string_view json;
  std::optional<std::span<const std::byte>> chunk;  // the binary one of a GLB
};

/// Returns the place of the chunk behind one that ends at `end`. Some writers give lengths without the padding to four
/// bytes, or do not pad.
std::uint64_t next_chunk(const Bytes& bytes, std::uint64_t end, std::uint32_t length) {
  return end + kChunkHeader <= length && word(bytes, end + 4) == kBin ? end : (end + 3) / 4 * 4;
}

/// Checks the lengths in a GLB and returns its parts. Chunks of other kinds are read over, as glTF has it.
FileParts glb_parts(const Bytes& bytes) {
  if (bytes.size() < kGlbHeader + kChunkHeader)
    refuse("is cut short: {} bytes, but a GLB header with one chunk takes {}; copy the file again", bytes.size(),
           kGlbHeader + kChunkHeader);
  const std::uint32_t version = word(bytes, 4), length = word(bytes, 8);
  if (version != 2) refuse("is GLB version {}; expected 2; convert it with a current exporter", version);
  if (length > bytes.size())
    refuse("is cut short: its header gives {} bytes, the file has {}; copy or export it again", length, bytes.size());
  const std::uint64_t begin = kGlbHeader + kChunkHeader, end = begin + word(bytes, kGlbHeader);
  if (word(bytes, kGlbHeader + 4) != kJson) refuse("its first GLB chunk is not JSON; export it again");
  if (end > length) refuse("its JSON chunk ends at byte {}, but the file has {}; export it again", end, length);
  FileParts parts{.json = {reinterpret_cast<const char*>(bytes.data()) + begin, end - begin}, .chunk = {}};
  for (std::uint64_t at = next_chunk(bytes, end, length); at + kChunkHeader <= length && !parts.chunk;) {
    const std::uint64_t first = at + kChunkHeader, last = first + word(bytes, at);
    const bool is_binary = word(bytes, at + 4) == kBin;
    if (is_binary && last > length)
      refuse("its binary chunk ends at byte {}, but the file has {}; export it again", last, length);
    if (is_binary) parts.chunk = std::span(bytes).subspan(first, last - first);
    at = next_chunk(bytes, last, length);
  }
  return parts;
}

/// Has tinygltf make the model of a document. Buffers and images are read here: it takes files alone whose length is
/// byteLength, and few kinds of data URIs.
void parse(GltfFile& file, const FileParts& parts) {
  GltfJson root = parse_gltf_json(file.path, parts.json);
  tidy_json(root);
  check_required(root);
  GltfData data = read_data(file, root, parts.chunk);
  root.erase("buffers");
  root.erase("images");
  const std::vector<std::size_t> completed = complete_json(root);
  need_model_memory(root);
  const std::string text = root.dump(-1, ' ', false, GltfJson::error_handler_t::replace);
  root = nullptr;  // its memory serves tinygltf's own document
  if (text.size() > std::numeric_limits<std::uint32_t>::max())
    refuse("has {} bytes of JSON; expected less than 4 GiB; split the scene", text.size());
  std::string error, warning;
  bool good = false;
  try {
    tinygltf::TinyGLTF reader;
    good =
        reader.LoadASCIIFromString(&file.model, &error, &warning, text.data(), static_cast<unsigned>(text.size()), "");
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    good = false;
  }
  if (!good)
    refuse(
        "is not valid glTF 2.0: a member has a type or a value that the standard does not give it; "
        "export it again");
  file.model.buffers = std::move(data.buffers);
  file.model.images = std::move(data.images);
  for (const std::size_t accessor : completed) file.model.accessors[accessor].bufferView = -1;
}

/// Throws on required extensions that Ballot cannot read. Extensions of materials and textures change no triangle, so
/// an unknown one gives only a note.
void check_extensions(GltfFile& file) {
  constexpr std::array<std::string_view, 12> kRead{kMeshopt,
                                                   kDraco,
                                                   "EXT_texture_webp",
                                                   "KHR_mesh_quantization",
                                                   "KHR_materials_emissive_strength",
                                                   "KHR_materials_transmission",
                                                   "KHR_materials_ior",
                                                   "KHR_materials_unlit",
                                                   "KHR_lights_punctual",
                                                   "KHR_texture_transform",
                                                   "EXT_mesh_gpu_instancing",
                                                   kSpecularGlossiness};
  for (const std::string& name : file.model.extensionsRequired) {
    if (std::ranges::find(kRead, name) != kRead.end()) continue;
    if (name.starts_with("KHR_materials_") || name == "KHR_texture_basisu" || name == "EXT_texture_avif") {
      file.notes.push_back(fmt::format("The extension {}, which the file requires, was ignored.", name));
      continue;
    }
    refuse("requires the glTF extension {}, which Ballot cannot read; export it without it", name);
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
    refuse("has {} bytes; glTF files end at 4 GiB; split the scene into several buffers", bytes.size());
  FileParts parts{.json = {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, .chunk = {}};
  if (bytes.size() >= 4 && word(bytes, 0) == kMagic) parts = glb_parts(bytes);
  std::string_view& json = parts.json;
  json = without_mark(path, json);
  while (json.ends_with('\0')) json.remove_suffix(1);  // some writers pad with zeros
  const std::size_t start = json.find_first_not_of(" \t\r\n");
  if (start == std::string_view::npos || json[start] != '{')
    refuse("is not glTF: expected the word glTF (binary) or '{{' (text) at its start, found '{}'",
           shown_in_line(json.substr(0, 4)));
  parse(file, parts);
  if (!file.model.asset.version.starts_with("2"))
    refuse("is glTF version '{}'; expected 2.0; convert it with a current exporter", file.model.asset.version);
  check_extensions(file);
  decompress(file);
  for (std::size_t i = 0; i < file.model.bufferViews.size(); ++i)
    open_buffer_view(file, static_cast<int>(i), label("bufferView", i, ""));
  return file;
}

}  // namespace ballot
