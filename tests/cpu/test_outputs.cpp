// Tests of what happens around files: streams, temporary files of killed processes, what is one file by two names,
// memory that is asked for, and texts that are shown.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/core/file_id.h"
#include "engine/core/json_text.h"
#include "engine/core/memory.h"
#include "engine/core/shown.h"
#include "engine/core/standard_output.h"
#include "tests/cpu/gltf_builder.h"

namespace ballot::test {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Streams, OpenDescriptorsAreNamedInThreeWays) {
  EXPECT_EQ(descriptor_of("/dev/stdout"), 1);
  EXPECT_EQ(descriptor_of("/dev/fd/7"), 7);
  EXPECT_EQ(descriptor_of("/proc/self/fd/12"), 12);
  for (const char* other : {"/dev/null", "/dev/fd/", "/dev/fd/x", "/dev/fd/3x", "/proc/1/fd/1", "stdout", "-"})
    EXPECT_EQ(descriptor_of(other), std::nullopt) << other;
}

TEST(Streams, WritingToAnOpenFileGoesOnWhereItStands) {
  const TemporaryFolder folder;
  const fs::path file = folder.write("log", "before ");
  const int fd = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  ASSERT_GE(fd, 0);
  const std::string stream = "/dev/fd/" + std::to_string(fd);
  check_writable(stream);
  write_file(stream, std::string_view("one "));
  write_file(stream, std::string_view("two"));
  ::close(fd);
  EXPECT_EQ(content_of(file), "before one two");
  expect_error(Failure::Work, {"cannot write " + stream}, [&] { check_writable(stream); });
}

TEST(Temporaries, ThoseOfDeadProcessesAreSwept) {
  const TemporaryFolder folder;
  const fs::path left = folder.write(".ballot-1-00000000-0.tmp", "half"), other = folder.write(".ballot-x", "mine"),
                 used = folder.write(".ballot-2-00000000-0.tmp", "in use");
  const int fd = ::open(used.c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(::flock(fd, LOCK_EX), 0);
  write_file(folder.path() / "out", std::string_view("whole"));
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(other));
  EXPECT_TRUE(fs::exists(used));
  ::close(fd);
}

TEST(Temporaries, AKilledWriterLeavesNothingForLong) {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "out";
  const pid_t child = ::fork();
  if (child == 0) {
    write_atomically(out, [](OutputFile&) { ::kill(::getpid(), SIGKILL); });
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);  // the litter
  write_file(out, std::string_view("whole"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
  EXPECT_EQ(content_of(out), "whole");
}

TEST(FileIds, LinksNameOneFile) {
  const TemporaryFolder folder;
  const fs::path file = folder.write("a", "x"), soft = folder.path() / "soft", hard = folder.path() / "hard";
  fs::create_symlink("a", soft);
  fs::create_hard_link(file, hard);
  EXPECT_EQ(file_id(file), file_id(soft));
  EXPECT_EQ(file_id(file), file_id(hard));
  EXPECT_EQ(file_id(file), file_id(folder.path() / "." / "a"));
  EXPECT_NE(file_id(file), file_id(folder.write("b", "x")));
  const fs::path dangling = folder.path() / "dangling";
  fs::create_symlink("new", dangling);
  EXPECT_EQ(file_id(dangling), file_id(folder.path() / "new"));
  EXPECT_NE(file_id(dangling), file_id(folder.path() / "newer"));
  EXPECT_EQ(file_id("/dev/null"), std::nullopt);
}

TEST(Memory, WhatDoesNotFitIsRefusedWithBothFigures) {
  need_memory(1 << 20, "a little");
  expect_error(Failure::Work, {"the moon needs about 4.00 TiB of memory, but ", " is left; use a smaller file or"},
               [] { need_memory(std::uint64_t{4} << 40, "the moon"); });
  set_memory_limit(std::uint64_t{1} << 40);
  expect_error(Failure::Work, {"the moon needs about 4.00 TiB", "of the limit of 1.00 TiB", "raise --memory"},
               [] { need_memory(std::uint64_t{4} << 40, "the moon"); });
  set_memory_limit(1 << 20);  // less than the process has already
  expect_error(Failure::Work, {"needs about 1.00 KiB", "but 0 bytes is left of the limit of 1.00 MiB"},
               [] { need_memory(1024, "a page"); });
  set_memory_limit(0);
}

TEST(Memory, SizesAreParsed) {
  EXPECT_EQ(parse_bytes("1000", "--memory"), 1000u);
  EXPECT_EQ(parse_bytes("512M", "--memory"), 512u << 20);
  EXPECT_EQ(parse_bytes("1.5GiB", "--memory"), 3u << 29);
  for (const char* bad : {"", "G", "4X", "-1", "0", "nan", "inf", "1e400", "4 G", "1MBx"})
    expect_error(Failure::Arguments, {"--memory", "512M or 4G"}, [&] { parse_bytes(bad, "--memory"); });
}

// A file of one kilobyte may ask for any number of triangles, as many nodes may place one mesh.
TEST(Memory, ScenesAndImagesAreEstimatedBeforeTheyAreLoaded) {
  GltfBuilder b;
  b.mesh(b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0}));
  b.json["accessors"].push_back({{"componentType", 5126}, {"count", 3 << 20}, {"type", "VEC3"}});
  b.primitive()["attributes"]["POSITION"] = 1;
  for (int i = 0; i < 100; ++i) b.node({{"mesh", 0}});
  set_memory_limit(std::uint64_t{2} << 30);
  expect_error(Failure::Work, {"the scene of 104857600 triangles needs about 3.91 GiB", "of the limit of 2.00 GiB"},
               [&] { b.load({.instances = InstancePolicy::Copy}); });
  set_memory_limit(0);
}

TEST(Shown, WhatSteersATerminalIsSpelledOut) {
  EXPECT_EQ(shown("plain caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x8e\xb2\n\t"),
            "plain caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x8e\xb2\n\t");
  EXPECT_EQ(shown("a\x1b[31mb\x7f\r"), "a\\x1b[31mb\\x7f\\x0d");
  EXPECT_EQ(shown("\xc2\x9b"), "\\u009b");      // CSI in one character
  EXPECT_EQ(shown("\xe2\x80\xae"), "\\u202e");  // turns the direction of writing
  EXPECT_EQ(shown("\xd8\x9c"), "\\u061c");      // the same
  EXPECT_EQ(shown("\xff\xc3(\xed\xa0\x80\xc0\x80"), "\\xff\\xc3(\\xed\\xa0\\x80\\xc0\\x80");
  EXPECT_EQ(shown("\xe2\x82"), "\\xe2\\x82");
  EXPECT_EQ(shown_in_line("a\nb"), "a\\x0ab");
}

TEST(JsonText, NamesThatAreNotUtf8LoseNothingElse) {
  const auto read = nlohmann::json::parse(json_text({{"name", "sc\xff"}, {"figure", 3}}));
  EXPECT_EQ(read["figure"], 3);
  EXPECT_EQ(read["name"], "sc\xef\xbf\xbd");
}

}  // namespace
}  // namespace ballot::test
