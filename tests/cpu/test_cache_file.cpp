// Tests of the files of caches: which are read, how they are made, and what other users cannot do with them.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>

#include "engine/core/cache_file.h"
#include "engine/tree/host/bvh.h"
#include "tests/cpu/gltf_builder.h"
#include "tests/cpu/needs.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

constexpr fs::perms kAll = fs::perms::all;
constexpr uid_t kStranger = 12345;

std::span<const std::byte> bytes_of_text(std::string_view text) { return std::as_bytes(std::span(text)); }

std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Runs work in a child, as it changes what belongs to a process. Returns what it returned; -1: it did not end so.
int in_child(const std::function<int()>& work) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(20);  // ends one that waits
    ::_exit(work());
  }
  int status = 0;
  return ::waitpid(child, &status, 0) == child && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(CacheFiles, AreOfTheUserAlone) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "a" / "b" / "c";
  ASSERT_TRUE(write_cache(file, bytes_of_text("abc")));
  EXPECT_EQ(read_cache(file)->size(), 3u);
  for (const fs::path& made : {folder.path() / "a", folder.path() / "a" / "b"})
    EXPECT_EQ(fs::status(made).permissions(), fs::perms::owner_all) << made;
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST(CacheFiles, ThatOthersMayWriteAreNeitherReadNorWritten) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "sub" / "c";
  for (const fs::perms others : {fs::perms::group_write, fs::perms::others_write}) {
    ASSERT_TRUE(write_cache(file, bytes_of_text("abc")));
    fs::permissions(file, others, fs::perm_options::add);
    EXPECT_FALSE(read_cache(file));
    fs::permissions(file, others, fs::perm_options::remove);
    EXPECT_TRUE(read_cache(file));
    fs::permissions(file.parent_path(), others, fs::perm_options::add);
    EXPECT_FALSE(read_cache(file));
    EXPECT_FALSE(write_cache(file, bytes_of_text("new")));
    EXPECT_EQ(content_of(file), "abc");
    fs::permissions(file.parent_path(), others, fs::perm_options::remove);
  }
}

TEST(CacheFiles, OfOthersAreNeitherReadNorWritten) {
  BALLOT_NEEDS(::geteuid() == 0, "only root can give files away");
  const test::TemporaryFolder folder;
  const fs::path sub = folder.path() / "sub", file = sub / "c";
  ASSERT_TRUE(write_cache(file, bytes_of_text("abc")));
  for (const fs::path& given : {file, sub, folder.path()}) {
    ASSERT_EQ(::chown(given.c_str(), kStranger, kStranger), 0);
    EXPECT_FALSE(read_cache(file)) << given;
    if (given != file) {
      EXPECT_FALSE(write_cache(file, bytes_of_text("new"))) << given;
    }
    ASSERT_EQ(::chown(given.c_str(), 0, 0), 0);
  }
  EXPECT_TRUE(read_cache(file));
  ASSERT_EQ(::chown(folder.path().c_str(), kStranger, kStranger), 0);
  EXPECT_FALSE(write_cache(folder.path() / "new" / "sub" / "c", bytes_of_text("abc")));
  EXPECT_FALSE(fs::exists(folder.path() / "new"));
}

TEST(CacheFiles, LinksLeadNowhere) {
  const test::TemporaryFolder folder;
  const fs::path victim = folder.write("victim", "precious"), sub = folder.path() / "sub", file = sub / "c";
  ASSERT_TRUE(write_cache(sub / "d", bytes_of_text("abc")));
  fs::create_symlink(victim, file);
  EXPECT_FALSE(read_cache(file));
  EXPECT_TRUE(write_cache(file, bytes_of_text("new")));  // in place of the link
  EXPECT_EQ(content_of(victim), "precious");
  EXPECT_FALSE(fs::is_symlink(file));
  fs::create_directory_symlink(sub, folder.path() / "other");
  EXPECT_FALSE(read_cache(folder.path() / "other" / "d"));
  EXPECT_FALSE(write_cache(folder.path() / "other" / "e", bytes_of_text("new")));
  EXPECT_FALSE(fs::exists(sub / "e"));
}

TEST(CacheFiles, PipesAreNotWaitedFor) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "sub" / "c";
  ASSERT_TRUE(write_cache(file, bytes_of_text("abc")));
  fs::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  EXPECT_EQ(in_child([&] { return read_cache(file) ? 1 : 0; }), 0);
  EXPECT_EQ(in_child([&] { return write_cache(file, bytes_of_text("new")) ? 0 : 1; }), 0);
  EXPECT_EQ(content_of(file), "new");
}

// Below the folder of the environment every component counts, not the last one alone.
TEST(CacheFiles, LinksBelowTheFolderOfTheEnvironmentAreNotFollowed) {
  const test::TemporaryFolder folder;
  const auto writes = [&] {
    ::setenv("XDG_CACHE_HOME", (folder.path() / "cache").c_str(), 1);
    return write_cache(cache_folder() / "bvh" / "c", bytes_of_text("abc")) ? 1 : 0;
  };
  fs::create_directory(folder.path() / "real");
  fs::create_directory(folder.path() / "elsewhere");
  fs::create_directory_symlink("real", folder.path() / "cache");  // the user's own choice
  EXPECT_EQ(in_child(writes), 1);
  EXPECT_TRUE(fs::exists(folder.path() / "real" / "ballot" / "bvh" / "c"));
  fs::remove_all(folder.path() / "real" / "ballot");
  fs::create_directory_symlink(folder.path() / "elsewhere", folder.path() / "real" / "ballot");
  EXPECT_EQ(in_child(writes), 0);
  EXPECT_TRUE(fs::is_empty(folder.path() / "elsewhere"));
}

