// Tests what the OBJ loader makes of MTL files as programs write them: opacity, odd values, textures, what is left out.
#include <algorithm>

#include "engine/files/image.h"
#include "gltf_builder.h"

namespace ballot::test {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kUsed = "mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1 0.5\n";

/// A folder with m.mtl and an OBJ file of one triangle that uses its material 'a'.
struct Writer {
  TemporaryFolder folder;
  explicit Writer(std::string_view mtl) { folder.write("m.mtl", mtl); }

  Scene load(std::string_view rest = "f 1/1 2/2 3/3\n") const {
    return load_scene(folder.write("s.obj", std::string(kUsed).append(rest)));
  }
  /// Writes a picture of one pixel of this grey, from 0 to 1.
  void picture(const std::string& name, float grey) const {
    Image image{.width = 1, .height = 1, .channels = {}, .attributes = {}};
    for (const char* channel : {"R", "G", "B"}) image.channels.push_back({channel, Pixel::Float, {grey}, {}});
    fs::create_directories((folder.path() / name).parent_path());
    write_png(folder.path() / name, image);
  }
};

const Material& used(const Scene& scene) { return scene.materials[scene.material(0)]; }

/// Returns how many notes hold a text.
std::ptrdiff_t notes_with(const Scene& scene, std::string_view text) {
  return std::ranges::count_if(scene.notes, [&](const std::string& n) { return n.find(text) != std::string::npos; });
}

TEST(Mtl, OpacityByTheHabitsOfWriters) {
  const auto transmission = [](const char* lines, std::string_view note = {}) {
    const Scene scene = Writer(std::string("newmtl a\nKd 1 1 1\n") + lines).load();
    EXPECT_EQ(notes_with(scene, "opaque") + notes_with(scene, "invisible:"), note.empty() ? 0 : 1) << lines;
    EXPECT_EQ(notes_with(scene, note) > 0 || note.empty(), true) << lines;
    return used(scene).transmission;
  };
  EXPECT_EQ(transmission("Tr 1.000000\n", "opaque"), 0);
  EXPECT_EQ(transmission("Tr 0\n"), 0);
  EXPECT_EQ(transmission("Tr 0.75\n"), 0.75f);
  EXPECT_EQ(transmission("d 1\nTr 1\n"), 0);  // d is taken before Tr, whichever comes first
  EXPECT_EQ(transmission("Tr 1\nd 1\n"), 0);
  EXPECT_EQ(transmission("d 0.25\nTr 0.1\n"), 0.75f);
  EXPECT_EQ(transmission("d -halo 0.25\n"), 0.75f);
  EXPECT_EQ(transmission("d 0\n", "invisible:"), 1);
  EXPECT_EQ(transmission("d nan\nTr x\n"), 0);
  EXPECT_EQ(transmission("d 7\n"), 0);
}

TEST(Mtl, ColoursOfAnyForm) {
  const auto kd = [](const std::string& line, bool readable) {
    const Scene scene = Writer("newmtl a\n" + line).load();
    EXPECT_EQ(notes_with(scene, "1 values, the first in line 2,"), readable ? 0 : 1) << line;
    return used(scene).base_color;
  };
  EXPECT_EQ(kd("Kd 0.5 0.25 0\n", true), glm::vec3(0.5f, 0.25f, 0));
  EXPECT_EQ(kd("kd +0.5 2.5e-1 -1 7\n", true), glm::vec3(0.5f, 0.25f, 0));
  EXPECT_EQ(kd("Kd 0.5\n", true), glm::vec3(0.5f));  // one number is grey
  EXPECT_EQ(kd("\tKd  0 0 0\r\n", true), glm::vec3(0));
  for (const char* line :
       {"Kd nan nan nan\n", "Kd 1 inf 1\n", "Kd 0.5 0.5\n", "Kd\n", "Kd spectral x.rfl 1\n", "Kd red\n"})
    EXPECT_EQ(kd(line, false), glm::vec3(1)) << line;
  const glm::vec3 white = kd("Kd xyz 0.9505 1 1.089\n", true), green = kd("Kd xyz 0.3576 0.7152 0.1192\n", true);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(white[c], 1, 1e-3);
    EXPECT_NEAR(green[c], c == 1, 1e-3);
  }
  const Scene without = Writer("newmtl a\nKs 0 0 0\n").load();
  EXPECT_EQ(used(without).base_color, glm::vec3(1));
  EXPECT_EQ(notes_with(without, "without Kd are white"), 1);
  EXPECT_EQ(used(Writer("newmtl a\nKd 1 1 1\nNs nan\nKs 0.5\nNi x\n").load()).base_color, glm::vec3(1));
}

