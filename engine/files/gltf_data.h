// Bytes of glTF files: buffers and images in data URIs, in the chunk of a GLB and in files. Internal to engine/files.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <vector>

#include "engine/files/gltf_file.h"

namespace ballot {

/// The buffers and images of a file. Images in files of their own are not read.
struct GltfData {
  std::vector<tinygltf::Buffer> buffers;
  std::vector<tinygltf::Image> images;  // `image`: the bytes of a data URI, still encoded
};

/// Reads buffers and images as the JSON describes them. `chunk` is the binary chunk of a GLB. A buffer may have more
/// bytes than its byteLength; these are no part of it. A buffer that stands for decompressed data (meshopt's fallback)
/// and has no URI is empty.
/// Throws Error(Work) on buffers that are missing or too short, and on data URIs that cannot be decoded.
GltfData read_data(const GltfFile& file, const nlohmann::json& root, std::optional<std::span<const std::byte>> chunk);

/// Returns the bytes of a data URI: with any media type and parameters or none, in base64 or percent escapes; nothing
/// if the text is no data URI. `place` names it in errors. Throws Error(Work) if it cannot be decoded.
std::optional<std::vector<unsigned char>> data_of_uri(std::string_view uri, const std::string& place);

}  // namespace ballot
