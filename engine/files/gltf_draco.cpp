// Decodes meshes of KHR_draco_mesh_compression.
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>

#include "engine/core/memory.h"
#include "engine/files/gltf_accessor.h"
#include "engine/files/gltf_compressed.h"
#include "engine/files/loaders.h"

namespace ballot {
namespace {

/// Reads Draco's variable-length number at `at`, and moves `at` behind it. Returns nothing at the end of the bytes.
std::optional<std::uint64_t> draco_number(std::span<const unsigned char> bytes, std::size_t& at) {
  std::uint64_t value = 0;
  for (int shift = 0; shift < 64 && at < bytes.size(); shift += 7) {
    const unsigned char byte = bytes[at++];
    value |= std::uint64_t(byte & 0x7F) << shift;
    if (byte < 0x80) return value;
  }
  return std::nullopt;
}

/// Moves `at` behind an element of metadata: pairs of a name and bytes, and elements with names inside it. Returns
/// false if the bytes end before.
bool skip_metadata(std::span<const unsigned char> bytes, std::size_t& at, int depth = 0) {
  const auto skip = [&](std::optional<std::uint64_t> count) {
    if (!count || at > bytes.size() || *count > bytes.size() - at) return false;
    at += static_cast<std::size_t>(*count);
    return true;
  };
  const auto skip_name = [&] { return at < bytes.size() && skip(std::uint64_t{bytes[at]} + 1); };
  const std::optional<std::uint64_t> pairs = draco_number(bytes, at);
  if (!pairs || depth > 64) return false;
  for (std::uint64_t i = 0; i < *pairs; ++i)
    if (!skip_name() || !skip(draco_number(bytes, at))) return false;
  const std::optional<std::uint64_t> inside = draco_number(bytes, at);
  for (std::uint64_t i = 0; i < inside.value_or(0); ++i)
    if (!skip_name() || !skip_metadata(bytes, at, depth + 1)) return false;
  return inside.has_value();
}

/// What the start of a stream claims, before memory is taken for it.
struct DracoClaims {
  std::uint64_t faces = 0;
  std::optional<std::uint64_t> points;  // of a stream in file order; one by edgebreaker has at most three a face
};

/// Returns the claims of a mesh of version 2.2, the one that glTF allows. Returns nothing for other streams.
std::optional<DracoClaims> claims_of(std::span<const unsigned char> bytes) {
  std::size_t at = 11;  // the header
  if (bytes.size() < at || std::memcmp(bytes.data(), "DRACO\x02\x02\x01", 8) != 0) return std::nullopt;
  if ((bytes[10] & 0x80) != 0) {
    const std::optional<std::uint64_t> attributes = draco_number(bytes, at);
    for (std::uint64_t i = 0; i < attributes.value_or(0); ++i)
      if (!draco_number(bytes, at) || !skip_metadata(bytes, at)) return std::nullopt;
    if (!attributes || !skip_metadata(bytes, at)) return std::nullopt;
  }
  const bool edgebreaker = bytes[8] == draco::MESH_EDGEBREAKER_ENCODING;
  if (edgebreaker) {
    ++at;  // the kind of traversal
    draco_number(bytes, at);
  }
  const auto faces = draco_number(bytes, at);
  if (!faces || (!edgebreaker && bytes[8] != draco::MESH_SEQUENTIAL_ENCODING)) return std::nullopt;
  return DracoClaims{*faces, edgebreaker ? std::nullopt : draco_number(bytes, at)};
}

/// A decoder of Draco's that asks for memory when the types of a stream's attributes are known, but no value is.
template <class Base>
class AskingDecoder : public Base {
 public:
  explicit AskingDecoder(std::string what) : what_(std::move(what)) {}

 private:
  bool DecodeAllAttributes() override {
    constexpr std::uint64_t kCopies = 3;  // as integers, as values, and as they are predicted
    const draco::PointCloud& cloud = *this->point_cloud();
    std::uint64_t bytes = 0;
    for (std::int32_t i = 0; i < cloud.num_attributes(); ++i)
      bytes += kCopies * std::max<std::uint64_t>(std::uint64_t(cloud.attribute(i)->byte_stride()), 4);
    need_memory_for(bytes * cloud.num_points(), what_);
    return Base::DecodeAllAttributes();
  }

  std::string what_;
};

/// Decodes a stream that claims_of() knows. Returns null if it is damaged.
std::unique_ptr<draco::Mesh> decode_known(std::span<const unsigned char> bytes, const std::string& what) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  auto mesh = std::make_unique<draco::Mesh>();
  const draco::DecoderOptions options;
  const bool edgebreaker = bytes[8] == draco::MESH_EDGEBREAKER_ENCODING;
  const draco::Status status =
      edgebreaker ? AskingDecoder<draco::MeshEdgebreakerDecoder>(what).Decode(options, &buffer, mesh.get())
                  : AskingDecoder<draco::MeshSequentialDecoder>(what).Decode(options, &buffer, mesh.get());
  return status.ok() ? std::move(mesh) : nullptr;
}

tinygltf::Accessor& accessor_of(GltfFile& file, int index, const std::string& place) {
  auto& accessors = file.model.accessors;
  if (index < 0 || static_cast<std::size_t>(index) >= accessors.size())
    refuse("{} names accessor {}, but the file has {}", place, index, accessors.size());
  return accessors[static_cast<std::size_t>(index)];
}

template <class T>
std::vector<unsigned char> values_of(const draco::Mesh& mesh, const draco::PointAttribute& from, int components) {
  const std::size_t bytes = sizeof(T) * static_cast<std::size_t>(components);
  std::vector<unsigned char> to(mesh.num_points() * bytes);
  std::array<T, 16> value{};
  for (draco::PointIndex i(0); i < mesh.num_points(); ++i) {
    if (!from.ConvertValue<T>(from.mapped_index(i), static_cast<std::int8_t>(components), value.data())) value = {};
    std::memcpy(to.data() + i.value() * bytes, value.data(), bytes);
  }
  return to;
}

std::vector<unsigned char> values_as(const draco::Mesh& mesh, const draco::PointAttribute& from, int components,
                                     int component_type) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return values_of<std::int8_t>(mesh, from, components);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return values_of<std::uint8_t>(mesh, from, components);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return values_of<std::int16_t>(mesh, from, components);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return values_of<std::uint16_t>(mesh, from, components);
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return values_of<float>(mesh, from, components);
    default:
      return {};
  }
}

