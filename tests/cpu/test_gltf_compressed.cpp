// Tests of compressed glTF. The files are made here, by the encoders of meshoptimizer, Draco and libwebp.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>
#include <webp/encode.h>

#include <algorithm>
#include <array>

#include "tests/cpu/gltf_builder.h"

namespace ballot::test {
namespace {

constexpr int kWavySide = 12;

/// A wavy grid.
struct Grid {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
};

Grid wavy() {
  Grid grid;
  for (int y = 0; y <= kWavySide; ++y)
    for (int x = 0; x <= kWavySide; ++x)
      for (const float v : {float(x), float(y), float(x * y % 5) / 4}) grid.positions.push_back(v);
  for (std::uint32_t y = 0; y < kWavySide; ++y)
    for (std::uint32_t x = 0; x < kWavySide; ++x) {
      const std::uint32_t a = y * (kWavySide + 1) + x, c = a + kWavySide + 1;
      for (const std::uint32_t i : {a, a + 1, c, c, a + 1, c + 1}) grid.indices.push_back(i);
    }
  return grid;
}

/// Returns the triangles of the grid, as a file without compression has them.
UnsetVector<Triangle> plain(const Grid& grid) {
  GltfBuilder b;
  const int positions = b.vec3(grid.positions);
  b.mesh(positions);
  b.primitive()["indices"] = b.accessor(b.view(grid.indices), 5125, grid.indices.size(), "SCALAR");
  b.node({{"mesh", 0}});
  return b.load().triangles;
}

/// Triangles without their order, and without the corner that each begins with.
std::vector<std::array<float, 9>> unordered(const UnsetVector<Triangle>& triangles) {
  std::vector<std::array<float, 9>> all;
  for (const Triangle& t : triangles) {
    std::array<std::array<float, 9>, 3> turned{};
    for (std::size_t first = 0; first < 3; ++first)
      for (std::size_t k = 0; k < 9; ++k) turned[first][k] = t[(first + k / 3) % 3][int(k % 3)];
    all.push_back(*std::ranges::min_element(turned));
  }
  std::ranges::sort(all);
  return all;
}

/// A file with the compressed data in buffer 0 and, for meshopt, a buffer 1 that holds nothing.
class Compressed : public ::testing::Test {
 protected:
  int pack(const std::vector<unsigned char>& bytes, std::size_t count, std::size_t stride, const char* mode,
           const char* filter = nullptr) {
    const int packed = b.view(bytes);
    nlohmann::json extension = b.json["bufferViews"][packed];
    b.json["bufferViews"].erase(packed);
    extension.update({{"byteStride", stride}, {"count", count}, {"mode", mode}});
    if (filter) extension["filter"] = filter;
    b.json["bufferViews"].push_back({{"buffer", 1},
                                     {"byteOffset", place_},
                                     {"byteLength", count * stride},
                                     {"extensions", {{"EXT_meshopt_compression", extension}}}});
    if (std::string_view(mode) == "ATTRIBUTES") b.json["bufferViews"].back()["byteStride"] = stride;
    place_ += count * stride;
    return packed;
  }

  void meshopt_grid(bool sequence) {
    std::vector<unsigned char> vertices(meshopt_encodeVertexBufferBound(vertex_count, 12));
    vertices.resize(
        meshopt_encodeVertexBuffer(vertices.data(), vertices.size(), grid.positions.data(), vertex_count, 12));
    const int positions = b.accessor(pack(vertices, vertex_count, 12, "ATTRIBUTES"), 5126, vertex_count, "VEC3");
    const std::size_t n = grid.indices.size();
    std::vector<unsigned char> packed(sequence ? meshopt_encodeIndexSequenceBound(n, vertex_count)
                                               : meshopt_encodeIndexBufferBound(n, vertex_count));
    packed.resize(sequence ? meshopt_encodeIndexSequence(packed.data(), packed.size(), grid.indices.data(), n)
                           : meshopt_encodeIndexBuffer(packed.data(), packed.size(), grid.indices.data(), n));
    const int view = pack(packed, n, 4, sequence ? "INDICES" : "TRIANGLES");
    b.mesh(positions);
    b.primitive()["indices"] = b.accessor(view, 5125, n, "SCALAR");
    finish("EXT_meshopt_compression");
    b.json["buffers"] = {{{"byteLength", b.data.size()}},
                         {{"byteLength", place_}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}};
  }

