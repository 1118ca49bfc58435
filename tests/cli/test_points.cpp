// Tests of the commands that ask about points and crossings: distance, inside, check, and trace --count, --all,
// --first.
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <random>

#include "engine/core/file.h"
#include "engine/files/npy_points.h"
#include "tests/cli/cli.h"
#include "tests/cpu/gltf_builder.h"
#include "tests/cpu/shapes.h"

namespace ballot::test {
namespace {

class Points : public Cli {
 protected:
  void SetUp() override {
    // A box from 0 to 2 as OBJ.
    std::string text;
    for (int i = 0; i < 8; ++i) text += fmt::format("v {} {} {}\n", i & 1 ? 2 : 0, i & 2 ? 2 : 0, i & 4 ? 2 : 0);
    for (const char* face : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"})
      text += fmt::format("f {}\n", face);
    write("box.obj", text);
    write("open.obj", text.substr(0, text.rfind("f ")));
    write("turned.obj", text.substr(0, text.rfind("f ")) + "f 6 8 4 2\n");
  }

  /// Writes an array of masks.
  void masks(const std::string& name, const std::vector<std::uint32_t>& numbers) const {
    write_numbers(path(name), std::span<const std::uint32_t>(numbers));
  }
};

TEST_F(Points, Distances) {
  array("points.npy", {1, 1, 4, 1, 1, 1.75f, 9, 1, 1}, 3);
  const Result result = succeed({"distance", "box.obj", "--points", "points.npy", "--out", "d.npy", "--validate"});
  expect_parts(result.out, {"d.npy: 3 points, 3 with a triangle", "million points/s"});
  EXPECT_EQ(items<float>("d.npy", "'<f4'"), (std::vector<float>{2, 0.25f, 7}));
  succeed({"distance", "box.obj", "--points", "points.npy", "--out", "d.npy", "--signed"});
  EXPECT_EQ(items<float>("d.npy", "'<f4'"), (std::vector<float>{2, -0.25f, 7}));
  succeed({"distance", "box.obj", "--points", "points.npy", "--out", "d.npy", "--limit", "3"});
  EXPECT_EQ(items<float>("d.npy", "'<f4'"), (std::vector<float>{2, 0.25f, HUGE_VALF}));
  succeed({"distance", "box.obj", "--points", "points.npy", "--out", "d.npy", "--signed", "--numeric", "exact"});
  EXPECT_EQ(items<float>("d.npy", "'<f4'"), (std::vector<float>{2, -0.25f, 7}));
  refuse(2, {"numeric is 'fast'; expected watertight or exact"},
         {"inside", "box.obj", "--points", "points.npy", "--out", "e.npy", "--numeric", "fast"});
  refuse(2, {"--limit -3"}, {"distance", "box.obj", "--points", "points.npy", "--out", "e.npy", "--limit", "-3"});
}

TEST_F(Points, DistanceFields) {
  const Result result =
      succeed({"distance", "box.obj", "--grid", "7", "--signed", "--out", "f.npy", "--json", "f.json"});
  expect_parts(result.out, {"f.npy: 343 points, 343 with a triangle"});
  const auto field = items<float>("f.npy", "'shape': (7, 7, 7)");
  ASSERT_EQ(field.size(), 343u);
  EXPECT_NEAR(field[171], -1, 1e-6);                   // the middle
  EXPECT_NEAR(field[0], 0.2f * std::sqrt(3.f), 1e-6);  // a corner
  EXPECT_NEAR(field[3 + 7 * 3 + 49], -0.2f, 1e-6);     // one step inside of the lower side: the step is 0.4
  EXPECT_NEAR(json("f.json")["grid"]["step"].get<double>(), 0.4, 1e-6);
  EXPECT_EQ(json("f.json")["grid"]["side"], 7);
  succeed({"distance", "box.obj", "--grid", "7", "--signed", "--out", "f.raw"});
  EXPECT_EQ(read("f.raw").size(), 343 * sizeof(float));
  refuse(2, {"--grid 1", "2 to 4096"}, {"distance", "box.obj", "--grid", "1", "--out", "g.npy"});
  refuse(2, {"--points and --grid"}, {"distance", "box.obj", "--out", "g.npy"});
  refuse(2, {"--points and --grid"}, {"inside", "box.obj", "--out", "g.npy"});
}

TEST_F(Points, SlicesOfFields) {
  succeed({"distance", "box.obj", "--grid", "41", "--signed", "--out", "f.npy", "--slice", "z=0.5", "--png", "s.png"});
  EXPECT_EQ(read("s.png").substr(1, 3), "PNG");
  const auto refuse_slice = [&](const char* says, const Words& more) {
    Words all{"distance", "box.obj", "--out", "g.npy"};
    all.insert(all.end(), more.begin(), more.end());
    refuse(2, {says}, all);
  };
  refuse_slice("such as z=0.5", {"--grid", "7", "--slice", "w=0.5", "--png", "t.png"});
  refuse_slice("a share from 0 to 1", {"--grid", "7", "--slice", "x=1.5", "--png", "t.png"});
  refuse_slice("a share from 0 to 1", {"--grid", "7", "--slice", "x=0.5z", "--png", "t.png"});
  refuse_slice("give both", {"--grid", "7", "--slice", "x=0.5"});
  refuse_slice("give --grid", {"--points", "points.npy", "--slice", "x=0.5", "--png", "t.png"});
}

TEST_F(Points, SignsByPseudonormals) {
  array("points.npy", {1, 1, 4, 1, 1, 1.75f, 1, 1, 9}, 3);
  const Words both[] = {{}, {"--numeric", "exact"}};
  for (const char* mesh : {"box.obj", "open.obj"})
    for (const Words& mode : both) {
      Words all{"distance", mesh, "--points", "points.npy", "--out", "d.npy", "--signed", "--sign", "pseudonormal"};
      all.insert(all.end(), mode.begin(), mode.end());
      succeed(all);
      EXPECT_EQ(items<float>("d.npy", "'<f4'"), (std::vector<float>{2, -0.25f, 7})) << mesh;
    }
  refuse(2, {"--sign pseudonormal: give --signed"},
         {"distance", "box.obj", "--points", "points.npy", "--out", "e.npy", "--sign", "pseudonormal"});
  refuse(2, {"sign is 'normal'; expected parity, pseudonormal or winding"},
         {"distance", "box.obj", "--points", "points.npy", "--out", "e.npy", "--signed", "--sign", "normal"});
  const Words turned{"distance", "turned.obj", "--points", "points.npy",  "--out",
                     "e.npy",    "--signed",   "--sign",   "pseudonormal"};
  refuse(2, {"turned.obj: triangles are wound against each other: at 4 of the 18 edges", "ballot check turned.obj"},
         turned);
}

TEST_F(Points, BenchAndVerifyKnowQueries) {
  const Words run{"box.obj", "--queries", "all",      "--numeric", "all",    "--rays", "primary",
                  "--size",  "16x16",     "--repeat", "1",         "--json", "q.json"};
  Words bench{"bench"}, verify{"verify"};
  bench.insert(bench.end(), run.begin(), run.end());
  verify.insert(verify.end(), run.begin(), run.end());
  expect_parts(succeed(bench).out, {"nearest hit", "count", "list", "first", "nearest", "inside", "side",
                                    "random points", "surface", "M/s"});
  EXPECT_TRUE(json("q.json")["records"][1]["checked"].is_null());
  expect_parts(succeed(verify).out, {"wrong", "beyond the bound", "exact: ", "answers judged, 0 differ"});
  const auto document = json("q.json");
  for (const auto& record : document["records"]) {
    if (record["query"] == "nearest hit") continue;
    EXPECT_GT(record["checked"], 200);
    EXPECT_EQ(record["beyond"], 0);
    if (record["numeric"] == "exact") {
      EXPECT_EQ(record["wrong"], 0);
    }
  }
  refuse(2, {"'nearby' is none of count, list, first, nearest, inside, side, all"},
         {"bench", "box.obj", "--queries", "nearby"});
  refuse(2, {"--numeric plain", "watertight, exact"}, {"bench", "box.obj", "--queries", "count", "--numeric", "plain"});
}

TEST_F(Points, Inside) {
  array("points.npy", {1, 1, 4, 1, 1, 1.75f, NAN, 1, 1}, 3);
  const Result result = succeed({"inside", "box.obj", "--points", "points.npy", "--out", "i.npy"});
  expect_parts(result.out, {"i.npy: 3 points, 1 inside"});
  EXPECT_EQ(items<char>("i.npy", "'|b1'"), (std::vector<char>{0, 1, 0}));
  for (const Words& words : {Words{"inside"}, Words{"distance", "--signed"}}) {
    Words all = words;
    all.insert(all.begin() + 1, {"open.obj", "--points", "points.npy", "--out", "o.npy"});
    refuse(2,
           {"open.obj: the mesh is not closed: 4 of its 17 edges", "ballot check open.obj", "--sign pseudonormal",
            "--assume-closed"},
           all);
    all.push_back("--assume-closed");
    succeed(all);
    std::filesystem::remove(path("o.npy"));
  }
}

TEST_F(Points, WrongPoints) {
  array("rays.npy", {1, 1, 4, 1, 1, 1}, 6);
  refuse(1, {"rays.npy", "expected points of shape (n, 3)"},
         {"distance", "box.obj", "--points", "rays.npy", "--out", "d.npy"});
  refuse(1, {"missing.npy"}, {"inside", "box.obj", "--points", "missing.npy", "--out", "i.npy"});
  refuse(2, {"--out"}, {"inside", "box.obj", "--points", "rays.npy"});
}

TEST_F(Points, Crossings) {
  array("rays.npy", {1, 1, 9, 0, 0, -1, 1, 0.5f, 1, 0, 0, -1, 9, 9, 9, 1, 0, 0}, 6);
  const Result result = succeed({"trace", "box.obj", "--rays", "rays.npy", "--out", "n.npy", "--count"});
  expect_parts(result.out, {"n.npy: 3 rays, 3 crossings"});
  EXPECT_EQ(items<std::uint32_t>("n.npy", "'<u4'"), (std::vector<std::uint32_t>{2, 1, 0}));
  struct Record {
    std::uint32_t ray;
    Hit hit;
  };
  succeed({"trace", "box.obj", "--rays", "rays.npy", "--out", "h.npy", "--all", "--validate"});
  const auto all = items<Record>("h.npy", "[('ray', '<u4'), ('t', '<f4'), ('prim', '<u4')");
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].hit.t, 7);
  EXPECT_EQ(all[1].hit.t, 9);
  EXPECT_EQ(all[2].ray, 1u);
  EXPECT_EQ(all[2].hit.t, 1);
  succeed({"trace", "box.obj", "--rays", "rays.npy", "--out", "h.npy", "--first", "1"});
  EXPECT_EQ(items<Record>("h.npy", "'ray'").size(), 2u);
  succeed({"trace", "box.obj", "--rays", "rays.npy", "--out", "h.npy", "--last", "2"});
  const auto last = items<Record>("h.npy", "'ray'");
  ASSERT_EQ(last.size(), 3u);
  EXPECT_EQ(std::vector({last[0].hit.t, last[1].hit.t, last[2].hit.t}), std::vector({9.f, 7.f, 1.f}));
  EXPECT_EQ(last[2].ray, 1u);
  refuse(2, {"last crossings: found 17", "1 to 16"},
         {"trace", "box.obj", "--rays", "rays.npy", "--out", "x.npy", "--last", "17"});
  refuse(2, {"give one of them"}, {"trace", "box.obj", "--rays", "rays.npy", "--out", "x.npy", "--last", "2", "--any"});
  refuse(2, {"--first"}, {"trace", "box.obj", "--rays", "rays.npy", "--out", "h.npy", "--first", "0"});
  refuse(2, {"give one of them"}, {"trace", "box.obj", "--rays", "rays.npy", "--out", "x.npy", "--all", "--any"});
  succeed(
      {"trace", "box.obj", "--rays", "rays.npy", "--out", "n.npy", "--count", "--numeric", "exact", "--cull", "back"});
  EXPECT_EQ(items<std::uint32_t>("n.npy", "'<u4'"), (std::vector<std::uint32_t>{1, 0, 0}));
  masks("m.npy", {1, 1, 2, 2, 4, 4, 8, 8, 16, 16, 32, 32});
  masks("r.npy", {2, 3, 1});
  succeed({"trace", "box.obj", "--rays", "rays.npy", "--out", "n.npy", "--count", "--masks", "m.npy", "--ray-masks",
           "r.npy"});
  EXPECT_EQ(items<std::uint32_t>("n.npy", "'<u4'"), (std::vector<std::uint32_t>{1, 1, 0}));
  refuse(2, {"--masks r.npy: found 3 masks; expected one for each of the 12 triangles"},
         {"trace", "box.obj", "--rays", "rays.npy", "--out", "x.npy", "--count", "--masks", "r.npy"});
  refuse(2, {"found 12 masks; expected one for each of the 3 rays"},
         {"trace", "box.obj", "--rays", "rays.npy", "--out", "x.npy", "--count", "--ray-masks", "m.npy"});
  refuse(1, {"rays.npy", "expected masks, uint32"},
         {"trace", "box.obj", "--rays", "rays.npy", "--out", "x.npy", "--count", "--masks", "rays.npy"});
  succeed({"trace", "box.obj", "--rays", "rays.npy", "--out", "h.npy", "--cull", "front"});  // nearest hits
  const auto hits = items<Hit>("h.npy", "[('t', '<f4'), ('prim', '<u4')");
  ASSERT_EQ(hits.size(), 3u);
  EXPECT_EQ(hits[0].t, 9);
  EXPECT_EQ(hits[1].t, 1);
  EXPECT_EQ(hits[2].prim, NO_HIT);
  refuse(2, {"cull is 'no'; expected none, back or front"},
         {"trace", "box.obj", "--rays", "rays.npy", "--out", "x.npy", "--cull", "no"});
  refuse(2, {"leave --method"},
         {"trace", "box.obj", "--rays", "rays.npy", "--out", "x.npy", "--count", "--method", "packet"});
}

// A closed box that a file uses three times, turned, stretched and mirrored: kept once, it is as its copies are.
TEST_F(Points, OfMeshesThatAreKeptOnce) {
  GltfBuilder b;
  std::vector<float> at;
  for (const Triangle& t : shapes::box({0, 0, 0}, {2, 1, 1}))
    for (const glm::vec3& v : t) at.insert(at.end(), {v.x, v.y, v.z});
  b.mesh(b.vec3(at));
  b.node({{"mesh", 0}});
  b.node({{"mesh", 0}, {"translation", {4, 0, 0}}, {"scale", {-1, 2, 0.5}}});
  b.node({{"mesh", 0}, {"translation", {0, 5, 0}}, {"rotation", {0, 0, 0.6, 0.8}}});
  write("boxes.glb", b.glb());
  array("points.npy", {1, 0.75f, 0.5f, 3, 1.5f, 0.25f, 0, 6, 0.5f, 9, 9, 9, -1, -1, -1}, 3);
  for (const char* policy : {"keep", "copy"}) {
    const std::string out = std::string(policy) + ".npy";
    for (const char* sign : {"parity", "pseudonormal"}) {
      const Result result = succeed({"distance", "boxes.glb", "--instances", policy, "--points", "points.npy",
                                     "--signed", "--sign", sign, "--out", sign + out});
      EXPECT_NE(result.out.find("5 with a triangle"), std::string::npos);
    }
    succeed({"inside", "boxes.glb", "--instances", policy, "--points", "points.npy", "--out", "i" + out});
    succeed({"distance", "boxes.glb", "--instances", policy, "--grid", "9", "--out", "g" + out, "--numeric", "exact"});
  }
  EXPECT_EQ(read("ikeep.npy"), read("icopy.npy"));
  for (const char* what : {"parity", "pseudonormal", "g"}) {
    const auto kept = items<float>(std::string(what) + "keep.npy", "'<f4'"),
               copied = items<float>(std::string(what) + "copy.npy", "'<f4'");
    ASSERT_EQ(kept.size(), copied.size());
    for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_NEAR(kept[i], copied[i], 2e-6f) << what << i;
    if (*what != 'g') {
      EXPECT_TRUE(kept[0] == -0.25f && kept[1] == -0.25f && kept[2] < 0 && kept[3] > 0 && kept[4] > 0);
    }
  }
  expect_parts(succeed({"verify", "boxes.glb", "--instances", "keep", "--queries", "all", "--size", "16x16"}).out,
               {"exact: ", "0 differ from the exact ones"});
}

// Half a box of glTF, open at x = 0, and its node mirrored: one closed box, wound alike.
TEST_F(Points, AMirroredHalfIsWoundAlike) {
  GltfBuilder b;
  std::vector<float> at;
  for (const Triangle& t : shapes::box({0, -0.5f, -0.5f}, {1, 0.5f, 0.5f}))
    if (t[0].x + t[1].x + t[2].x > 0)
      for (const glm::vec3& v : t) at.insert(at.end(), {v.x, v.y, v.z});
  b.mesh(b.vec3(at));
  b.node({{"mesh", 0}});
  b.node({{"mesh", 0}, {"scale", {-1, 1, 1}}});
  write("half.glb", b.glb());
  expect_parts(succeed({"check", "half.glb"}).out, {"20 triangles", "closed: yes", "consistently wound: yes"});
  array("points.npy", {0.5f, 0, 0, -0.5f, 0, 0, -2, 0, 0}, 3);
  for (const char* sign : {"parity", "pseudonormal"}) {
    succeed({"distance", "half.glb", "--points", "points.npy", "--signed", "--sign", sign, "--out", "d.npy"});
    EXPECT_EQ(items<float>("d.npy", "'<f4'"), (std::vector<float>{-0.5f, -0.5f, 1})) << sign;
  }
  // Kept once, each half is a mesh by itself, which is open. Its corners in the world meet those of the other.
  const Words kept{"distance",   "half.glb", "--instances", "keep", "--points",
                   "points.npy", "--signed", "--out",       "k.npy"};
  refuse(2, {"the mesh is not closed: 8 of its 34 edges", "--instances copy"}, kept);
  Words by_sides = kept;
  by_sides.insert(by_sides.end(), {"--sign", "pseudonormal"});
  succeed(by_sides);
  EXPECT_EQ(items<float>("k.npy", "'<f4'"), (std::vector<float>{-0.5f, -0.5f, 1}));
  array("rays.npy", {0.5f, 0.1f, 2, 0, 0, -1, -0.5f, 0.1f, 2, 0, 0, -1}, 6);
  struct Record {
    std::uint32_t ray;
    Hit hit;
  };
  for (const auto& [cull, t] : {std::pair("back", 1.5f), {"front", 2.5f}}) {
    succeed({"trace", "half.glb", "--rays", "rays.npy", "--out", "h.npy", "--all", "--cull", cull});
    const auto crossings = items<Record>("h.npy", "'ray'");
    ASSERT_EQ(crossings.size(), 2u) << cull;
    for (const Record& r : crossings) EXPECT_EQ(r.hit.t, t) << cull;
  }
}

// Two triangles in one place, of which one has no alpha to speak of.
TEST_F(Points, CrossingsByAlpha) {
  const std::vector<float> corners{0, 0, 0, 2, 0, 0, 0, 2, 0};
  write("veil.bin", std::string(reinterpret_cast<const char*>(corners.data()), corners.size() * sizeof(float)));
  write("veil.gltf",
        R"({"asset":{"version":"2.0"},"buffers":[{"uri":"veil.bin","byteLength":36}],
            "bufferViews":[{"buffer":0,"byteLength":36}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[2,2,0]}],
            "materials":[{"alphaMode":"MASK","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.25]}},
                         {"pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.25]}}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0},
                                     {"attributes":{"POSITION":0},"material":1}]}],
            "nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]})");
  array("rays.npy", {0.5f, 0.5f, 9, 0, 0, -1}, 6);
  const auto numbers = [&](const Words& how) {
    Words all{"trace", "veil.gltf", "--rays", "rays.npy", "--out", "n.npy", "--validate"};
    all.insert(all.end(), how.begin(), how.end());
    succeed(all);
  };
  numbers({"--count"});
  EXPECT_EQ(items<std::uint32_t>("n.npy", "'<u4'"), (std::vector<std::uint32_t>{2}));
  numbers({"--count", "--alpha"});
  EXPECT_EQ(items<std::uint32_t>("n.npy", "'<u4'"), (std::vector<std::uint32_t>{1}));
  for (const Words& how : {Words{"--all", "--alpha"}, Words{"--first", "1", "--alpha"}}) {
    numbers(how);
    const auto found = items<std::array<std::uint32_t, 5>>("n.npy", "'ray'");
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0][2], 1u);
  }
  refuse(2, {"alpha is 1 and numeric is 'exact'"},
         {"trace", "veil.gltf", "--rays", "rays.npy", "--out", "x.npy", "--count", "--alpha", "--numeric", "exact"});
  numbers({"--alpha"});
  EXPECT_EQ(items<Hit>("n.npy", "'prim'").at(0).prim, 1u);
}

