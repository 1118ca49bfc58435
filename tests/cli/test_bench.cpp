// Tests of `ballot bench`: its measurements, its output files and the arguments that it refuses.
#include <sys/wait.h>

#include <cstdlib>

#include "engine/answer/knobs.h"
#include "engine/files/npy.h"
#include "engine/render/batch/ray_kinds.h"
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

constexpr const char* kCornell = BALLOT_SOURCE_DIR "/scenes/cornell.gltf";

class Bench : public Cli {
 protected:
  void SetUp() override { square(); }

  std::set<std::string> labels(const nlohmann::json& run, const std::string& role = "") const {
    std::set<std::string> all;
    for (const auto& record : run["records"])
      if (role.empty() || record["role"] == role) all.insert(record["label"]);
    return all;
  }
  nlohmann::json bench(const Words& more) const {
    Words args{"bench", "square.glb", "--size", "16x16", "--repeat", "2", "--json", "bench.json"};
    args.insert(args.end(), more.begin(), more.end());
    succeed(args);
    return json("bench.json");
  }
};

TEST_F(Bench, BuildersAreMeasured) {
  const Result run = succeed({"bench", kCornell, "--builders", "fast,balanced", "--rays", "primary,ao", "--methods",
                              "while-while", "--size", "32x32", "--repeat", "1", "--json", "b.json"});
  expect_parts(run.out, {"cornell: 4438 triangles", "| fast ", "| balanced ", "ao Mrays/s"});
  expect_parts(report("tables b.json"), {"pays from rays"});
  const nlohmann::json records = json("b.json")["records"];
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[1]["builder"], "balanced");
  EXPECT_GT(records[1]["mrays_per_s"]["ao"], 0.0);
  EXPECT_GT(records[0]["build_s"][0], 0.0);
  refuse(2, {"--builders auto", "other than auto"}, {"bench", "square.glb", "--builders", "auto"});
  refuse(2, {"no BVH builder is called 'slow'"}, {"bench", "square.glb", "--builders", "slow"});
}

TEST_F(Bench, CornellIsMeasuredCheckedReportedAndComparedWithItself) {
  const Result result =
      succeed({"bench", kCornell, "--size", "64x64", "--repeat", "2", "--methods", "packet,while-while,cut", "--check",
               "--counters", "--sweep", "--views", "view0,view1", "--json", "bench.json"});
  expect_parts(result.out, {"cornell, primary", "cornell, secondary", "packet(any)", "watertight", "of best"});
  const auto run = json("bench.json");
  EXPECT_EQ(run["size"], (nlohmann::json{64, 64}));
  EXPECT_EQ(run["repeats"], 2);
  EXPECT_EQ(run["partial"], false);
  EXPECT_EQ(run["scenes"][0]["name"], "cornell");
  expect_parts(run["command"].get<std::string>(), {" bench ", "cornell.gltf", "--size 64x64"});
  EXPECT_EQ(labels(run, "method"),
            (std::set<std::string>{"packet(any)", "packet(count)", "packet(sum)", "while-while", "cut", "cut(sum)"}));
  EXPECT_EQ(labels(run, "best"), (std::set<std::string>{"cut(best)", "cut(best,sum)"}));
  for (const auto& record : run["records"]) {
    SCOPED_TRACE(record["label"]);
    EXPECT_GT(record["trace_ms"]["median"], 0);
    EXPECT_EQ(record.contains("frame_ms"), record["role"] != "sweep");
    if (record["role"] == "sweep") continue;
    EXPECT_EQ(record["trace_ms"]["samples"].size(), 2u);
    EXPECT_EQ(record["check"]["rays"], record["ray_count"]);
    EXPECT_EQ(record["check"]["unwritten"], 0);
    EXPECT_GT(record["counters"]["nodes"], 0);
    EXPECT_LE(record["counters"]["nodes_needed"], record["counters"]["nodes"]);
  }
  expect_parts(report("tables bench.json"),
               {"## Speed", "(over the best), primary", "speed by vote", "Mrays/s by f", "counters", ", 0 errors"});
  expect_parts(report("compare bench.json bench.json"),
               {"cornell, primary, watertight, packet(any)", "too few samples"});
}

TEST_F(Bench, SecondaryRaysAreTwiceThePrimaryHits) {
  const auto run = bench({"--methods", "while-while", "--views", "front"});
  ASSERT_EQ(run["records"].size(), 2u);
  EXPECT_EQ(run["records"][0]["ray_count"], 256);
  EXPECT_EQ(run["records"][1]["rays"], "secondary");
  EXPECT_EQ(run["records"][1]["ray_count"].get<int>() % 2, 0);
}

