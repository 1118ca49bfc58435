// Tests what the OBJ loader makes of valid files.
#include <cmath>
#include <glm/geometric.hpp>

#include "engine/files/polygon.h"
#include "gltf_builder.h"

namespace ballot::test {
namespace {

Scene load_text(std::string_view obj, std::string_view mtl = {}) {
  const TemporaryFolder folder;
  if (!mtl.empty()) folder.write("m.mtl", mtl);
  return load_scene(folder.write("text.obj", obj));
}

constexpr std::string_view kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

std::string square(std::string_view rest) { return std::string(kSquare).append(rest); }

double area(const Scene& scene) {
  double sum = 0;
  for (const auto& [a, b, c] : scene.triangles) sum += glm::length(glm::cross(b - a, c - a)) / 2;
  return sum;
}

TEST(Obj, PolygonsKeepTheirOrderAndNumbers) {
  const Scene scene = load_text(square("f 1 2 3\nf 1 2 3 4\nf 2 3 4\n"));
  ASSERT_EQ(scene.triangles.size(), 4u);
  EXPECT_EQ(scene.triangles[1], (Triangle{glm::vec3{0, 0, 0}, glm::vec3{1, 0, 0}, glm::vec3{1, 1, 0}}));
  EXPECT_EQ(scene.triangles[2], (Triangle{glm::vec3{0, 0, 0}, glm::vec3{1, 1, 0}, glm::vec3{0, 1, 0}}));
  EXPECT_EQ(scene.triangles[3][0], glm::vec3(1, 0, 0));
  EXPECT_EQ(scene.name, "text");
  EXPECT_TRUE(scene.normals.empty());
}

TEST(Obj, NormalsThatTheFileLacksAreLeftOut) {
  const Scene scene = load_text(square("f 1//1 2//1 3//1\nf 1//-1 2/7/-2 4/7\n"));
  EXPECT_EQ(scene.triangles.size(), 2u);
  EXPECT_TRUE(scene.normals.empty());
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0],
            "5 corners of faces, the first in line 5, name normals that the file lacks; they are shaded without.");
}

TEST(Obj, NegativeIndicesCountBackwards) {
  const Scene scene = load_text(square("f -4 -3 -2\nv 9 9 9\nf -1 -2 1\n"));
  EXPECT_EQ(scene.triangles.at(0)[0], glm::vec3(0, 0, 0));
  EXPECT_EQ(scene.triangles.at(1), (Triangle{glm::vec3{9, 9, 9}, glm::vec3{0, 1, 0}, glm::vec3{0, 0, 0}}));
}

