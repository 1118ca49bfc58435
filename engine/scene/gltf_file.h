// A glTF file as tinygltf parses it, after the checks that tinygltf lacks. Internal to engine/scene.
#pragma once

#include <tiny_gltf.h>

#include <filesystem>
#include <string>
#include <vector>

namespace ballot {

struct GltfFile {
  std::filesystem::path path;
  tinygltf::Model model;
  std::vector<std::string> notes;  // a sentence each, for Scene::notes
};

/// Reads .gltf or .glb (the content decides) with its buffers; images stay encoded, and those in files of their own unread.
/// Refuses truncated files, other glTF versions and required extensions that Ballot lacks. Throws Error(Work).
GltfFile read_gltf(const std::filesystem::path& path);

/// "mesh 3 ('chair')", or "mesh 3" without a name.
std::string label(const char* kind, std::size_t index, const std::string& name);

}  // namespace ballot
