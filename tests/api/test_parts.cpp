// Scenes of files by the installed library: their meshes and instances, ids, and parts that move.
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "api.h"
#include "tests/temporary.h"

namespace {

// The node before the last is of mesh 0, the last of mesh 2; mesh 1 has two nodes.
constexpr const char* kPlates = R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
 "nodes": [{"children": [1, 2, 3, 4]}, {"name": "left", "mesh": 1},
           {"name": "right", "mesh": 1, "translation": [3, 0, 0]},
           {"name": "lone", "mesh": 0, "translation": [0, 3, 0]}, {"mesh": 2, "translation": [3, 3, 0]}],
 "materials": [{"name": "red"}, {"name": "blue"}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 1}]},
            {"name": "plate", "primitives": [{"attributes": {"POSITION": 0}, "material": 0}]},
            {"name": "last", "primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0],
                "max": [1, 1, 0]}],
 "bufferViews": [{"buffer": 0, "byteLength": 36}],
 "buffers": [{"byteLength": 36,
              "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
constexpr const char* kGroups =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 3 0 0\nv 4 0 0\nv 3 1 0\n"
    "g door\nf 1 2 3\nf 1 3 2\ng wing\nf 4 5 6\n";

using Numbers = std::vector<std::uint32_t>;
using Counts = std::vector<std::int64_t>;

/// What rays down on the four plates, and one beside them, find.
struct Found {
  std::vector<ballot::Hit> hits{5};
  Numbers prims = Numbers(5), ids = Numbers(5), instances = Numbers(5);
  std::vector<float> t = std::vector<float>(5);
  explicit Found(const ballot::Scene& scene) {
    std::vector<ballot::Ray> rays;
    for (const auto& [x, y] : {std::pair{0, 0}, {3, 0}, {0, 3}, {3, 3}, {9, 9}})
      rays.push_back({{float(x) + 0.25f, float(y) + 0.25f, 2}, 0, {0, 0, -1}, 10});
    scene.trace(rays, {.hits = hits.data(),
                       .t = t.data(),
                       .prims = prims.data(),
                       .mesh_ids = ids.data(),
                       .instances = instances.data()});
  }
};

class ApiParts : public Api {
 protected:
  ballot::Scene load(const char* name, const char* text, const ballot::SceneOptions& options) {
    return ballot::Scene::load(*device_, folder_.write(name, text).string(), options);
  }
  ballot::test::TemporaryFolder folder_;
};

template <class Info>
std::vector<std::string> names_of(const std::vector<Info>& all) {
  std::vector<std::string> names;
  for (const Info& i : all) names.push_back(i.name);
  return names;
}

template <class Info>
Numbers ids_of(const std::vector<Info>& all) {
  Numbers ids;
  for (const Info& i : all) ids.push_back(i.id);
  return ids;
}

TEST_F(ApiParts, ColumnsOnTheDeviceHaveTheIdsOfEachRule) {
  std::vector<ballot::Ray> rays;
  for (std::size_t i = 0; i < 400; ++i)
    rays.push_back({{0.25f * float(i % 20), 0.25f * float(i / 20), 2}, 0, {0, 0, -1}, 10});
  const std::size_t n = rays.size();
  ballot::Array<ballot::Ray> in(*device_, n);
  in.write(rays);
  std::map<std::string, Numbers> flat;
  for (const char* instances : {"copy", "keep"})
    for (const char* rule : {"mesh", "node", "material"}) {
      const ballot::Scene scene = load("plates.gltf", kPlates, {.instances = instances, .ids = rule});
      Numbers prims(n), ids(n), numbers(n), found(n);
      scene.trace(rays, {.prims = prims.data(), .mesh_ids = ids.data(), .instances = numbers.data()});
      ballot::Array<std::uint32_t> prims_there(*device_, n), ids_there(*device_, n), numbers_there(*device_, n);
      scene.trace(in, {{"prims", prims_there}, {"mesh_ids", ids_there}, {"instances", numbers_there}}, n);
      const auto expect = [&](const ballot::Array<std::uint32_t>& there, const Numbers& here) {
        there.read(found);
        EXPECT_EQ(found, here) << instances << rule;
      };
      expect(prims_there, prims);
      expect(ids_there, ids);
      expect(numbers_there, numbers);
      EXPECT_EQ(flat.try_emplace(rule, ids).first->second, ids);
      EXPECT_GE(std::set(ids.begin(), ids.end()).size(), 3u) << rule;
    }
}

TEST_F(ApiParts, NodesAreMeshesOfAFlatScene) {
  const ballot::Scene scene = load("plates.gltf", kPlates, {.instances = "copy"});
  const auto meshes = scene.meshes();
  EXPECT_EQ(names_of(meshes), (std::vector<std::string>{"left", "right", "lone", "last"}));
  EXPECT_EQ(ids_of(meshes), (Numbers{1, 1, 0, 2}));
  EXPECT_EQ(scene.info().trees, 0u);
  for (std::size_t m = 0; m < 4; ++m) {
    EXPECT_EQ(meshes[m].first, m);
    EXPECT_EQ(meshes[m].triangles, 1u);
  }
  EXPECT_EQ(meshes[3].lo[0], 3);
  EXPECT_EQ(meshes[3].hi[1], 4);
  const Found found(scene);
  EXPECT_EQ(found.prims, (Numbers{0, 0, 0, 0, ballot::kMiss}));
  EXPECT_EQ(found.ids, (Numbers{1, 1, 0, 2, ballot::kMiss}));
  EXPECT_EQ(found.instances, (Numbers{0, 1, 2, 3, ballot::kMiss}));
}

TEST_F(ApiParts, NodesAreInstancesOfMeshesThatAreKeptOnce) {
  const ballot::Scene scene = load("plates.gltf", kPlates, {.instances = "keep"});
  const auto meshes = scene.meshes();
  const auto instances = scene.instances();
  EXPECT_EQ(names_of(meshes), (std::vector<std::string>{"plate", "lone", "last"}));
  EXPECT_EQ(ids_of(meshes), (Numbers{1, 0, 2}));
  EXPECT_EQ(names_of(instances), (std::vector<std::string>{"left", "right", "lone", "last"}));
  EXPECT_EQ(ids_of(instances), (Numbers{1, 2, 3, 4}));
  const Numbers which{0, 0, 1, 2};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(instances[i].mesh, which[i]);
    EXPECT_EQ(instances[i].first, i);
    EXPECT_EQ(instances[i].triangles, 1u);
  }
  EXPECT_EQ(instances[1].transform[3], 3);
  EXPECT_EQ(instances[1].lo[0], 3);
  EXPECT_EQ(instances[1].hi[1], 1);
  EXPECT_EQ(scene.info().triangles, 3u);
  EXPECT_EQ(scene.info().instances, 4u);
  EXPECT_EQ(scene.info().instance_triangles, 4u);
  const Found found(scene);
  EXPECT_EQ(found.prims, (Numbers{0, 0, 0, 0, ballot::kMiss}));
  EXPECT_EQ(found.ids, (Numbers{1, 1, 0, 2, ballot::kMiss}));
  EXPECT_EQ(found.instances, (Numbers{0, 1, 2, 3, ballot::kMiss}));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(found.hits[i].prim, i);
}

TEST_F(ApiParts, IdsAreThoseOfMeshesNodesOrMaterials) {
  for (const char* policy : {"keep", "copy"}) {
    const auto ids = [&](const char* source) {
      return Found(load("plates.gltf", kPlates, {.instances = policy, .ids = source})).ids;
    };
    EXPECT_EQ(ids("mesh"), (Numbers{1, 1, 0, 2, ballot::kMiss})) << policy;
    EXPECT_EQ(ids("node"), (Numbers{1, 2, 3, 4, ballot::kMiss})) << policy;
    EXPECT_EQ(ids("material"), (Numbers{0, 0, 1, 0, ballot::kMiss})) << policy;
  }
  std::string text;
  EXPECT_EQ(code_of([&] { load("plates.gltf", kPlates, {.ids = "name"}); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("'name'; there are: mesh, node, material"), std::string::npos) << text;
}

ballot::RayView masked(std::span<const ballot::Ray> rays, const Numbers& masks) {
  ballot::RayView view = ballot::rays(rays);
  view.masks = masks;
  return view;
}

TEST_F(ApiParts, GroupsOfObjAreMeshes) {
  ballot::Scene scene = load("house.obj", kGroups, {});
  const auto meshes = scene.meshes();
  EXPECT_EQ(names_of(meshes), (std::vector<std::string>{"door", "wing"}));
  EXPECT_EQ(ids_of(meshes), (Numbers{0, 1}));
  EXPECT_EQ(meshes[1].first, 2u);
  const Found found(scene);
  EXPECT_EQ(found.prims[1], 0u);
  EXPECT_EQ(found.hits[1].prim, 2u);
  EXPECT_EQ(found.ids[1], 1u);
  const Numbers parts{0, 1}, masks{1, 2}, rays{2};
  const ballot::Ray ray{{0.25f, 0.25f, 2}, 0, {0, 0, -1}, 10};
  scene.set_masks(parts, masks);
  scene.commit();
  EXPECT_EQ(scene.count_crossings(masked({&ray, 1}, rays)), (Counts{0}));
  EXPECT_EQ(scene.info().trees, 0u);
  move(scene, 1, std::vector<float>{3, 0, 1, 4, 0, 1, 3, 1, 1});
  EXPECT_EQ(Found(scene).t[1], 1);
  EXPECT_EQ(Found(scene).t[0], 2);
  EXPECT_EQ(scene.meshes()[1].lo[2], 1);
  std::string text;
  EXPECT_EQ(code_of([&] { move(scene, 1, std::vector<float>(6)); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("2 vertices, but the mesh was made with 3"), std::string::npos) << text;
}

TEST_F(ApiParts, MasksAreOfInstances) {
  ballot::Scene scene = load("plates.gltf", kPlates, {.instances = "keep"});
  std::vector<ballot::Ray> rays;
  for (const float x : {0.25f, 3.25f})
    for (const float y : {0.25f, 3.25f}) rays.push_back({{x, y, 2}, 0, {0, 0, -1}, 10});
  scene.set_masks(Numbers{0, 1, 2, 3}, Numbers{1, 1, 2, 1});
  scene.commit();
  EXPECT_EQ(scene.count_crossings(masked(rays, Numbers{1, 1, 1, 1})), (Counts{1, 0, 1, 1}));
  EXPECT_EQ(scene.count_crossings(rays), (Counts{1, 1, 1, 1}));
  const Found before(scene);
  scene.set_masks(Numbers{1}, Numbers{0});
  scene.commit();
  EXPECT_EQ(scene.count_crossings(rays), (Counts{1, 1, 0, 1}));
  const Found after(scene);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(after.t[i], i == 1 ? INFINITY : before.t[i]);
    if (i == 1) continue;
    EXPECT_EQ(after.hits[i].prim, before.hits[i].prim);
  }
}

TEST_F(ApiParts, PartsOfALoadedSceneMove) {
  ballot::Scene scene = load("plates.gltf", kPlates, {.instances = "keep"});
  move(scene, 0, std::vector<float>{0, 0, 1, 1, 0, 1, 0, 1, 1});
  EXPECT_EQ(Found(scene).t, (std::vector<float>{1, 1, 2, 2, INFINITY}));
  std::vector<float> places;
  for (const auto& i : scene.instances()) places.insert(places.end(), i.transform, i.transform + 12);
  places[12 + 11] = 0.5f;
  place(scene, places);
  EXPECT_EQ(Found(scene).t, (std::vector<float>{1, 0.5f, 2, 2, INFINITY}));
  EXPECT_EQ(scene.instances()[1].lo[2], 1.5f);
  const std::vector<float> before = places;
  std::string text;
  places[24 + 3] = 1;
  EXPECT_EQ(scene.info().trees, 2u);
  place(scene, places);  // a mesh leaves the tree that it shared
  EXPECT_EQ(scene.info().trees, 3u);
  EXPECT_EQ(Found(scene).t, (std::vector<float>{1, 0.5f, INFINITY, 2, INFINITY}));
  place(scene, before);
  EXPECT_EQ(Found(scene).t, (std::vector<float>{1, 0.5f, 2, 2, INFINITY}));
  places.resize(36);
  EXPECT_EQ(code_of([&] { place(scene, places); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("3 transforms, but the scene has 4 instances"), std::string::npos) << text;
  EXPECT_EQ(Found(scene).t, (std::vector<float>{1, 0.5f, 2, 2, INFINITY}));
  ballot::Scene copied = load("plates.gltf", kPlates, {.instances = "copy"});
  move(copied, 3, std::vector<float>{3, 3, 1, 4, 3, 1, 3, 4, 1});
  EXPECT_EQ(Found(copied).t, (std::vector<float>{2, 2, 2, 1, INFINITY}));
  place(copied, before);
  EXPECT_EQ(Found(copied).t, (std::vector<float>{2, INFINITY, 2, 1, INFINITY}));  // moved twice
}

// A tree of several meshes lies before that of the mesh that moves, and one of a single mesh moves too.
TEST_F(ApiParts, MeshesMoveBesideOthersInTheWorld) {
  std::string others = kPlates, alone = kPlates;
  others.replace(others.find("1, 2, 3, 4"), 10, "3, 4, 1, 2");
  alone.replace(alone.find("1, 2, 3, 4"), 10, "1, 3, 2");
  ballot::Scene scene = load("others.gltf", others.c_str(), {.instances = "keep"});
  EXPECT_EQ(names_of(scene.meshes()), (std::vector<std::string>{"lone", "last", "plate"}));
  move(scene, 2, std::vector<float>{0, 0, 1, 1, 0, 1, 0, 1, 1});
  EXPECT_EQ(Found(scene).t, (std::vector<float>{1, 1, 2, 2, INFINITY}));
  EXPECT_EQ(scene.triangles()[2], 0);
  EXPECT_EQ(scene.triangles()[20], 1);
  std::vector<float> places;
  for (const auto& i : scene.instances()) places.insert(places.end(), i.transform, i.transform + 12);
  places[3 * 12 + 11] = 0.5f;
  place(scene, places);
  EXPECT_EQ(Found(scene).t, (std::vector<float>{1, 0.5f, 2, 2, INFINITY}));
  EXPECT_EQ(scene.instances()[3].transform[11], 0.5f);

  ballot::Scene single = load("alone.gltf", alone.c_str(), {.instances = "keep"});
  places.clear();
  for (const auto& i : single.instances()) places.insert(places.end(), i.transform, i.transform + 12);
  for (const float z : {1.f, 0.5f}) {
    places[12 + 11] = z;
    place(single, places);
    EXPECT_EQ(Found(single).t, (std::vector<float>{2, 2, 2 - z, INFINITY, INFINITY}));
    EXPECT_EQ(single.instances()[1].lo[2], z);
    EXPECT_EQ(single.render({}, {.width = 8, .height = 8}).size(), 256u);
  }
  move(single, single.instances()[1].mesh, std::vector<float>{0, 3, 0.25f, 1, 3, 0.25f, 0, 4, 0.25f});
  EXPECT_EQ(Found(single).t, (std::vector<float>{2, 2, 1.25f, INFINITY, INFINITY}));
}

TEST_F(ApiParts, AnimationsAloneMoveTheirScene) {
  const auto file = std::filesystem::path(BALLOT_SOURCE_DIR) / "scenes" / "dance.gltf";
  for (const char* policy : {"keep", "copy"}) {
    ballot::Scene scene = ballot::Scene::load(*device_, file.string(), {.instances = policy});
    std::string text;
    EXPECT_EQ(code_of([&] { move(scene, 0, std::vector<float>(9)); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find("the scene's animations move it"), std::string::npos) << text;
  }
}

}  // namespace
