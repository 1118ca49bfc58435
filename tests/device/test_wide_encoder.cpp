// Compares the wide trees that the device makes of its pairs with the host's of the same pairs, and traces them.
#include <algorithm>

#include "engine/tree/device/wide_encoder.h"
#include "engine/tree/formats/pair_decode.h"
#include "engine/tree/host/padding.h"
#include "tests/device/builders.h"
#include "tests/device/ray_sets.h"

namespace ballot {
namespace {

using namespace harness;
using shapes::Triangles;
using tree_shapes::kTreeShapes;
using tree_shapes::TreeShape;
using Texels = std::vector<glm::uvec4>;

Texels downloaded(const Buffer<glm::uvec4>& buffer) {
  Texels texels(buffer.size());
  buffer.download(texels);
  return texels;
}

/// The pairs of a device tree: `there` on the device, `here` on the host with parents before their children.
struct Pairs {
  Buffer<glm::uvec4> there, leaves;
  PairTree here;

  Pairs(Context& gpu, DeviceBuild& build, Padding padding)
      : there(gpu, build.built().pairs * PAIR_TEXELS(LAYOUT_INTERLEAVED), Access::Storage, "pairs"),
        leaves(gpu, build.built().leaf_texels, Access::Storage, "leaves") {
    read(build, padding);
  }

