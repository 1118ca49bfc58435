// Tests of the tree cache: hits, damaged files, concurrent writers, folders that cannot be written.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "engine/core/error.h"
#include "engine/tree/host/builders.h"
#include "engine/tree/host/bvh.h"
#include "tests/cpu/shapes.h"
#include "tests/cpu/tree_file.h"
#include "tests/temporary.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

class BvhCache : public testing::Test {
 protected:
  Bvh get(const BuildSettings& settings = {}) const { return build_bvh_cached(triangles_, settings, folder_); }

  std::vector<fs::path> files() const {
    if (!fs::exists(folder_)) return {};
    return {fs::directory_iterator(folder_), fs::directory_iterator()};
  }

  std::string content() const {
    std::ifstream in(files().at(0), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void overwrite(const std::string& bytes) const {
    std::ofstream(files().at(0), std::ios::binary | std::ios::trunc).write(bytes.data(), std::ssize(bytes));
  }

  UnsetVector<Triangle> triangles_ = shapes::slivers(200);
  const test::TemporaryFolder kept_;
  const fs::path folder_ = kept_.path() / "trees";
};

void expect_equal(const Bvh& a, const Bvh& b) {
  EXPECT_EQ(a.references, b.references);
  ASSERT_EQ(a.nodes.size(), b.nodes.size());
  EXPECT_EQ(std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(BvhNode)), 0);
  EXPECT_EQ(facts_of(a), facts_of(b));
  EXPECT_EQ(a.bounds.lo, b.bounds.lo);
  EXPECT_EQ(a.bounds.hi, b.bounds.hi);
}

TEST_F(BvhCache, SecondCallLoads) {
  const Bvh built = get();
  const Bvh loaded = get();
  EXPECT_FALSE(built.stats.from_cache);
  EXPECT_TRUE(loaded.stats.from_cache);
  expect_equal(built, loaded);
  EXPECT_TRUE(check_bvh(loaded, triangles_).empty());
  EXPECT_EQ(files().size(), 1u);
}

TEST_F(BvhCache, TreesOfAllBuildersLoad) {
  triangles_ = shapes::soup(3000, 0.1f);
  for (const Builder& builder : kBuilders) {
    if (builder.on_device || builder.chooses) continue;
    const Bvh built = get({.builder = builder.id});
    const Bvh loaded = get({.builder = builder.id});
    EXPECT_TRUE(loaded.stats.from_cache) << builder.name;
    expect_equal(built, loaded);
  }
}

TEST_F(BvhCache, EmptySceneAndOneTriangle) {
  for (const std::size_t count : {0u, 1u}) {
    triangles_ = shapes::identical(count);
    get();
    const Bvh loaded = get();
    EXPECT_TRUE(loaded.stats.from_cache);
    EXPECT_TRUE(check_bvh(loaded, triangles_).empty());
  }
}

TEST_F(BvhCache, OtherSettingsOrTrianglesAreOtherFiles) {
  get();
  EXPECT_FALSE(get({.split_budget = 0}).stats.from_cache);
  EXPECT_FALSE(get({.max_leaf = 2}).stats.from_cache);
  EXPECT_FALSE(get({.builder = BuilderId::Fast}).stats.from_cache);
  EXPECT_EQ(get({.builder = BuilderId::Fast}).stats.builder, BuilderId::Fast);
  EXPECT_FALSE(get({.traversal_cost = 2}).stats.from_cache);
  triangles_[0][0].x += 1;
  EXPECT_FALSE(get().stats.from_cache);
  EXPECT_EQ(files().size(), 6u);
}

TEST_F(BvhCache, TruncatedFilesAreReplaced) {
  const Bvh built = get();
  const std::string whole = content();
  for (const std::size_t length : {std::size_t{0}, std::size_t{1}, std::size_t{50}, std::size_t{103}, std::size_t{104},
                                   std::size_t{105}, whole.size() / 2, whole.size() - 1}) {
    overwrite(whole.substr(0, length));
    const Bvh again = get();
    EXPECT_FALSE(again.stats.from_cache) << length;
    expect_equal(built, again);
    EXPECT_EQ(content(), whole);
  }
  overwrite(whole + "x");
  EXPECT_FALSE(get().stats.from_cache);
  EXPECT_TRUE(get().stats.from_cache);
}

TEST_F(BvhCache, AFlippedBitIsFound) {
  get();
  const std::string whole = content();
  shapes::Random random(1);
  for (int i = 0; i < 40; ++i) {
    std::string damaged = whole;
    const std::size_t at = i < 20 ? random.below(104) : random.below(whole.size());
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random.below(8)));
    overwrite(damaged);
    EXPECT_FALSE(get().stats.from_cache) << "byte " << at;
    EXPECT_EQ(content(), whole);
  }
}

