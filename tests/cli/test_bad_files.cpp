// Scene files that every command must refuse: with one sentence, exit code 1 and no file written.
#include <cmath>
#include <limits>

#include "tests/cli/cli.h"
#include "tests/cpu/gltf_builder.h"

namespace ballot::test {
namespace {

class BadFiles : public Cli {
 protected:
  void refuse_scene(const std::string& scene, std::initializer_list<std::string_view> parts) const {
    const Words commands[] = {{"info", scene, "--triangles", "t.npy", "--json", "o.json"},
                              {"render", scene, "--size", "4x4", "--out", "p.exr", "--json", "o.json"},
                              {"trace", scene, "--rays", "rays.npy", "--out", "hits.npy", "--json", "o.json"}};
    for (const Words& command : commands) {
      refuse(1, {scene}, command);
      refuse(1, parts, command);
    }
  }
  void SetUp() override { rays(); }
};

TEST_F(BadFiles, MissingEmptyFolderUnknownFormat) {
  refuse_scene("none.glb", {"no such scene file"});
  refuse_scene(write("empty.gltf", ""), {"is empty"});
  std::filesystem::create_directory(path("folder.glb"));
  refuse_scene("folder.glb", {"is a folder"});
  refuse_scene(write("scene.fbx", "x"), {".gltf, .glb, .obj"});
}

TEST_F(BadFiles, NotWhatTheyClaim) {
  refuse_scene(write("text.glb", "this is no scene"), {"is not glTF"});
  refuse_scene(write("text.gltf", "{\"asset\": "), {"not valid glTF"});
  const std::string good = one_triangle().glb();
  refuse_scene(write("half.glb", good.substr(0, good.size() / 2)), {"is cut short"});
  refuse_scene(write("page.obj", "<html>\n"), {"is not OBJ"});
}

TEST_F(BadFiles, CountsAndIndices) {
  GltfBuilder b = one_triangle();
  b.json["accessors"][0]["count"] = std::uint64_t{1} << 60;
  refuse_scene(write("huge.glb", b.glb()), {"accessor 0", "1152921504606846976"});
  b = one_triangle();
  b.primitive()["indices"] = b.indices({0, 1, 3});
  refuse_scene(write("index.glb", b.glb()), {"index 2 is 3", "3 vertices"});
}

TEST_F(BadFiles, VerticesThatAreNotFinite) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    GltfBuilder b;
    b.mesh(b.vec3({0, 0, 0, 1, 0, 0, 0, bad, 0}));
    b.node({{"mesh", 0}});
    refuse_scene(write("vertex.glb", b.glb()), {"vertex 2", std::isnan(bad) ? "nan" : "inf", "finite"});
  }
}

}  // namespace
}  // namespace ballot::test
