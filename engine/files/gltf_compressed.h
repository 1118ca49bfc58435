// Decompresses glTF files: EXT_meshopt_compression and KHR_draco_mesh_compression. Internal to engine/files.
#pragma once

#include <string>

#include "engine/files/gltf_file.h"

namespace ballot {

/// Decompresses every bufferView and primitive that is compressed, to buffers of their own. Afterwards accessors and
/// bufferViews are as in a file without compression.
/// Throws Error(Work) if the data cannot be decoded, is not what the JSON says of it, or does not fit into memory
/// (memory.h).
void decompress(GltfFile& file);

/// Decompresses a primitive with KHR_draco_mesh_compression: its accessors get bufferViews of decoded data, its mode
/// becomes triangles. `place` is "mesh 3 ('chair') primitive 0". Throws as decompress().
void decode_draco(GltfFile& file, tinygltf::Primitive& primitive, const std::string& place);

/// Appends a buffer with a bufferView of all its bytes. Returns the number of the bufferView.
int add_decoded(GltfFile& file, std::vector<unsigned char> bytes);

/// Returns a whole number of an extension. Throws Error(Work) if it is missing, negative or not whole.
std::uint64_t whole_number(const tinygltf::Value& object, const char* key, const std::string& place);

inline constexpr const char* kMeshopt = "EXT_meshopt_compression";
inline constexpr const char* kDraco = "KHR_draco_mesh_compression";

}  // namespace ballot