TEST_F(BvhCache, HugeStatedSizesAskForNoMemory) {
  get();
  std::string damaged = content();
  damaged.replace(40, 8, std::string(8, '\x7f'));
  overwrite(damaged);
  EXPECT_FALSE(get().stats.from_cache);
}

// The checksum is right in these files: what they state of the tree is not.
TEST_F(BvhCache, TheTreeIsWhatTheFileStates) {
  get();
  const std::string whole = content();
  const auto loads = [&](std::size_t at, std::uint32_t word) {
    std::string changed = whole;
    std::memcpy(changed.data() + at, &word, sizeof word);
    tree_file::sign(changed);
    overwrite(changed);
    return get().stats.from_cache;
  };
  const auto word_at = [&](std::size_t at) {
    std::uint32_t word = 0;
    std::memcpy(&word, whole.data() + at, sizeof word);
    return word;
  };
  const std::uint32_t depth = word_at(tree_file::kDepthAt), leaves = word_at(tree_file::kLeavesAt);
  EXPECT_TRUE(loads(tree_file::kDepthAt, depth));
  for (const std::uint32_t other : {0u, depth - 1, depth + 1, 0xd6005700u})
    EXPECT_FALSE(loads(tree_file::kDepthAt, other)) << other;
  EXPECT_FALSE(loads(tree_file::kLeavesAt, leaves + 1));
  const Bvh built = build_bvh(triangles_);
  const auto word_of = [](std::size_t node, std::size_t member) {
    return tree_file::kHeader + node * sizeof(BvhNode) + member;
  };
  EXPECT_FALSE(loads(word_of(1, offsetof(BvhNode, count)), 1000));  // the node without a place in the tree
  std::vector<std::size_t> inner, leaf;
  for (std::size_t i = 2; i < built.nodes.size(); ++i) (built.nodes[i].count == 0 ? inner : leaf).push_back(i);
  ASSERT_GE(std::min(inner.size(), leaf.size()), 2u);
  // A node with the children of another one: walks could take 2 to the power of the depth.
  EXPECT_FALSE(loads(word_of(inner[0], offsetof(BvhNode, first)), built.nodes[inner.back()].first));
  const auto largest = std::ranges::max_element(leaf, {}, [&](std::size_t i) { return built.nodes[i].count; });
  ASSERT_GT(built.nodes[*largest].count, 1u);
  EXPECT_FALSE(loads(word_of(*largest, offsetof(BvhNode, count)), 1));  // references that no leaf has
}

TEST_F(BvhCache, ManyWritersAndReaders) {
  const Bvh built = build_bvh(triangles_);
  std::vector<std::jthread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&] {
      for (int round = 0; round < 5; ++round) expect_equal(built, get());
    });
  threads.clear();
  EXPECT_TRUE(get().stats.from_cache);
  EXPECT_EQ(files().size(), 1u);  // no temporary file is left
}

TEST_F(BvhCache, AFolderThatCannotBeWrittenIsNoError) {
  std::ofstream(folder_) << "a file where the folder should be";
  EXPECT_FALSE(get().stats.from_cache);
  EXPECT_FALSE(build_bvh_cached(triangles_, {}, "/proc/nowhere").stats.from_cache);
}

TEST_F(BvhCache, ErrorsAreNotCached) {
  EXPECT_THROW(get({.max_leaf = 9}), Error);
  EXPECT_TRUE(files().empty());
}

}  // namespace
}  // namespace ballot
