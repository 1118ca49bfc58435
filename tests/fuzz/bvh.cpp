// The cache of trees. Seven of eight inputs get the key and the checksum that the reader asks for, so that what lies
// behind both is read, too: byte 0 of an input decides, the file follows.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstring>

#include "engine/formats/pair.h"
#include "engine/oracle/oracle.h"
#include "tests/cpu/shapes.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeader = 104, kChecksumAt = 24, kNodesAt = 40;  // as engine/bvh/cache.cpp has them

const std::vector<Triangle>& triangles() {
  static const std::vector<Triangle> all = shapes::slivers(12);
  return all;
}

fs::path tree_folder() { return folder() / "bvh"; }

/// Builds the tree, whose file then is the one that the reader looks for.
const fs::path& tree_file() {
  static const fs::path path = [] {
    build_bvh_cached(triangles(), {}, tree_folder());
    return fs::directory_iterator(tree_folder())->path();
  }();
  return path;
}

const std::string& good_file() {
  static const std::string bytes = bytes_in(tree_file());
  return bytes;
}

std::vector<std::string> bvh_seeds() { return {"s" + good_file(), "r" + good_file()}; }

std::vector<std::string> bvh_words() { return {std::string("\0\0\0\0", 4), "\xff\xff\xff\xff", "BALLTBVH"}; }

/// Gives a file the key of the good one, and the checksum of its content.
void sign(std::string& bytes) {
  if (bytes.size() < kHeader) return;
  std::memcpy(bytes.data(), good_file().data(), kNodesAt);
  std::uint64_t nodes = 0;
  std::memcpy(&nodes, bytes.data() + kNodesAt, sizeof nodes);
  const std::uint64_t body = bytes.size() - kHeader, node_bytes = nodes * sizeof(BvhNode);
  if (nodes > body || node_bytes > body) return;
  std::memset(bytes.data() + kChecksumAt, 0, sizeof(XXH128_hash_t));
  const char* const content = bytes.data() + kHeader;
  const XXH128_hash_t all[3] = {XXH3_128bits(bytes.data(), kHeader), XXH3_128bits(content, node_bytes),
                                XXH3_128bits(content + node_bytes, body - node_bytes)};
  const XXH128_hash_t sum = XXH3_128bits(all, sizeof all);
  std::memcpy(bytes.data() + kChecksumAt, &sum, sizeof sum);
}

void read_bvh(std::string_view input) {
  if (input.empty()) return;
  std::string bytes(input.substr(1));
  if (input[0] % 8 != 0) sign(bytes);
  put("bvh/" + tree_file().filename().string(), bytes);
  expect_plain([&] {
    const Bvh bvh = build_bvh_cached(triangles(), {}, tree_folder());
    if (!bvh.stats.from_cache) return;
    const PairTree tree = encode_pairs(bvh, triangles(), NodeLayout::Interleaved);
    Oracle(tree).nearest(Ray{.origin = {0, 0, 5}, .t_min = 0, .dir = {0.1f, 0.1f, -1}, .t_max = 100});
  });
}

}  // namespace

Target bvh_target() { return {"bvh", Form::Bytes, bvh_seeds(), bvh_words(), read_bvh}; }

}  // namespace ballot::fuzz
