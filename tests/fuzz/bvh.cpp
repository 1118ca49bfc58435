// The cache of trees. Seven of eight inputs get the key and the checksum that the reader asks for, so that what lies
// behind both is read, too: byte 0 of an input decides, the file follows.
#include <cstring>

#include "engine/oracle/oracle.h"
#include "engine/tree/formats/pair.h"
#include "tests/cpu/shapes.h"
#include "tests/cpu/tree_file.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

namespace fs = std::filesystem;

const UnsetVector<Triangle>& triangles() {
  static const UnsetVector<Triangle> all = shapes::slivers(12);
  return all;
}

fs::path tree_folder() { return folder() / "bvh"; }

/// Builds the tree, whose file then is the one that the reader looks for.
const fs::path& good_path() {
  static const fs::path path = [] {
    build_bvh_cached(triangles(), {}, tree_folder());
    return fs::directory_iterator(tree_folder())->path();
  }();
  return path;
}

const std::string& good_file() {
  static const std::string bytes = bytes_in(good_path());
  return bytes;
}

std::vector<std::string> bvh_seeds() { return {"s" + good_file(), "x" + good_file()}; }

std::vector<std::string> bvh_words() { return {std::string("\0\0\0\0", 4), "\xff\xff\xff\xff", "BALLTBVH"}; }

/// Gives a file the key of the good one, and the checksum of its content.
void sign(std::string& bytes) {
  if (bytes.size() < tree_file::kHeader) return;
  std::memcpy(bytes.data(), good_file().data(), tree_file::kChecksumAt);
  tree_file::sign(bytes);
}

void read_bvh(std::string_view input) {
  if (input.empty()) return;
  std::string bytes(input.substr(1));
  if (input[0] % 8 != 0) sign(bytes);
  put("bvh/" + good_path().filename().string(), bytes);
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