TEST(Mtl, NamesAndDefinitions) {
  const Scene twice = Writer("newmtl a\nKd 1 0 0\nnewmtl b\nnewmtl a\nKd 0 1 0\n").load();
  EXPECT_EQ(used(twice).base_color, glm::vec3(0, 1, 0));
  EXPECT_EQ(notes_with(twice, "the material 'a' is defined again"), 1);
  const Writer number("newmtl Material #2\nKd 1 0 0\nnewmtl plain # the second\nKd 0 1 0\nnewmtl\nKd 0 0 1\n");
  const Scene names = number.load("usemtl Material #2\nf 1 2 3\nusemtl plain # here\nf 1 2 3\nusemtl plain\nf 1 2 3\n");
  EXPECT_EQ(names.material_of, (std::vector<std::uint32_t>{0, 1, 1}));
}

TEST(Mtl, MapsOfColours) {
  const Writer w(
      "newmtl a\nKd 0 0 0\nmap_Kd -s 2 4 1 -o 0.5 0.25 -clamp on .\\maps\\a wall.png\nmap_Ks x.png\nbump -bm 1 y\n");
  w.picture("maps/a wall.png", 1);
  const Scene scene = w.load();
  const Material& m = used(scene);
  EXPECT_EQ(m.base_color, glm::vec3(1));  // a black Kd would hide the map
  ASSERT_TRUE(m.base_texture);
  ASSERT_EQ(scene.images.size(), 1u);
  EXPECT_TRUE(scene.images[0].srgb);
  EXPECT_EQ(scene.images[0].rgba, std::vector<std::uint8_t>(4, 255));
  EXPECT_EQ(scene.textures[0].wrap_u, Wrap::Clamp);
  EXPECT_EQ(scene.uvs[0], (std::vector{std::array{glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(0, 1)}}));
  EXPECT_EQ(m.base_texture.row_u, glm::vec3(2, 0, 0.5f));    // 2 u + 0.5
  EXPECT_EQ(m.base_texture.row_v, glm::vec3(0, -4, 0.75f));  // 1 - (4 v + 0.25): rows are counted from the top
  EXPECT_EQ(features_of(scene), (SceneFeatures{.base_texture = true, .perspective = true}));
  EXPECT_EQ(notes_with(scene, "bump, map_ks of its materials are not read"), 1);
  EXPECT_EQ(notes_with(scene, "a black Kd beside a map_Kd"), 1);
  EXPECT_EQ(scene.notes.size(), 2u);
  const Scene bare = w.load("f 1 2 3\nusemtl b\nf -3//1 -2/9/1 -1/0\n");
  EXPECT_EQ(bare.uvs[0].size(), 2u);
  EXPECT_EQ(notes_with(bare, "3 corners of triangles with a texture have no texture coordinates"), 1);
}

TEST(Mtl, ImagesBesideTheMaterialFileOrTheScene) {
  const TemporaryFolder folder;
  const Writer w("newmtl a\nmap_Kd in.png\n");
  w.picture("low.png", 0);
  w.picture("sub/in.png", 1);
  w.folder.write("sub/n.mtl", "newmtl b\nmap_kd \"in.png\"\nnewmtl c\nmap_Kd low.png\nnewmtl d\nmap_Kd ../low.png\n");
  const Scene scene = w.load(
      "f 1/1 2/2 3/3\nmtllib sub/n.mtl\nusemtl b\nf 1/1 2/2 3/3\nusemtl c\nf 1/1 2/2 3/3\nusemtl d\nf 1/1 2/2 3/3\n");
  EXPECT_EQ(notes_with(scene, "The image 'in.png' was not found"), 1);
  ASSERT_EQ(scene.images.size(), 2u);
  EXPECT_FALSE(used(scene).base_texture);
  EXPECT_EQ(scene.images[scene.textures[scene.materials[1].base_texture.texture].image].rgba[0], 255);
  for (const std::size_t material : {2u, 3u})
    EXPECT_EQ(scene.images[scene.textures[scene.materials[material].base_texture.texture].image].rgba[0], 0);
}

TEST(Mtl, ImagesThatCannotBeUsedAreNotes) {
  for (const auto& [name, reason] : {std::pair{"gone.png", "was not found"},
                                     {"text.png", "cannot be used ("},
                                     {"../x.png", "lies outside"},
                                     {"http://host/x.png", "has the scheme"},
                                     {"C:\\maps\\x.png", "was not found"}}) {
    const Writer w(std::string("newmtl a\nKd 0.5 0.5 0.5\nmap_Kd ") + name + "\n");
    w.folder.write("text.png", "not a picture");
    const Scene scene = w.load();
    EXPECT_EQ(notes_with(scene, reason), 1) << name;
    EXPECT_EQ(used(scene).base_color, glm::vec3(0.5f));
    EXPECT_TRUE(scene.textures.empty() && scene.uvs[0].empty());
  }
  // An image that no face needs is not looked for.
  EXPECT_TRUE(Writer("newmtl a\nKd 1 1 1\nnewmtl b\nmap_Kd gone.png\n").load().notes.empty());
}

}  // namespace
}  // namespace ballot::test
