// Tests of texts as the wild has them: byte order marks, ends of lines, statements that are not read, no triangles.
#include <glm/geometric.hpp>

#include "engine/files/npy.h"
#include "engine/files/text_mark.h"
#include "gltf_builder.h"

namespace ballot::test {
namespace {

constexpr std::string_view kMark = "\xEF\xBB\xBF";
const UnsetVector<Triangle> kOne{{glm::vec3{0, 0, 0}, glm::vec3{1, 0, 0}, glm::vec3{0, 1, 0}}};

/// Files of one triangle, by name.
std::vector<std::pair<std::string, std::string>> texts() {
  GltfBuilder b = one_triangle();
  b.json["buffers"] = {{{"byteLength", 36},
                        {"uri",
                         "data:application/octet-stream;base64,"
                         "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}};
  return {{"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 \\\n2 3\n"},
          {"a.ply",
           "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
          {"a.stl",
           "solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
           "endsolid a b\n"},
          {"a.gltf", b.json.dump(1)}};
}

/// Returns a text with other ends of lines.
std::string with_ends(std::string_view text, std::string_view end) {
  std::string to;
  for (const char c : text) c == '\n' ? to.append(end) : to.append(1, c);
  return to;
}

TEST(TextFiles, MarksAndEndsOfLines) {
  const TemporaryFolder folder;
  for (const auto& [name, text] : texts())
    for (const char* end : {"\n", "\r\n", "\r"})
      for (const std::string_view mark : {std::string_view(), kMark}) {
        const Scene scene = load_scene(folder.write(name, std::string(mark) + with_ends(text, end)));
        EXPECT_EQ(scene.triangles, kOne) << name << " " << mark.size() << " " << int(end[0]);
        EXPECT_TRUE(scene.notes.empty()) << name;
      }
}

TEST(TextFiles, OtherEncodingsAreRefused) {
  const TemporaryFolder folder;
  for (const auto& [name, text] : texts()) {
    std::string low("\xFF\xFE"), high("\xFE\xFF");
    for (const char c : text) low += {c, '\0'}, high += {'\0', c};
    for (const std::string& wide : {low, high})
      expect_error(Failure::Work, {name, "UTF-16", "save it as"},
                   [&, &name = name] { load_scene(folder.write(name, wide)); });
  }
  folder.write("m.mtl", std::string("\xFF\xFEn\0e\0w\0", 8));
  expect_error(Failure::Work, {"m.mtl", "UTF-16"}, [&] { load_scene(folder.write("a.obj", "mtllib m.mtl\n")); });
  EXPECT_EQ(without_mark("x", "\xEF\xBB\xBF{}"), "{}");
  EXPECT_EQ(without_mark("x", "{}"), "{}");
  expect_error(Failure::Work, {"x: is text in UTF-32"},
               [] { without_mark("x", std::string_view("\xFF\xFE\0\0{\0\0\0", 8)); });
}

TEST(TextFiles, MarksAndEndsOfLinesOfMaterials) {
  const TemporaryFolder folder;
  for (const char* end : {"\n", "\r\n", "\r"}) {
    folder.write("m.mtl", std::string(kMark) + with_ends("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n", end));
    const Scene scene = load_scene(
        folder.write("a.obj", std::string(kMark) + "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"));
    ASSERT_EQ(scene.materials.size(), 2u);
    EXPECT_EQ(scene.materials[scene.material(0)].base_color, glm::vec3(1, 0, 0));
    EXPECT_TRUE(scene.notes.empty());
  }
}

// An end of line may be the last byte of a block, and its second byte the first of the next one.
TEST(TextFiles, LinesAcrossBlocks) {
  const TemporaryFolder folder;
  for (std::size_t place = (1 << 20) - 4; place < (1 << 20) + 4; ++place) {
    std::string text = "v 0 0 0\r\nv 1 0 0\r\n#";
    text.resize(place, 'x');
    text += "\r\nv 0 1 0\r\nf 1 2 3\r\nf 1 2 9\r\n";
    expect_error(Failure::Work, {"a.obj:6: face names vertex 9"}, [&] { load_scene(folder.write("a.obj", text)); });
  }
}

TEST(TextFiles, ObjStatementsThatAreNotRead) {
  const TemporaryFolder folder;
  const Scene scene = load_scene(folder.write(
      "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nfo 1 2 3\nl 1 2\np 1\np 2\ng x\nvp 0 0\nV 1 1 1\ncurv 0 1 1 2\n"));
  EXPECT_EQ(scene.triangles, kOne);
  EXPECT_EQ(scene.notes, std::vector<std::string>{
                             "Statements that Ballot does not read were left out: V (1), curv (1), l (1), p (2)."});
}

TEST(TextFiles, NoTriangleIsANote) {
  const TemporaryFolder folder;
  GltfBuilder empty;
  empty.node({{"translation", {0, 0, 0}}});
  write_triangles(folder.path() / "e.npy", {});
  folder.write("e.obj", "v 0 0 0\n");
  folder.write("e.ply",
               "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
               "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n");
  folder.write("e.stl", std::string(84, '\0'));
  folder.write("e.glb", empty.glb());
  for (const char* name : {"e.npy", "e.obj", "e.ply", "e.stl", "e.glb"}) {
    const Scene scene = load_scene(folder.path() / name);
    EXPECT_TRUE(scene.triangles.empty());
    ASSERT_FALSE(scene.notes.empty()) << name;
    EXPECT_EQ(scene.notes.back(), "The file holds no triangle, so there is nothing to hit.") << name;
  }
}

}  // namespace
}  // namespace ballot::test
