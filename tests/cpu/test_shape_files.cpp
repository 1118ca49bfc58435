// Tests the loaders of shapes: rows of arrays, points of PLY, points and lines of glTF.
#include <fmt/format.h>

#include <limits>

#include "engine/core/registry.h"
#include "gltf_builder.h"

namespace ballot::test {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

template <class Number>
std::string npy(std::size_t width, const std::vector<Number>& values) {
  std::string text = fmt::format("{{'descr': '<f{}', 'fortran_order': False, 'shape': ({}, {}), }}", sizeof(Number),
                                 values.size() / width, width);
  text.resize(117, ' ');
  return std::string("\x93NUMPY\x01\x00\x76\x00", 10) + text + "\n" +
         std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Number));
}

Scene load(const std::string& name, const std::string& content, const LoadOptions& options = {}) {
  const TemporaryFolder folder;
  return load_scene(folder.write(name, content), options);
}

void refuse_file(const std::string& name, const std::string& content, std::initializer_list<std::string_view> parts,
                 const LoadOptions& options = {}, Failure kind = Failure::Work) {
  expect_error(kind, parts, [&] { load(name, content, options); });
}

LoadOptions as(ShapeKind kind, float radius = 0) { return {.shapes = &info_of(kind), .radius = radius}; }

ShapeKind kind_of(const Scene& scene, std::size_t mesh = 0) { return scene.instances.mesh_labels[mesh].kind; }

TEST(ShapeArrays, RowsAreShapes) {
  const Scene spheres = load("a.npy", npy<float>(4, {1, 2, 3, 0.5f, 4, 5, 6, 0}));
  ASSERT_EQ(spheres.shapes.size(), 2u);
  EXPECT_EQ(kind_of(spheres), ShapeKind::Spheres);
  EXPECT_EQ(spheres.shapes[0].a, glm::vec4(1, 2, 3, 0.5f));
  EXPECT_NEAR(spheres.bounds.hi.x, 4, 1e-6);  // of a sphere without radius, too
  EXPECT_TRUE(spheres.instanced());
  EXPECT_EQ(spheres.instances.mesh_name(0), "a");

  const Scene discs = load("a.npy", npy<float>(7, {1, 2, 3, 0, 0, 2, 0.5f}), as(ShapeKind::Discs));
  EXPECT_EQ(kind_of(discs), ShapeKind::Discs);
  EXPECT_EQ(discs.shapes[0].b, glm::vec4(0, 0, 1, 0));
  const Scene capsules = load("a.npy", npy<float>(7, {1, 2, 3, 0, 0, 2, 0.5f}), as(ShapeKind::Capsules));
  EXPECT_EQ(capsules.shapes[0].b, glm::vec4(0, 0, 2, 0.5f));
  EXPECT_EQ(capsules.shapes[0].a, glm::vec4(1, 2, 3, 0.5f));
  const Scene cones = load("a.npy", npy<double>(8, {1, 2, 3, 0, 0, 2, 0.5, 0.25}));
  EXPECT_EQ(kind_of(cones), ShapeKind::Capsules);
  EXPECT_EQ(cones.shapes[0].b, glm::vec4(0, 0, 2, 0.25f));
  const Scene boxes = load("a.npy", npy<float>(6, {1, 0, 3, 0, 2, 4}));
  EXPECT_EQ(kind_of(boxes), ShapeKind::Boxes);
  EXPECT_EQ(boxes.shapes[0].a, glm::vec4(0, 0, 3, 0));
}

TEST(ShapeArrays, ARadiusIsGivenToRowsWithoutOne) {
  const Scene points = load("a.npy", npy<float>(3, {1, 2, 3}), {.radius = 0.25f});
  EXPECT_EQ(points.shapes[0].a, glm::vec4(1, 2, 3, 0.25f));
  const Scene ends = load("a.npy", npy<float>(6, {1, 2, 3, 0, 0, 2}), as(ShapeKind::Capsules, 0.25f));
  EXPECT_EQ(ends.shapes[0].b, glm::vec4(0, 0, 2, 0.25f));
  EXPECT_EQ(load("a.npy", npy<float>(4, {1, 2, 3, 0.5f}), {.radius = 0.25f}).shapes[0].a.w, 0.5f);
}