  void draco_grid(int method, int bits) {
    const UnsetVector<Triangle> triangles = plain(grid);
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(int(triangles.size()));
    const int attribute = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    for (std::uint32_t i = 0; i < triangles.size(); ++i)
      builder.SetAttributeValuesForFace(attribute, draco::FaceIndex(i), &triangles[i][0], &triangles[i][1],
                                        &triangles[i][2]);
    const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
    draco::Encoder encoder;
    encoder.SetTrackEncodedProperties(true);
    encoder.SetEncodingMethod(method);
    if (bits > 0) encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, bits);
    draco::EncoderBuffer out;
    ASSERT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &out).ok());
    const int view = b.view(std::vector<char>(out.data(), out.data() + out.size()));
    b.json["accessors"] = {{{"componentType", 5126}, {"count", encoder.num_encoded_points()}, {"type", "VEC3"}},
                           {{"componentType", 5123}, {"count", 3 * triangles.size()}, {"type", "SCALAR"}}};
    b.mesh(0);
    b.primitive()["indices"] = 1;
    const auto id = mesh->GetNamedAttribute(draco::GeometryAttribute::POSITION)->unique_id();
    b.primitive()["extensions"] = {
        {"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", {{"POSITION", id}}}}}};
    finish("KHR_draco_mesh_compression");
  }

  void finish(const char* extension) {
    b.node({{"mesh", 0}});
    b.json["extensionsUsed"] = b.json["extensionsRequired"] = {extension};
  }
  nlohmann::json& meshopt(int view) { return b.json["bufferViews"][view]["extensions"]["EXT_meshopt_compression"]; }
  nlohmann::json& draco_part() { return b.primitive()["extensions"]["KHR_draco_mesh_compression"]; }
  void refuse(std::initializer_list<std::string_view> parts) const {
    expect_error(Failure::Work, parts, [this] { b.load(); });
  }

  const Grid grid = wavy();
  const std::size_t vertex_count = grid.positions.size() / 3;
  GltfBuilder b;

 private:
  std::size_t place_ = 0;
};

TEST_F(Compressed, MeshoptTriangles) {
  meshopt_grid(false);
  const Scene scene = b.load();
  EXPECT_EQ(unordered(scene.triangles), unordered(plain(grid)));
  EXPECT_TRUE(scene.notes.empty());
}

TEST_F(Compressed, MeshoptSequence) {
  meshopt_grid(true);
  EXPECT_EQ(b.load().triangles, plain(grid));
}

TEST_F(Compressed, MeshoptInTextFiles) {
  meshopt_grid(true);
  const TemporaryFolder folder;
  folder.write("grid.bin", b.data);
  b.json["buffers"][0]["uri"] = "grid.bin";
  EXPECT_EQ(load_scene(folder.write("grid.gltf", b.json.dump())).triangles, plain(grid));
}

TEST_F(Compressed, MeshoptFiltersNormals) {
  meshopt_grid(false);
  std::vector<float> normals;
  for (std::size_t i = 0; i < vertex_count; ++i)
    for (const float v : {0.6f, 0.0f, 0.8f, 0.0f}) normals.push_back(v);
  std::vector<signed char> octahedral(vertex_count * 4);
  meshopt_encodeFilterOct(octahedral.data(), vertex_count, 4, 8, normals.data());
  std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(vertex_count, 4));
  packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), octahedral.data(), vertex_count, 4));
  const int accessor =
      b.accessor(pack(packed, vertex_count, 4, "ATTRIBUTES", "OCTAHEDRAL"), 5120, vertex_count, "VEC3");
  b.json["accessors"][accessor]["normalized"] = true;
  b.primitive()["attributes"]["NORMAL"] = accessor;
  b.json["buffers"][0]["byteLength"] = b.data.size();
  const Scene scene = b.load();
  ASSERT_EQ(scene.normals.size(), scene.triangles.size());
  for (const auto& corners : scene.normals)
    for (const glm::vec3& n : corners) EXPECT_NEAR(0.6f * n.x + 0.8f * n.z, 1, 1e-3);
}

