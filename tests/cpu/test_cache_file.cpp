// Tests of the files of caches: which are read, and how they are made.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "engine/bvh/bvh.h"
#include "engine/core/cache_file.h"
#include "tests/cpu/gltf_builder.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

constexpr fs::perms kAll = fs::perms::all;

std::span<const std::byte> bytes_of_text(std::string_view text) { return std::as_bytes(std::span(text)); }

TEST(CacheFiles, AreOfTheUserAlone) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "a" / "b" / "c";
  ASSERT_TRUE(write_cache(file, bytes_of_text("abc")));
  EXPECT_EQ(read_cache(file)->size(), 3u);
  for (const fs::path& made : {folder.path() / "a", folder.path() / "a" / "b"})
    EXPECT_EQ(fs::status(made).permissions(), fs::perms::owner_all) << made;
}

TEST(CacheFiles, ThatAllMayWriteAreNotRead) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "sub" / "c";
  ASSERT_TRUE(write_cache(file, bytes_of_text("abc")));
  fs::permissions(file, fs::perms::others_write, fs::perm_options::add);
  EXPECT_FALSE(read_cache(file));
  fs::permissions(file, fs::perms::others_write, fs::perm_options::remove);
  EXPECT_TRUE(read_cache(file));
  fs::permissions(file.parent_path(), kAll);
  EXPECT_FALSE(read_cache(file));
}

TEST(CacheFiles, OfOthersAndLinksAreNotRead) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "sub" / "c";
  ASSERT_TRUE(write_cache(file, bytes_of_text("abc")));
  fs::create_symlink("c", file.parent_path() / "link");
  EXPECT_FALSE(is_own_file(file.parent_path() / "link"));
  EXPECT_FALSE(is_own_file(file.parent_path()));
  EXPECT_FALSE(is_own_file(file.parent_path() / "gone"));
  if (::geteuid() != 0) return;  // only root can give files away
  for (const fs::path& given : {file, file.parent_path()}) {
    ASSERT_EQ(::chown(given.c_str(), 12345, 12345), 0);
    EXPECT_FALSE(read_cache(file)) << given;
    ASSERT_EQ(::chown(given.c_str(), 0, 0), 0);
  }
  EXPECT_TRUE(read_cache(file));
}

TEST(CacheFiles, FoldersThatCannotBeMadeCostTimeAlone) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.write("file", "");
  EXPECT_FALSE(write_cache(file / "below" / "c", bytes_of_text("abc")));
}

TEST(CacheFiles, TreesInFoldersOfAllAreBuiltAgain) {
  const test::TemporaryFolder folder;
  const fs::path trees = folder.path() / "bvh";
  const std::vector<Triangle> triangles = shapes::slivers(20);
  build_bvh_cached(triangles, {}, trees);
  EXPECT_TRUE(build_bvh_cached(triangles, {}, trees).stats.from_cache);
  fs::permissions(trees, kAll);
  EXPECT_FALSE(build_bvh_cached(triangles, {}, trees).stats.from_cache);
}

}  // namespace
}  // namespace ballot
