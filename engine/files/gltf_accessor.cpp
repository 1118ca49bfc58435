#include "engine/files/gltf_accessor.h"

#include <algorithm>
#include <cstring>
#include <initializer_list>
#include <utility>

#include "engine/files/loaders.h"

namespace ballot {
namespace {

/// The limit for accessors without data: such an accessor is all zeros, and nothing in the file bounds its count.
constexpr std::size_t kMaxImplicitCount = std::size_t{1} << 24;

template <class T>
T load(const unsigned char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);  // glTF requires alignment, but hostile files may lack it
  return value;
}

/// Opens elements of `element_bytes` in a buffer view, at the view's stride.
CheckedBytes open_elements(const GltfFile& file, int view, std::size_t offset, std::size_t count,
                           std::size_t element_bytes, const std::string& name) {
  const CheckedBytes bytes = open_buffer_view(file, view, name);
  const std::size_t stride = file.model.bufferViews[static_cast<std::size_t>(view)].byteStride;
  return bytes.elements(offset, count, element_bytes, stride == 0 ? element_bytes : stride, name);
}

std::uint32_t unsigned_at(const unsigned char* at, int component_type) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return *at;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(at);
    default:
      return load<std::uint32_t>(at);
  }
}

bool is_index_type(int component_type) {
  return component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
         component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
         component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

std::vector<std::uint32_t> sparse_indices(const GltfFile& file, const tinygltf::Accessor& accessor,
                                          const std::string& name) {
  const auto& sparse = accessor.sparse;
  // Some versions of tinygltf count in int, others in std::size_t.
  if (std::cmp_less(sparse.count, 0) || std::cmp_greater(sparse.count, accessor.count) ||
      std::cmp_less(sparse.indices.byteOffset, 0) || std::cmp_less(sparse.values.byteOffset, 0))
    refuse("{} has {} elements, but its sparse part counts {} or starts before its bufferView", name, accessor.count,
           sparse.count);
  if (!is_index_type(sparse.indices.componentType))
    refuse("{} has sparse indices of component type {}; expected 5121, 5123 or 5125", name,
           sparse.indices.componentType);
  const auto bytes = static_cast<std::size_t>(
      tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(sparse.indices.componentType)));
  const auto count = static_cast<std::size_t>(sparse.count);
  const CheckedBytes at =
      open_elements(file, sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset), count, bytes,
                    name + " (sparse indices)");
  std::vector<std::uint32_t> indices(count);
  for (std::size_t i = 0; i < count; ++i) {
    indices[i] = unsigned_at(at[i], sparse.indices.componentType);
    if (indices[i] >= accessor.count || (i > 0 && indices[i] <= indices[i - 1]))
      refuse("{} has the sparse index {} at place {}; expected ascending numbers below {}", name, indices[i], i,
             accessor.count);
  }
  return indices;
}

AccessorView open_typed(const GltfFile& file, int index, std::string_view place, int type,
                        std::initializer_list<int> component_types, const char* expected) {
  AccessorView view = open_accessor(file, index, place);
  const tinygltf::Accessor& accessor = file.model.accessors[static_cast<std::size_t>(index)];
  if (accessor.type != type || std::ranges::find(component_types, accessor.componentType) == component_types.end())
    refuse("{} uses {} of type {} and component type {}; expected {}", place,
           label("accessor", static_cast<std::size_t>(index), accessor.name), accessor.type, accessor.componentType,
           expected);
  return view;
}

}  // namespace

const unsigned char* AccessorView::element(std::size_t i) const {
  if (!sparse_indices_.empty()) {
    const auto found = std::ranges::lower_bound(sparse_indices_, i);
    if (found != sparse_indices_.end() && *found == i)
      return sparse_values_[static_cast<std::size_t>(found - sparse_indices_.begin())];
  }
  return data_.size() > 0 ? data_[i] : nullptr;
}

