// Parses PLY files: text, or binary of either byte order. Internal to engine/files.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace ballot {

/// The vertices and faces of a file.
struct PlyFile {
  std::vector<glm::vec3> vertices;       // about the origin
  glm::dvec3 origin{0};                  // not zero if that keeps digits of numbers in text or in double
  std::vector<glm::vec3> normals;        // one a vertex, as in the file; empty if it has none
  std::vector<glm::vec3> colors;         // one a vertex, linear; empty if it has none
  std::vector<float> radii;              // one a vertex; empty if it has none
  bool has_faces = false;                // the header names faces or strips, of which there may be none
  std::vector<std::uint32_t> corners;    // of faces with 3 or more; below vertices.size()
  std::vector<std::uint32_t> face_ends;  // into corners: face f ends before corner face_ends[f]
  std::vector<std::string> notes;
};

/// Parses a PLY file: x y z, nx ny nz, red green blue and radius (or scalar_radius) of its vertices, and vertex_indices
/// or vertex_index of its faces and of its strips of triangles ('tristrips'), in any order. Colours are taken as sRGB
/// whose full value is 255 in 8-bit integers, 65535 in 16-bit ones, and else 1. Other properties and elements are
/// skipped. Throws Flaw that names the line or the element where they are known.
///
/// Source: Greg Turk, "The PLY Polygon File Format", Stanford University, 1994.
PlyFile read_ply(const std::filesystem::path& path);

}  // namespace ballot
