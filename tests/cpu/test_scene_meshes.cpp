// The meshes and placements of scenes, from memory and from files: ranges, names, ids.
#include <algorithm>

#include "engine/files/npy.h"
#include "engine/model/digest.h"
#include "engine/model/instances.h"
#include "engine/model/prim_ids.h"
#include "tests/cpu/animated.h"

namespace ballot {
namespace {

using namespace test;

constexpr LoadOptions kKeep{.instances = InstancePolicy::Keep}, kCopy{.instances = InstancePolicy::Copy};
using Names = std::vector<std::string>;
using Numbers = std::vector<std::uint32_t>;
using Sizes = std::vector<std::size_t>;

Names mesh_names(const Scene& scene) {
  Names all;
  for (std::size_t m = 0; m < scene.instances.meshes(); ++m) all.push_back(scene.instances.mesh_name(m));
  return all;
}

Names placement_names(const Scene& scene) {
  Names all;
  for (std::size_t p = 0; p < scene.instances.placements.size(); ++p) all.push_back(scene.instances.placement_name(p));
  return all;
}

Numbers mesh_numbers(const Scene& scene, std::uint32_t MeshLabel::*which) {
  Numbers all;
  for (const MeshLabel& label : scene.instances.mesh_labels) all.push_back(label.*which);
  return all;
}

Numbers nodes(const Scene& scene) {
  Numbers all;
  for (const PlacementLabel& label : scene.instances.placement_labels) all.push_back(label.node);
  return all;
}

Numbers placed_meshes(const Scene& scene) {
  Numbers all;
  for (const Placement& p : scene.instances.placements) all.push_back(p.mesh);
  return all;
}

Numbers ids(const Scene& scene, IdSource source) {
  const PrimIds all(scene, source);
  Numbers list;
  for (std::uint32_t prim = 0; prim < triangle_count(scene); ++prim) list.push_back(all.at(prim));
  return list;
}

Scene load_obj_text(std::string_view text) {
  const TemporaryFolder folder;
  return load_scene(folder.write("car.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + std::string(text)));
}

Scene built(std::size_t triangles) {
  Scene scene;
  scene.name = "built";
  for (std::size_t i = 0; i < triangles; ++i) {
    const float x = float(i);
    scene.triangles.push_back({glm::vec3{x, 0, 0}, glm::vec3{x + 1, 0, 0}, glm::vec3{x, 1, 0}});
  }
  return scene;
}

TEST(SceneMeshes, ASceneFromMemoryIsOneMesh) {
  Scene scene = built(3);
  finish_scene(scene);
  EXPECT_FALSE(scene.instanced());
  EXPECT_EQ(scene.instances.first, (Sizes{0, 3}));
  EXPECT_EQ(mesh_names(scene), Names{"built"});
  EXPECT_EQ(placement_names(scene), Names{"built"});
  EXPECT_EQ(scene.instances.mesh_labels[0].material, 0u);
  scene.triangles.push_back(scene.triangles[0]);  // which this mesh holds too
  finish_scene(scene);
  EXPECT_EQ(scene.instances.first, (Sizes{0, 4}));
  EXPECT_EQ(ids(scene, IdSource::Node), (Numbers{0, 0, 0, 0}));
  Scene empty;
  finish_scene(empty);
  EXPECT_EQ(empty.instances.first, (Sizes{0, 0}));
  EXPECT_EQ(empty.instances.mesh_labels[0].material, kSeveralMaterials);
}

TEST(SceneMeshes, MeshesWithoutPlacementsLieInTheWorld) {
  Scene scene = built(4);
  scene.materials.resize(2);
  scene.material_of = {1, 1, 0, 1};
  scene.instances.first = {0, 2, 2, 4};
  const std::uint64_t whole = digest_of(scene);
  finish_scene(scene);
  EXPECT_FALSE(scene.instanced());
  EXPECT_EQ(mesh_names(scene), (Names{"mesh 0", "mesh 1", "mesh 2"}));
  EXPECT_EQ(placed_meshes(scene), (Numbers{0, 1, 2}));
  EXPECT_EQ(mesh_numbers(scene, &MeshLabel::material), (Numbers{1, kSeveralMaterials, kSeveralMaterials}));
  EXPECT_EQ(ids(scene, IdSource::Mesh), (Numbers{0, 0, 2, 2}));
  EXPECT_EQ(ids(scene, IdSource::Material), scene.material_of);
  EXPECT_EQ(digest_of(scene), whole);
  const TreeLayout layout = tree_layout(scene);
  EXPECT_EQ(layout.first, (Sizes{0, 4}));
  EXPECT_EQ(layout.placements.size(), 1u);
  EXPECT_EQ(bounds_of_mesh(scene, 2).lo, glm::vec3(2, 0, 0));
  EXPECT_EQ(bounds_of_mesh(scene, 1).hi, glm::vec3(0));
}

TEST(SceneMeshes, IdsNeedNoNames) {
  Scene scene = built(4);
  scene.instances.first = {0, 1, 3, 4};
  scene.instances.mesh_labels = {{.id = 7}, {.id = 4000000000}, {.id = 7}};
  finish_scene(scene);
  EXPECT_EQ(mesh_names(scene), (Names{"mesh 0", "mesh 1", "mesh 2"}));
  EXPECT_EQ(ids(scene, IdSource::Mesh), (Numbers{7, 4000000000, 4000000000, 7}));
}

TEST(SceneMeshes, GivenPlacementsAreInstances) {
  Scene scene = built(3);
  scene.instances.first = {0, 1, 3};
  scene.instances.placements = {{0, {}}, {1, {}}};
  finish_scene(scene);
  EXPECT_TRUE(scene.instanced());
  EXPECT_EQ(placement_names(scene), (Names{"mesh 0", "mesh 1"}));
  EXPECT_EQ(ids(scene, IdSource::Node), (Numbers{0, 1, 1}));
  EXPECT_EQ(tree_layout(scene).first, scene.instances.first);  // a tree for each
}

TEST(SceneMeshes, WrongLabelsAreRefused) {
  Scene good = built(3);
  good.instances.first = {0, 1, 3};
  finish_scene(good);
  const auto refuse = [&](std::initializer_list<std::string_view> parts, const auto& change) {
    Scene scene = good;
    change(scene.instances);
    expect_error(Failure::Arguments, parts, [&] { finish_scene(scene); });
  };
  refuse({"'built'", "2 meshes", "1 labels"}, [](auto& all) { all.mesh_labels.pop_back(); });
  refuse({"2 placements", "3 labels"}, [](auto& all) { all.placement_labels.push_back({}); });
  refuse({"a name that is not among its 2 names"}, [](auto& all) { all.placement_labels[0].name = 2; });
  refuse({"mesh 0 lies in the world", "out of order"},
         [](auto& all) { std::swap(all.placements[0], all.placements[1]); });
  refuse({"mesh 0 lies in the world", "twice"}, [](auto& all) { all.placements[1].mesh = 0; });
  refuse({"mesh 1 lies in the world", "elsewhere"}, [](auto& all) { all.placements[1].transform.m[0][3] = 1; });
  refuse({"mesh 1 lies in the world, but has no placement"}, [](auto& all) {
    all.placements.pop_back();
    all.placement_labels.pop_back();
  });
  refuse({"2 meshes", "1 labels"}, [](auto& all) {
    all.mesh_labels.pop_back();
    all.names.clear();
    all.placements.clear();
    all.placement_labels.clear();
  });
}

/// Returns a file of nested nodes: mesh 0, of two materials, is placed by "car" and by a nameless child; mesh 1,
/// "wheel", by a nameless child and by another "car". A node without a mesh, one with points alone, and one with no
/// triangle are between them.
GltfBuilder nested() {
  GltfBuilder b;
  b.json["materials"] = {{{"name", "red"}}, {{"name", "blue"}}};
  const int corners = b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0});
  b.mesh(corners);
  b.primitive()["material"] = 1;
  b.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", corners}}}, {"material", 0}});
  b.mesh(corners);
  b.json["meshes"][1]["name"] = "wheel";
  b.primitive(1)["material"] = 1;
  b.mesh(corners);
  b.primitive(2)["mode"] = 0;
  b.mesh(b.vec3({0, 0, 0, 1, 0, 0}));
  b.node({{"name", "car"}, {"mesh", 0}, {"children", {3, 1, 2}}});
  b.node({{"name", "empty"}, {"children", {4, 5}}});
  b.node({{"name", "points"}, {"mesh", 2}});
  b.node({{"mesh", 1}, {"translation", {1, 0, 0}}});
  b.node({{"mesh", 0}, {"translation", {2, 0, 0}}});
  b.node({{"name", "car"}, {"mesh", 1}, {"translation", {3, 0, 0}}, {"children", {6}}});
  b.node({{"name", "no triangle"}, {"mesh", 3}});
  b.json["scenes"] = {{{"nodes", {0}}}};
  return b;
}

TEST(SceneMeshes, NodesOfAGltfFileAreMeshes) {
  const Scene scene = nested().load(kCopy);
  EXPECT_FALSE(scene.instanced());
  EXPECT_EQ(scene.instances.first, (Sizes{0, 2, 3, 5, 6}));
  EXPECT_EQ(mesh_names(scene), (Names{"car", "wheel", "node 4", "car"}));
  EXPECT_EQ(placement_names(scene), mesh_names(scene));
  EXPECT_EQ(nodes(scene), (Numbers{0, 3, 4, 5}));
  EXPECT_EQ(mesh_numbers(scene, &MeshLabel::id), (Numbers{0, 1, 0, 1}));
  EXPECT_EQ(mesh_numbers(scene, &MeshLabel::material), (Numbers{kSeveralMaterials, 1, kSeveralMaterials, 1}));
  EXPECT_EQ(bounds_of_mesh(scene, 2).lo, glm::vec3(2, 0, 0));  // in the world
}

TEST(SceneMeshes, KeptMeshesAreThereOnceWithTheirNodes) {
  const Scene scene = nested().load(kKeep);
  EXPECT_TRUE(scene.instanced());
  EXPECT_EQ(mesh_names(scene), (Names{"mesh 0", "wheel"}));
  EXPECT_EQ(placement_names(scene), (Names{"car", "wheel", "node 4", "car"}));
  EXPECT_EQ(placed_meshes(scene), (Numbers{0, 1, 0, 1}));
  EXPECT_EQ(nodes(scene), (Numbers{0, 3, 4, 5}));
  EXPECT_EQ(mesh_numbers(scene, &MeshLabel::material), (Numbers{kSeveralMaterials, 1}));
  EXPECT_EQ(moved(bounds_of_mesh(scene, 0), scene.instances.placements[2].transform).lo, glm::vec3(2, 0, 0));
}

TEST(SceneMeshes, IdsAreThoseOfTheFileWhateverThePolicy) {
  for (const LoadOptions& options : {kKeep, kCopy}) {
    const Scene scene = nested().load(options);
    EXPECT_EQ(ids(scene, IdSource::Mesh), (Numbers{0, 0, 1, 0, 0, 1}));
    EXPECT_EQ(ids(scene, IdSource::Node), (Numbers{0, 0, 3, 4, 4, 5}));
    EXPECT_EQ(ids(scene, IdSource::Material), (Numbers{1, 0, 1, 1, 0, 1}));
  }
}

// Nodes whose meshes are not kept share a tree where they follow one another.
TEST(SceneMeshes, WhatIsNotKeptIsOneMeshOfTheTrees) {
  GltfBuilder b;
  for (int mesh = 0; mesh < 6; ++mesh) b.mesh(b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0}));
  for (const int mesh : {0, 1, 2, 2, 3, 4, 2, 5}) b.node({{"mesh", mesh}, {"translation", {0, 0, mesh}}});
  b.json["nodes"][2]["scale"] = {-1, 1, 1};  // turned; so mesh 2 is there twice
  const Scene scene = b.load(kKeep);
  EXPECT_EQ(scene.instances.first, (Sizes{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(placed_meshes(scene), (Numbers{0, 1, 2, 3, 4, 5, 3, 6}));
  EXPECT_EQ(mesh_numbers(scene, &MeshLabel::id), (Numbers{0, 1, 2, 2, 3, 4, 5}));
  const TreeLayout layout = tree_layout(scene);
  EXPECT_EQ(layout.first, (Sizes{0, 2, 3, 4, 6, 7}));
  Numbers meshes;
  for (const Placement& p : layout.placements) meshes.push_back(p.mesh);
  EXPECT_EQ(meshes, (Numbers{0, 1, 2, 3, 2, 4}));
  Scene other = scene;
  other.instances.names.assign(other.instances.names.size(), "other");
  EXPECT_EQ(digest_of(other), digest_of(scene));
  EXPECT_EQ(ids(scene, IdSource::Mesh), ids(b.load(kCopy), IdSource::Mesh));
}

TEST(SceneMeshes, CopiesOfOneNodeAreOneMesh) {
  GltfBuilder b = one_triangle();
  b.node({{"mesh", 0}, {"name", "last"}});
  b.json["nodes"][0]["extensions"] = {
      {"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", b.vec3({1, 0, 0, 2, 0, 0, 3, 0, 0})}}}}}};
  b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  const Scene copied = b.load(kCopy), kept = b.load(kKeep);
  EXPECT_EQ(copied.instances.first, (Sizes{0, 3, 4}));
  EXPECT_EQ(kept.instances.first, (Sizes{0, 1}));
  EXPECT_EQ(placement_names(kept), (Names{"node 0", "node 0", "node 0", "last"}));
  EXPECT_EQ(kept.instances.names.size(), 3u);  // with the mesh's
  EXPECT_EQ(ids(copied, IdSource::Node), (Numbers{0, 0, 0, 1}));
  EXPECT_EQ(ids(kept, IdSource::Node), (Numbers{0, 0, 0, 1}));
}

