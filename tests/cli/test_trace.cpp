// Tests of `ballot trace`, which reads rays from a NumPy file and writes their hits to another.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "engine/answer/knobs.h"
#include "engine/answer/numeric.h"
#include "engine/core/file.h"
#include "engine/files/npy.h"
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

class Trace : public Cli {
 protected:
  void SetUp() override { square(); }

  void expect_square_hits(const std::vector<Ray>& rays, bool any = false) const {
    const auto found = hits();
    ASSERT_EQ(found.size(), rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
      SCOPED_TRACE(i);
      EXPECT_EQ(found[i].prim != NO_HIT, hits_square(rays[i]));
      if (!hits_square(rays[i])) {
        EXPECT_EQ(found[i].t, std::numeric_limits<float>::infinity());
        EXPECT_EQ(found[i].u, 0);
        EXPECT_EQ(found[i].v, 0);
        continue;
      }
      EXPECT_NEAR(found[i].t, 4, 1e-5);  // t: a distance of 2 along a direction of length 1/2
      EXPECT_TRUE(any || found[i].prim == (rays[i].origin.y > rays[i].origin.x ? 1u : 0u));
    }
  }
};

TEST_F(Trace, RoundTrip) {
  rays(1000);
  const Result result = succeed(
      {"trace", "square.glb", "-v", "--rays", "rays.npy", "--out", "hits.npy", "--validate", "--json", "trace.json"});
  expect_parts(result.out, {"hits.npy: 1000 rays", "Mrays/s", ".nearest.watertight", "auto: "});
  expect_square_hits(square_rays(1000));
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(files(), (std::set<std::string>{"square.glb", "rays.npy", "hits.npy", "trace.json"}));
}

TEST_F(Trace, JsonHasTheContractsNames) {
  rays();
  succeed({"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy", "--any", "--method", "packet", "--knob",
           "vote=sum", "--json", "trace.json"});
  const auto all = json("trace.json");
  for (const char* field : {"device", "driver", "subgroup_size", "commit", "command", "scenes", "records"})
    EXPECT_TRUE(all.contains(field)) << field;
  ASSERT_EQ(all["records"].size(), 1u);
  const auto record = all["records"][0];
  for (const char* field :
       {"scene", "rays", "any", "method", "knobs", "numeric", "ray_count", "mrays_per_s", "trace_ms"})
    EXPECT_TRUE(record.contains(field)) << field;
  EXPECT_EQ(record["scene"], "square");
  EXPECT_EQ(record["rays"], "rays.npy");
  EXPECT_EQ(record["any"], true);
  EXPECT_EQ(record["method"], "packet");
  EXPECT_EQ(record["knobs"], (nlohmann::json{{"vote", "sum"}}));
  EXPECT_EQ(record["ray_count"], 64);
}

// Every method, for one vote and for nearest or any hit; every vote; and every mode with the default method.
TEST_F(Trace, EveryMethodModeAndVoteNearestAndAny) {
  const auto expected = square_rays(64);
  rays(64);
  for (const Method& method : kMethods)
    for (const NumericMode& mode : kNumericModes)
      for (const Vote vote : {Vote::Any, Vote::Count, Vote::Sum})
        for (const bool any : {false, true}) {
          if (method.packet() ? !method.takes(vote) : vote != Vote::Any) continue;
          if (mode.name != kDefaultNumeric && method.name != kDefaultMethod) continue;
          const bool whole = method.chooses || &method == kMethods;  // the default and a packet, in every way
          const bool its_turn = any == ((&method - kMethods) % 2 == 1) && (!method.packet() || vote == Vote::Count);
          if (!whole && !its_turn) continue;
          SCOPED_TRACE(fmt::format("{} {} {} {}", method.name, mode.name, vote_name(vote), any ? "any" : "nearest"));
          Words args{"trace", "square.glb", "-v", "--rays", "rays.npy", "--out", "hits.npy", "--validate"};
          for (const std::string_view word :
               {std::string_view("--method"), method.name, std::string_view("--numeric"), mode.name})
            args.emplace_back(word);
          if (method.packet())
            args.insert(args.end(), {std::string("--knob"), fmt::format("vote={}", vote_name(vote))});
          if (any) args.push_back("--any");
          const Result result = succeed(args);
          const std::string runs(method.chooses ? "" : method.name);
          expect_parts(result.out, {runs + (any ? ".any." : ".nearest.") + std::string(mode.name)});
          expect_square_hits(expected, any);
        }
}

