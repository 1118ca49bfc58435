// Parses glTF files with tinygltf, with the checks that tinygltf lacks. Internal to engine/files.
#pragma once

#include <tiny_gltf.h>

#include <filesystem>
#include <string>
#include <vector>

#include "engine/files/load.h"

namespace ballot {

/// A parsed glTF file.
struct GltfFile {
  std::filesystem::path path;
  tinygltf::Model model;
  LoadOptions options;
  std::vector<std::string> notes;  // for Scene::notes, one sentence each
};

/// Reads a .gltf or .glb file, as its content says, with its buffers. Images stay encoded; images in separate files are
/// not read.
/// Throws Error(Work) on truncated files, buffer views beyond their buffer, other glTF versions and required extensions
/// that Ballot lacks.
GltfFile read_gltf(const std::filesystem::path& path, const LoadOptions& options = {});

/// Returns an index or a set that an extension holds; -1, which nothing has, unless it is a whole number of an int.
int index_in(const tinygltf::Value& value);

/// Returns "mesh 3 ('chair')", or "mesh 3" without a name.
std::string label(const char* kind, std::size_t index, const std::string& name);

}  // namespace ballot
