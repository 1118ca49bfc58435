// Holds every builder to the same rules: sound trees, and hits in watertight that do not depend on the builder, for
// each tree format. The sort of the builder `device` is held to std::stable_sort.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "engine/oracle/predicates.h"
#include "engine/tree/formats/pair_decode.h"
#include "engine/tree/host/build.h"
#include "engine/tree/host/padding.h"
#include "tests/device/builders.h"
#include "tests/device/ray_sets.h"

namespace ballot {
namespace {

using namespace harness;
using shapes::Triangles;
using tree_shapes::kTreeShapes;
using tree_shapes::TreeShape;

TEST_F(Builders, TreesAreSound) {
  for (const TreeShape& shape : kTreeShapes) {
    SCOPED_TRACE(shape.name);
    const Triangles triangles = shape.make();
    const Bvh bvh = sound(triangles, {}, device());
    const Bvh best = build_bvh(triangles, {.split_budget = 0});
    EXPECT_EQ(bvh.bounds.lo, best.bounds.lo);
    EXPECT_EQ(bvh.bounds.hi, best.bounds.hi);
    EXPECT_LE(bvh.stats.sah, 2.5 * best.stats.sah + 1);
  }
}

// Area is decided without rounding, on the device as on the host: by what integers say.
TEST_F(Builders, NeedlesOfAnyWidthAreInTheTree) {
  Triangles triangles = shapes::soup(100, 0.3f);
  for (int e = -149; e < 0; e += 3)
    for (const glm::vec3& tip : {glm::vec3(1, 0, 0), glm::vec3(0, 1, -1), glm::vec3(1, 1, 1)})
      triangles.push_back({{{-3, -3, -3}, {1.5f, 1.5f, 1.5f}, std::ldexp(1.f, e) * tip}});
  const auto flat = std::ranges::count_if(triangles, [](const Triangle& t) { return !has_area(t); });
  EXPECT_EQ(flat, 50);
  EXPECT_EQ(sound(triangles, {}, device()).stats.degenerate, flat);
  EXPECT_EQ(build_bvh(triangles).stats.degenerate, flat);
}

TEST_F(Builders, SettingsHold) {
  const Triangles triangles = shapes::soup(900, 0.3f);
  for (std::uint32_t most = 1; most <= 6; ++most)
    for (const float cost : {0.3f, 1.2f, 5.f}) {
      const Bvh bvh = sound(triangles, {.max_leaf = most, .traversal_cost = cost}, device());
      EXPECT_LE(bvh.stats.largest_leaf, most);
    }
  EXPECT_THROW(build(triangles, {.max_leaf = 7}, device()), Error);
  EXPECT_THROW(build(triangles, {.traversal_cost = 0}, device()), Error);
  for (const float bad : {1e38f, std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    Triangles wrong = triangles;
    wrong[13][2].y = bad;
    EXPECT_THROW(build(wrong, {}, device()), Error);
  }
}

TEST_F(Builders, CountsAroundTheSizesOfSubgroupsAndRanges) {
  for (std::size_t count = 1; count <= 35; ++count)
    sound(shapes::soup(count, 0.5f, std::uint32_t(count)), {}, device());
  for (const std::size_t count : {63u, 64u, 65u, 129u, 511u, 513u, 1023u, 1024u, 1025u, 2049u})
    sound(shapes::soup(count, 0.1f), {}, device());
}

TEST_F(Builders, ManyTriangles) {
  // At its other subgroup sizes lavapipe runs code that it has not optimised.
  const DeviceInfo& d = gpu_->info();
  const Triangles triangles = shapes::soup(harness::at_default_size(d) ? 100'000 : 20'000, 0.01f);
  const Bvh bvh = sound(triangles, {}, device());
  EXPECT_LE(bvh.stats.sah, 1.35 * build_bvh(triangles, {.builder = BuilderId::Balanced}).stats.sah);
}

TEST_F(Builders, TreesAreTheSameInEveryRun) {
  const Triangles triangles = shapes::soup(5000, 0.05f);
  const Bvh first = build(triangles, {}, device());
  for (int run = 0; run < 3; ++run) {
    const Bvh again = build(triangles, {}, device());
    EXPECT_EQ(again.references, first.references);
    EXPECT_EQ(again.stats.sah, first.stats.sah);
  }
}

// A builder is used again, for more and for fewer triangles, and tells the cost that the tree read back has.
TEST_F(Builders, MemoryIsUsedAgain) {
  DeviceBuilder builder(*gpu_);
  for (const std::size_t count : {700u, 30u, 2500u, 0u, 5u, 2000u}) {
    const Triangles triangles = shapes::soup(count, 0.2f);
    const Buffer<Triangle> buffer = DeviceBuilder::upload(*gpu_, triangles);
    const BuiltTree built = builder.build(buffer, std::uint32_t(count), {});
    const BvhStats stats = build(triangles, {}, device()).stats;
    EXPECT_NEAR(built.sah, stats.sah, 1e-4 * stats.sah) << count;
    EXPECT_EQ(built.depth, stats.depth);
    EXPECT_EQ(built.leaf_texels, stats.leaves * LEAF_HEADER_TEXELS + stats.references * TRIANGLE_TEXELS);
  }
}

// Codes of more bits order triangles finer, and give a tree of about the same cost.
TEST_F(Builders, CodesOfTwoWords) {
  const Triangles triangles = shapes::soup(4000, 0.1f);
  const Buffer<Triangle> buffer = DeviceBuilder::upload(*gpu_, triangles);
  DeviceBuilder builder(*gpu_);
  const double cost = builder.build(buffer, 4000, {}).sah;
  for (const std::uint32_t bits : {40u, 64u}) {
    builder.set_code_bits(bits);
    EXPECT_NEAR(builder.build(buffer, 4000, {}).sah, cost, 0.03 * cost) << bits;
  }
  EXPECT_EQ(DeviceBuilder::code_bits(10'000), 24u);
  EXPECT_EQ(DeviceBuilder::code_bits(4'000'000), 32u);
  EXPECT_EQ(DeviceBuilder::code_bits(16'000'000), 32u);
  EXPECT_EQ(DeviceBuilder::code_bits(20'000'000), 40u);
}

TEST_F(Builders, HitsDoNotDependOnTheBuilder) {
  std::vector<const char*> methods{"while-while", "bvh4", "packet-wide", "frontier"};
  if (!harness::at_default_size(gpu_->info())) methods.resize(1);  // the others take long to compile
  std::size_t dealt = 0;
  for (const TreeShape& shape : kTreeShapes) {
    if (!is_dealt(gpu_->info(), dealt++)) continue;
    SCOPED_TRACE(shape.name);
    const Triangles triangles = shape.make();
    std::vector<Ray> rays;
    std::vector<Hit> first;
    for (const Builder& builder : kBuilders) {
      if (builder.chooses) continue;
      const Bvh bvh = sound(triangles, {}, builder);
      if (first.empty())
        for (const shapes::RaySet& set : shapes::ray_sets(triangles, bvh))
          for (std::size_t i = 0; i < set.rays.size(); i += 4) rays.push_back(set.rays[i]);
      // Kernels for trees of about the same depth are the same, so few are compiled.
      TreeFacts facts{.depth = 60, .largest_leaf = MAX_LEAF_TRIANGLES};
      while (facts.depth < bvh.stats.depth) facts.depth *= 4;
      Tracer tracer(*gpu_, bvh, triangles, facts);
      for (const char* method : methods) {
        std::vector<Hit> hits(rays.size());
        tracer.trace(rays, hits, {.method = method});
        if (first.empty()) first = hits;
        EXPECT_EQ(count_different(first, hits), 0u) << builder.name << ", " << method;
      }
    }
  }
}

/// A tree as the device writes it.
PairTree written(Context& gpu, DeviceBuild& build, NodeLayout layout, Padding padding) {
  PairTree tree;
  tree.layout = layout;
  tree.root = build.built().root;
  tree.origin = build.built().origin;
  Buffer<glm::uvec4> pairs(gpu, build.built().pairs * tree.pair_texels(), Access::Storage, "pairs");
  Buffer<glm::uvec4> leaves(gpu, build.built().leaf_texels, Access::Storage, "leaves");
  build.write(layout, padding, pairs, leaves);
  tree.nodes.resize(pairs.size());
  tree.leaves.resize(leaves.size());
  pairs.download(tree.nodes);
  leaves.download(tree.leaves);
  return tree;
}

/// Expects that `inner` lies in `outer`, and that `outer` is not much larger: by 2^-6 of its extent, as half extents
/// may have 8 bits, and by a millionth of its coordinates.
bool is_close_around(const Bounds& outer, const Bounds& inner) {
  for (int axis = 0; axis < 3; ++axis) {
    const double extent = double(inner.hi[axis]) - inner.lo[axis];
    const double far = std::max(std::abs(double(inner.lo[axis])), std::abs(double(inner.hi[axis])));
    const double slack = extent / 64 + far * 1e-6 + 1e-30;
    if (outer.lo[axis] > inner.lo[axis] || outer.hi[axis] < inner.hi[axis]) return false;
    if (outer.lo[axis] < inner.lo[axis] - slack || outer.hi[axis] > inner.hi[axis] + slack) return false;
  }
  return true;
}

// Boxes hold those of the reference form, in every layout and padding, and are hardly larger.
TEST_F(Builders, BoxesAreWrittenAsOnTheHost) {
  for (const TreeShape& shape : kTreeShapes) {
    const Triangles triangles = shape.make();
    DeviceBuild build(*gpu_, triangles, {});
    const Bvh& bvh = build.bvh();
    if (bvh.nodes.size() < 3) continue;
    std::vector<Bounds> own(bvh.nodes.size());
    for (std::size_t i = 0; i < own.size(); ++i)
      own[i] = {bvh.nodes[i].lo - build.built().origin, bvh.nodes[i].hi - build.built().origin};
    for (const NodeLayout layout :
         {NodeLayout::Paper, NodeLayout::Interleaved, NodeLayout::Centred, NodeLayout::Compact})
      for (const Padding padding : {Padding::Ray, Padding::Tree}) {
        if (padding == Padding::Tree && padded_reach(bvh.bounds) == 0) continue;
        const PairTree tree = written(*gpu_, build, layout, padding);
        const std::vector<Bounds> boxes = padding == Padding::Tree ? padded_boxes(bvh, triangles) : own;
        std::vector<std::pair<std::uint32_t, std::uint32_t>> todo{{0, tree.root}};
        std::size_t wrong = 0;
        while (!todo.empty()) {
          const auto [node, ref] = todo.back();
          todo.pop_back();
          if (is_leaf(ref)) continue;
          const DevicePair pair = decode_pair(tree, ref);
          const std::uint32_t first = bvh.nodes[node].first;
          wrong += !is_close_around(pair.left.box, boxes[first]) + !is_close_around(pair.right.box, boxes[first + 1]);
          todo.push_back({first, pair.left.ref});
          todo.push_back({first + 1, pair.right.ref});
        }
        EXPECT_EQ(wrong, 0u) << shape.name << ", layout " << int(layout) << ", padding " << int(padding);
      }
  }
}

/// Adds the leaves below a child reference, and the boxes of all children by their references.
void collect(const PairTree& tree, std::uint32_t from, std::vector<std::uint32_t>& leaves,
             std::map<std::uint32_t, Bounds>& boxes) {
  std::vector<std::uint32_t> todo{from};
  while (!todo.empty()) {
    const std::uint32_t ref = todo.back();
    todo.pop_back();
    if (is_leaf(ref)) {
      leaves.push_back(ref);
      continue;
    }
    const DevicePair pair = decode_pair(tree, ref);
    for (const DeviceChild& child : {pair.left, pair.right}) {
      boxes[child.ref] = child.box;
      todo.push_back(child.ref);
    }
  }
}

// For each octant the frontier that the device writes holds every leaf once, below boxes that hold those of the pairs;
// the same nodes for all octants, as many as there may be.
TEST_F(Builders, FrontiersHoldEveryLeafOnce) {
  for (const TreeShape& shape : kTreeShapes)
    for (const NodeLayout layout :
         {NodeLayout::Paper, NodeLayout::Interleaved, NodeLayout::Centred, NodeLayout::Compact}) {
      SCOPED_TRACE(fmt::format("{}, layout {}", shape.name, int(layout)));
      const std::uint32_t nodes = layout == NodeLayout::Compact ? 64 : 32;
      DeviceBuild build(*gpu_, shape.make(), {});
      PairTree tree;
      tree.layout = layout;
      Buffer<glm::uvec4> pairs(*gpu_, build.built().pairs * tree.pair_texels(), Access::Storage, "pairs"),
          leaves(*gpu_, build.built().leaf_texels, Access::Storage, "leaves"),
          frontier(*gpu_, 2 * FRONTIER_OCTANTS * nodes, Access::Storage, "frontier");
      build.write(layout, Padding::Ray, pairs, leaves);
      build.write_frontier(layout, pairs, nodes, frontier);
      tree.nodes.resize(pairs.size());
      pairs.download(tree.nodes);
      std::vector<glm::uvec4> texels(frontier.size());
      frontier.download(texels);
      std::vector<std::uint32_t> expected, first;
      std::map<std::uint32_t, Bounds> boxes;
      if (build.built().root != END_OF_TREE) collect(tree, build.built().root, expected, boxes);
      std::ranges::sort(expected);
      for (std::size_t octant = 0; octant < FRONTIER_OCTANTS; ++octant) {
        std::vector<std::uint32_t> refs, below;
        for (std::size_t i = octant * nodes; i < (octant + 1) * nodes; ++i) {
          const Bounds box{as_vec3(texels[2 * i]), as_vec3(texels[2 * i + 1])};
          const std::uint32_t ref = texels[2 * i].w;
          if (ref == END_OF_TREE) {
            EXPECT_GT(box.lo.x, box.hi.x);
            continue;
          }
          EXPECT_EQ(refs.size(), i - octant * nodes) << "behind an unused place";
          refs.push_back(ref);
          std::map<std::uint32_t, Bounds> ignored;
          collect(tree, ref, below, ignored);
          if (ref != build.built().root) {
            EXPECT_TRUE(is_close_around(box, boxes.at(ref)));
          }
        }
        std::ranges::sort(below);
        EXPECT_EQ(below, expected);
        EXPECT_EQ(refs.size(), std::min<std::size_t>(nodes, expected.size()));
        std::ranges::sort(refs);
        if (octant == 0) first = refs;
        EXPECT_EQ(refs, first);
      }
    }
}

// Kernels read the arrays that the device wrote, without a tree on the host.
TEST_F(Builders, TreesOfTheDeviceAreTracedWhereTheyLie) {
  const Triangles triangles = shapes::soup(3001, 0.1f);
  const auto build = std::make_shared<DeviceBuild>(*gpu_, triangles, BuildSettings{});
  const Bvh best = build_bvh(triangles);
  TreeFacts facts = facts_of(build->summary());
  facts.depth = std::max(facts.depth, best.stats.depth);
  Tracer host(*gpu_, best, triangles, facts);
  Tracer there(*gpu_, build->summary(), triangles, facts, build);
  const std::vector<Ray> rays = shapes::random_rays(1999);
  std::vector<Hit> expected(rays.size()), hits(rays.size());
  host.trace(rays, expected, {.method = "while-while"});
  std::vector<Query> queries{{.method = "bvh4"}, {.method = "packet"}, {.method = "frontier"}};
  for (const char* layout : {"paper", "interleaved", "centred", "compact"})
    for (const char* padding : {"ray", "tree"})
      queries.push_back({.method = "while-while", .knobs = {{"layout", layout}, {"padding", padding}}});
  for (const Query& query : queries) {
    there.trace(rays, hits, query);
    EXPECT_EQ(count_different(expected, hits), 0u) << there.variant(query).name();
  }
}

/// Returns the text of the error that `work` throws; "" if it throws none.
std::string error_of(const std::function<void()>& work) {
  try {
    work();
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

// A tree that is too large for one kind of buffers is read through another, with the same hits, wherever it was built.
TEST_F(Builders, TreesBeyondTheLimitsOfABufferAreReadInAnotherWay) {
  constexpr std::uint64_t kTexels = 8000, kStorage = 250'000;  // leaves have more texels
  const Triangles triangles = shapes::soup(3001, 0.1f);
  const std::vector<Ray> rays = shapes::random_rays(1999);
  Context narrow(options());
  narrow.lower_limits(kTexels, kStorage);
  const Bvh bvh = build_bvh(triangles);
  const auto build = std::make_shared<DeviceBuild>(narrow, triangles, BuildSettings{});
  Tracer wide(*gpu_, bvh, triangles, facts_of(bvh)), host(narrow, bvh, triangles, facts_of(bvh)),
      there(narrow, build->summary(), triangles, facts_of(build->summary()), build);
  for (const char* method : {"while-while", "bvh4"}) {
    const Query query{.method = method};
    std::vector<Hit> expected(rays.size()), hits(rays.size());
    wide.trace(rays, expected, query);
    for (Tracer* tracer : {&host, &there}) {
      EXPECT_EQ(tracer->variant(query).config.fetch, Fetch::Reference) << method;
      tracer->trace(rays, hits, query);
      EXPECT_EQ(count_different(expected, hits), 0u) << method;
    }
  }
  const std::string asked = error_of([&] { host.kernel({.method = "while-while", .knobs = {{"fetch", "texel"}}}); });
  EXPECT_NE(asked.find("maxTexelBufferElements"), asked.npos) << asked;
  const std::string built = error_of([&] { DeviceBuild(narrow, shapes::soup(4001, 0.1f), BuildSettings{}); });
  EXPECT_NE(built.find("4001 triangles, but builder 'device' takes 3125"), built.npos) << built;
  expect_silent(narrow);
}

TEST_F(Builders, SortAgreesWithTheStandardLibrary) {
  shapes::Random random(5);
  for (const std::uint32_t bits : {32u, 40u, 64u})
    for (const std::uint32_t count : {0u, 1u, 255u, 256u, 4097u, 30011u}) {
      std::vector<std::uint64_t> keys(count);
      for (std::uint64_t& key : keys) {
        key = std::uint64_t(random.below(1ull << 32)) << 32 | random.below(1ull << 32);
        if (count % 2) key &= 0x0F00'0003'0000'00FFull;  // many equal digits and keys
        if (bits < 64) key &= (1ull << bits) - 1;
      }
      const std::uint32_t words = key_words(bits);
      std::vector<std::uint32_t> given(count * words), prims(count), out(count * words);
      for (std::size_t i = 0; i < count; ++i)
        for (std::uint32_t w = 0; w < words; ++w) given[i * words + w] = std::uint32_t(keys[i] >> 32 * w);
      const auto make = [&](std::size_t n) { return Buffer<std::uint32_t>(*gpu_, n, Access::Storage, "sort"); };
      Buffer<std::uint32_t> a = make(count * words), b = make(count * words), p = make(count), q = make(count);
      a.upload(given);
      RadixSort sort(*gpu_, bits, count);
      PassMs ms;
      const std::size_t at = sort.record({{&a, &b}, {&p, &q}}, {count}, added_to(ms, "sort"));
      (at ? b : a).download(out);
      std::vector<std::uint32_t> expected(count);
      std::iota(expected.begin(), expected.end(), 0u);
      std::ranges::stable_sort(expected, {}, [&](std::uint32_t i) { return keys[i]; });
      if (count) (at ? q : p).download(prims);
      EXPECT_EQ(prims, expected) << bits << " bits, " << count << " keys";
      for (std::size_t i = 0; i < count; ++i)
        for (std::uint32_t w = 0; w < words; ++w)
          ASSERT_EQ(out[i * words + w], std::uint32_t(keys[expected[i]] >> 32 * w)) << bits << " bits, key " << i;
    }
}

}  // namespace
}  // namespace ballot