TEST(ShapeArrays, DoublesAreCountedFromAnOrigin) {
  const Scene scene = load("a.npy", npy<double>(4, {4e6 + 0.125, 5e5, 7, 0.5, 4e6 + 1, 5e5 + 1, 8, 0.25}));
  EXPECT_NE(scene.origin, glm::dvec3(0));
  EXPECT_EQ(glm::dvec3(glm::vec3(scene.shapes[0].a)) + scene.origin, glm::dvec3(4e6 + 0.125, 5e5, 7));
  EXPECT_EQ(scene.shapes[1].a.w, 0.25f);
  EXPECT_TRUE(scene.notes.empty());
}

LoadOptions as_heights(const glm::dvec2& spacing = glm::dvec2(0)) {
  return {.shapes = &find_named(kShapes, kHeights, "kind"), .spacing = spacing};
}

TEST(ShapeArrays, RastersAreCellsOfTwoTriangles) {
  const Scene scene = load("a.npy", npy<float>(3, {0, 1, 2, 3, 4, 5}), as_heights({0.5, 2}));
  ASSERT_EQ(scene.triangles.size(), 4u);
  EXPECT_EQ(scene.triangles[0], (Triangle{{{0, 0, 0}, {0.5f, 0, 1}, {0.5f, 2, 4}}}));
  EXPECT_EQ(scene.triangles[1], (Triangle{{{0, 0, 0}, {0.5f, 2, 4}, {0, 2, 3}}}));
  EXPECT_EQ(scene.triangles[3], (Triangle{{{0.5f, 0, 1}, {1, 2, 5}, {0.5f, 2, 4}}}));
  EXPECT_EQ(kind_of(scene), ShapeKind::Triangles);
  EXPECT_EQ(scene.instances.mesh_labels[0].columns, 3u);
  EXPECT_EQ(scene.instances.mesh_labels[0].rows(4), 2u);
  EXPECT_FALSE(scene.instanced());
  EXPECT_EQ(load("a.npy", npy<double>(3, {0, 1, 2, 3, 4, 5}), as_heights()).triangles[2][2], glm::vec3(2, 1, 5));
}

TEST(ShapeArrays, TrianglesOfMissingHeightsHaveNoArea) {
  const Scene scene = load("a.npy", npy<float>(3, {kNaN, 1, 2, 3, 4, 5}), as_heights());
  for (const std::size_t t : {0, 1}) EXPECT_EQ(scene.triangles[t], (Triangle{{{1, 0, 1}, {1, 0, 1}, {1, 0, 1}}}));
  EXPECT_EQ(scene.triangles[2][1], glm::vec3(2, 0, 2));
  const Scene none = load("a.npy", npy<float>(2, {kNaN, kNaN, kNaN, kNaN}), as_heights());
  EXPECT_EQ(none.triangles[1], (Triangle{}));
  const Scene high = load("a.npy", npy<double>(2, {4e6 + 0.125, kNaN, 4e6, 4e6, 4e6 + 1, 4e6}), as_heights());
  EXPECT_EQ(double(high.triangles[3][2].z) + high.origin.z, 4e6 + 1);
  EXPECT_EQ(double(high.triangles[0][0].z) + high.origin.z, 4e6);  // float32 holds the heights as steps of 0.25
}

TEST(ShapeArrays, BadRastersAreRefused) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  refuse_file("a.npy", npy<float>(3, {0, 1, 2}), {"a.npy", "3 heights in 3 columns", "two full rows"}, as_heights());
  refuse_file("a.npy", npy<float>(1, {0, 1, 2}), {"3 heights in 1 columns"}, as_heights());
  refuse_file("a.npy", npy<float>(2, {0, 1, kInfinity, 2}), {"row 1, column 0 is inf"}, as_heights());
  refuse_file("a.npy", npy<double>(2, {0, 1, 1e300, 2}), {"row 1, column 0 is inf"}, as_heights());
  std::string whole = npy<float>(2, {0, 1, 2, 3});
  refuse_file("a.npy", whole.substr(0, whole.size() - 3), {"a.npy"}, as_heights());
  whole.replace(whole.find("<f4"), 3, "<i4");
  refuse_file("a.npy", whole, {"expected heights: float32 or float64 of shape (rows, columns)"}, as_heights());
  const std::string right = npy<float>(2, {0, 1, 2, 3});
  for (const glm::dvec2& wrong : {glm::dvec2(0, 1), glm::dvec2(-1), glm::dvec2(1, double(kNaN)), glm::dvec2(kInfinity)})
    refuse_file("a.npy", right, {"spacing of heights", "above 0"}, as_heights(wrong), Failure::Arguments);
  refuse_file("a.npy", right, {"spacing (1, 1)", "expected none"}, {.spacing = glm::dvec2(1)}, Failure::Arguments);
  refuse_file("a.ply",
              "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
              "end_header\n0 0 0\n",
              {"its points are no heights"}, as_heights());
}

