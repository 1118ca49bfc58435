#include "engine/files/gltf_compressed.h"

#include <meshoptimizer.h>

#include <cmath>

#include "engine/core/memory.h"
#include "engine/files/gltf_accessor.h"
#include "engine/files/loaders.h"

namespace ballot {
namespace {

/// A compressed bufferView, as its extension describes it.
struct Packed {
  std::string place, mode, filter;
  CheckedBytes bytes;
  std::uint64_t count = 0, stride = 0;
};

std::string text_of(const tinygltf::Value& object, const char* key, const char* otherwise) {
  return object.Has(key) && object.Get(key).IsString() ? object.Get(key).Get<std::string>() : otherwise;
}

Packed open_packed(const GltfFile& file, std::size_t view, const tinygltf::Value& from) {
  Packed to;
  to.place = fmt::format("bufferView {} ({})", view, kMeshopt);
  const std::uint64_t buffer = whole_number(from, "buffer", to.place);
  const auto& buffers = file.model.buffers;
  if (buffer >= buffers.size()) refuse("{} names buffer {}, but the file has {}", to.place, buffer, buffers.size());
  const CheckedBytes whole(buffers[buffer].data, fmt::format("buffer {}", buffer));
  const std::uint64_t offset = from.Has("byteOffset") ? whole_number(from, "byteOffset", to.place) : 0;
  to.bytes = whole.part(offset, whole_number(from, "byteLength", to.place), to.place);
  to.stride = whole_number(from, "byteStride", to.place);
  to.count = whole_number(from, "count", to.place);
  to.mode = text_of(from, "mode", "");
  to.filter = text_of(from, "filter", "NONE");
  return to;
}

/// Checks the numbers that the decoders take for granted.
void check_packed(const Packed& p) {
  const bool attributes = p.mode == "ATTRIBUTES", triangles = p.mode == "TRIANGLES";
  if (!attributes && !triangles && p.mode != "INDICES")
    refuse("{} has the mode '{}'; expected ATTRIBUTES, TRIANGLES or INDICES", p.place, p.mode);
  if (attributes ? p.stride == 0 || p.stride > 256 || p.stride % 4 != 0 : p.stride != 2 && p.stride != 4)
    refuse("{} has a byteStride of {}; expected {}", p.place, p.stride,
           attributes ? "a multiple of 4 up to 256" : "2 or 4");
  if (triangles && p.count % 3 != 0)
    refuse("{} has {} indices of triangles; expected a multiple of 3", p.place, p.count);
  const bool fits = p.filter == "NONE" || (p.filter == "OCTAHEDRAL" && (p.stride == 4 || p.stride == 8)) ||
                    (p.filter == "QUATERNION" && p.stride == 8) || p.filter == "EXPONENTIAL";
  if (!fits || (p.filter != "NONE" && !attributes))
    refuse("{} has the filter '{}' on {} of {} bytes; expected NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL", p.place,
           p.filter, p.mode, p.stride);
}

std::vector<unsigned char> decode_packed(const Packed& p) {
  check_packed(p);
  need_memory_for(p.count * p.stride, p.place);
  std::vector<unsigned char> to(p.count * p.stride);
  const std::span<const unsigned char> from = p.bytes.bytes();
  int status = 0;
  if (p.count == 0) return to;
  if (p.mode == "ATTRIBUTES")
    status = meshopt_decodeVertexBuffer(to.data(), p.count, p.stride, from.data(), from.size());
  else if (p.mode == "TRIANGLES")
    status = meshopt_decodeIndexBuffer(to.data(), p.count, p.stride, from.data(), from.size());
  else
    status = meshopt_decodeIndexSequence(to.data(), p.count, p.stride, from.data(), from.size());
  if (status != 0)
    refuse("{} cannot be decoded: its {} bytes are not {} elements of {} bytes; export it again", p.place, from.size(),
           p.count, p.stride);
  if (p.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(to.data(), p.count, p.stride);
  if (p.filter == "QUATERNION") meshopt_decodeFilterQuat(to.data(), p.count, p.stride);
  if (p.filter == "EXPONENTIAL") meshopt_decodeFilterExp(to.data(), p.count, p.stride);
  return to;
}

}  // namespace

std::uint64_t whole_number(const tinygltf::Value& object, const char* key, const std::string& place) {
  const double value = object.IsObject() && object.Has(key) && object.Get(key).IsNumber()
                           ? object.Get(key).GetNumberAsDouble()
                           : std::nan("");
  if (!(value >= 0 && value < 9e15 && value == std::floor(value)))
    refuse("{} has no whole number '{}'; export it again", place, key);
  return static_cast<std::uint64_t>(value);
}

int add_decoded(GltfFile& file, std::vector<unsigned char> bytes) {
  tinygltf::BufferView view;
  view.buffer = static_cast<int>(file.model.buffers.size());
  view.byteLength = bytes.size();
  file.model.buffers.emplace_back().data = std::move(bytes);
  file.model.bufferViews.push_back(view);
  return static_cast<int>(file.model.bufferViews.size()) - 1;
}

void decompress(GltfFile& file) {
  for (std::size_t i = 0; i < file.model.bufferViews.size(); ++i) {
    const auto& extensions = file.model.bufferViews[i].extensions;
    const auto found = extensions.find(kMeshopt);
    if (found == extensions.end()) continue;
    std::vector<unsigned char> bytes = decode_packed(open_packed(file, i, found->second));
    tinygltf::BufferView& view = file.model.bufferViews[i];
    view.buffer = static_cast<int>(file.model.buffers.size());
    view.byteOffset = 0;
    view.byteLength = bytes.size();
    file.model.buffers.emplace_back().data = std::move(bytes);
  }
  for (std::size_t m = 0; m < file.model.meshes.size(); ++m) {
    tinygltf::Mesh& mesh = file.model.meshes[m];
    for (std::size_t i = 0; i < mesh.primitives.size(); ++i)
      if (mesh.primitives[i].extensions.contains(kDraco))
        decode_draco(file, mesh.primitives[i], fmt::format("{} primitive {}", label("mesh", m, mesh.name), i));
  }
}

}  // namespace ballot