TEST(SceneMeshes, WhatMovesKeepsItsLabels) {
  const Scene scene = moving_triangle().load(kKeep);
  EXPECT_TRUE(scene.instanced());  // though it lies where a copy would
  const Scene later = posed(scene, 1.5);
  EXPECT_EQ(later.instances.placements[0].transform.m[0][3], 5);
  EXPECT_EQ(nodes(later), Numbers{0});
  EXPECT_FALSE(moving_triangle().load(kCopy).instanced());
}

TEST(SceneMeshes, GroupsOfAnObjFileAreMeshes) {
  const Scene scene = load_obj_text(
      "f 1 2 3\no body\nf 1 2 3 4\nusemtl a\nf 1 2 4\ng wheel\ng left wheel # a comment\nf 1 2 4\ng wheel#2\ng body\n"
      "f 2 3 4\ng\nf 1 2 3\ng default\nf 1 2 4\ng car\nf 1 3 4\ng none\n");
  EXPECT_FALSE(scene.instanced());
  EXPECT_EQ(mesh_names(scene), (Names{"car", "body", "left wheel", "body", "default", "car"}));
  EXPECT_EQ(scene.instances.first, (Sizes{0, 1, 4, 5, 6, 8, 9}));
  EXPECT_EQ(mesh_numbers(scene, &MeshLabel::id), (Numbers{0, 1, 2, 1, 3, 0}));
  EXPECT_EQ(nodes(scene), (Numbers{0, 1, 2, 1, 3, 0}));
  EXPECT_EQ(ids(scene, IdSource::Mesh), (Numbers{0, 1, 1, 1, 2, 1, 3, 3, 0}));
  EXPECT_EQ(ids(scene, IdSource::Node), ids(scene, IdSource::Mesh));
}