TEST(ShapeArrays, BadRowsAreRefused) {
  refuse_file("a.npy", npy<float>(4, {1, 2, 3, -1}), {"a.npy", "radius of vertex 0 is -1", "0 to 1e12"});
  refuse_file("a.npy", npy<float>(4, {1, 2, 3, 1, 1, 2, 3, kNaN}), {"radius of vertex 1 is nan"});
  refuse_file("a.npy", npy<float>(4, {1, kNaN, 3, 1}), {"spheres: vertex 0 is (1, nan, 3)", "finite"});
  refuse_file("a.npy", npy<float>(7, {1, 2, 3, 0, 0, 0, 1}), {"normal of vertex 0 is (0, 0, 0)"}, as(ShapeKind::Discs));
  refuse_file("a.npy", npy<float>(7, {1, 2, 3, 0, 0, 1, 1}),
              {"discs (center, normal, radius) or capsules (both ends, radius)", "say which"});
  refuse_file("a.npy", npy<float>(3, {1, 2, 3}), {"expected triangles", "spheres (n, 3): center with a radius given"});
  refuse_file("a.npy", npy<float>(5, {1, 2, 3, 4, 5}), {"of shape (1, 5)", "boxes (n, 6): low, high"});
  refuse_file("a.npy", npy<float>(4, {1, 2, 3, 4}), {"expected float32 or float64 of boxes (n, 6)"},
              as(ShapeKind::Boxes));
  const std::string whole = npy<float>(4, {1, 2, 3, 0.5f, 4, 5, 6, 1});
  refuse_file("a.npy", whole.substr(0, whole.size() - 3), {"a.npy"});
  refuse_file("a.npy", whole, {"radius of points: -2", "more than 0"}, {.radius = -2}, Failure::Arguments);
  refuse_file("a.npy", whole, {"radius of points: nan"}, {.radius = kNaN}, Failure::Arguments);
  refuse_file("a.npy", whole, {"triangles"}, as(ShapeKind::Triangles), Failure::Arguments);
  refuse_file("a.obj", "v 0 0 0\n", {".obj files have triangles alone", ".ply"}, {.radius = 1}, Failure::Arguments);
  refuse_file("a.glb", one_triangle().glb(), {"'discs'", ".glb", ".ply, .npy"}, as(ShapeKind::Discs),
              Failure::Arguments);
}

std::string cloud(const std::string& more, const std::string& rows, std::size_t count = 2) {
  return fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float "
      "z\n{}end_header\n{}",
      count, more, rows);
}

TEST(ShapePly, PointsAreSpheresOrDiscs) {
  for (const char* name : {"radius", "scalar_radius"}) {
    const Scene scene = load("a.ply", cloud(fmt::format("property float {}\n", name), "1 2 3 0.5\n4 5 6 0.25\n"));
    EXPECT_EQ(kind_of(scene), ShapeKind::Spheres);
    EXPECT_EQ(scene.shapes[1].a, glm::vec4(4, 5, 6, 0.25f));
  }
  const std::string normals =
      "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\n";
  const std::string rows = "1 2 3 0 0 3 255 0 0\n4 5 6 1 0 0 0 255 0\n";
  const Scene discs = load("a.ply", cloud(normals, rows), as(ShapeKind::Discs, 0.5f));
  EXPECT_EQ(kind_of(discs), ShapeKind::Discs);
  EXPECT_EQ(discs.shapes[0].a.w, 0.5f);
  EXPECT_EQ(discs.shapes[0].b, glm::vec4(0, 0, 1, 0));
  ASSERT_EQ(discs.colors.size(), 2u);
  EXPECT_EQ(discs.colors[1][2], glm::vec4(0, 1, 0, 1));
  EXPECT_EQ(kind_of(load("a.ply", cloud(normals, rows), {.radius = 1})), ShapeKind::Spheres);
  const std::string faces =
      cloud("element face 1\nproperty list uchar int vertex_indices\n", "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", 3);
  EXPECT_TRUE(load("a.ply", faces, {.radius = 1}).shapes.empty());
  EXPECT_EQ(load("a.ply", faces, as(ShapeKind::Spheres, 1)).shapes.size(), 3u);
}