TEST(Obj, ColoursOfVerticesAreLinear) {
  EXPECT_TRUE(load_text(square("f 1 2 3\n")).colors.empty());
  const Scene scene = load_text("v 0 0 0\nv 1 0 0 1 0.5 0\nv 1 1 0 1 0 2 -1\nv 0 1 0 1\nf 1 2 3 4\n");
  ASSERT_EQ(scene.colors.size(), scene.triangles.size());
  for (std::size_t t = 0; t < scene.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::vec3 at = scene.triangles[t][k];
      glm::vec4 expected(1);
      if (at == glm::vec3(1, 0, 0)) expected = {1, 0.21404114f, 0, 1};
      if (at == glm::vec3(1, 1, 0)) expected = {0, 1, 0, 1};  // behind w; clamped
      EXPECT_LT(glm::distance(scene.colors[t][k], expected), 1e-6f) << t << " " << k;
    }
  EXPECT_THROW(load_text("v 0 0 0 1 red 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), Error);
}

TEST(Obj, SyntaxVariants) {
  const Scene scene = load_text(
      "# note\r\nv +1e0 .5 -2E-1 1.0\r\nv 1 0 0 # w\nv \\\n 0 1 0\no thing\ng a b\nvt 0 0\n"
      "f 1/1 2/1/ 3//\nl 1 2\np 1\nf 4 1 2\nv 7 7 7");
  ASSERT_EQ(scene.triangles.size(), 2u);
  EXPECT_EQ(scene.triangles[0][0], glm::vec3(1, 0.5f, -0.2f));
  EXPECT_EQ(scene.triangles[1][0], glm::vec3(7, 7, 7));
}

TEST(Obj, StatementsOfSeveralLines) {
  const std::string corners = "# of C:\\models\\\nv 0 0 0\nv 1 0 0 # \\\nv 0 1 0\n";
  for (const char* face :
       {"f 1 2 3\n", "f 1 \\\n2 3\n", "f\\\n1\\\r\n2\\ \t\n3", "f 1 2 3\\\n", "f 1 2 3 \\\n\nf 1 2 \\"})
    EXPECT_EQ(load_text(corners + face).triangles.size(), 1u) << face;
}

TEST(Obj, DecimalsAreRoundedToTheNearestFloat) {
  const Scene scene = load_text("v 0.1 16777217 1e-46\nv 3.4028235e38 1 0\nv 0.333333343 0 1\nf 1 2 3\n");
  EXPECT_EQ(scene.triangles.at(0)[0], glm::vec3(0.1f, 16777216.0f, 0.0f));
  EXPECT_EQ(scene.triangles.at(0)[1].x, 3.4028235e38f);
  EXPECT_EQ(scene.triangles.at(0)[2].x, 0.333333343f);
}

TEST(Obj, ConcavePolygonsAreClipped) {
  // An L shape. A fan of triangles about its first corner would leave the shape.
  const Scene scene = load_text("v 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nv 2 0 0\nf 1 2 3 4 5 6\n");
  EXPECT_EQ(scene.triangles.size(), 4u);
  EXPECT_NEAR(area(scene), 3, 1e-6);
}

TEST(Obj, PolygonsThatCrossThemselvesAreANote) {
  const Scene scene = load_text(square("s 1\nf 1 2 3 4\nf 1 3 2 4\nf 1 3 2 4\n"));
  EXPECT_EQ(scene.triangles.size(), 6u);
  EXPECT_LE(area(scene), 3);
  EXPECT_EQ(scene.notes,
            std::vector<std::string>{
                "2 polygons, the first at line 7, cross themselves; their triangles cover about as much."});
}

TEST(Obj, ImpossiblePolygonsStillGiveTheirNumberOfTriangles) {
  std::vector<std::array<std::uint32_t, 3>> cut;
  const std::vector<glm::vec3> bow_tie{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}, point(7, glm::vec3{1, 1, 1});
  triangulate(bow_tie, cut);
  EXPECT_EQ(cut.size(), 2u);
  triangulate(point, cut);
  EXPECT_EQ(cut.size(), 7u);
}

TEST(Obj, NormalsOfTheFile) {
  const Scene scene = load_text(square("vn 0 3 4\nvn 0 0 0\nf 1//1 2//-1 3\n"));
  ASSERT_EQ(scene.normals.size(), 1u);
  EXPECT_LT(glm::length(scene.normals[0][0] - glm::vec3(0, 0.6f, 0.8f)), 1e-6f);
  EXPECT_EQ(scene.normals[0][1], glm::vec3(0, 0, 1));  // zero in the file, so the geometric normal is used
  EXPECT_EQ(scene.normals[0][2], glm::vec3(0, 0, 1));
}

TEST(Obj, SmoothingGroupsMeetOnlyInsideThemselves) {
  // Three sides at a corner of a cube. The first two are one smoothing group.
  const Scene scene =
      load_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ns 1\nf 1 2 3\nf 1 3 4\ns 2\nf 1 4 2\ns off\nf 4 3 2\n");
  ASSERT_EQ(scene.normals.size(), 4u);
  EXPECT_LT(glm::length(scene.normals[0][0] - glm::normalize(glm::vec3(1, 0, 1))), 1e-6f);
  EXPECT_EQ(scene.normals[0][0], scene.normals[1][0]);
  EXPECT_EQ(scene.normals[0][1], glm::vec3(0, 0, 1));  // vertex 2 belongs to one face of the group
  EXPECT_EQ(scene.normals[2][0], glm::vec3(0, 1, 0));
  EXPECT_EQ(scene.normals[3][0], scene.normals[3][1]);  // flat shading
}

TEST(Obj, MaterialsOfTheMtl) {
  const Scene scene = load_text(
      square("mtllib m.mtl\nf 1 2 3\nusemtl mirror\nf 1 2 3\nusemtl glass\nf 1 2 3 4\nusemtl lamp\nf 1 2 4\n"),
      "newmtl lamp\nKd 0.5 0.25 0\nKe 3 2 1\nnewmtl mirror\nillum 5\nKs 0.9 0.9 0.8\nNs 200\n"
      "newmtl glass\nillum 7\nNi 1.6\nKd 0 0 0\nnewmtl thin\nd 0.25\nnewmtl shiny\nKs 0.2 0.2 0.2\nNs 30\n");
  ASSERT_EQ(scene.materials.size(), 6u);
  EXPECT_EQ(scene.materials[5].name, "default");
  EXPECT_EQ(scene.material_of, (std::vector<std::uint32_t>{5, 1, 2, 2, 0}));
  EXPECT_EQ(scene.materials[0].base_color, glm::vec3(0.5f, 0.25f, 0));
  EXPECT_EQ(scene.materials[0].emissive, glm::vec3(3, 2, 1));
  EXPECT_EQ(scene.materials[1].metallic, 1);
  EXPECT_EQ(scene.materials[1].roughness, 0);
  EXPECT_EQ(scene.materials[1].base_color, glm::vec3(0.9f, 0.9f, 0.8f));
  EXPECT_EQ(scene.materials[2].transmission, 1);
  EXPECT_EQ(scene.materials[2].ior, 1.6f);
  EXPECT_EQ(scene.materials[2].base_color, glm::vec3(1));
  EXPECT_EQ(scene.materials[3].transmission, 0.75f);
  EXPECT_NEAR(scene.materials[4].roughness, 0.5, 1e-6);  // (2 / 32)^(1/4)
  EXPECT_EQ(features_of(scene),
            (SceneFeatures{.reflects = true, .refracts = true, .emits = true, .glossy = true, .perspective = true}));
}

TEST(Obj, MissingMaterialsAreNotes) {
  const Scene scene = load_text(square("mtllib gone.mtl\nusemtl a\nf 1 2 3\nusemtl a\nf 1 2\n"));
  EXPECT_EQ(scene.materials.size(), 1u);
  ASSERT_EQ(scene.notes.size(), 3u);
  EXPECT_NE(scene.notes[0].find("'gone.mtl' was not found"), std::string::npos);
  EXPECT_NE(scene.notes[1].find("'a'"), std::string::npos);
  EXPECT_NE(scene.notes[2].find("1 faces of fewer than 3"), std::string::npos);
}

TEST(Obj, PolygonOfManyCornersIsQuick) {
  constexpr int kCorners = 100000;
  std::string text, face = "f";
  for (int i = 0; i < kCorners; ++i) {
    text += fmt::format("v {} {} 0\n", i % 2, i);  // a zigzag, not convex
    face += fmt::format(" {}", i + 1);
  }
  EXPECT_EQ(load_text(text + face + "\n").triangles.size(), std::size_t{kCorners - 2});
}

// Each of these took time of the square of the number of materials or lines, which here is half a minute or more.
TEST(Obj, ManyMaterialsAreQuick) {
  constexpr int kMaterials = 100000;
  std::string obj = square("mtllib m.mtl\n"), mtl;
  for (int i = 0; i < kMaterials; ++i) {
    mtl += fmt::format("newmtl a_rather_long_material_name_{}\n", i);
    obj += fmt::format("usemtl a_rather_long_material_name_{}\nf 1 2 3\n", i);
    if (i % 2 == 0) obj += "mtllib m.mtl ./m.mtl\n";
  }
  const Scene scene = load_text(obj, mtl);
  ASSERT_EQ(scene.materials.size(), std::size_t{kMaterials});  // a library is read once
  EXPECT_EQ(scene.material_of.back(), std::uint32_t{kMaterials - 1});
}

TEST(Obj, LaterLibraryOverridesAnEarlierOne) {
  const TemporaryFolder folder;
  folder.write("a.mtl", "newmtl x\nKd 1 0 0\nnewmtl x\nKd 0 1 0\n");
  folder.write("b.mtl", "newmtl x\nKd 0 0 1\n");
  const Scene scene =
      load_scene(folder.write("t.obj", square("mtllib a.mtl\nusemtl x\nf 1 2 3\nmtllib b.mtl\nusemtl x\nf 1 2 3\n")));
  EXPECT_EQ(scene.material_of, (std::vector<std::uint32_t>{1, 2}));
}

TEST(Obj, WithoutFacesIsValid) {
  EXPECT_TRUE(load_text(kSquare).triangles.empty());
  EXPECT_TRUE(load_text("# nothing\n").triangles.empty());
}

}  // namespace
}  // namespace ballot::test