TEST_F(Points, CheckOfMeshes) {
  const Result good = succeed({"check", "box.obj", "--json", "c.json"});
  expect_parts(good.out, {"12 triangles, 18 edges", "closed: yes", "manifold: yes", "consistently wound: yes"});
  EXPECT_TRUE(json("c.json")["closed"]);
  const Result bad = run({"check", "open.obj", "--picture", "open.png"});
  EXPECT_EQ(read("open.png").substr(1, 3), "PNG");
  EXPECT_EQ(bad.code, 1);
  expect_parts(bad.out, {"closed: no", "manifold: yes", "4 edges of one triangle", "(2, 0, 0)", "wrote open.png"});
  write("fin.obj", read("box.obj") + "v 1 1 -1\nv 1 1 1\nv 1 0.5 1\nf 9 10 11\n");
  const Result crossed = run({"check", "fin.obj"});
  EXPECT_EQ(crossed.code, 1);
  expect_parts(crossed.out, {"self-intersecting: yes", "triangles that pass through another", "and 12"});
  std::string fan;  // triangles of random corners in a cube, most of which pass through many others
  std::mt19937 random(1);
  for (int i = 0; i < 4000; ++i) {
    for (int k = 0; k < 3; ++k) fan += fmt::format("v {} {} {}\n", random() % 1000, random() % 1000, random() % 1000);
    fan += "f -3 -2 -1\n";
  }
  write("fan.obj", fan);
  const Result many = run({"check", "fan.obj", "--json", "f.json"});
  EXPECT_EQ(many.code, 1);
  expect_parts(many.out, {"self-intersecting: yes", "the search ended with", "at least 4000 triangles"});
  EXPECT_FALSE(json("f.json")["all_pairs"]);
  EXPECT_TRUE(json("c.json")["all_pairs"]);
}

}  // namespace
}  // namespace ballot::test
