#include "engine/answer/repair.h"

#include <limits>
#include <optional>
#include <string>

#include "engine/oracle/in_double.h"
#include "engine/oracle/predicates.h"
#include "engine/tree/formats/pair_decode.h"

namespace ballot {

namespace {

/// Returns the steps of a leaf, as pieces_of() counts them.
std::uint64_t leaf_steps(std::uint32_t leaf) { return 1 + leaf_count(leaf); }

/// Returns how the exact t of hits on two triangles of a single tree, or of one instance, compare. The hits of two
/// instances are ordered by their rounded t.
std::strong_ordering exact_order(const Ray& ray, const DeviceTree& tree, std::uint32_t a, std::uint32_t b) {
  if (const Forest* forest = tree.forest()) {
    const Forest::Place at = forest->place_of(a), other = forest->place_of(b);
    if (at.instance != other.instance) return std::strong_ordering::equal;
    const Instance& instance = forest->instances()[at.instance];
    const std::span<const Triangle> mesh = tree.triangles(instance.mesh);
    const Ray moved = object_ray(ray, instance.map);
    return compare_t(ExactSight(moved, mesh[at.triangle]), ExactSight(moved, mesh[other.triangle]));
  }
  return compare_t(ExactSight(ray, tree.triangles()[a]), ExactSight(ray, tree.triangles()[b]));
}

/// Returns t in double of a hit of a single tree, which mode double compares.
double t_in_double(const RayInDouble& ray, const DeviceTree& tree, std::uint32_t prim) {
  const CornersInDouble corners =
      tree.doubles() ? tree.doubles()->here()[prim] : ballot::widened(tree.triangles()[prim]);
  return sight_in_double(ray, corners).t;
}

/// Returns true if hit a comes before hit b of the same ray. Mode double compares t before it is rounded.
bool better(const RayInDouble& ray, const DeviceTree& tree, const NumericMode&, const Hit& a, const Hit& b) {
  if (a.prim == NO_HIT || b.prim == NO_HIT) return b.prim == NO_HIT && a.prim != NO_HIT;
  if (a.t != b.t || tree.forest()) return a.t < b.t || (a.t == b.t && a.prim < b.prim);
  const double t = t_in_double(ray, tree, a.prim), other = t_in_double(ray, tree, b.prim);
  return t < other || (t == other && a.prim < b.prim);
}

/// The same of rays in float32. An exact mode compares t before it is rounded.
bool better(const Ray& ray, const DeviceTree& tree, const NumericMode& mode, const Hit& a, const Hit& b) {
  if (mode.triangle == TRIANGLE_DOUBLE) return better(in_double(ray), tree, mode, a, b);
  if (a.prim == NO_HIT || b.prim == NO_HIT) return b.prim == NO_HIT && a.prim != NO_HIT;
  if (mode.arithmetic == Arithmetic::Exact && a.prim != b.prim && (!tree.forest() || a.t == b.t)) {
    const auto order = exact_order(ray, tree, a.prim, b.prim);
    return order < 0 || (order == 0 && a.prim < b.prim);
  }
  return a.t < b.t || (a.t == b.t && a.prim < b.prim);
}

/// Returns the first texels of the inner nodes of a top-level tree, parents before their children.
std::vector<std::uint32_t> inner_nodes(const TopTree& top) {
  std::vector<std::uint32_t> nodes;
  if (!is_leaf(top.root)) nodes.push_back(top.root);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (const std::uint32_t child : {top.texels[nodes[i]].w, top.texels[nodes[i] + 2].w})
      if (!is_leaf(child)) nodes.push_back(child);
  return nodes;
}

/// Returns the steps of a mesh, as pieces_of() counts them.
std::uint64_t mesh_steps(const PairTree& mesh) { return mesh.nodes.size() / mesh.pair_texels() + mesh.leaves.size(); }

}  // namespace

std::vector<TreePiece> pieces_of(const TopTree& top, const Forest& forest, const MeshPairs& pairs,
                                 std::uint64_t limit) {
  if (top.root == END_OF_TREE) return {{top.root}};
  std::vector<std::uint64_t> of_mesh;
  for (std::size_t i = 0; i < forest.meshes().size(); ++i) of_mesh.push_back(mesh_steps(pairs(i)));
  std::vector<std::uint64_t> steps(top.records / TOP_NODE_TEXELS);
  const auto mesh_of = [&](std::uint32_t leaf) { return forest.mesh_of(leaf & ~LEAF_BIT); };
  const auto steps_of = [&](std::uint32_t node) {
    return is_leaf(node) ? of_mesh[mesh_of(node)] : steps[node / TOP_NODE_TEXELS];
  };
  const std::vector<std::uint32_t> nodes = inner_nodes(top);
  for (std::size_t i = nodes.size(); i-- > 0;)
    steps[nodes[i] / TOP_NODE_TEXELS] = 1 + steps_of(top.texels[nodes[i]].w) + steps_of(top.texels[nodes[i] + 2].w);
  std::vector<TreePiece> pieces;
  std::vector<std::uint32_t> open{top.root};
  while (!open.empty()) {
    const std::uint32_t node = open.back();
    open.pop_back();
    if (steps_of(node) <= limit) {
      pieces.push_back({node});
    } else if (is_leaf(node)) {
      for (const std::uint32_t root : pieces_of(pairs(mesh_of(node)), limit)) pieces.push_back({node, root});
    } else {
      open.push_back(top.texels[node + 2].w);
      open.push_back(top.texels[node].w);
    }
  }
  return pieces;
}

std::vector<std::uint32_t> pieces_of(const PairTree& bvh, std::uint64_t limit) {
  if (bvh.root == END_OF_TREE || is_leaf(bvh.root)) return {bvh.root};
  // Children lie behind their parents, so one pass from the back sums the steps below every pair.
  std::vector<std::uint64_t> steps(bvh.nodes.size() / bvh.pair_texels(), 0);
  const auto steps_of = [&](std::uint32_t node) {
    return is_leaf(node) ? leaf_steps(node) : steps[node / bvh.pair_texels()];
  };
  for (std::size_t pair = steps.size(); pair-- > 0;) {
    const DevicePair children = decode_pair(bvh, std::uint32_t(pair) * bvh.pair_texels());
    steps[pair] = 1 + steps_of(children.left.ref) + steps_of(children.right.ref);
  }
  std::vector<std::uint32_t> pieces, open{bvh.root};
  while (!open.empty()) {
    const std::uint32_t node = open.back();
    open.pop_back();
    if (is_leaf(node) || steps_of(node) <= limit) {
      pieces.push_back(node);
      continue;
    }
    const DevicePair children = decode_pair(bvh, node);
    open.push_back(children.right.ref);
    open.push_back(children.left.ref);
  }
  return pieces;
}

std::vector<TreePiece> pieces_of(DeviceTree& tree, const TreeAccess& access, std::uint64_t limit) {
  if (const Forest* forest = tree.forest())
    return pieces_of(
        tree.top_tree(), *forest,
        [&](std::size_t mesh) -> const PairTree& { return tree.mesh_pairs(mesh, access.layout, access.padding); },
        limit);
  std::vector<TreePiece> all;
  for (const std::uint32_t root : pieces_of(tree.pairs(access.layout, access.padding), limit)) all.push_back({root});
  return all;
}

Query repair_query(Query query) {
  if (!format_of(find_method(query.method).tree).begins_at_pairs()) {  // pieces are subtrees of the pair tree
    query.method = kPlainestMethod;
    query.knobs = {};
  }
  query.knobs["launch"] = "plain";  // one invocation per ray, so that rays do not share the limit of loop iterations
  return query;
}

/// The rays of a buffer, each of which an invocation traces.
template <class Given>
class Repair::Walks {
 public:
  using Answer = Hit;
  static constexpr const char* kQueries = "rays";

