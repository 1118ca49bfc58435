// Tests the loaders of PLY, STL and arrays of triangles: what they make of valid files, and how they refuse others.
#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "engine/files/npy.h"
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
/// Returns a text with CR alone at the ends of its lines.
std::string with_cr(std::string_view text) {
  std::string to(text);
  std::ranges::replace(to, '\n', '\r');
  return to;
}

constexpr std::string_view kMeshText =
    "ply\r\nformat ascii 1.0\ncomment of any kind\nelement vertex 4\nproperty double x\nproperty float y\n"
    "property list uchar int more\nproperty float z\nelement face 2\nproperty uchar colour\n"
    "property list uchar uint vertex_index\nelement edge 1\nproperty int a\nend_header\n"
    "0 0 2 7 8 0\n1 0 0 0\n1 1 1 5 0\n0 1 0 0\n255 3 0 1 3\n9 3 1 2 3\n7\n";

TEST(Ply, TextWithOtherProperties) {
  const Scene scene = load_mesh("a.ply", kMeshText);
  EXPECT_EQ(scene.triangles, (UnsetVector<Triangle>{kFirst, kSecond}));
  EXPECT_TRUE(scene.normals.empty());
  EXPECT_TRUE(scene.material_of.empty());  // one material
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

TEST(Ply, ElementsOfAnyOrder) {
  const std::string head = "ply\nformat ascii 1.0\n",
                    faces = "element face 2\nproperty list uint8 int16 vertex_index\n",
                    points = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n", indices = "3 0 1 3\n3 1 2 3\n";
  const std::string first =
      head + faces + "element edge 1\nproperty int a\n" + std::string(kMeshVertices) + "end_header\n" + indices + "7\n";
  EXPECT_EQ(load_mesh("a.ply", first + points).triangles, (UnsetVector<Triangle>{kFirst, kSecond}));
  refuse_mesh("a.ply", first + points.substr(6), {"the file ends"});
  const std::string wrong = head + faces + std::string(kMeshVertices) + "end_header\n3 0 1 3\n3 1 4 3\n" + points;
  refuse_mesh("a.ply", wrong, {"face 1 names vertex 4, but the file has 4"});
  refuse_mesh("a.ply", head + std::string(kMeshVertices) + std::string(kMeshVertices) + faces + "end_header\n",
              {"has 2 elements 'vertex'"});
  std::string binary =
      "ply\rformat binary_little_endian 1.0\relement face 2\rproperty list int32 uint32 vertex_indices\r"
      "element vertex 4\rproperty float32 x\rproperty float32 y\rproperty float64 z\rend_header\r";
  for (const std::uint32_t value : {3u, 0u, 1u, 3u, 3u, 1u, 2u, 3u}) add_bytes(binary, value);
  for (const auto& [x, y] : {std::pair(0.f, 0.f), {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}})
    add_bytes(binary, x), add_bytes(binary, y), add_bytes(binary, 0.0);
  EXPECT_EQ(load_mesh("a.ply", binary).triangles, (UnsetVector<Triangle>{kFirst, kSecond}));
  std::string ten =
      "ply\rformat binary_little_endian 1.0\relement x 1\rproperty uchar a\r" + with_cr(kMeshVertices) +
      "element face 1\rproperty list uchar uchar vertex_indices\rend_header\r\n";  // data begin with byte 10
  ten += std::string(48, '\0') + std::string("\3\0\1\3", 4);
  EXPECT_EQ(load_mesh("a.ply", ten).triangles.size(), 1u);
}

TEST(Ply, StripsOfTriangles) {
  const std::string
      head = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n",
      points = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n";
  const Scene scene =
      load_mesh("a.ply", head + "element tristrips 2\nproperty list int int vertex_indices\nend_header\n" + points +
                             "10 0 1 2 3 -1 -1 2 3 4 5\n2 0 1\n");
  ASSERT_EQ(scene.triangles.size(), 4u);
  for (const auto& [a, b, c] : scene.triangles)  // all are wound alike: half a square each
    EXPECT_EQ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x), 1);
  EXPECT_EQ(scene.triangles[2], (Triangle{glm::vec3{0, 1, 0}, glm::vec3{1, 1, 0}, glm::vec3{0, 2, 0}}));
  const Scene both = load_mesh("a.ply", head +
                                            "element face 1\nproperty list int int vertex_index\n"
                                            "element tristrips 1\nproperty list int int vertex_index\nend_header\n" +
                                            points + "4 0 1 3 2\n3 2 3 4\n");
  EXPECT_EQ(both.triangles.size(), 3u);
}

TEST(Ply, LinesOfOtherLengths) {
  const std::string head = "ply\nformat ascii 1.0\n" + std::string(kMeshVertices) +
                           "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  const Scene longer =
      load_mesh("a.ply", head + "0 0 0 255 255\n1 0 0 9\n\n1 1 0\n0 1 0 1\n3 0 1 3 6 0 0 1 1 0 1\n3 1 2 3\n");
  EXPECT_EQ(longer.triangles, (UnsetVector<Triangle>{kFirst, kSecond}));
  EXPECT_EQ(longer.notes,
            std::vector<std::string>{"Lines hold more numbers than the header names; those behind were left out."});
  const char* several = "0 0 0 1 0 0\n1 1 0 0 1 0\n3 0 1 3 3 1 2 3\n";  // elements of a line
  EXPECT_EQ(load_mesh("a.ply", head + several).triangles, (UnsetVector<Triangle>{kFirst, kSecond}));
}

