// Tests the loaders of PLY, STL and arrays of triangles: what they make of valid files, and how they refuse others.
#include <bit>
#include <cstring>
#include <limits>

#include "engine/core/npy.h"
#include "gltf_builder.h"

namespace ballot::test {
namespace {

const Triangle kFirst{glm::vec3{0, 0, 0}, glm::vec3{1, 0, 0}, glm::vec3{0, 1, 0}};
const Triangle kSecond{glm::vec3{1, 0, 0}, glm::vec3{1, 1, 0}, glm::vec3{0, 1, 0}};

Scene load_mesh(const std::string& name, std::string_view content) {
  const TemporaryFolder folder;
  return load_scene(folder.write(name, content));
}

void refuse_mesh(const std::string& name, std::string_view content, std::initializer_list<std::string_view> parts) {
  expect_error(Failure::Work, parts, [&] { load_mesh(name, content); });
}

/// Appends a number's bytes, in either order.
template <class T>
void add_bytes(std::string& to, T value, bool swap = false) {
  auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (swap) std::reverse(bytes.begin(), bytes.end());
  to.append(bytes.data(), bytes.size());
}

constexpr std::string_view kMeshVertices = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
constexpr std::string_view kMeshText =
    "ply\r\nformat ascii 1.0\ncomment of any kind\nelement vertex 4\nproperty double x\nproperty float y\n"
    "property list uchar int more\nproperty float z\nelement face 2\nproperty uchar colour\n"
    "property list uchar uint vertex_index\nelement edge 1\nproperty int a\nend_header\n"
    "0 0 2 7 8 0\n1 0 0 0\n1 1 1 5 0\n0 1 0 0\n255 3 0 1 3\n9 3 1 2 3\n7\n";

TEST(Ply, TextWithOtherProperties) {
  const Scene scene = load_mesh("a.ply", kMeshText);
  EXPECT_EQ(scene.triangles, (std::vector{kFirst, kSecond}));
  EXPECT_TRUE(scene.normals.empty());
  EXPECT_EQ(scene.material_of, (std::vector<std::uint32_t>{0, 0}));
}

TEST(Ply, BinaryOfBothByteOrdersWithPolygonsAndNormals) {
  for (const bool big : {false, true}) {
    std::string file = std::string("ply\nformat binary_") + (big ? "big" : "little") + "_endian 1.0\n" +
                       std::string(kMeshVertices) +
                       "property float nx\nproperty float ny\nproperty float nz\n"
                       "element face 2\nproperty list uint8 int32 vertex_indices\nend_header\n";
    for (const auto& [x, y] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}})
      for (const float value : {float(x), float(y), 0.f, 0.f, 0.f, x ? 2.f : 0.f}) add_bytes(file, value, big);
    file += char(4);
    for (const std::int32_t index : {0, 1, 2, 3}) add_bytes(file, index, big);
    file += char(2);
    for (const std::int32_t index : {0, 1}) add_bytes(file, index, big);
    const Scene scene = load_mesh("a.ply", file);
    ASSERT_EQ(scene.triangles.size(), 2u);
    EXPECT_EQ(scene.triangles[0], (Triangle{glm::vec3{0, 0, 0}, glm::vec3{1, 0, 0}, glm::vec3{1, 1, 0}}));
    ASSERT_EQ(scene.normals.size(), 2u);
    EXPECT_EQ(scene.normals[0][1], glm::vec3(0, 0, 1));
    EXPECT_EQ(scene.normals[0][0], glm::vec3(0, 0, 1));  // zero in the file: the triangle's
    EXPECT_EQ(scene.notes, (std::vector<std::string>{"1 faces of fewer than 3 corners were left out."}));
    refuse_mesh("a.ply", std::string_view(file).substr(0, file.size() - 5), {"a.ply", "'face'", "cut short"});
  }
}

TEST(Ply, ElementsWithoutPropertiesTakeNoTime) {
  const std::string nothing = "ply\nformat ascii 1.0\nelement nothing 300000000000\n";
  refuse_mesh("a.ply", nothing + "end_header\n", {"has no faces"});
}

TEST(Ply, WrongFilesAreRefused) {
  const std::string start = "ply\nformat ascii 1.0\n", vertices(kMeshVertices);
  refuse_mesh("a.ply", "solid", {"a.ply: is not PLY"});
  refuse_mesh("a.ply", "ply\nformat ascii 1.0\n", {"a.ply:2", "before 'end_header'"});
  refuse_mesh("a.ply", "ply\nformat utf8 1.0\nend_header\n", {"a.ply:2", "'utf8'"});
  refuse_mesh("a.ply", "ply\nend_header\n", {"no format"});
  refuse_mesh("a.ply", start + "property float x\nend_header\n", {"a.ply:3", "before the first element"});
  refuse_mesh("a.ply", start + "element vertex 4\nproperty half x\nend_header\n", {"a.ply:4", "'half'"});
  refuse_mesh("a.ply", start + "element vertex -1\nend_header\n", {"a.ply:3", "'-1'"});
  refuse_mesh("a.ply", start + "element vertex 4\nproperty float x\nend_header\n1\n2\n3\n4\n", {"no x, y and z"});
  refuse_mesh("a.ply", start + "element vertex 4000000000\nproperty float x\nend_header\n",
              {"4000000000", "cut short"});
  refuse_mesh("a.ply", start + vertices + "end_header\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n", {"no faces, only 4 points"});
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string points = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
  refuse_mesh("a.ply", start + vertices + faces + points + "3 0 1 4\n", {"face 0 names vertex 4", "has 4"});
  refuse_mesh("a.ply", start + vertices + faces + points + "3 0 1 -1\n", {"face 0 names vertex -1"});
  refuse_mesh("a.ply", start + vertices + faces + points + "3 0 1\n", {"a.ply:15", "the file ends"});
  refuse_mesh("a.ply", start + vertices + faces + points + "3 0 1 x\n", {"a.ply:14: 'x' where a number"});
  refuse_mesh("a.ply", start + vertices + faces + points + "-3 0 1 2\n", {"-3 items"});
  refuse_mesh("a.ply", start + vertices + faces + "0 0 nan\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n",
              {"vertex 0 is (0, 0, nan)"});
  for (std::size_t end = 0; end < kMeshText.size() - 3; ++end)  // what is cut short is refused, not read beyond
    EXPECT_THROW(load_mesh("a.ply", kMeshText.substr(0, end)), Error) << end;
}

