// Tests of the cache of encoded tree formats: hits, other trees, damaged files, folders that cannot be written.
#include <gtest/gtest.h>

#include <fstream>

#include "engine/core/file.h"
#include "engine/tree/formats/encoded_cache.h"
#include "tests/cpu/shapes.h"
#include "tests/temporary.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

class EncodedCache : public testing::Test {
 protected:
  static PairTree pairs_of(std::uint32_t seed) {
    const shapes::Triangles triangles = shapes::soup(2000, 0.1f, seed);
    return encode_pairs(build_bvh(triangles), triangles, NodeLayout::Interleaved);
  }
  std::vector<fs::path> files() const {
    if (!fs::exists(folder_)) return {};
    return {fs::directory_iterator(folder_), fs::directory_iterator()};
  }

  const TreeFormat& wide8_ = format_of(TreeFormatId::Wide8);
  const test::TemporaryFolder kept_;
  const fs::path folder_ = kept_.path() / "encoded";
};

TEST_F(EncodedCache, TexelsAreThoseOfTheEncoder) {
  const PairTree pairs = pairs_of(1);
  for (const TreeFormatId id : {TreeFormatId::Bvh4, TreeFormatId::Bvh8, TreeFormatId::Wide8}) {
    const std::vector<glm::uvec4> encoded = format_of(id).encode(pairs, 0);
    EXPECT_EQ(encode_cached(format_of(id), pairs, 0, folder_), encoded);
    EXPECT_EQ(encode_cached(format_of(id), pairs, 0, folder_), encoded);
  }
  EXPECT_EQ(files().size(), 3u);
}

// A tampered file whose checksum is right shows that the second call reads it.
TEST_F(EncodedCache, TheSecondCallReadsTheFile) {
  const PairTree a = pairs_of(1), b = pairs_of(2);
  encode_cached(wide8_, a, 0, folder_);
  const fs::path of_a = files().at(0);
  fs::path of_b;
  encode_cached(wide8_, b, 0, folder_);
  for (const fs::path& file : files())
    if (file != of_a) of_b = file;
  fs::copy_file(of_b, of_a, fs::copy_options::overwrite_existing);
  EXPECT_EQ(encode_cached(wide8_, a, 0, folder_), wide8_.encode(b, 0));
}

TEST_F(EncodedCache, DamagedFilesAreReplaced) {
  const PairTree pairs = pairs_of(1);
  const std::vector<glm::uvec4> encoded = encode_cached(wide8_, pairs, 0, folder_);
  const fs::path file = files().at(0);
  const std::vector<std::byte> whole = read_file(file);
  for (const std::size_t keep : {std::size_t{0}, std::size_t{7}, std::size_t{16}, whole.size() / 2, whole.size() - 1}) {
    write_file(file, std::span(whole).first(keep));
    EXPECT_EQ(encode_cached(wide8_, pairs, 0, folder_), encoded);
    EXPECT_EQ(read_file(file), whole);
  }
  std::vector<std::byte> flipped = whole;
  flipped[whole.size() / 3] ^= std::byte{4};
  write_file(file, flipped);
  EXPECT_EQ(encode_cached(wide8_, pairs, 0, folder_), encoded);
}

TEST_F(EncodedCache, WithoutAFolderNothingIsWritten) {
  const PairTree pairs = pairs_of(1);
  EXPECT_EQ(encode_cached(wide8_, pairs, 0, {}), wide8_.encode(pairs, 0));
  std::ofstream(folder_) << "a file, not a folder";
  EXPECT_EQ(encode_cached(wide8_, pairs, 0, folder_), wide8_.encode(pairs, 0));
}

TEST_F(EncodedCache, QuickFormatsAreNotKept) {
  const PairTree pairs = pairs_of(1);
  encode_cached(format_of(TreeFormatId::Frontier), pairs, 32, folder_);
  EXPECT_TRUE(files().empty());
}

}  // namespace
}  // namespace ballot