  Walks(const Repair& repair, std::span<const Given> rays, TraceTimes& times)
      : repair_(repair), all_(rays), times_(times) {}

  static Hit none() { return {std::numeric_limits<float>::infinity(), NO_HIT, 0, 0}; }
  std::string name() const { return "kernel " + repair_.job_.kernel->kernel->name(); }

  void choose(std::span<const std::uint32_t> numbers) {
    part_.clear();
    for (const std::uint32_t i : numbers) part_.push_back(all_[i]);
    rays_.emplace(repair_.gpu_, part_.size(), Access::Storage, "rays cut short").upload(part_);
    hits_.emplace(repair_.gpu_, part_.size(), Access::Storage, "hits cut short");
  }

  std::vector<TreePiece> pieces(std::uint64_t limit) const {
    return pieces_of(repair_.tree_, repair_.job_.variant.config.tree_access(), limit);
  }

  void ask(const TreePiece& piece, std::span<Hit> found) {
    repair_.dispatcher_.run(repair_.job_, *rays_, *hits_, {0, std::uint32_t(part_.size())}, piece, times_);
    hits_->download(found);
  }

  void add(std::size_t k, Hit& best, const Hit& found) const {
    if (better(part_[k], repair_.tree_, *repair_.job_.variant.numeric, found, best)) best = found;
  }

 private:
  const Repair& repair_;
  std::span<const Given> all_;
  TraceTimes& times_;
  std::vector<Given> part_;
  std::optional<Buffer<Given>> rays_;
  std::optional<Buffer<Hit>> hits_;
};

template <class Given>
void Repair::finish(const Buffer<Given>& rays, Buffer<Hit>& hits, std::uint32_t count, TraceTimes& times) {
  std::vector<Hit> all(count);
  std::vector<Given> all_rays(count);
  hits.download(all);
  rays.download(all_rays);
  Walks<Given> walks(*this, all_rays, times);
  repair(walks, std::span(all), kWholeTree, gpu_, times);
  hits.upload(all);
}

void Repair::run(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, TraceTimes& times) {
  finish(rays, hits, count, times);
}

void Repair::run(const Buffer<RayInDouble>& rays, Buffer<Hit>& hits, std::uint32_t count, TraceTimes& times) {
  finish(rays, hits, count, times);
}

}  // namespace ballot