std::string binary_stl(std::uint32_t count) {
  std::string file(80, ' ');
  file.replace(0, 5, "solid");  // as some writers begin binary files
  add_bytes(file, count);
  for (const Triangle& t : {kFirst, kSecond}) {
    file.append(12, '\x7f');
    file.append(reinterpret_cast<const char*>(&t), sizeof t);
    file.append(2, '\0');
  }
  return file;
}

TEST(Ply, ColoursOfVertices) {
  const auto with = [](const char* type, const char* rows) {
    return load_mesh("a.ply",
                     std::string("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                 "property float z\nproperty ") +
                         type + " red\nproperty " + type + " green\nproperty " + type +
                         " blue\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" + rows +
                         "3 0 1 2\n")
        .colors;
  };
  const auto bytes = with("uchar", "0 0 0 255 0 0\n1 0 0 0 188 0\n0 1 0 0 0 0\n");
  ASSERT_EQ(bytes.size(), 1u);
  EXPECT_EQ(bytes[0][0], glm::vec4(1, 0, 0, 1));
  EXPECT_NEAR(bytes[0][1].g, 0.5, 0.01);  // half the light
  const auto floats = with("float", "0 0 0 1 0 nan\n1 0 0 2 -1 0\n0 1 0 0 0 1\n");
  EXPECT_EQ(floats[0], (std::array{glm::vec4(1, 0, 0, 1), glm::vec4(1, 0, 0, 1), glm::vec4(0, 0, 1, 1)}));
}

TEST(Stl, BinaryAndText) {
  EXPECT_EQ(load_mesh("a.stl", binary_stl(2)).triangles, (std::vector{kFirst, kSecond}));
  const std::string text =
      "solid a name of words\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1.0e0 0 0\n"
      "   vertex 0 +1 0\n  endloop\n endfacet\nendsolid a name\n";
  const Scene scene = load_mesh("a.STL", text);
  EXPECT_EQ(scene.triangles, std::vector{kFirst});
  EXPECT_TRUE(scene.normals.empty());
}

TEST(Stl, WrongFilesAreRefused) {
  const std::string whole = binary_stl(2);
  std::string header(whole);
  header[0] = 'S';
  header[80] = 3;
  refuse_mesh("a.stl", header, {"a.stl", "3 triangles"});
  header.replace(80, 4, "\xff\xff\xff\xff");
  refuse_mesh("a.stl", header, {"4294967295 triangles"});
  refuse_mesh("a.stl", "abc", {"is not STL: it has 3 bytes"});
  refuse_mesh("a.stl", "solid a\nendsolid\n", {"has no facets"});
  refuse_mesh("a.stl", "solid a\nfacet\nvertex 0 0 0\nendfacet\n", {"a.stl:4: the facet has 1 vertices"});
  refuse_mesh("a.stl", "solid a\nfacet\nvertex 0 0\n", {"a.stl:4", "the file ends"});
  refuse_mesh("a.stl", "solid a\nfacet\nvertex 0 0 0\n", {"ends within a facet"});
  refuse_mesh("a.stl", "solid a\nvertex 0 0 x\n", {"a.stl:2: 'x'"});
  std::string wrong = whole;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(&wrong[84 + 12], &nan, sizeof nan);
  refuse_mesh("a.stl", wrong, {"triangle 0 has a vertex (nan, 0, 0)"});
}

TEST(ArraysOfTriangles, BothTypesAndShapes) {
  const auto file = [](const char* descr, const char* shape, auto zero) {
    std::string text = std::string("{'descr': '") + descr + "', 'fortran_order': False, 'shape': " + shape + ", }";
    text.resize(117, ' ');
    text += '\n';
    std::string bytes("\x93NUMPY\x01\x00", 8);
    add_bytes(bytes, std::uint16_t(text.size()));
    bytes += text;
    for (const glm::vec3& v : kFirst)
      for (int axis = 0; axis < 3; ++axis) add_bytes(bytes, decltype(zero)(v[axis]));
    return bytes;
  };
  EXPECT_EQ(load_mesh("a.npy", file("<f4", "(1, 3, 3)", 0.f)).triangles, std::vector{kFirst});
  EXPECT_EQ(load_mesh("a.npy", file("<f8", "(1, 9)", 0.)).triangles, std::vector{kFirst});
  refuse_mesh("a.npy", file("<f4", "(3, 3)", 0.f), {"a.npy", "expected triangles", "(n, 3, 3)"});
  refuse_mesh("a.npy", file("<i4", "(1, 9)", 0), {"a.npy", "expected triangles"});
  refuse_mesh("a.npy", file("<f4", "(2, 9)", 0.f), {"a.npy"});
  refuse_mesh("a.npy", "solid", {"a.npy"});
}

}  // namespace
}  // namespace ballot::test