TEST_F(Bench, AllMethodsAndVotesAllRayKinds) {
  const auto run = bench({"--rays", "all", "--views", "front"});
  std::set<std::string> methods, kinds;
  for (const auto& record : run["records"]) {
    methods.insert(record["method"]);
    kinds.insert(record["rays"]);
  }
  EXPECT_EQ(methods.size(), std::size(kMethods));
  EXPECT_EQ(kinds.size(), std::size(kRayKinds));
  for (const char* label :
       {"packet(any)", "packet(count)", "packet(sum)", "stack-max(11)", "stack-max(7)", "cut", "cut(sum)", "if-if"})
    EXPECT_TRUE(labels(run).contains(label)) << label;
}

TEST_F(Bench, ItemsMayCarryKnobs) {
  const auto run = bench({"--methods", "packet:vote=sum,stack-max:k=3:vote=any,cut:f=0.50:vote=count,if-if", "--knob",
                          "workgroup=128", "--rays", "primary"});
  EXPECT_EQ(labels(run), (std::set<std::string>{"packet(sum,workgroup=128)", "stack-max(3,workgroup=128)",
                                                "cut(workgroup=128)", "if-if(workgroup=128)"}));
  EXPECT_EQ(run["records"][0]["workgroup"], 128);
}

TEST_F(Bench, ForeignRaysNearestAndAny) {
  rays(100);
  const auto run = bench({"--methods", "packet:vote=any", "--rays", "rays.npy,rays.npy:any"});
  ASSERT_EQ(run["records"].size(), 2u);
  for (const auto& record : run["records"]) {
    EXPECT_EQ(record["rays"], "rays.npy");
    EXPECT_EQ(record["ray_count"], 100);
    EXPECT_FALSE(record.contains("frame_ms"));
  }
  EXPECT_NE(run["records"][0]["any"], run["records"][1]["any"]);
}

TEST_F(Bench, FilesOfOneNameAreViewsOfOneSet) {
  rays(100);
  std::filesystem::copy_file(path("rays.npy"), path("more.npy"));
  const auto run = bench({"--methods", "if-if", "--rays", "mine=rays.npy,mine=more.npy"});
  ASSERT_EQ(run["records"].size(), 2u);
  std::set<std::string> views;
  for (const auto& record : run["records"]) {
    EXPECT_EQ(record["rays"], "mine");
    views.insert(record["view"]);
  }
  EXPECT_EQ(views, (std::set<std::string>{"rays", "more"}));
  views.clear();
  std::filesystem::create_directories(path("out/k=3"));
  std::filesystem::copy_file(path("rays.npy"), path("out/k=3/rays.npy"));
  const auto more = bench({"--methods", "if-if", "--rays", "rays.npy,out/k=3/rays.npy,more=more.npy"});
  for (const auto& record : more["records"])
    views.insert(record["rays"].get<std::string>() + " " + record["view"].get<std::string>());
  EXPECT_EQ(views, (std::set<std::string>{"rays.npy rays.npy", "rays.npy out/k=3/rays.npy", "more "}));
  const Words words{"bench", "square.glb", "--rays"};
  for (const char* bad : {"mine=rays.npy,mine=./rays.npy", "ao=rays.npy"}) {
    Words args = words;
    args.push_back(bad);
    refuse(2, {"--rays"}, args);
  }
}

TEST_F(Bench, NumericModesSideBySide) {
  const auto run = bench({"--methods", "if-if", "--numeric", "plain,watertight", "--rays", "primary"});
  std::set<std::string> modes;
  for (const auto& record : run["records"]) modes.insert(record["numeric"]);
  EXPECT_EQ(modes, (std::set<std::string>{"plain", "watertight"}));
}

TEST_F(Bench, ViewsWithoutRaysAreLeftOutAndNoneIsAnError) {
  empty();
  const Words args{"bench", "empty.glb", "--size", "16x16", "--repeat", "1", "--methods", "if-if", "--rays"};
  Words primary = args, shadow = args;
  primary.push_back("primary");
  shadow.push_back("shadow");
  succeed(primary);
  const Result result = run(shadow);
  EXPECT_EQ(result.code, 1);
  expect_parts(result.err,
               {"view front of empty starts no shadow rays and is left out",
                "empty: no view starts shadow rays, expected a hit in some view", "ballot: nothing was measured"});
}

