// Tests of the files that scenes name: only files of the scene's folder are read unless more is allowed.
#include <gtest/gtest.h>

#include "engine/files/named_file.h"
#include "tests/cpu/gltf_builder.h"

namespace ballot::test {
namespace {

namespace fs = std::filesystem;

TEST(NamedFiles, OnlyThoseOfTheFolder) {
  for (const char* good : {"a.bin", "textures/a.png", "./a.bin", "a/../b.bin", "..a", "a b", "c:x", "1:1.png"})
    EXPECT_EQ(why_refused("s.obj", good, false), "") << good;
  for (const char* outside : {"../a.bin", "a/../../b", "/etc/passwd", "..", "textures/../..//b"}) {
    EXPECT_NE(why_refused("s.obj", outside, false).find("--allow-outside"), std::string::npos) << outside;
    EXPECT_EQ(why_refused("s.obj", outside, true), "") << outside;
  }
  for (const char* scheme : {"http://host/a.png", "https://host/a", "file:///a", "file:a", "ftp://x"})
    for (const bool allowed : {false, true})
      EXPECT_NE(why_refused("s.obj", scheme, allowed).find("Ballot reads files alone"), std::string::npos) << scheme;
  EXPECT_NE(why_refused("s.obj", std::string_view("a\0b", 3), true), "");
  EXPECT_EQ(decoded_uri("..%2fa%20b%zz%"), "../a b%zz%");
}

/// A folder "scene" beside a file outside.bin with one triangle.
struct Neighbours {
  TemporaryFolder folder;
  Neighbours() {
    fs::create_directory(folder.path() / "scene");
    const std::vector<float> corners{0, 0, 0, 1, 0, 0, 0, 1, 0};
    folder.write("outside.bin", {reinterpret_cast<const char*>(corners.data()), 36});
  }
  /// Writes a scene whose buffer is at `uri` and loads it.
  Scene load(const std::string& uri, bool allowed) const {
    GltfBuilder b = one_triangle();
    b.json["buffers"] = {{{"byteLength", 36}, {"uri", uri}}};
    return load_scene(folder.write("scene/s.gltf", b.json.dump()), {.allow_outside = allowed});
  }
};

TEST(NamedFiles, Buffers) {
  const Neighbours n;
  const std::string absolute = (n.folder.path() / "outside.bin").string();
  for (const std::string& uri : {std::string("../outside.bin"), std::string("..%2Foutside.bin"), absolute}) {
    expect_error(Failure::Work, {"s.gltf: a buffer names", "outside.bin", "--allow-outside"},
                 [&] { n.load(uri, false); });
    EXPECT_EQ(n.load(uri, true).triangles.size(), 1u) << uri;
  }
  expect_error(Failure::Work, {"a buffer names 'http://host/a.bin', which has the scheme http://"},
               [&] { n.load("http://host/a.bin", true); });
  expect_error(Failure::Work, {"'absent.bin' was not found"}, [&] { n.load("absent.bin", false); });
}

// tinygltf also looks for buffers in the folder that the process is in.
TEST(NamedFiles, TheWorkingFolderIsNotSearched) {
  const Neighbours n;
  const fs::path before = fs::current_path();
  fs::current_path(n.folder.path());
  expect_error(Failure::Work, {"'outside.bin' was not found"}, [&] { n.load("outside.bin", false); });
  fs::current_path(before);
}

TEST(NamedFiles, ImagesAndMaterials) {
  const Neighbours n;
  GltfBuilder b = one_triangle();
  b.json["images"] = {{{"uri", "../a.png"}}};
  b.json["textures"] = {{{"source", 0}}};
  b.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  b.primitive()["material"] = 0;
  b.primitive()["attributes"]["TEXCOORD_0"] = b.accessor(b.view(std::vector<float>(6)), 5126, 3, "VEC2");
  const fs::path glb = n.folder.write("scene/i.glb", b.glb());
  expect_error(Failure::Work, {"i.glb: image 0 names '../a.png', which lies outside"}, [&] { load_scene(glb); });
  EXPECT_EQ(load_scene(glb, {.allow_outside = true}).notes.size(), 1u);  // it is not there: left out

  n.folder.write("m.mtl", "newmtl red\nKd 1 0 0\n");
  const fs::path obj =
      n.folder.write("scene/o.obj", "mtllib ../m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n");
  const Scene without = load_scene(obj), with = load_scene(obj, {.allow_outside = true});
  ASSERT_FALSE(without.notes.empty());
  EXPECT_NE(without.notes[0].find("'../m.mtl' lies outside of the scene's folder"), std::string::npos);
  EXPECT_EQ(with.materials[with.material(0)].name, "red");
}

TEST(NamedFiles, LinksOutOfTheFolder) {
  const Neighbours n;
  const fs::path scene = n.folder.path() / "scene";
  fs::create_symlink("../outside.bin", scene / "link.bin");
  fs::create_symlink("..", scene / "up");
  fs::create_symlink("link.bin", scene / "twice.bin");
  fs::create_directory(scene / "in");
  fs::copy_file(n.folder.path() / "outside.bin", scene / "in/inside.bin");
  fs::create_symlink("in/inside.bin", scene / "within.bin");
  fs::create_directory_symlink("scene", n.folder.path() / "same");
  EXPECT_EQ(n.load("within.bin", false).triangles.size(), 1u);
  EXPECT_EQ(load_scene(n.folder.path() / "same/s.gltf").triangles.size(), 1u);  // its folder may be a link
  for (const char* uri : {"link.bin", "up/outside.bin", "twice.bin", "up/scene/../outside.bin"}) {
    expect_error(Failure::Work, {"a buffer names", uri, "a link that leads out", "--allow-outside"},
                 [&] { n.load(uri, false); });
    EXPECT_EQ(n.load(uri, true).triangles.size(), 1u) << uri;
  }
  n.folder.write("m.mtl", "newmtl red\nKd 1 0 0\nmap_Kd up/x.png\n");
  fs::create_symlink("../m.mtl", scene / "l.mtl");
  fs::copy_file(n.folder.path() / "m.mtl", scene / "own.mtl");
  const std::string rest = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
  const Scene linked = load_scene(n.folder.write("scene/o.obj", "mtllib l.mtl\n" + rest));
  EXPECT_NE(linked.notes.at(0).find("'l.mtl' is a link that leads out"), std::string::npos);
  n.folder.write("x.png", "secret");
  const Scene image = load_scene(n.folder.write("scene/o.obj", "mtllib own.mtl\n" + rest));
  EXPECT_NE(image.notes.at(0).find("'up/x.png' is a link that leads out"), std::string::npos);
}

}  // namespace
}  // namespace ballot::test