TEST_F(Trace, KnobsReachTheKernel) {
  rays();
  const Words args{"trace", "square.glb", "-v", "--rays", "rays.npy", "--out", "hits.npy", "--validate", "--knob"};
  for (const char* knob :
       {"fetch=storage", "fetch=texel", "layout=paper", "stack=private", "stack=shared", "launch=persistent"}) {
    Words with = args;
    with.push_back(knob);
    expect_parts(succeed(with).out, {knob});
    expect_square_hits(square_rays(64));
  }
  Words two = args;
  for (const char* word : {"launch=persistent", "--knob", "batches=3", "--knob", "workgroup=128"}) two.push_back(word);
  expect_parts(succeed(two).out, {"launch=persistent workgroup=128 batches=3"});
  expect_square_hits(square_rays(64));
}

TEST_F(Trace, DeviceByIndexAndCpu) {
  rays();
  succeed({"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy", "--device", "0"});
  expect_square_hits(square_rays(64));
}

TEST_F(Trace, NoRays) {
  rays(0);
  const Result result =
      succeed({"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy", "--validate", "--json", "t.json"});
  expect_parts(result.out, {"0 rays, 0 hits"});
  EXPECT_TRUE(hits().empty());
  EXPECT_EQ(json("t.json")["records"][0]["ray_count"], 0);
}

TEST_F(Trace, AnEmptySceneIsMissed) {
  empty();
  rays(100);
  for (const char* method : {"packet", "if-if", "while-while"}) {
    succeed({"trace", "empty.glb", "--rays", "rays.npy", "--out", "hits.npy", "--validate", "--method", method});
    for (const Hit& h : hits()) EXPECT_EQ(h.prim, NO_HIT);
  }
}

TEST_F(Trace, DeadRaysAreCounted) {
  std::vector<Ray> some = square_rays(6);
  some[1].origin.y = std::numeric_limits<float>::quiet_NaN();
  some[2].dir = glm::vec3(0);
  some[3].dir = glm::vec3(1e-40f, 0, -1e-39f);
  some[4].t_min = std::numeric_limits<float>::infinity();
  some[5].t_max = some[5].t_min;  // an empty range is meant: no warning
  write_rays(path("rays.npy"), some);
  for (const char* want : {"--any", "--count"}) {
    const Result result = succeed({"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy", want});
    EXPECT_EQ(result.err,
              "ballot: rays.npy: 2 of 6 rays have a component that is NaN or infinite; they are misses\n"
              "ballot: rays.npy: 2 of 6 rays have no direction: each component is zero or denormal; they are misses\n");
  }
}

TEST_F(Trace, TheDefaultOutputIsALine) {
  rays();
  const Result result = succeed({"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy"});
  EXPECT_EQ(std::ranges::count(result.out, '\n'), 1) << result.out;
}

TEST_F(Trace, AnInfiniteEndIsNoBound) {
  std::vector<Ray> some = square_rays(4);
  some[1].t_max = std::numeric_limits<float>::infinity();
  some[2].t_min = std::numeric_limits<float>::infinity();
  write_rays(path("rays.npy"), some);
  succeed({"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy", "--validate"});
  EXPECT_EQ(hits()[1].prim, hits()[0].prim);
  EXPECT_EQ(hits()[2].prim, NO_HIT);
}

TEST_F(Trace, SeveralFilesAndPartsOfOne) {
  rays(1000);
  write_rays(path("few.npy"), square_rays(10));
  succeed({"trace", "square.glb", "--rays", "rays.npy", "few.npy", "--out", "hits.npy", "few_hits.npy"});
  const auto whole = hits();
  EXPECT_EQ(hits("few_hits.npy").size(), 10u);
  std::vector<Hit> joined;
  for (const char* part : {"0/3", "1/3", "2/3"}) {
    succeed({"trace", "square.glb", "--rays", "rays.npy", "--out", "part.npy", "--part", part});
    for (const Hit& h : hits("part.npy")) joined.push_back(h);
  }
  ASSERT_EQ(joined.size(), whole.size());
  EXPECT_EQ(std::memcmp(joined.data(), whole.data(), whole.size() * sizeof(Hit)), 0);
  refuse(2, {"--part", "3/3"}, {"trace", "square.glb", "--rays", "rays.npy", "--out", "x.npy", "--part", "3/3"});
  refuse(2, {"--rays", "--out"}, {"trace", "square.glb", "--rays", "rays.npy", "few.npy", "--out", "x.npy"});
  refuse(2, {"--out", "twice"}, {"trace", "square.glb", "--rays", "rays.npy", "few.npy", "--out", "x.npy", "x.npy"});
}

