// Parses OBJ files and their MTL materials. Internal to engine/scene.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "engine/scene/scene.h"

namespace ballot {

inline constexpr std::uint32_t kNoMaterial = 0xFFFFFFFF;

struct ObjCorner {
  std::int32_t vertex = 0;
  std::int32_t normal = -1;  // -1: none
};

struct ObjFace {
  std::uint32_t first = 0, count = 0;  // range of ObjFile::corners
  std::uint32_t material = kNoMaterial;
  std::uint32_t smoothing = 0;  // smoothing group; 0: flat
  std::uint32_t line = 0;       // line number in the file, from 1
};

struct ObjFile {
  std::vector<glm::vec3> vertices, normals;
  std::vector<glm::vec3> colors;   // one a vertex, linear, white where the file gives none; empty if no vertex has one
  std::vector<ObjCorner> corners;  // indices from 0, in range
  std::vector<ObjFace> faces;      // with 3 corners or more, in file order
  std::vector<Material> materials;
  std::vector<std::string> notes;
};

/// Parses an OBJ file and the MTL files that it names. One that is missing or outside of the folder gives a note.
/// Throws Error(Work) "PATH:LINE: ...".
///
/// tinyobjloader is not used here: it turns an unreadable number (also "nan") into 0, rounds decimals twice, and names
/// no line for a wrong index. It does read the materials.
ObjFile read_obj(const std::filesystem::path& path, const LoadOptions& options = {});

/// Appends the materials of an MTL file. Returns false if there is no such file. Throws Error(Work) if it cannot be
/// read.
bool read_mtl(const std::filesystem::path& path, std::vector<Material>& materials);

}  // namespace ballot