TEST_F(Bench, SceneWithoutRaysOfAKindLosesNothingElse) {
  empty();
  const Result result = run({"bench", "empty.glb", "square.glb", "--size", "16x16", "--repeat", "1", "--methods",
                             "if-if", "--views", "front", "--rays", "shadow,primary", "--json", "bench.json"});
  EXPECT_EQ(result.code, 1);
  expect_parts(result.err, {"ballot: note: empty: no view starts shadow rays",
                            "ballot: 1 pairs of scene and ray kind have no rays (above)"});
  const auto bench = json("bench.json");
  EXPECT_EQ(bench["partial"], false);
  std::set<std::string> measured;
  for (const auto& record : bench["records"])
    measured.insert(record["scene"].get<std::string>() + " " + record["rays"].get<std::string>());
  EXPECT_EQ(measured, (std::set<std::string>{"empty primary", "square primary", "square shadow"}));
}

TEST_F(Bench, KnobsGoToTheMethodsThatTheyConcern) {
  const auto run =
      bench({"--methods", "all", "--rays", "primary", "--views", "front", "--knob", "list=8", "--knob", "vote=any"});
  for (const char* label : {"packet(any)", "stack-max(11)", "split-count(8)", "if-if", "cut(list=8)", "cut(sum,list=8)",
                            "alternate", "while-while"})
    EXPECT_TRUE(labels(run).contains(label)) << label;
  EXPECT_FALSE(labels(run).contains("packet(count)"));
  refuse(2, {"knob list=8: it concerns none"}, {"bench", "square.glb", "--methods", "packet", "--knob", "list=8"});
  refuse(2, {"knob vote=any: it concerns none"}, {"bench", "square.glb", "--methods", "cut", "--knob", "vote=any"});
}

TEST_F(Bench, AoRaysAndRadius) {
  const Words words{"--methods", "if-if", "--rays", "ao", "--views", "front"};
  const auto standard = bench(words);
  Words few = words;
  for (const char* word : {"--ao-rays", "2", "--ao-radius", "0.25"}) few.emplace_back(word);
  const auto given = bench(few);
  EXPECT_EQ(standard["ao_rays"], 8);
  EXPECT_EQ(standard["ao_radius"], 0.05);
  EXPECT_EQ(standard["offset"], "bounded");
  EXPECT_EQ(given["ao_rays"], 2);
  EXPECT_EQ(given["ao_radius"], 0.25);
  EXPECT_EQ(4 * given["records"][0]["ray_count"].get<int>(), standard["records"][0]["ray_count"].get<int>());
  refuse(2, {"65"}, {"bench", "square.glb", "--ao-rays", "65"});
  refuse(2, {"radius"}, {"bench", "square.glb", "--ao-radius", "0"});
}

TEST_F(Bench, OffsetPolicies) {
  const auto run = bench({"--methods", "if-if", "--rays", "ao", "--views", "front", "--offset", "ulp"});
  EXPECT_EQ(run["offset"], "ulp");
  refuse(2, {"no offset policy is called 'none'; there are: constant, ulp, pbrt, proved, bounded"},
         {"bench", "square.glb", "--offset", "none"});
}

TEST_F(Bench, EnvironmentIsRecorded) {
  const Words args{"bench",     "square.glb", "--size", "16x16",   "--repeat", "1",
                   "--methods", "if-if",      "--rays", "primary", "--json",   "bench.json"};
  succeed(args, {{"LP_NATIVE_VECTOR_WIDTH", "128"}});
  EXPECT_EQ(json("bench.json")["environment"]["LP_NATIVE_VECTOR_WIDTH"], "128");
}

TEST_F(Bench, LargeThresholdsParseBack) {
  const auto run = bench({"--methods", "split-count:n=1000000:vote=count", "--rays", "primary", "--views", "front"});
  EXPECT_EQ(labels(run), (std::set<std::string>{"split-count(1000000,count)"}));
  EXPECT_EQ(run["records"][0]["threshold"]["value"], 1000000);
}

TEST_F(Bench, AnInterruptedRunKeepsWhatItMeasured) {
  const std::string command =
      "cd '" + path("").string() + "' && XDG_CACHE_HOME='" + path("cache").string() +
      "' timeout --foreground --preserve-status --signal=INT 5 " BALLOT_BINARY
      " bench square.glb --size 128x128 --repeat 10000 --methods if-if --json bench.json > out.txt 2> err.txt";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 128 + 2);
  EXPECT_EQ(json("bench.json")["partial"], true);
  expect_parts(read("err.txt"), {"ballot: interrupted; what was measured is kept"});
}

TEST_F(Bench, AKilledRunLeavesTheBlocksBefore) {
  rays(16);
  const std::string command =
      "cd '" + path("").string() + "' && export XDG_CACHE_HOME='" + path("cache").string() +
      "'; " BALLOT_BINARY
      " bench square.glb --rays rays.npy,primary --size 256x256 --repeat 10000 --methods if-if --json bench.json "
      "> out.txt 2> err.txt & pid=$!; i=0; while [ ! -e '" +
      path("bench.json").string() + "' ] && [ $i -lt 600 ]; do sleep 0.1; i=$((i + 1)); done; kill -9 $pid; wait $pid";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 128 + 9);
  const auto run = json("bench.json");
  EXPECT_EQ(run["partial"], true);
  ASSERT_EQ(run["records"].size(), 1u);
  EXPECT_EQ(run["records"][0]["rays"], "rays.npy");
}

