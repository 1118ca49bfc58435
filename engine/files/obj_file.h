// Parses OBJ files and their MTL materials. Internal to engine/files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "engine/files/load.h"

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

/// The image of a material's colour (map_Kd), which is looked up at scale * (u, v) + offset.
struct ObjMap {
  std::string name = {};              // as in the file, with slashes; "": none
  std::filesystem::path folder = {};  // of the MTL file, from the OBJ file's on
  glm::vec2 scale{1}, offset{0};
  bool clamp = false;
};

/// The faces from one `g` or `o` on, up to the next.
struct ObjGroup {
  std::uint32_t first = 0;  // of ObjFile::faces
  std::uint32_t name = 0;   // of ObjFile::names
};

struct ObjFile {
  std::vector<glm::vec3> vertices;  // about the origin
  glm::dvec3 origin{0};             // not zero if that keeps digits of the text
  std::vector<glm::vec3> normals;
  std::vector<glm::vec2> coordinates;  // of textures; v runs upwards
  std::vector<glm::vec3> colors;   // one a vertex, linear, white where the file gives none; empty if no vertex has one
  std::vector<ObjCorner> corners;  // indices from 0, in range
  std::vector<std::int32_t> coordinates_of;  // one a corner, into coordinates, -1: none; empty if no corner has any
  std::vector<ObjFace> faces;                // with 3 corners or more, in file order
  std::vector<ObjGroup> groups;              // with a face or more, in file order
  std::vector<std::string> names;            // of groups, each once; faces before any have the file's
  std::vector<Material> materials;
  std::vector<ObjMap> maps;  // one a material
  std::vector<std::string> notes;
};

/// Parses an OBJ file and the MTL files that it names. One that is missing or outside of the folder gives a note.
/// Throws Flaw with the line.
ObjFile read_obj(const std::filesystem::path& path, const LoadOptions& options = {});

/// Appends the materials of the MTL file `name`, which lies beside the OBJ file `obj` or below, with notes of what they
/// ask for and do not get. Returns false if there is no such file. Throws Error(Work) if it cannot be read.
bool read_mtl(const std::filesystem::path& obj, const std::filesystem::path& name, ObjFile& file);

/// Gives the materials in use that name an image their textures. `used` has one entry a material. An image that is
/// missing, outside of the folder or cannot be decoded gives a note.
void read_obj_textures(const std::filesystem::path& obj, const LoadOptions& options, const ObjFile& file,
                       const std::vector<bool>& used, Scene& scene);

}  // namespace ballot