TEST(CacheFiles, FoldersThatCannotBeMadeCostTimeAlone) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.write("file", "");
  EXPECT_FALSE(write_cache(file / "below" / "c", bytes_of_text("abc")));
}

TEST(CacheFiles, TreesInFoldersOfAllAreBuiltAgain) {
  const test::TemporaryFolder folder;
  const fs::path trees = folder.path() / "bvh";
  const UnsetVector<Triangle> triangles = shapes::slivers(20);
  build_bvh_cached(triangles, {}, trees);
  EXPECT_TRUE(build_bvh_cached(triangles, {}, trees).stats.from_cache);
  fs::permissions(trees, kAll);
  EXPECT_FALSE(build_bvh_cached(triangles, {}, trees).stats.from_cache);
}

/// Prepares Mesa's cache in a child. Returns 1 if it is on, 0 if it is off.
int driver_cache(
    const fs::path& cache, const std::function<bool()>& before = [] { return true; }, const char* given = nullptr) {
  return in_child([&] {
    ::setenv("XDG_CACHE_HOME", cache.c_str(), 1);
    ::unsetenv("MESA_SHADER_CACHE_DISABLE");
    ::unsetenv("LP_NATIVE_VECTOR_WIDTH");
    ::unsetenv("MESA_SHADER_CACHE_DIR");
    if (given) ::setenv("MESA_SHADER_CACHE_DIR", given, 1);
    if (!before()) return 2;
    prepare_driver_cache();
    const char* folder = std::getenv("MESA_SHADER_CACHE_DIR");
    if (std::getenv("MESA_SHADER_CACHE_DISABLE")) return 0;
    struct stat index {};
    const bool reserved = ::stat((fs::path(folder) / "mesa_shader_cache" / "index").c_str(), &index) == 0 &&
                          index.st_size == 1310728 && 512 * index.st_blocks >= index.st_size;
    return reserved ? 1 : 3;
  });
}

TEST(DriverCache, HasItsRoomBeforeTheDriverMapsIt) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(driver_cache(folder.path()), 1);
  EXPECT_TRUE(fs::exists(folder.path() / "ballot" / "mesa" / "mesa_shader_cache" / "index"));
  fs::resize_file(folder.path() / "ballot" / "mesa" / "mesa_shader_cache" / "index", 0);  // as one that is sparse
  fs::resize_file(folder.path() / "ballot" / "mesa" / "mesa_shader_cache" / "index", 1310728);
  EXPECT_EQ(driver_cache(folder.path()), 1);
  EXPECT_EQ(driver_cache(
                folder.path(), [] { return true; }, (folder.path() / "given").c_str()),
            1);
  EXPECT_TRUE(fs::exists(folder.path() / "given" / "mesa_shader_cache" / "index"));
}

TEST(DriverCache, IsOffOnAFullDisk) {
  const test::TemporaryFolder folder;
  const auto mount = [&] {
    return ::unshare(CLONE_NEWNS) == 0 && ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
           ::mount("none", folder.path().c_str(), "tmpfs", 0, "size=64k,mode=700") == 0;
  };
  const int on = driver_cache(folder.path(), mount);
  BALLOT_NEEDS(on != 2, "root's right to mount, in a namespace of its own");
  EXPECT_EQ(on, 0);
}

TEST(DriverCache, IsOffWhereOthersCouldWrite) {
  const test::TemporaryFolder folder;
  const fs::path victim = folder.write("victim", "precious"), mesa = folder.path() / "ballot" / "mesa";
  ASSERT_EQ(driver_cache(folder.path()), 1);
  fs::remove_all(mesa / "mesa_shader_cache");
  fs::create_directory_symlink(folder.path(), mesa / "mesa_shader_cache");
  EXPECT_EQ(driver_cache(folder.path()), 0);
  fs::remove(mesa / "mesa_shader_cache");
  fs::create_directory(mesa / "mesa_shader_cache");
  fs::create_symlink(victim, mesa / "mesa_shader_cache" / "index");
  EXPECT_EQ(driver_cache(folder.path()), 0);
  EXPECT_EQ(content_of(victim), "precious");
  fs::remove(mesa / "mesa_shader_cache" / "index");
  ASSERT_EQ(::mkfifo((mesa / "mesa_shader_cache" / "index").c_str(), 0600), 0);
  EXPECT_EQ(driver_cache(folder.path()), 0);
  fs::remove(mesa / "mesa_shader_cache" / "index");
  fs::permissions(mesa, fs::perms::group_write, fs::perm_options::add);
  EXPECT_EQ(driver_cache(folder.path()), 0);
  fs::permissions(mesa, fs::perms::group_write, fs::perm_options::remove);
  EXPECT_EQ(driver_cache(folder.path()), 1);
  if (::geteuid() != 0) return;  // only root can give files away
  ASSERT_EQ(::chown(folder.path().c_str(), kStranger, kStranger), 0);
  EXPECT_EQ(driver_cache(folder.path()), 0);
}

}  // namespace
}  // namespace ballot