double AccessorView::component(std::size_t i, std::size_t c) const {
  const unsigned char* at = element(i);
  if (!at) return 0;
  const auto scaled = [this](double value, double most) { return normalized_ ? std::max(value / most, -1.0) : value; };
  switch (component_type_) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return scaled(load<std::int8_t>(at + c), 127);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return scaled(at[c], 255);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return scaled(load<std::int16_t>(at + 2 * c), 32767);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return scaled(load<std::uint16_t>(at + 2 * c), 65535);
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return load<float>(at + 4 * c);
    default:
      return 0;
  }
}

glm::dvec3 AccessorView::vec3(std::size_t i) const {
  if (component_type_ == TINYGLTF_COMPONENT_TYPE_FLOAT && sparse_indices_.empty() && data_.size() > 0) {
    const unsigned char* at = data_[i];  // the usual case
    return {load<float>(at), load<float>(at + 4), load<float>(at + 8)};
  }
  return {component(i, 0), component(i, 1), component(i, 2)};
}

glm::dvec2 AccessorView::vec2(std::size_t i) const { return {component(i, 0), component(i, 1)}; }
glm::dvec4 AccessorView::vec4(std::size_t i) const {
  return {component(i, 0), component(i, 1), component(i, 2), component(i, 3)};
}

std::uint32_t AccessorView::index(std::size_t i) const {
  const unsigned char* at = element(i);
  return at ? unsigned_at(at, component_type_) : 0;
}

CheckedBytes open_buffer_view(const GltfFile& file, int index, std::string_view place) {
  const auto& views = file.model.bufferViews;
  if (index < 0 || static_cast<std::size_t>(index) >= views.size())
    refuse("{} names bufferView {}, but the file has {}", place, index, views.size());
  const tinygltf::BufferView& view = views[static_cast<std::size_t>(index)];
  const std::string name = fmt::format("bufferView {}", index);
  const auto& buffers = file.model.buffers;
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= buffers.size())
    refuse("{} names buffer {}, but the file has {}", name, view.buffer, buffers.size());
  const CheckedBytes buffer(buffers[static_cast<std::size_t>(view.buffer)].data, fmt::format("buffer {}", view.buffer));
  return buffer.part(view.byteOffset, view.byteLength, name);
}

AccessorView open_accessor(const GltfFile& file, int index, std::string_view place) {
  const auto& accessors = file.model.accessors;
  if (index < 0 || static_cast<std::size_t>(index) >= accessors.size())
    refuse("{} names accessor {}, but the file has {}", place, index, accessors.size());
  const tinygltf::Accessor& accessor = accessors[static_cast<std::size_t>(index)];
  const std::string name = label("accessor", static_cast<std::size_t>(index), accessor.name);
  const int component_bytes = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
  const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  if (component_bytes <= 0 || components <= 0)
    refuse("{} has type {} and component type {}; expected those of glTF 2.0", name, accessor.type,
           accessor.componentType);
  AccessorView view;
  view.count_ = accessor.count;
  view.components_ = static_cast<std::size_t>(components);
  view.component_type_ = accessor.componentType;
  view.normalized_ = accessor.normalized;
  const std::size_t element_bytes = static_cast<std::size_t>(component_bytes) * view.components_;
  if (accessor.bufferView != -1) {
    view.data_ = open_elements(file, accessor.bufferView, accessor.byteOffset, accessor.count, element_bytes, name);
  } else if (accessor.count > kMaxImplicitCount) {
    refuse("{} has {} elements and no bufferView; expected at most {}", name, accessor.count, kMaxImplicitCount);
  }
  if (accessor.sparse.isSparse) {
    view.sparse_indices_ = sparse_indices(file, accessor, name);
    const std::string values = name + " (sparse values)";
    view.sparse_values_ = open_elements(file, accessor.sparse.values.bufferView,
                                        static_cast<std::size_t>(accessor.sparse.values.byteOffset),
                                        view.sparse_indices_.size(), element_bytes, values);
    if (view.sparse_values_.stride() != element_bytes)
      refuse("{} are strided ({} bytes); glTF wants them packed", values, view.sparse_values_.stride());
  }
  return view;
}