/// Makes an accessor read decoded bytes.
void redirect(GltfFile& file, tinygltf::Accessor& accessor, std::vector<unsigned char> bytes) {
  accessor.bufferView = add_decoded(file, std::move(bytes));
  accessor.byteOffset = 0;
  accessor.sparse.isSparse = false;
}

/// Decodes the stream of a primitive whose accessors promise `points` vertices and `faces` triangles.
std::unique_ptr<draco::Mesh> decode_stream(const CheckedBytes& packed, std::size_t points, std::size_t faces,
                                           std::size_t attributes, const std::string& place) {
  const std::span<const unsigned char> bytes = packed.bytes();
  const auto disagree = [&](std::uint64_t found_faces) {
    refuse("{} promises {} triangles, but its Draco data has {}; export it again", place, faces, found_faces);
  };
  const std::optional<DracoClaims> claimed = claims_of(bytes);
  if (!claimed)
    refuse("{} cannot be decoded: its {} bytes do not begin as a Draco mesh of version 2.2; export it again", place,
           bytes.size());
  if (claimed->faces != faces) disagree(claimed->faces);
  if (claimed->points && *claimed->points != points)
    refuse("{} promises {} vertices, but its Draco data has {}; export it again", place, points, *claimed->points);
  constexpr std::uint64_t kFaceBytes = 96, kValueBytes = 32;  // of Draco's tables and of the decoded values
  const std::string what = fmt::format("{} of {} triangles", place, faces);
  need_memory_for(faces * kFaceBytes + points * attributes * kValueBytes, what);
  std::unique_ptr<draco::Mesh> mesh = decode_known(bytes, what);
  if (!mesh) refuse("{} cannot be decoded: its {} bytes are no mesh of Draco's; export it again", place, bytes.size());
  if (mesh->num_faces() != faces) disagree(mesh->num_faces());
  if (mesh->num_points() != points)
    refuse("{} promises {} vertices, but its Draco data has {}; export it again", place, points, mesh->num_points());
  return mesh;
}

std::vector<unsigned char> indices_of(const draco::Mesh& mesh) {
  std::vector<unsigned char> bytes(std::size_t{mesh.num_faces()} * 3 * sizeof(std::uint32_t));
  for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh.face(f);
    const std::array<std::uint32_t, 3> corners{face[0].value(), face[1].value(), face[2].value()};
    std::memcpy(bytes.data() + std::size_t{f.value()} * sizeof corners, corners.data(), sizeof corners);
  }
  return bytes;
}

}  // namespace

void decode_draco(GltfFile& file, tinygltf::Primitive& primitive, const std::string& place) {
  const std::string here = fmt::format("{} ({})", place, kDraco);
  const tinygltf::Value draco = primitive.extensions.at(kDraco);
  const std::uint64_t view = whole_number(draco, "bufferView", here);
  const CheckedBytes packed = open_buffer_view(file, static_cast<int>(std::min<std::uint64_t>(view, 0x7FFFFFFF)), here);
  const auto position = primitive.attributes.find("POSITION");
  if (position == primitive.attributes.end() || primitive.indices == -1 || !draco.Has("attributes") ||
      !draco.Get("attributes").IsObject())
    refuse("{} has no POSITION, no indices or no attributes; export it again", here);
  tinygltf::Accessor& indices = accessor_of(file, primitive.indices, here);
  const bool strip = primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP && indices.count >= 2;
  const std::size_t faces = strip && indices.count % 3 != 0 ? indices.count - 2 : indices.count / 3;
  const std::vector<std::string> names = draco.Get("attributes").Keys();
  const auto mesh = decode_stream(packed, accessor_of(file, position->second, here).count, faces, names.size(), here);
  for (const std::string& name : names) {
    const auto attribute = primitive.attributes.find(name);
    if (attribute == primitive.attributes.end()) continue;
    const std::uint64_t id = whole_number(draco.Get("attributes"), name.c_str(), here + " attributes");
    const auto* from = id > 0xFFFFFFFF ? nullptr : mesh->GetAttributeByUniqueId(static_cast<std::uint32_t>(id));
    tinygltf::Accessor& accessor = accessor_of(file, attribute->second, here + " " + name);
    const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
    if (!from || components < 1 || components > 16)
      refuse("{} names attribute {} for {}, which its Draco data lacks; export it again", here, id, name);
    accessor.count = mesh->num_points();
    redirect(file, accessor, values_as(*mesh, *from, components, accessor.componentType));
  }
  indices.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  indices.count = std::size_t{mesh->num_faces()} * 3;
  redirect(file, indices, indices_of(*mesh));
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
}

}  // namespace ballot
