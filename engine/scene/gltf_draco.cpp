// Decodes meshes of KHR_draco_mesh_compression.
#include <draco/compression/decode.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>

#include "engine/core/memory.h"
#include "engine/scene/gltf_accessor.h"
#include "engine/scene/gltf_compressed.h"
#include "engine/scene/loaders.h"

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

/// Returns the number of faces that the start of a stream claims, before memory is taken for them. Returns
/// nothing if it has metadata or is no mesh of version 2.2, which all exporters of glTF write.
std::optional<std::uint64_t> claimed_faces(std::span<const unsigned char> bytes) {
  constexpr std::size_t kHeader = 11;
  if (bytes.size() < kHeader || std::memcmp(bytes.data(), "DRACO\x02\x02\x01", 8) != 0 || (bytes[10] & 0x80) != 0)
    return std::nullopt;
  std::size_t at = kHeader;
  if (bytes[8] == draco::MESH_EDGEBREAKER_ENCODING) {
    ++at;  // the kind of traversal
    draco_number(bytes, at);
  }
  return draco_number(bytes, at);
}

tinygltf::Accessor& accessor_of(GltfFile& file, int index, const std::string& place) {
  auto& accessors = file.model.accessors;
  if (index < 0 || static_cast<std::size_t>(index) >= accessors.size())
    fail_in(file.path, "{} names accessor {}, but the file has {}", place, index, accessors.size());
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
std::unique_ptr<draco::Mesh> decode_stream(const GltfFile& file, const CheckedBytes& packed, std::size_t points,
                                           std::size_t faces, std::size_t attributes, const std::string& place) {
  const std::span<const unsigned char> bytes = packed.bytes();
  const auto disagree = [&](std::uint64_t found_faces) {
    fail_in(file.path, "{} promises {} triangles, but its Draco data has {}; export it again", place, faces,
            found_faces);
  };
  const std::optional<std::uint64_t> claimed = claimed_faces(bytes);
  if (claimed && *claimed != faces) disagree(*claimed);
  constexpr std::uint64_t kFaceBytes = 96, kValueBytes = 32;  // of Draco's tables and of the decoded values
  need_memory(faces * kFaceBytes + points * attributes * kValueBytes,
              fmt::format("{}: {} of {} triangles", file.path.string(), place, faces));
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok() || !decoded.value())
    fail_in(file.path, "{} cannot be decoded: its {} bytes are no mesh of Draco's; export it again", place,
            bytes.size());
  std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
  if (mesh->num_faces() != faces) disagree(mesh->num_faces());
  if (mesh->num_points() != points)
    fail_in(file.path, "{} promises {} vertices, but its Draco data has {}; export it again", place, points,
            mesh->num_points());
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
  const std::uint64_t view = whole_number(file, draco, "bufferView", here);
  const CheckedBytes packed = open_buffer_view(file, static_cast<int>(std::min<std::uint64_t>(view, 0x7FFFFFFF)), here);
  const auto position = primitive.attributes.find("POSITION");
  if (position == primitive.attributes.end() || primitive.indices == -1 || !draco.Has("attributes") ||
      !draco.Get("attributes").IsObject())
    fail_in(file.path, "{} has no POSITION, no indices or no attributes; export it again", here);
  tinygltf::Accessor& indices = accessor_of(file, primitive.indices, here);
  const bool strip = primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP && indices.count >= 2;
  const std::size_t faces = strip && indices.count % 3 != 0 ? indices.count - 2 : indices.count / 3;
  const std::vector<std::string> names = draco.Get("attributes").Keys();
  const auto mesh =
      decode_stream(file, packed, accessor_of(file, position->second, here).count, faces, names.size(), here);
  for (const std::string& name : names) {
    const auto attribute = primitive.attributes.find(name);
    if (attribute == primitive.attributes.end()) continue;
    const std::uint64_t id = whole_number(file, draco.Get("attributes"), name.c_str(), here + " attributes");
    const auto* from = id > 0xFFFFFFFF ? nullptr : mesh->GetAttributeByUniqueId(static_cast<std::uint32_t>(id));
    tinygltf::Accessor& accessor = accessor_of(file, attribute->second, here + " " + name);
    const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
    if (!from || components < 1 || components > 16)
      fail_in(file.path, "{} names attribute {} for {}, which its Draco data lacks; export it again", here, id, name);
    accessor.count = mesh->num_points();
    redirect(file, accessor, values_as(*mesh, *from, components, accessor.componentType));
  }
  indices.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  indices.count = std::size_t{mesh->num_faces()} * 3;
  redirect(file, indices, indices_of(*mesh));
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
}

}  // namespace ballot