TEST(SceneMeshes, AnyNameIsKept) {
  const std::string lengthy(1 << 20, 'n'), odd = "\x1b[2J\xff|\t\xe2\x80\xae#";
  const Scene scene = load_obj_text("g " + lengthy + "\nf 1 2 3\ng " + odd + "\nf 1 2 3\n");
  EXPECT_EQ(mesh_names(scene), (Names{lengthy, odd}));
  GltfBuilder b = one_triangle();
  b.json["nodes"][0]["name"] = std::string("a\0\n", 3);
  EXPECT_EQ(mesh_names(b.load()), Names{std::string("a\0\n", 3)});
}

TEST(SceneMeshes, OtherFilesAreOneMeshOfTheirName) {
  const TemporaryFolder folder;
  folder.write("part.ply",
               "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
               "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  folder.write("part.stl",
               "solid other\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
               "endfacet\nendsolid\n");
  folder.write("part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write_triangles(folder.path() / "part.npy", built(1).triangles);
  for (const char* name : {"part.ply", "part.stl", "part.npy", "part.obj"}) {
    const Scene scene = load_scene(folder.path() / name);
    EXPECT_EQ(mesh_names(scene), Names{"part"}) << name;
    EXPECT_EQ(ids(scene, IdSource::Mesh), Numbers{0}) << name;
    EXPECT_EQ(ids(scene, IdSource::Node), Numbers{0}) << name;
  }
}

}  // namespace
}  // namespace ballot