  void read(DeviceBuild& build, Padding padding) {
    build.write(NodeLayout::Interleaved, padding, there, leaves);
    const Texels texels = downloaded(there);
    here = {};
    here.root = build.built().root;
    std::vector<std::uint32_t> order{0};
    for (std::size_t i = 0; i < order.size(); ++i) {
      here.nodes.insert(here.nodes.end(), &texels[order[i]], &texels[order[i]] + 4);
      for (int side = 0; side < 2; ++side) {
        std::uint32_t& ref = here.nodes[4 * i + 3][side];
        if (is_leaf(ref)) continue;
        order.push_back(ref);
        ref = std::uint32_t(4 * (order.size() - 1));
      }
    }
    const DevicePair pair = decode_pair(here, 0);
    here.root_box = {glm::min(pair.left.box.lo, pair.right.box.lo), glm::max(pair.left.box.hi, pair.right.box.hi)};
  }
};

/// A child of a wide node: its box as the format stores it, in steps or as bits of floats.
struct Child {
  std::uint32_t ref = END_OF_TREE;  // a leaf, or the number of a node
  std::vector<std::uint32_t> box;
  std::uint32_t slot = 0;
};

/// A node: its grid, and its children in order; those of bvh8 by their slots.
struct Node {
  std::vector<std::uint32_t> grid;
  std::vector<Child> children;
};

Node bvh4_node(const Texels& texels, std::uint32_t number) {
  const glm::uvec4* t = &texels[number * BVH4_NODE_TEXELS];
  Node node{{t[0].x, t[0].y, t[0].z, t[0].w, t[1].w, t[2].w}, {}};
  for (std::uint32_t c = 0; c < BVH4_CHILDREN; ++c) {
    const std::uint32_t ref = t[3][int(c)];
    node.children.push_back({is_leaf(ref) ? ref : ref / BVH4_NODE_TEXELS, {}, c});
    for (int axis = 0; axis < 3; ++axis)
      for (int side : {1, 2}) node.children.back().box.push_back(t[side][axis] >> 8 * c & 255);
  }
  return node;
}

Node wide8_node(const Texels& texels, std::uint32_t number) {
  const glm::uvec4* t = &texels[number * WIDE8_NODE_TEXELS];
  Node node;
  for (std::uint32_t c = 0; c < WIDE8_CHILDREN; ++c) {
    const glm::uvec4 lo = t[c], hi = t[WIDE8_CHILDREN + c];
    node.children.push_back({lo.w, {lo.x, lo.y, lo.z, hi.x, hi.y, hi.z}, c});
  }
  return node;
}

Node bvh8_node(const Texels& texels, std::uint32_t number) {
  const glm::uvec4* t = &texels[number * BVH8_NODE_TEXELS];
  Node node{{t[0].x, t[0].y, t[0].z, t[1].x, t[1].y, t[1].z}, {}};
  std::uint32_t inner = t[0].w >> 8, leaf = 0;
  for (std::uint32_t s = 0; s < BVH8_CHILDREN; ++s) {
    Child child{END_OF_TREE, {}, s};
    if (t[0].w >> s & 1) child.ref = inner++;
    if (t[1].w >> s & 1) child.ref = texels[(t[1].w >> 8) + leaf / 4][int(leaf % 4)], ++leaf;
    for (int axis = 0; axis < 3; ++axis)
      for (std::uint32_t side : {0u, 2u}) child.box.push_back(t[2 + axis][int(side + s / 4)] >> 8 * (s % 4) & 255);
    if (child.ref != END_OF_TREE) node.children.push_back(child);
  }
  return node;
}

Node node_of(TreeFormatId id, const Texels& texels, std::uint32_t number) {
  return id == TreeFormatId::Bvh4   ? bvh4_node(texels, number)
         : id == TreeFormatId::Bvh8 ? bvh8_node(texels, number)
                                    : wide8_node(texels, number);
}

/// Returns the sum that bvh8.h makes largest, doubled, in scene units and of the boxes on the grid.
double gain_of(const Node& node) {
  double gain = 0;
  for (const Child& c : node.children)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double centre = (c.box[2 * axis] + c.box[2 * axis + 1] - 255.0) * as_float(node.grid[3 + axis]);
      gain += c.slot >> axis & 1 ? centre : -centre;
    }
  return gain;
}

/// The least leaf reference below each node, by which the nodes of two trees are matched.
std::vector<std::uint32_t> least_leaves(TreeFormatId id, const Texels& texels) {
  std::vector<std::uint32_t> order{0}, least(texels.size() / format_of(id).node_texels, END_OF_TREE);
  for (std::size_t i = 0; i < order.size(); ++i)
    for (const Child& c : node_of(id, texels, order[i]).children)
      if (!is_leaf(c.ref)) order.push_back(c.ref);
  for (std::size_t i = order.size(); i-- > 0;)
    for (const Child& c : node_of(id, texels, order[i]).children)
      least[order[i]] = std::min(least[order[i]], is_leaf(c.ref) ? c.ref : least[c.ref]);
  return least;
}

/// Expects two trees to be the same but for the order of nodes and, in bvh8, slots whose sum is at most 1 % less.
/// `moved`: the first tree was refitted and kept its slots, which are not compared. Returns the number of nodes.
std::size_t compare(TreeFormatId id, const Texels& there, const Texels& here, bool moved) {
  const bool slots = id == TreeFormatId::Bvh8;
  const std::vector<std::uint32_t> below_there = least_leaves(id, there), below_here = least_leaves(id, here);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> todo{{0, 0}};
  std::size_t wrong = 0, worse = 0;
  for (std::size_t i = 0; i < todo.size(); ++i) {
    Node a = node_of(id, there, todo[i].first), b = node_of(id, here, todo[i].second);
    const double gain = gain_of(slots ? a : Node{}), best = gain_of(slots ? b : Node{});
    worse += !moved && gain < best - 0.01 * std::abs(best);
    const auto sort = [&](Node& node, const std::vector<std::uint32_t>& below) {
      if (slots)
        std::ranges::sort(node.children, {}, [&](const Child& c) { return is_leaf(c.ref) ? c.ref : below[c.ref]; });
    };
    sort(a, below_there);
    sort(b, below_here);
    // As floats: minima of 0 and -0 may be either.
    const bool same_grid = std::ranges::equal(a.grid, b.grid, {}, as_float, as_float);
    if (!same_grid || a.children.size() != b.children.size()) {
      ADD_FAILURE() << "node " << i << ": another grid or other children";
      return 0;
    }
    for (std::size_t c = 0; c < a.children.size(); ++c) {
      const Child &x = a.children[c], &y = b.children[c];
      wrong += x.box != y.box || is_leaf(x.ref) != is_leaf(y.ref) || (is_leaf(x.ref) && x.ref != y.ref);
      if (!is_leaf(x.ref) && !is_leaf(y.ref)) todo.push_back({x.ref, y.ref});
    }
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(worse, 0u);
  return todo.size();
}

/// Expects the wide tree of a shape to be that of the host.
void expect_as_on_the_host(Context& gpu, DeviceBuild& build, TreeFormatId id, const Pairs& pairs,
                           const WideShape& shape, bool moved) {
  const TreeFormat& format = format_of(id);
  Buffer<glm::uvec4> texels(gpu, build.encoder(id).texels(shape), Access::Storage, "wide tree");
  build.encoder(id).write(shape, pairs.there, texels);
  const Texels there = downloaded(texels), here = format.encode(pairs.here, 0);
  EXPECT_EQ(there.size(), here.size());
  EXPECT_EQ(compare(id, there, here, moved), shape.nodes);
}

/// The fixture Builders, in a suite of its own.
class WideEncoders : public Builders {};

constexpr TreeFormatId kWide[] = {TreeFormatId::Bvh4, TreeFormatId::Bvh8, TreeFormatId::Wide8};

// The device chooses the same nodes as the host, and gives them the same boxes, bit for bit.
TEST_F(WideEncoders, TreesAreThoseOfTheHost) {
  for (const TreeShape& shape : kTreeShapes) {
    DeviceBuild build(*gpu_, shape.make(), {});
    if (is_leaf(build.built().root)) continue;
    for (const TreeFormatId id : kWide)
      for (const Padding padding : {Padding::Ray, Padding::Tree}) {
        if (padding == Padding::Tree && (!format_of(id).padded || padded_reach(build.built().bounds) == 0)) continue;
        SCOPED_TRACE(fmt::format("{}, {}, padding {}", shape.name, format_of(id).name, int(padding)));
        const Pairs pairs(*gpu_, build, padding);
        expect_as_on_the_host(*gpu_, build, id, pairs, build.collapse(id, pairs.there), false);
      }
  }
}

// A tree that is one leaf is encoded as one node that holds the leaf.
TEST_F(WideEncoders, OneLeafIsOneNode) {
  DeviceBuild build(*gpu_, shapes::soup(1, 1), {});
  ASSERT_TRUE(is_leaf(build.built().root));
  const Pairs pairs(*gpu_, build, Padding::Tree);
  for (const TreeFormatId id : kWide) {
    const WideShape shape = build.collapse(id, pairs.there);
    EXPECT_EQ(shape.nodes, 1u);
    Buffer<glm::uvec4> texels(*gpu_, build.encoder(id).texels(shape), Access::Storage, "wide tree");
    build.encoder(id).write(shape, pairs.there, texels);
    std::size_t leaves = 0;
    for (const Child& c : node_of(id, downloaded(texels), 0).children) leaves += c.ref == build.built().root;
    EXPECT_EQ(leaves, 1u) << format_of(id).name;
  }
}

// After a refit the shape stays, and the boxes are those that the host gives the same children.
TEST_F(WideEncoders, BoxesFollowRefits) {
  const Triangles triangles = shapes::soup(2001, 0.1f), half = shapes::scaled(triangles, 0.5f);
  for (const TreeFormatId id : kWide) {
    DeviceBuild build(*gpu_, triangles, {});
    Pairs pairs(*gpu_, build, Padding::Ray);
    const WideShape shape = build.collapse(id, pairs.there);
    for (const Triangles* to : {&half, &triangles}) {  // halving is exact, so the host collapses it to the same nodes
      build.upload(*to);
      build.begin_refit(bounds_of_vertices(*to, "moved"));
      ASSERT_TRUE(build.end_refit());
      pairs.read(build, Padding::Ray);
      SCOPED_TRACE(format_of(id).name);
      expect_as_on_the_host(*gpu_, build, id, pairs, shape, true);
    }
  }
}

// Arrays are the same in every run: nothing depends on which lanes come first.
TEST_F(WideEncoders, ArraysAreTheSameInEveryRun) {
  DeviceBuild build(*gpu_, shapes::soup(5000, 0.05f), {});
  const Pairs pairs(*gpu_, build, Padding::Ray);
  for (const TreeFormatId id : kWide) {
    Texels first;
    for (int run = 0; run < 3; ++run) {
      const WideShape shape = build.collapse(id, pairs.there);
      Buffer<glm::uvec4> texels(*gpu_, build.encoder(id).texels(shape), Access::Storage, "wide tree");
      build.encoder(id).write(shape, pairs.there, texels);
      const Texels found = downloaded(texels);
      if (run == 0) first = found;
      EXPECT_EQ(found, first) << format_of(id).name;
    }
  }
}

// Kernels find the hits of the host's tree in wide trees where the device wrote them, after a refit too.
TEST_F(WideEncoders, WideTreesAreTracedWhereTheyLie) {
  std::vector<Query> queries{{.method = "bvh8"}};
  if (harness::at_default_size(gpu_->info()))  // else lavapipe compiles too long
    for (const char* method : {"bvh4", "packet-wide"}) queries.push_back({.method = method});
  const Triangles triangles = shapes::soup(3001, 0.1f), moved = shapes::soup(3001, 0.1f, 9);
  const auto build = std::make_shared<DeviceBuild>(*gpu_, triangles, BuildSettings{});
  const Bvh host = build_bvh(triangles, {.split_budget = 0}), after = build_bvh(moved, {.split_budget = 0});
  const TreeFacts facts{.depth = 60, .largest_leaf = MAX_LEAF_TRIANGLES};
  Tracer before(*gpu_, host, triangles, facts), then(*gpu_, after, moved, facts),
      there(*gpu_, build->summary(), triangles, facts, build);
  const std::vector<Ray> rays = shapes::random_rays(1999);
  std::vector<Hit> expected(rays.size()), hits(rays.size());
  before.trace(rays, expected, {.method = "while-while"});
  for (const Query& query : queries) {
    EXPECT_EQ(there.tree().source_of(find_method(query.method).tree, LeafFormat::Vertices), Source::Device);
    there.trace(rays, hits, query);
    EXPECT_EQ(count_different(expected, hits), 0u) << query.method;
  }
  ASSERT_TRUE(there.tree().refit(moved, bounds_of_vertices(moved, "moved")));
  const Bvh summary = build->summary();
  there.moved(summary, moved, facts);
  then.trace(rays, expected, {.method = "while-while"});
  for (const Query& query : queries) {
    there.trace(rays, hits, query);
    EXPECT_EQ(count_different(expected, hits), 0u) << query.method << ", moved";
  }
}

}  // namespace
}  // namespace ballot
