// Tests of where results go: standard output for data alone, never over an input, never lost; and of signals.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "engine/files/image.h"
#include "tests/cli/cli.h"
#include "tests/cpu/gltf_builder.h"

namespace ballot::test {
namespace {

namespace fs = std::filesystem;

class Outputs : public Cli {
 protected:
  /// Runs a line of the shell in the working folder, with $B for the program. Returns its exit code.
  int shell(const std::string& line) const {
    const std::string command = "cd '" + path("").string() + "' && B='" + BALLOT_BINARY + "' && " + line;
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  /// Writes mesh.obj: one triangle, which is not closed.
  std::string mesh(const std::string& name = "mesh.obj") const {
    return write(name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  }
};

TEST_F(Outputs, StandardOutputTakesDataAlone) {
  mesh();
  for (const char* name : {"-", "/dev/stdout", "/dev/fd/1"}) {
    const Result result = run({"check", "mesh.obj", "--json", name});
    EXPECT_EQ(nlohmann::json::parse(result.out).at("triangles"), 1) << result.out;
    expect_parts(result.err, {"1 triangles"});
  }
  EXPECT_EQ(nlohmann::json::parse(succeed({"info", "--json", "-"}).out).count("devices"), 1u);
  EXPECT_FALSE(fs::exists(path("-")));
  refuse(2, {"--out -: standard output takes what --json writes"},
         {"trace", square(), "--rays", rays(), "--out", "-", "--json", "/dev/stdout"});
}

TEST_F(Outputs, WhatStandardOutputHoldsStays) {
  mesh();
  EXPECT_EQ(shell("echo before > log; $B check mesh.obj --json - >> log 2> /dev/null; echo after >> log"), 0);
  const std::string log = read("log");
  EXPECT_TRUE(log.starts_with("before\n{")) << log;
  EXPECT_TRUE(log.ends_with("}\nafter\n")) << log;
}

TEST_F(Outputs, FullDisksAndClosedPipesAreErrors) {
  EXPECT_EQ(shell("$B methods > /dev/full 2> err"), 1);
  EXPECT_EQ(read("err"), "ballot: cannot write standard output: No space left on device\n");
  EXPECT_EQ(shell("(sleep 0.3; $B methods 2> err; echo $? > code) | true"), 0);
  EXPECT_EQ(read("code"), "1\n");
  EXPECT_EQ(read("err"), "ballot: cannot write standard output: Broken pipe\n");
  mesh();
  EXPECT_EQ(shell("$B check mesh.obj --json - > /dev/full 2> err"), 1);
  EXPECT_EQ(shell("$B --help > /dev/full 2> err"), 1);
  EXPECT_EQ(shell("ulimit -f 1; $B methods > small 2> err"), 1);
  expect_parts(read("err"), {"cannot write standard output: File too large"});
}

TEST_F(Outputs, InputsAreNotReplaced) {
  GltfBuilder b = one_triangle();
  b.json["buffers"] = {{{"byteLength", 36}, {"uri", "s.bin"}}};
  write("s.gltf", b.json.dump());
  write("s.bin", b.data);
  fs::create_symlink("s.gltf", path("soft"));
  fs::create_hard_link(path("s.gltf"), path("hard"));
  for (const char* name : {"s.gltf", "./s.gltf", "soft", "hard"})
    refuse(2,
           {std::string("--json ") + name + ": it is the file that SCENE reads, and would be replaced; name another"},
           {"check", "s.gltf", "--json", name});
  refuse(2, {"--json s.bin: the command reads this file, and would replace it"},
         {"check", "s.gltf", "--json", "s.bin"});
  EXPECT_EQ(read("s.bin"), b.data);
  const std::string r = rays();
  refuse(2, {"--out rays.npy: it is the file that --rays reads"}, {"trace", "s.gltf", "--rays", r, "--out", r});
  refuse(2, {"--out h.npy: it would be written twice, as --json names it too"},
         {"trace", "s.gltf", "--rays", r, "--out", "h.npy", "--json", "h.npy"});
  fs::create_symlink("new.npy", path("leads-to-new"));
  refuse(2, {"it would be written twice, as --out names it too"},
         {"trace", "s.gltf", "--rays", r, r, "--out", "new.npy", "leads-to-new"});
}

TEST_F(Outputs, NamesThatAreNotUtf8LoseNoResult) {
  const std::string name = mesh("m\xff.obj");
  const Result result = run({"check", name, "--json", "o.json"});
  EXPECT_EQ(result.code, 1);  // not closed
  EXPECT_EQ(json("o.json").at("triangles"), 1);
  expect_parts(result.out, {"m\\xff.obj: 1 triangles"});
}

TEST_F(Outputs, NamesCannotSteerTheTerminal) {
  const std::string name = write("a\x1b[31m.obj", "v 0 0 0\nf 1 2 3\n");
  refuse(1, {"a\\x1b[31m.obj:2: face names vertex 2"}, {"check", name});
}

TEST_F(Outputs, SuggestedCommandsAreQuoted) {
  const std::string name = mesh("a b.obj");
  EXPECT_EQ(shell("printf '\\223NUMPY\\001\\000\\072\\000' > p.npy; printf '%-57s\\n' "
                  "\"{'descr': '<f4', 'fortran_order': False, 'shape': (0,3)}\" >> p.npy"),
            0);
  refuse(2, {"`ballot check 'a b.obj'`"}, {"inside", name, "--points", "p.npy", "--out", "in.npy"});
}

TEST_F(Outputs, AFileOfTheSceneMayBeOutsideIfAllowed) {
  fs::create_directory(path("sub"));
  GltfBuilder b = one_triangle();
  b.json["buffers"] = {{{"byteLength", 36}, {"uri", "../s.bin"}}};
  write("s.bin", b.data);
  write("sub/s.gltf", b.json.dump());
  refuse(1, {"a buffer names '../s.bin', which lies outside of the scene's folder", "--allow-outside"},
         {"check", "sub/s.gltf"});
  expect_parts(run({"check", "sub/s.gltf", "--allow-outside"}).out, {"1 triangles"});
}

TEST_F(Outputs, AnOutputThatCannotBeMadeIsRefusedFirst) {
  write("file", "x");
  refuse(1, {"--out file/sub/: ", "file: Not a directory; name another"}, {"render", "no.gltf", "--out", "file/sub/"});
}

TEST_F(Outputs, AMisspeltFolderOfShadersIsRefused) {
  refuse(1, {"BALLOT_SHADERS: /no/such/shaders holds no shared/layout.h"},
         {"render", square(), "--view", "front", "--size", "4x4", "--out", "p.exr"},
         {{"BALLOT_SHADERS", "/no/such/shaders"}});
}

// The limit on the size of files stands in for a full disk: the checkpoint is larger than the picture.
TEST_F(Outputs, AFullDiskAtACheckpointKeepsRendering) {
  ASSERT_EQ(shell("ulimit -f 64; $B render '" BALLOT_SOURCE_DIR "/scenes/cornell.gltf' --view view0 --shading path "
                  "--size 64x64 --spp 64 --aov color --checkpoint 0.000001 --out full.exr > out 2> err"),
            0);
  const std::string err = read("err");
  expect_parts(err, {"ballot: no checkpoint, but rendering goes on: cannot write full.checkpoint.exr: "});
  EXPECT_EQ(read_exr(path("full.exr")).width, 64u);
  EXPECT_FALSE(fs::exists(path("full.checkpoint.exr")));
  for (const std::string& file : files()) EXPECT_FALSE(file.ends_with(".tmp")) << file;
}

/// A command that a signal stops: its exit code and its error text.
class Stopping : public Outputs {
 protected:
  /// Runs `ballot command`, which writes `sign` early, sends the signal `later_ms` after that, and returns the exit
  /// code, negative if the signal killed it.
  int stop(int signal, const std::string& command, const std::string& sign, int later_ms = 0) const {
    const pid_t child = ::fork();
    if (child == 0) {
      for (const int any : {SIGINT, SIGTERM, SIGHUP}) ::signal(any, SIG_DFL);  // the tests may run under nohup
      fs::current_path(path(""));
      const std::string line = "exec '" + std::string(BALLOT_BINARY) + "' " + command + " 2> err > out";
      ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      ::_exit(127);
    }
    for (int i = 0; i < 6000 && !fs::exists(path(sign)); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    std::this_thread::sleep_for(std::chrono::milliseconds(later_ms));
    ::kill(child, signal);
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  int stop_render(int signal) const {
    return stop(signal,
                "render square.glb --view front --shading path --sky 1,1,1 --size 16x16 --spp 65536 --checkpoint 0.01 "
                "--out 'a b.exr'",
                "a b.checkpoint.exr");
  }
};

TEST_F(Stopping, ASignalKeepsWhatWasRendered) {
  square();
  EXPECT_EQ(stop_render(SIGINT), 130);
  const std::string err = read("err");
  expect_parts(err, {"ballot: SIGINT stopped view front after ", " of 65536 samples; a b.checkpoint.exr keeps them",
                     "--out 'a b.exr' --resume"});
  expect_error_lines(err);
  const Image kept = read_exr(path("a b.checkpoint.exr"));
  EXPECT_GT(std::get<int>(kept.attributes.at("film_samples")), 0);
  for (const std::string& file : files()) EXPECT_FALSE(file.ends_with(".tmp")) << file;
  fs::remove(path("a b.checkpoint.exr"));
  EXPECT_EQ(stop_render(SIGTERM), 143);
  fs::remove(path("a b.checkpoint.exr"));
  EXPECT_EQ(stop_render(SIGHUP), 128 + SIGHUP);
}

TEST_F(Stopping, VerifyKeepsWhatWasVerified) {
  square();
  EXPECT_EQ(stop(SIGTERM,
                 "verify square.glb --rays primary,ao,shadow --methods while-while --numeric plain --size 400x400 "
                 "--json v.json",
                 "v.json"),
            143);
  EXPECT_TRUE(json("v.json").at("partial"));
  EXPECT_EQ(read("err"), "ballot: interrupted; what was measured is kept\n");
}

TEST_F(Stopping, TraceWritesNothing) {
  square();
  rays(4'000'000);
  // The rays come in two parts, so that the signal arrives while there is work left on any machine.
  ASSERT_EQ(shell("mkfifo pipe; (head -c 64000000 rays.npy; sleep 3; tail -c +64000001 rays.npy) > pipe 2> log &"), 0);
  EXPECT_EQ(stop(SIGHUP, "trace square.glb --rays - --out hits.npy --method while-while < pipe", "out", 1500),
            128 + SIGHUP);
  EXPECT_EQ(read("err"), "ballot: tracing was stopped by SIGHUP; nothing was written\n");
  EXPECT_FALSE(fs::exists(path("hits.npy")));
  for (const std::string& file : files()) EXPECT_FALSE(file.ends_with(".tmp")) << file;
}

TEST_F(Stopping, ALogGrowsLineByLine) {
  square();
  EXPECT_EQ(stop_render(SIGKILL), -SIGKILL);
  expect_parts(read("out"), {"square: 2 triangles on "});
}

}  // namespace
}  // namespace ballot::test