TEST_F(Compressed, MeshoptThatIsNotWhatItSays) {
  meshopt_grid(false);
  const GltfBuilder good = b;
  const auto changed = [&](int view, const char* key, const nlohmann::json& value,
                           std::initializer_list<std::string_view> parts) {
    b = good;
    meshopt(view)[key] = value;
    refuse(parts);
  };
  changed(0, "byteLength", 40, {"bufferView 0 (EXT_meshopt_compression) cannot be decoded", "40 bytes"});
  changed(0, "byteLength", 1 << 20, {"bufferView 0 (EXT_meshopt_compression) spans 1048576 bytes", "buffer 0"});
  changed(0, "buffer", 7, {"names buffer 7, but the file has 2"});
  changed(0, "buffer", "x", {"has no whole number 'buffer'"});
  changed(0, "count", -1, {"has no whole number 'count'"});
  changed(0, "count", 1e12, {"needs about 10.91 TiB of memory"});
  changed(0, "byteStride", 6, {"byteStride of 6", "a multiple of 4"});
  changed(0, "mode", "CUBES", {"the mode 'CUBES'"});
  changed(0, "filter", "OCTAHEDRAL", {"the filter 'OCTAHEDRAL'", "12"});
  changed(1, "filter", "EXPONENTIAL", {"the filter 'EXPONENTIAL' on TRIANGLES"});
  changed(1, "byteStride", 12, {"byteStride of 12", "2 or 4"});
  changed(1, "count", 10, {"10 indices", "a multiple of 3"});
  b = good;
  b.data[b.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["byteOffset"].get<std::size_t>()] ^= 0x55;
  refuse({"bufferView 0 (EXT_meshopt_compression) cannot be decoded"});
}

TEST_F(Compressed, DracoInFileOrder) {
  draco_grid(draco::MESH_SEQUENTIAL_ENCODING, 0);
  EXPECT_EQ(b.load().triangles, plain(grid));
}

TEST_F(Compressed, DracoEdgebreaker) {
  draco_grid(draco::MESH_EDGEBREAKER_ENCODING, 16);
  const auto found = unordered(b.load().triangles), expected = unordered(plain(grid));
  ASSERT_EQ(found.size(), expected.size());
  std::size_t near = 0;  // of rounded coordinates another corner may be the first
  for (const auto& t : expected)
    near += std::ranges::any_of(found, [&](const auto& f) {
      double difference = 0;
      for (std::size_t k = 0; k < 9; k += 3) difference += std::abs(double(f[k] + f[k + 1]) - double(t[k] + t[k + 1]));
      return difference < 1e-2;
    });
  EXPECT_EQ(near, expected.size());
}

TEST_F(Compressed, DracoThatIsNotWhatItSays) {
  draco_grid(draco::MESH_EDGEBREAKER_ENCODING, 12);
  const GltfBuilder good = b;
  draco_part()["bufferView"] = 9;
  refuse({"mesh 0 primitive 0 (KHR_draco_mesh_compression) names bufferView 9, but the file has 1"});
  b = good;
  draco_part()["attributes"]["POSITION"] = 77;
  refuse({"names attribute 77 for POSITION"});
  b = good;
  b.json["accessors"][1]["count"] = 3;
  refuse({"promises 1 triangles, but its Draco data has 288"});
  b = good;
  b.json["accessors"][0]["count"] = 5;
  refuse({"promises 5 vertices"});
  b = good;
  b.json["bufferViews"][0]["byteLength"] = 100;
  refuse({"cannot be decoded: its 100 bytes"});
  b = good;
  b.data[0] = 'X';
  refuse({"cannot be decoded"});
  b = good;
  b.data[13] = b.data[14] = b.data[15] = b.data[16] = '\xFF';  // the counts of vertices and faces
  refuse({"Draco data has "});
  b = good;
  b.data[6] = '\1';  // an older version, whose claims lie elsewhere
  refuse({"do not begin as a Draco mesh of version 2.2"});
  b = good;
  b.data[10] = '\x80';  // metadata, which are not there
  refuse({"do not begin as a Draco mesh of version 2.2"});
  b = good;
  b.primitive()["extensions"]["KHR_draco_mesh_compression"].erase("attributes");
  refuse({"no attributes"});
}

TEST_F(Compressed, WebpTextures) {
  b = one_triangle();
  const std::vector<std::uint8_t> pixels{255, 0, 0, 255, 0, 255, 0, 128};
  std::uint8_t* encoded = nullptr;
  const std::size_t size = WebPEncodeLosslessRGBA(pixels.data(), 2, 1, 8, &encoded);
  ASSERT_GT(size, 0u);
  const std::vector<std::uint8_t> bytes(encoded, encoded + size);
  WebPFree(encoded);
  b.json["images"] = {{{"bufferView", b.view(bytes)}, {"mimeType", "image/webp"}}};
  b.json["textures"] = {{{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}}};
  b.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  b.primitive()["material"] = 0;
  b.json["extensionsRequired"] = b.json["extensionsUsed"] = {"EXT_texture_webp"};
  const Scene scene = b.load();
  ASSERT_EQ(scene.images.size(), 1u);
  EXPECT_EQ(scene.images[0].rgba, pixels);
  b.json["bufferViews"][1]["byteLength"] = size - 3;
  refuse({"image 0", "WebP"});
  b.json["bufferViews"][1]["byteLength"] = 14;
  refuse({"image 0", "bad WebP header"});
}

}  // namespace
}  // namespace ballot::test