TEST(Ply, WhatChangesTheLookIsRead) {
  const Scene scene = load_mesh(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar diffuse_red\nproperty uchar diffuse_green\nproperty uchar diffuse_blue\nproperty float s\n"
      "element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty uchar red\n"
      "end_header\n0 0 0 255 0 0 1\n1 0 0 0 255 0 1\n0 1 0 0 0 255 1\n3 0 1 2 2 0 0 9\n");
  EXPECT_EQ(scene.colors,
            (std::vector{std::array{glm::vec4(1, 0, 0, 1), glm::vec4(0, 1, 0, 1), glm::vec4(0, 0, 1, 1)}}));
  EXPECT_EQ(scene.notes,
            std::vector<std::string>{
                "Properties that change the look are not read: s of vertex, texcoord of face, red of face."});
}

TEST(Ply, PolygonsThatAreNotSimpleAreANote) {
  const std::string head =
      "ply\nformat ascii 1.0\n" + std::string(kMeshVertices) +
      "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
  EXPECT_TRUE(load_mesh("a.ply", head + "4 0 1 2 3\n6 0 1 1 2 2 3\n").notes.empty());
  EXPECT_EQ(load_mesh("a.ply", head + "4 0 1 2 3\n4 0 2 1 3\n").notes,
            std::vector<std::string>{
                "1 polygons, the first at face 1, cross themselves; their triangles cover about as much."});
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
  EXPECT_EQ(load_mesh("a.stl", binary_stl(2)).triangles, (UnsetVector<Triangle>{kFirst, kSecond}));
  const std::string text =
      "solid a name of words\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1.0e0 0 0\n"
      "   vertex 0 +1 0\n  endloop\n endfacet\nendsolid a name\n";
  const Scene scene = load_mesh("a.STL", text);
  EXPECT_EQ(scene.triangles, UnsetVector<Triangle>{kFirst});
  EXPECT_TRUE(scene.normals.empty());
}

// Text as other programs write it: in capitals, with blanks, on one line, several solids, names of any words.
TEST(Stl, TextInTheWild) {
  const std::string
      first = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n",
      second = "facet normal nan 0 0\nouter loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\n";
  const auto changed = [](std::string text, auto change) {
    for (char& c : text) c = change(c);
    return text;
  };
  const auto upper = [](char c) { return c >= 'a' && c <= 'z' ? char(c - 32) : c; };
  const auto one_line = [](char c) { return c == '\n' ? ' ' : c; };
  const std::string plain = "solid a\n" + first + second + "endsolid a\n";
  for (const std::string& text :
       {plain, changed(plain, upper), "Solid a\n" + first + second + "EndSolid\n", changed(plain, one_line),
        "\n  \t\n  " + plain, "\xEF\xBB\xBF" + plain, "solid\n" + first + second + "endsolid",
        "solid facet of a solid vertex 7\n" + first + second + "endsolid facet of a solid vertex 7\n",
        "solid a\n" + first + "endsolid a\n\nsolid b\n" + second + "endsolid b\n",
        changed("solid a b\n" + first + "endsolid a b\nsolid b\n" + second + "endsolid b\n", one_line),
        "solid a\n" + first + "endsolid a\nsolid empty\nendsolid empty\nsolid\n" + second + "endsolid"}) {
    const Scene scene = load_mesh("a.stl", text);
    EXPECT_EQ(scene.triangles, (UnsetVector<Triangle>{kFirst, kSecond})) << text;
    EXPECT_TRUE(scene.notes.empty());
  }
  for (std::size_t end = 1; end < plain.size(); ++end)  // only the name of the end may be cut
    if (end < plain.size() - 3) refuse_mesh("a.stl", plain.substr(0, end), {"a.stl"});
  refuse_mesh("a.stl", "solid a\n" + first, {"a.stl:9", "before 'endsolid'", "cut short"});
  refuse_mesh("a.stl", "solid a\n" + first + "solid b\n" + second + "endsolid b\n", {"a.stl:9", "before 'endsolid'"});
  refuse_mesh("a.stl", "solid a\n" + first + first.substr(0, first.find("endfacet")) + second + "endsolid\n",
              {"a facet begins before"});
  refuse_mesh("a.stl", "<html>\n<body>" + std::string(100, 'x'), {"is not STL", "'<html>'", "expected 'solid'"});
  std::string cut = binary_stl(2);  // its header begins with "solid"
  refuse_mesh("a.stl", cut.substr(0, cut.size() - 1), {"2 triangles"});
  EXPECT_EQ(load_mesh("a.stl", cut + "more").notes,
            std::vector<std::string>{"4 bytes behind the last triangle were left out."});
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
  EXPECT_EQ(load_mesh("a.npy", file("<f4", "(1, 3, 3)", 0.f)).triangles, UnsetVector<Triangle>{kFirst});
  EXPECT_EQ(load_mesh("a.npy", file("<f8", "(1, 9)", 0.)).triangles, UnsetVector<Triangle>{kFirst});
  refuse_mesh("a.npy", file("<f4", "(3, 3)", 0.f), {"a.npy", "expected triangles", "(n, 3, 3)"});
  refuse_mesh("a.npy", file("<i4", "(1, 9)", 0), {"a.npy", "expected triangles"});
  refuse_mesh("a.npy", file("<f4", "(2, 9)", 0.f), {"a.npy"});
  refuse_mesh("a.npy", "solid", {"a.npy"});
}

}  // namespace
}  // namespace ballot::test