TEST_F(Bench, BadArguments) {
  const auto refused = [&](int code, std::initializer_list<std::string_view> parts, const Words& more) {
    Words args{"bench", "square.glb"};
    args.insert(args.end(), more.begin(), more.end());
    refuse(code, parts, args);
  };
  refuse(2, {"missing SCENE"}, {"bench"});
  refuse(1, {"none.glb"}, {"bench", "none.glb"});
  refuse(2, {"two scenes are called square"}, {"bench", "square.glb", "square.glb"});
  refused(2, {"'warp'", "packet", "cut"}, {"--methods", "warp"});
  refused(2, {"vote", "'most'", "any, count, sum"}, {"--methods", "packet:vote=most"});
  refused(2, {"method if-if has no packets whose lanes vote"}, {"--methods", "if-if:vote=any", "--json", "b.json"});
  refused(2, {"method cut needs numbers", "count, sum"}, {"--methods", "cut:vote=any"});
  refused(2, {"knob f", "'2'", "0 to 1"}, {"--methods", "cut:f=2"});
  refused(2, {"knob padding=tree", "packet-wide"}, {"--methods", "packet-wide:padding=tree"});
  refused(2, {"knob padding=tree", "bvh4"}, {"--methods", "bvh4:padding=tree"});
  refused(2, {"knob layout", "bvh4"}, {"--methods", "bvh4:layout=paper"});
  refused(2, {"knob sorted", "bvh4"}, {"--methods", "bvh4:sorted=0"});
  refused(2, {"knob padding=tree", "leaf_box=1"}, {"--methods", "while-while:padding=tree:leaf_box=1"});
  refused(2, {"'f' is not of the form NAME=VALUE"}, {"--methods", "cut:f"});
  refused(2, {"method packet has no such threshold"}, {"--methods", "packet:k=3"});
  refused(2, {"knob k=3: it concerns none of the chosen methods"}, {"--methods", "packet", "--knob", "k=3"});
  refused(2, {"knob padding=tree: it concerns none"}, {"--methods", "bvh4", "--knob", "padding=tree"});
  refused(2, {"empty item"}, {"--methods", "packet,,cut"});
  refused(2, {"'glossy'", "primary", "ao"}, {"--rays", "glossy"});
  refused(2, {"'sloppy'", "plain", "watertight"}, {"--numeric", "sloppy"});
  refused(2, {"'side'", "front, far"}, {"--views", "side"});
  refused(2, {"--repeat: 0"}, {"--repeat", "0"});
  refused(2, {"--repeat: 1000000"}, {"--repeat", "1000000"});
  refused(2, {"--repeat"}, {"--repeat", "many"});
  refused(2, {"size: 0x5"}, {"--size", "0x5"});
  refused(2, {"no device is called 'abacus'"}, {"--device", "abacus"});
}

TEST_F(Bench, BadFilesBeforeAnyWork) {
  const Words args{"bench", "square.glb", "--rays"};
  const auto refused = [&](std::initializer_list<std::string_view> parts, const Words& more) {
    Words all = args;
    all.insert(all.end(), more.begin(), more.end());
    refuse(1, parts, all);
  };
  refused({"rays.npy", "No such file"}, {"rays.npy"});
  write("rays.npy", "nonsense");
  refused({"rays.npy"}, {"rays.npy:any"});
  rays(0);
  refused({"rays.npy: found no rays"}, {"rays.npy"});
  refused({"nowhere/b.json", "no folder nowhere"}, {"primary", "--json", "nowhere/b.json"});
}

TEST_F(Bench, HelpListsMethodsVotesKindsAndModes) {
  const std::string text = succeed({"bench", "--help-all"}).out;
  for (const Method& m : kMethods) expect_parts(text, {m.name, m.summary});
  for (const RayKind& kind : kRayKinds) expect_parts(text, {kind.name, kind.summary});
  for (const KnobInfo& k : knobs()) expect_parts(text, {k.name, k.values, k.what});
  expect_parts(text, {"vote=any|count|sum", "--ao-rays", "--ao-radius", "k=11", "FILE.npy", "--sweep", "--check",
                      "--counters", "--repeat", "tools/report", "Ctrl-C"});
}

}  // namespace
}  // namespace ballot::test
