// Scene files that every command must refuse: with one sentence, exit code 1 and no file written.
#include <cmath>
#include <limits>

#include "engine/files/image.h"
#include "engine/render/film/film_file.h"
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

TEST_F(BadFiles, ImagesBeyondTheirBuffer) {
  GltfBuilder b = one_triangle();
  b.json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", 32}, {"byteLength", 8}});
  b.json["images"] = {{{"bufferView", 1}, {"mimeType", "image/png"}}};
  refuse_scene(write("image.glb", b.glb()), {"bufferView 1 spans 8 bytes from byte 32, but buffer 0 has 36"});
  b.json["bufferViews"][1]["byteOffset"] = std::uint64_t{1} << 45;
  refuse_scene(write("image.glb", b.glb()), {"bufferView 1 spans 8 bytes"});
}

TEST_F(BadFiles, DeepJson) {
  const std::string deep = std::string(100000, '[') + std::string(100000, ']');
  for (const std::string& text : {deep, "{\"views\": " + deep + "}"}) {
    write("deep.json", text);
    const auto parts = {std::string_view("deep.json: its JSON nests deeper than 256 brackets at byte 2")};
    square();
    refuse(1, parts, {"render", "square.glb", "--size", "4x4", "--out", "p.exr", "--views-file", "deep.json"});
  }
}

TEST_F(BadFiles, ViewsFilesAreJudgedInPlainWords) {
  const std::string scene = square();
  const auto refuse_views = [&](const std::string& text, std::initializer_list<std::string_view> parts) {
    write("views.json", text);
    const Words words{"render", scene, "--size", "4x4", "--out", "p.exr", "--views-file", "views.json"};
    refuse(1, parts, words);
  };
  refuse_views("{", {"views.json: expected JSON", "byte 2 of 1", "no views file"});
  refuse_views("[1]", {"views.json: top level: expected an object, found [1]"});
  refuse_views("{}", {"views.json: top level: expected an object with 'views', found {}"});
  refuse_views("\xEF\xBB\xBF{}", {"views.json: top level: expected an object with 'views', found {}"});
  refuse_views("\xFF\xFE{", {"views.json: is text in UTF-16", "expected UTF-8"});
  refuse_views("{\"views\": 1e999}", {"views.json: expected JSON, found a number that no double can hold"});
  refuse_views("{\"views\": [{\"name\": 3}]}", {"views[0]: expected an object with 'orientation'"});
  refuse_views("{\"views\": [{\"name\": \"a\", \"position\": [0, \"x\", 0], \"orientation\": [0, 0, 0, 1]}]}",
               {"views[0].position[1]: expected a number, found \"x\""});
}

TEST_F(BadFiles, PartsWhoseAttributesHaveOtherTypes) {
  Image image{.width = 1, .height = 1};
  image.channels.push_back({"Z", Pixel::Float, {1.0f}, {}});
  image.attributes = {{"part", std::string("0/1")}, {"seconds", std::string("long")}};
  write_exr(path("part.exr"), image);
  refuse(1, {"part.exr", "attribute seconds is no float"}, {"merge", "part.exr", "--out", "m.exr"});
}

TEST_F(BadFiles, CheckpointsWhoseChannelsHaveOtherTypes) {
  const std::filesystem::path file = path("c.exr");
  Film film = make_film(2, 2, {0, 0, 2, 2}, {}, true, false);
  write_film(file, film, "settings");
  const Image good = read_exr(file);
  read_film(file, film, "settings", 4);
  for (std::size_t c = 0; c < good.channels.size(); ++c) {
    Image bad = good;
    Channel& channel = bad.channels[c];
    const bool is_float = channel.type == Pixel::Float;
    channel = is_float ? Channel{channel.name, Pixel::Uint, {}, {1, 2, 3, 4}}
                       : Channel{channel.name, Pixel::Float, {1, 2, 3, 4}, {}};
    write_exr(file, bad);
    expect_error(Failure::Work, {file.string(), "not a checkpoint", channel.name},
                 [&] { read_film(file, film, "settings", 4); });
  }
}

TEST_F(BadFiles, CheckpointsWithFiguresThatCannotBe) {
  const std::filesystem::path file = path("c.exr");
  Film film = make_film(2, 2, {0, 0, 2, 2}, {}, true, false);
  film.samples = 4;
  write_film(file, film, "settings");
  const Image good = read_exr(file);
  const auto refuse_film = [&](const Image& image, std::initializer_list<std::string_view> parts) {
    write_exr(file, image);
    expect_error(Failure::Work, parts, [&] { read_film(file, film, "settings", 4); });
  };
  for (const int samples : {-1, 5, 0x7FFFFFFF}) {
    Image bad = good;
    bad.attributes["film_samples"] = samples;
    refuse_film(bad, {"c.exr", "this checkpoint has " + std::to_string(samples) + " samples; expected 0 to 4"});
  }
  Image wide = good;
  wide.width = 4, wide.height = 1;
  refuse_film(wide, {"c.exr: this checkpoint has 4 x 1 pixels; expected 2 x 2"});
  for (std::size_t c = 0; c < good.channels.size(); ++c) {
    if (good.channels[c].type != Pixel::Float) continue;
    Image bad = good;
    bad.channels[c].floats[3] = std::numeric_limits<float>::quiet_NaN();
    refuse_film(bad, {"this checkpoint is damaged: channel " + good.channels[c].name + " of pixel 3 is no number"});
  }
  write_exr(file, good);
  read_film(file, film, "settings", 4);
}

TEST_F(BadFiles, PartsThatClaimManyParts) {
  Image image{.width = 1, .height = 1};
  image.channels.push_back({"Z", Pixel::Float, {1.0f}, {}});
  image.attributes = {{"part", std::string("1/4294967295")}};
  write_exr(path("part.exr"), image);
  refuse(2, {"part 0/4294967295 is missing"}, {"merge", "part.exr", "--out", "m.exr"});
}

TEST_F(BadFiles, PicturesThatClaimMoreThanThereIs) {
  Image image{.width = 2048, .height = 1024};
  for (const char* name : {"R", "G", "B"})
    image.channels.push_back({name, Pixel::Half, std::vector<float>(2 << 20), {}});
  write_exr(path("sky.exr"), image);
  refuse(1, {"sky.exr: a picture of 2048 x 1024 pixels needs about 24.00 MiB", "of the limit of 16.00 MiB", "--memory"},
         {"merge", "sky.exr", "--out", "m.exr", "--memory", "16M"});
  refuse(2, {"--memory lots: expected a size"}, {"merge", "sky.exr", "--out", "m.exr", "--memory", "lots"});
}

TEST_F(BadFiles, DamagedPicturesAreDescribedInPlainWords) {
  Image image{.width = 8, .height = 8};
  for (const char* name : {"R", "G", "B"}) image.channels.push_back({name, Pixel::Half, std::vector<float>(64), {}});
  write_exr(path("whole.exr"), image);
  const std::string whole = read("whole.exr");
  for (std::size_t bytes = 0; bytes < whole.size(); bytes += 97) {
    write("cut.exr", whole.substr(0, bytes));
    refuse(1, {"cannot read cut.exr: "}, {"merge", "cut.exr", "--out", "m.exr"});
  }
}

}  // namespace
}  // namespace ballot::test