TEST_F(Trace, StandardInputAndOutput) {
  rays(1000);
  succeed({"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy"});
  const std::string command = std::string(BALLOT_BINARY) + " trace " + path("square.glb").string() +
                              " --rays - --out - < " + path("rays.npy").string() + " > " + path("piped.npy").string() +
                              " 2> " + path("text").string();
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(read_file(path("piped.npy")), read_file(path("hits.npy")));
  EXPECT_NE(read_file(path("text")).size(), 0u);
  const std::string cut = "head -c 5000 " + path("rays.npy").string() + " | " + BALLOT_BINARY + " trace " +
                          path("square.glb").string() + " --rays - --out " + path("cut.npy").string() + " 2> " +
                          path("text").string();
  EXPECT_NE(std::system(cut.c_str()), 0);
  EXPECT_FALSE(std::filesystem::exists(path("cut.npy")));
}

TEST_F(Trace, OutputMayNotReplaceInput) {
  rays();
  const std::string before = read("rays.npy");
  refuse(2, {"--out rays.npy: it is the file that --rays reads"},
         {"trace", "square.glb", "--rays", "rays.npy", "--out", "rays.npy"});
  EXPECT_EQ(read("rays.npy"), before);
}

TEST_F(Trace, BadRayFiles) {
  const Words args{"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy"};
  refuse(1, {"rays.npy", "No such file"}, args);
  write("rays.npy", "");
  refuse(1, {"rays.npy"}, args);
  write("rays.npy", "ox oy oz\n1 2 3\n");
  refuse(1, {"rays.npy"}, args);
  rays();
  const std::string good = read("rays.npy");
  write("rays.npy", good.substr(0, good.size() - 7));
  refuse(1, {"rays.npy"}, args);
  write("rays.npy", good.substr(0, 40));
  refuse(1, {"rays.npy"}, args);
  std::string bad = good;
  bad.replace(bad.find("<f4"), 3, "<i4");
  write("rays.npy", bad);
  refuse(1, {"rays.npy", "<i4", "float32", "(n, 8)"}, args);
  write_triangles(path("rays.npy"), UnsetVector<Triangle>(2, Triangle{}));
  refuse(1, {"rays.npy", "(2, 3, 3)", "(n, 8)"}, args);
  write_hits(path("rays.npy"), std::vector<Hit>(2));
  refuse(1, {"rays.npy", "prim"}, args);
}

// The range that the manual states for mode watertight: an origin 2^20 diagonals of the scene away. From there every
// ray that is aimed at the middle of a closed mesh hits it.
TEST_F(Trace, FromTheEndOfTheRangeNoRaySlipsThrough) {
  write("closed.obj",
        "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\nf 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\n"
        "f 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n");
  const double distance = 0x1p20 * 2 * std::sqrt(3.0);
  std::vector<Ray> rays;
  for (int i = 0; i < 1000; ++i) {
    const double z = (i + 0.5) / 500 - 1, r = std::sqrt(1 - z * z), angle = 2.399963 * i;
    const glm::vec3 away(r * std::cos(angle), r * std::sin(angle), z);
    rays.push_back({float(distance) * away, 0, -away, std::numeric_limits<float>::max()});
  }
  write_rays(path("far.npy"), rays);
  succeed({"trace", "closed.obj", "--rays", "far.npy", "--out", "hits.npy"});
  for (const Hit& hit : hits()) EXPECT_NE(hit.prim, NO_HIT);
}

TEST_F(Trace, BadOutputs) {
  rays();
  std::filesystem::create_directory(path("folder"));
  refuse(1, {"nowhere/h.npy", "no folder nowhere"},
         {"trace", "square.glb", "--rays", "rays.npy", "--out", "nowhere/h.npy"});
  refuse(1, {"folder", "it is a folder"}, {"trace", "square.glb", "--rays", "rays.npy", "--out", "folder"});
  refuse(1, {"the name is empty"}, {"trace", "square.glb", "--rays", "rays.npy", "--out", ""});
  refuse(1, {"nowhere/t.json"},
         {"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy", "--json", "nowhere/t.json"});
}

TEST_F(Trace, AFailureLeavesTheOldOutput) {
  write("rays.npy", "nonsense");
  write("hits.npy", "precious");
  refuse(1, {"rays.npy"}, {"trace", "square.glb", "--rays", "rays.npy", "--out", "hits.npy"});
  EXPECT_EQ(read("hits.npy"), "precious");
}

}  // namespace
}  // namespace ballot::test
