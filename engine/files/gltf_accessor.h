// Checked access to glTF accessors. Internal to engine/files.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <string_view>
#include <vector>

#include "engine/files/checked_bytes.h"
#include "engine/files/gltf_file.h"

namespace ballot {

/// Reads the elements of an accessor in place. A view is valid as long as its file.
class AccessorView {
 public:
  std::size_t size() const { return count_; }
  glm::dvec3 vec3(std::size_t i) const;                  // normalised integers are scaled to [0, 1] or [-1, 1]
  glm::dvec2 vec2(std::size_t i) const;                  // as vec3()
  glm::dvec4 vec4(std::size_t i) const;                  // as vec3()
  double component(std::size_t i, std::size_t c) const;  // number c of element i, as vec3()
  std::uint32_t index(std::size_t i) const;              // unsigned integers only

 private:
  friend AccessorView open_accessor(const GltfFile& file, int index, std::string_view place);
  const unsigned char* element(std::size_t i) const;

  std::size_t count_ = 0, components_ = 1;
  CheckedBytes data_;  // empty: all elements are zero
  int component_type_ = 0;
  bool normalized_ = false;
  std::vector<std::uint32_t> sparse_indices_;  // ascending
  CheckedBytes sparse_values_;
};

/// Returns the bytes of a buffer view. `place` names its user in errors.
/// Throws Error(Work) if there is no such view, or if it lies beyond its buffer.
CheckedBytes open_buffer_view(const GltfFile& file, int index, std::string_view place);

/// Checks an accessor (ranges, strides, sparse indices) and opens it. `place` names the user of the accessor in errors.
/// Throws Error(Work).
AccessorView open_accessor(const GltfFile& file, int index, std::string_view place);

// These also check the type and the component type. Throw Error(Work).
AccessorView open_positions(const GltfFile& file, int index, std::string_view place);  // VEC3; float or quantised
AccessorView open_normals(const GltfFile& file, int index, std::string_view place);    // VEC3; float or quantised
AccessorView open_uvs(const GltfFile& file, int index, std::string_view place);        // VEC2; float or quantised
/// VEC3 or VEC4 of float, or of normalised integers of 8 or 16 bits; `alpha` tells which.
AccessorView open_colors(const GltfFile& file, int index, std::string_view place, bool& alpha);
AccessorView open_rotations(const GltfFile& file, int index, std::string_view place);  // VEC4; float or normalised
AccessorView open_indices(const GltfFile& file, int index, std::string_view place);   // SCALAR; 8, 16, 32 bits unsigned
AccessorView open_times(const GltfFile& file, int index, std::string_view place);     // SCALAR; float
AccessorView open_numbers(const GltfFile& file, int index, std::string_view place);   // SCALAR; float or normalised
AccessorView open_matrices(const GltfFile& file, int index, std::string_view place);  // MAT4; float
AccessorView open_joints(const GltfFile& file, int index, std::string_view place);    // VEC4; 8 or 16 bits unsigned
AccessorView open_weights(const GltfFile& file, int index, std::string_view place);   // VEC4; float or normalised

}  // namespace ballot
