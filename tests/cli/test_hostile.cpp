// Tests of hostile surroundings: cache folders of others, full disks, links at names that can be foretold, and little
// memory.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "tests/cli/cli.h"
#include "tests/cpu/needs.h"

namespace ballot::test {
namespace {

namespace fs = std::filesystem;

class Hostile : public Cli {
 protected:
  /// Runs a line of the shell in the working folder, with $B for the program and $R for the arguments of a small
  /// picture. Its messages go to the file err. Returns its exit code.
  int shell(const std::string& line) const {
    const std::string command = "cd '" + path("").string() + "' && unset MESA_SHADER_CACHE_DIR && export B='" +
                                BALLOT_BINARY + "' R='render square.glb --view front --size 4x4 --out a.exr'; " + line;
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  void expect_one_line(std::initializer_list<std::string_view> parts) const {
    const std::string err = read("err");
    expect_error_lines(err);
    expect_parts(err, parts);
    EXPECT_EQ(std::ranges::count(err, '\n'), 1) << err;
  }
};

TEST_F(Hostile, FoldersOfOthersAreNoCache) {
  BALLOT_NEEDS(::geteuid() == 0, "only root can give files away");
  square();
  fs::create_directories(path("home/.cache"));
  write("victim", "precious");
  EXPECT_EQ(shell("unset XDG_CACHE_HOME; export HOME=$PWD/home; $B $R 2> err"), 0);
  EXPECT_EQ(read("err"), "");
  EXPECT_TRUE(fs::exists(path("home/.cache/ballot/mesa/mesa_shader_cache/index")));
  for (const auto& entry : fs::recursive_directory_iterator(path("home/.cache"))) {
    if (!entry.is_regular_file()) continue;
    fs::remove(entry.path());
    fs::create_symlink(path("victim"), entry.path());  // what is written stands in the old place, in the user's folder
  }
  EXPECT_EQ(shell("unset XDG_CACHE_HOME; export HOME=$PWD/home; $B $R 2> err"), 0);
  EXPECT_EQ(read("victim"), "precious");
  for (const char* given : {"home/.cache/ballot", "home/.cache"}) {
    ASSERT_EQ(::chown(path(given).c_str(), 12345, 12345), 0);
    EXPECT_EQ(shell("unset XDG_CACHE_HOME; export HOME=$PWD/home; $B $R 2> err"), 0);
    expect_one_line({"ballot: no cache: ", given, " belongs to user 12345"});
    ASSERT_EQ(::chown(path(given).c_str(), 0, 0), 0);
  }
}

// Mesa 22.3.6 maps a file that has no room on such a disk, and is killed by SIGBUS.
TEST_F(Hostile, AFullDiskTurnsTheDriversCacheOff) {
  BALLOT_NEEDS(shell("unshare -m true 2> err") == 0, "root's right to mount, in a namespace of its own");
  square();
  fs::create_directory(path("disk"));
  for (const char* size : {"4k", "64k", "1m"}) {
    const std::string mount = std::string("mount -t tmpfs -o mode=700,size=") + size + " none disk && ";
    EXPECT_EQ(shell("unshare -m sh -c '" + mount + "XDG_CACHE_HOME=$PWD/disk $B $R 2> err'"), 0);
    expect_one_line({"ballot: the driver's cache is off: ", "has no room: No space left on device"});
  }
}

TEST_F(Hostile, AReadOnlyHomeIsNoCache) {
  BALLOT_NEEDS(shell("unshare -m true 2> err") == 0, "root's right to mount, in a namespace of its own");
  square();
  fs::create_directories(path("home/.cache"));
  const std::string run = "unset XDG_CACHE_HOME; export HOME=$PWD/home; $B $R 2> err'";
  for (const char* before : {"", "mkdir -p home/.cache/ballot/mesa/mesa_shader_cache; "}) {
    const std::string mount = std::string(before) + "mount --bind home home && mount -o remount,bind,ro home && ";
    EXPECT_EQ(shell("unshare -m sh -c 'umask 077; " + mount + run), 0);
    expect_one_line({"ballot: no cache: ", "home/.cache/ballot",
                     " cannot be written: Read-only file system; name a "
                     "folder of your own in XDG_CACHE_HOME"});
  }
}

TEST_F(Hostile, LittleAddressSpaceIsRefusedBeforeTheDriverStarts) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer takes address space of its own";
#endif
  square();
  for (const char* limit : {"ulimit -v 300000", "ulimit -v 400000", "ulimit -d 100000"}) {
    EXPECT_EQ(shell(std::string(limit) + "; XDG_CACHE_HOME=$PWD/cache $B $R 2> err"), 3) << limit;
    expect_one_line({"a Vulkan driver needs about ", "below the limit of ulimit -v or -d"});
  }
  EXPECT_EQ(shell("ulimit -v 200000; XDG_CACHE_HOME=$PWD/cache $B info 2> err"), 3);
  expect_one_line({"a Vulkan driver needs about "});
}

TEST_F(Hostile, NamesThatTheUserDidNotGiveAreNoLinks) {
  const std::string scene = square();
  fs::create_directory(path("out"));
  const Words links{"a.png", "out/square-front.exr", "out/square-front.png"};
  for (std::size_t i = 0; i < links.size(); ++i)
    fs::create_symlink(path(write("victim" + std::to_string(i), "precious")), path(links[i]));
  for (const char* out : {"a.exr", "out"})
    succeed({"render", scene, "--view", "front", "--size", "4x4", "--png", "--out", out});
  for (const std::string& name : links) EXPECT_FALSE(fs::is_symlink(path(name))) << name;
  for (const char* victim : {"victim0", "victim1", "victim2"}) EXPECT_EQ(read(victim), "precious");
  fs::create_symlink("named.exr", path("link.exr"));  // one that the user names is followed
  succeed({"render", scene, "--view", "front", "--size", "4x4", "--out", "link.exr"});
  EXPECT_TRUE(fs::is_symlink(path("link.exr")));
  EXPECT_TRUE(fs::exists(path("named.exr")));
}

}  // namespace
}  // namespace ballot::test
