// Tests of the commands on files of shapes other than triangles.
#include <fmt/format.h>

#include "engine/files/npy.h"
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

class ShapeFiles : public Cli {
 protected:
  static std::string bytes(const std::vector<float>& numbers) {
    return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float)};
  }
  /// Writes rows of float32.
  void array(const std::string& name, const std::vector<float>& numbers, std::size_t columns) const {
    std::string header = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}",
                                     numbers.size() / columns, columns);
    header.resize(117, ' ');
    write(name, std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + "\n" + bytes(numbers));
  }
};

TEST_F(ShapeFiles, AreTracedMeasuredAndDrawn) {
  array("balls.npy", {0, 0, 0, 1, 4, 0, 0, 0.5f}, 4);
  array("rays.npy", {0, 0, 5, 0, 0, -1, 4, 0, 5, 0, 0, -1, 9, 9, 5, 0, 0, -1}, 6);
  array("points.npy", {0, 0, 3, 0, 0, 0.75f}, 3);
  const Result info = succeed({"info", "balls.npy", "--json", "info.json"});
  expect_parts(info.out, {"scene balls: 2 spheres", "holds: spheres", "| 2 spheres |"});
  EXPECT_EQ(json("info.json")["meshes"][0]["shapes"], "spheres");
  succeed({"trace", "balls.npy", "--rays", "rays.npy", "--out", "hits.npy"});
  const std::vector<Hit> hits = read_hits(path("hits.npy"));
  ASSERT_EQ(hits.size(), 3u);
  EXPECT_EQ(hits[0].t, 4);
  EXPECT_EQ(hits[1].prim, 1u);
  EXPECT_EQ(hits[2].prim, NO_HIT);
  succeed({"distance", "balls.npy", "--points", "points.npy", "--out", "distances.npy"});
  const std::string distances = read("distances.npy");
  EXPECT_EQ(distances.substr(distances.size() - 8), bytes({2, 0.25f}));
  succeed({"render", "balls.npy", "--size", "32x32", "--shading", "ao", "--spp", "1", "--out", "balls.exr"});
  array("discs.npy", {0, 0, 0, 0, 0, 1, 1}, 7);
  refuse(1, {"discs.npy", "say which of these"}, {"info", "discs.npy"});
  refuse(2, {"discs, which have no inside"},
         {"inside", "discs.npy", "--shapes", "discs", "--points", "points.npy", "--out", "inside.npy"});
  refuse(2, {"no kind of --shapes", "cubes", "spheres"}, {"info", "discs.npy", "--shapes", "cubes"});
  for (const auto& arguments : {std::vector<std::string>{"check", "balls.npy"},
                                {"bench", "balls.npy", "--check"},
                                {"verify", "balls.npy"},
                                {"info", "balls.npy", "--triangles", "triangles.npy"}})
    refuse(2, {"scene 'balls' has spheres", "triangles alone"}, arguments);
}

TEST_F(ShapeFiles, HeightsAreTracedCheckedAndDrawn) {
  array("terrain.npy", {0, 0, 1, 0, 0, 1}, 3);
  array("rays.npy", {3, 1, 9, 0, 0, -1, 9, 9, 9, 0, 0, -1}, 6);
  const std::vector<std::string> as{"terrain.npy", "--shapes", "heights", "--spacing", "2,3"};
  const auto with = [&](const char* command, const std::vector<std::string>& more) {
    std::vector<std::string> all{command};
    all.insert(all.end(), as.begin(), as.end());
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const Result info = succeed(with("info", {"--json", "info.json"}));
  expect_parts(info.out, {"scene terrain: 4 triangles", "heights 2 x 3"});
  EXPECT_EQ(json("info.json")["meshes"][0]["shapes"], "heights");
  EXPECT_EQ(json("info.json")["meshes"][0]["columns"], 3);
  succeed(with("trace", {"--rays", "rays.npy", "--out", "hits.npy"}));
  const std::vector<Hit> hits = read_hits(path("hits.npy"));
  EXPECT_EQ(hits[0].t, 8.5f);
  EXPECT_EQ(hits[0].prim, 2u);
  EXPECT_EQ(hits[1].prim, NO_HIT);
  succeed(with("render", {"--size", "32x32", "--shading", "ao", "--spp", "1", "--out", "terrain.exr"}));
  for (const char* wrong : {"0", "1,", "-1", "1,2,3", "nan", "x"})
    refuse(2, {"--spacing", wrong, "finite numbers above 0"},
           {"info", "terrain.npy", "--shapes", "heights", std::string("--spacing=") + wrong});
  refuse(2, {"it is of heights"}, {"info", "terrain.npy", "--spacing", "2"});
}

}  // namespace
}  // namespace ballot::test