AccessorView open_positions(const GltfFile& file, int index, std::string_view place) {
  return open_typed(file, index, place, TINYGLTF_TYPE_VEC3,
                    {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE,
                     TINYGLTF_COMPONENT_TYPE_SHORT, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT},
                    "VEC3 of 5126 (float), 5120 to 5123 (integers of 8 or 16 bits)");
}

AccessorView open_normals(const GltfFile& file, int index, std::string_view place) {
  return open_typed(file, index, place, TINYGLTF_TYPE_VEC3,
                    {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_BYTE, TINYGLTF_COMPONENT_TYPE_SHORT},
                    "VEC3 of 5126 (float), 5120 or 5122 (signed integers of 8 or 16 bits)");
}

AccessorView open_uvs(const GltfFile& file, int index, std::string_view place) {
  return open_typed(file, index, place, TINYGLTF_TYPE_VEC2,
                    {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE,
                     TINYGLTF_COMPONENT_TYPE_SHORT, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT},
                    "VEC2 of 5126 (float), 5120 to 5123 (integers of 8 or 16 bits)");
}

AccessorView open_rotations(const GltfFile& file, int index, std::string_view place) {
  return open_typed(file, index, place, TINYGLTF_TYPE_VEC4,
                    {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE,
                     TINYGLTF_COMPONENT_TYPE_SHORT, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT},
                    "VEC4 of 5126 (float), 5120 to 5123 (normalised integers of 8 or 16 bits)");
}

AccessorView open_times(const GltfFile& file, int index, std::string_view place) {
  return open_typed(file, index, place, TINYGLTF_TYPE_SCALAR, {TINYGLTF_COMPONENT_TYPE_FLOAT},
                    "SCALAR of 5126 (float)");
}

AccessorView open_numbers(const GltfFile& file, int index, std::string_view place) {
  return open_typed(file, index, place, TINYGLTF_TYPE_SCALAR,
                    {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE,
                     TINYGLTF_COMPONENT_TYPE_SHORT, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT},
                    "SCALAR of 5126 (float), 5120 to 5123 (normalised integers of 8 or 16 bits)");
}

AccessorView open_matrices(const GltfFile& file, int index, std::string_view place) {
  return open_typed(file, index, place, TINYGLTF_TYPE_MAT4, {TINYGLTF_COMPONENT_TYPE_FLOAT}, "MAT4 of 5126 (float)");
}

AccessorView open_colors(const GltfFile& file, int index, std::string_view place, bool& alpha) {
  const auto& accessors = file.model.accessors;
  alpha = index >= 0 && static_cast<std::size_t>(index) < accessors.size() &&
          accessors[static_cast<std::size_t>(index)].type == TINYGLTF_TYPE_VEC4;
  return open_typed(
      file, index, place, alpha ? TINYGLTF_TYPE_VEC4 : TINYGLTF_TYPE_VEC3,
      {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT},
      "VEC3 or VEC4 of 5126 (float), 5121 or 5123 (normalised integers of 8 or 16 bits)");
}

AccessorView open_joints(const GltfFile& file, int index, std::string_view place) {
  return open_typed(file, index, place, TINYGLTF_TYPE_VEC4,
                    {TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT},
                    "VEC4 of 5121 or 5123 (unsigned integers of 8 or 16 bits)");
}

AccessorView open_weights(const GltfFile& file, int index, std::string_view place) {
  return open_typed(
      file, index, place, TINYGLTF_TYPE_VEC4,
      {TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT},
      "VEC4 of 5126 (float), 5121 or 5123 (normalised integers of 8 or 16 bits)");
}

AccessorView open_indices(const GltfFile& file, int index, std::string_view place) {
  return open_typed(file, index, place, TINYGLTF_TYPE_SCALAR,
                    {TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                     TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT},
                    "SCALAR of 5121, 5123 or 5125 (unsigned integers of 8, 16 or 32 bits)");
}

}  // namespace ballot