TEST(ShapePly, BadPointsAreRefused) {
  const std::string plain = cloud("", "1 2 3\n4 5 6\n");
  refuse_file("a.ply", plain, {"has no faces, only 2 points", "a radius for all of them"});
  refuse_file("a.ply", plain, {"no property 'radius' or 'scalar_radius'"}, as(ShapeKind::Spheres));
  refuse_file("a.ply", plain, {"no normals nx, ny and nz, but discs do"}, as(ShapeKind::Discs, 1));
  refuse_file("a.ply", plain, {"its points are no capsules"}, as(ShapeKind::Capsules, 1));
  refuse_file("a.ply", cloud("property float radius\n", "1 2 3 1\n4 5 6 -1\n"), {"radius of vertex 1 is -1"});
  refuse_file("a.ply", cloud("property float radius\n", "1 2 3 1\n4 5\n"), {"a.ply", "the file ends"});
}

GltfBuilder points_and_lines() {
  GltfBuilder b = one_triangle();
  const int at = b.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"];
  for (const int mode : {0, 1, 2, 3})
    b.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", at}}}, {"mode", mode}});
  b.node({{"mesh", 0}, {"scale", {2, 2, 2}}});
  b.json["nodes"][0]["name"] = "first";
  return b;
}

TEST(ShapeGltf, PointsAreSpheresAndLinesCapsules) {
  const Scene scene = points_and_lines().load({.instances = InstancePolicy::Keep, .radius = 0.25f});
  // Of each node a mesh of 1 triangle, one of 3 spheres, one of 1 + 3 + 2 capsules.
  ASSERT_EQ(scene.instances.first, (std::vector<std::size_t>{0, 1, 4, 10, 11, 14, 20}));
  EXPECT_EQ(kind_of(scene, 0), ShapeKind::Triangles);
  EXPECT_EQ(kind_of(scene, 1), ShapeKind::Spheres);
  EXPECT_EQ(kind_of(scene, 2), ShapeKind::Capsules);
  EXPECT_EQ(scene.instances.mesh_name(2), "first");
  EXPECT_EQ(scene.shapes[2].a, glm::vec4(1, 0, 0, 0.25f));
  EXPECT_EQ(scene.shapes[12].a, glm::vec4(2, 0, 0, 0.25f));  // the node scales places, not the radius
  EXPECT_EQ(scene.shapes[7].a, glm::vec4(0, 1, 0, 0.25f));   // the end of the loop
  EXPECT_EQ(scene.shapes[7].b, glm::vec4(0, 0, 0, 0.25f));
  EXPECT_EQ(scene.shapes[9].b, glm::vec4(0, 1, 0, 0.25f));
  EXPECT_EQ(scene.shapes.size(), scene.triangles.size());
  EXPECT_TRUE(scene.notes.empty());
}

TEST(ShapeGltf, WithoutARadiusTheyAreLeftOut) {
  const Scene scene = points_and_lines().load();
  EXPECT_EQ(scene.triangles.size(), 2u);
  EXPECT_TRUE(scene.shapes.empty());
  ASSERT_EQ(scene.notes.size(), 4u);
  EXPECT_NE(scene.notes[0].find("mode 0: points or lines) was ignored; with a radius"), std::string::npos);
}

TEST(ShapeGltf, WhatMovesStaysAtRest) {
  GltfBuilder b = points_and_lines();
  b.json["animations"] = {
      {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
       {"samplers",
        {{{"input", b.accessor(b.view<float>({0, 1}), 5126, 2, "SCALAR")}, {"output", b.vec3({0, 0, 0, 1, 0, 0})}}}}}};
  b.json["accessors"][b.json["accessors"].size() - 2]["min"] = {0};
  b.json["accessors"][b.json["accessors"].size() - 2]["max"] = {1};
  const Scene scene = b.load({.radius = 0.25f});
  EXPECT_EQ(scene.shapes.size(), 20u);
  ASSERT_FALSE(scene.notes.empty());
  EXPECT_NE(scene.notes.back().find("points and lines of 1 nodes stay at rest"), std::string::npos);
}

}  // namespace
}  // namespace ballot::test
