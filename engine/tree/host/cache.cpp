// The cache of trees on disk. A file is a header and then the two arrays as they lie in memory. It is valid only on
// machines of the same byte order, which the magic number checks.
#include <sys/stat.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <new>
#include <optional>
#include <type_traits>
#include <utility>

#include "engine/core/cache_file.h"
#include "engine/core/stopwatch.h"
#include "engine/tree/host/bvh.h"

namespace ballot {
namespace {

constexpr std::uint64_t kMagic = 0x48564254'4C4C4142;  // "BALLTBVH" on little-endian machines

// Part of every key. Raise it whenever BvhNode, the format of the file or the tree that the builder makes changes.
constexpr std::uint32_t kVersion = 3;

using Hash = XXH128_hash_t;

struct Header {
  std::uint64_t magic = kMagic;
  Hash key{};
  Hash checksum{};  // over the header with this field zero, and over both arrays
  std::uint64_t node_count = 0, reference_count = 0;
  std::uint32_t triangles = 0, degenerate = 0, leaves = 0, depth = 0;
  double sah = 0;
  Bounds bounds;
};
static_assert(sizeof(Header) == 104 && std::has_unique_object_representations_v<Hash>, "a header must have no padding");

Hash key_of(std::span<const Triangle> triangles, const BuildSettings& s) {
  const struct {
    Hash triangles;
    std::uint64_t count;
    std::uint32_t version, max_leaf;
    float split_budget, traversal_cost, intersection_cost;
    BuilderId builder;  // Best is 0, what this word held before there were several builders
  } all{XXH3_128bits(triangles.data(), triangles.size_bytes()),
        triangles.size(),
        kVersion,
        s.max_leaf,
        s.split_budget,
        s.traversal_cost,
        s.intersection_cost,
        s.builder};
  static_assert(sizeof(all) == 48, "hashed bytes must have no padding");
  return XXH3_128bits(&all, sizeof(all));
}

Hash checksum_of(Header header, const Bvh& bvh) {
  header.checksum = {};
  const std::array<Hash, 3> all{XXH3_128bits(&header, sizeof(header)),
                                XXH3_128bits(bvh.nodes.data(), bvh.nodes.size() * sizeof(BvhNode)),
                                XXH3_128bits(bvh.references.data(), bvh.references.size() * sizeof(std::uint32_t))};
  return XXH3_128bits(&all, sizeof(all));
}

// True if the sizes that the header states match the size of the file. Checked before any memory is allocated.
bool sizes_fit(const Header& h, std::uint64_t file_bytes) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 32;
  return h.node_count < kMost && h.reference_count < kMost &&
         file_bytes == sizeof(Header) + h.node_count * sizeof(BvhNode) + h.reference_count * sizeof(std::uint32_t);
}

template <class T>
bool read_array(std::FILE* in, std::vector<T>& out, std::uint64_t count) {
  out.resize(count);
  return std::fread(out.data(), sizeof(T), count, in) == count;
}

struct TreeShape {
  std::uint32_t leaves = 0, depth = 0, largest_leaf = 0;  // as BvhStats
};

// Returns the shape of a tree. Returns nothing if a traversal could leave the arrays or meet anything twice: every
// child lies after its parent, as flatten() puts it, and has one parent; the leaves share out the references; node 1 is
// empty.
std::optional<TreeShape> shape_of(const Bvh& bvh, std::size_t triangle_count) {
  constexpr std::uint32_t kNoParent = std::numeric_limits<std::uint32_t>::max();
  const auto exists = [&](std::uint32_t prim) { return prim < triangle_count; };
  if (bvh.nodes.size() % 2 != 0 || !std::ranges::all_of(bvh.references, exists)) return std::nullopt;
  TreeShape shape;
  std::uint64_t references = 0;
  std::vector<std::uint32_t> above(bvh.nodes.size() / 2, kNoParent);  // inner nodes above each pair of siblings
  if (!above.empty()) above[0] = 0;
  for (std::size_t i = 0; i < bvh.nodes.size(); ++i) {
    const BvhNode& n = bvh.nodes[i];
    if (i == 1 && n.count == 0) continue;
    if (i == 1 || above[i / 2] == kNoParent) return std::nullopt;
    if (n.count > 0) {
      if (n.count > MAX_LEAF_TRIANGLES || std::uint64_t{n.first} + n.count > bvh.references.size()) return std::nullopt;
      references += n.count;
      ++shape.leaves;
      shape.depth = std::max(shape.depth, above[i / 2]);
      shape.largest_leaf = std::max(shape.largest_leaf, n.count);
    } else {
      if (n.first <= i || n.first % 2 != 0 || n.first >= bvh.nodes.size() - 1) return std::nullopt;
      if (std::exchange(above[n.first / 2], above[i / 2] + 1) != kNoParent) return std::nullopt;
    }
  }
  return references == bvh.references.size() ? std::optional(shape) : std::nullopt;
}

/// Reads a tree. Returns nothing if the file is not what save() wrote for these triangles.
std::optional<Bvh> read_tree(std::FILE* in, std::uint64_t bytes, const Hash& key, std::size_t triangle_count) {
  Header h;
  if (std::fread(&h, sizeof(h), 1, in) != 1) return std::nullopt;
  if (h.magic != kMagic || !XXH128_isEqual(h.key, key) || !sizes_fit(h, bytes)) return std::nullopt;
  Bvh bvh;
  if (!read_array(in, bvh.nodes, h.node_count) || !read_array(in, bvh.references, h.reference_count))
    return std::nullopt;
  if (!XXH128_isEqual(checksum_of(h, bvh), h.checksum)) return std::nullopt;
  // The checksum tells damage, not intent, and stacks are as deep as the tree says.
  const std::optional<TreeShape> shape = shape_of(bvh, triangle_count);
  if (!shape || shape->depth != h.depth || shape->leaves != h.leaves) return std::nullopt;
  bvh.bounds = h.bounds;
  bvh.stats = {.triangles = h.triangles,
               .degenerate = h.degenerate,
               .references = static_cast<std::uint32_t>(h.reference_count),
               .nodes = static_cast<std::uint32_t>(h.node_count == 0 ? 0 : h.node_count - 1),
               .leaves = h.leaves,
               .depth = h.depth,
               .largest_leaf = shape->largest_leaf,
               .sah = h.sah,
               .bytes = bytes - sizeof(Header),
               .from_cache = true};
  return bvh;
}

std::optional<Bvh> load(const std::filesystem::path& path, const Hash& key, std::size_t triangle_count) {
  const InputStream in = open_cache(path);
  struct stat info {};
  if (!in || ::fstat(::fileno(in.get()), &info) != 0) return std::nullopt;
  try {
    std::optional<Bvh> bvh = read_tree(in.get(), std::uint64_t(info.st_size), key, triangle_count);
    if (!bvh) say_damaged_cache(path);
    return bvh;
  } catch (const std::bad_alloc&) {
    return std::nullopt;  // the build that follows reports it
  }
}

void save(const std::filesystem::path& path, const Hash& key, const Bvh& bvh) {
  Header h;
  h.key = key;
  h.node_count = bvh.nodes.size();
  h.reference_count = bvh.references.size();
  h.triangles = bvh.stats.triangles;
  h.degenerate = bvh.stats.degenerate;
  h.leaves = bvh.stats.leaves;
  h.depth = bvh.stats.depth;
  h.sah = bvh.stats.sah;
  h.bounds = bvh.bounds;
  h.checksum = checksum_of(h, bvh);
  write_cache(path, {std::as_bytes(std::span(&h, 1)), std::as_bytes(std::span(bvh.nodes)),
                     std::as_bytes(std::span(bvh.references))});
}

}  // namespace

Bvh build_bvh_cached(std::span<const Triangle> triangles, const BuildSettings& settings,
                     const std::filesystem::path& cache_folder, const Progress& progress) {
  const Timer timer;
  const Hash key = key_of(triangles, settings);
  const std::filesystem::path path = cache_folder / fmt::format("{:016x}{:016x}.bvh", key.high64, key.low64);
  if (std::optional<Bvh> stored = load(path, key, triangles.size())) {
    stored->stats.builder = settings.builder;
    stored->stats.build_s = timer.seconds();
    if (progress) progress(1);
    return std::move(*stored);
  }
  Bvh bvh = build_bvh(triangles, settings, progress);
  save(path, key, bvh);
  return bvh;
}

}  // namespace ballot
