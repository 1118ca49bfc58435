#include "engine/trace/repair.h"

#include "engine/core/error.h"
#include "engine/formats/pair_decode.h"
#include "engine/oracle/predicates.h"

namespace ballot {

namespace {

/// Returns the steps of a leaf, as pieces_of() counts them.
std::uint64_t leaf_steps(std::uint32_t leaf) { return 1 + leaf_count(leaf); }

/// Returns true if hit a comes before hit b of the same ray. An exact mode compares t before it is rounded.
bool better(const Ray& ray, std::span<const Triangle> triangles, const NumericMode& mode, const Hit& a, const Hit& b) {
  if (a.prim == NO_HIT || b.prim == NO_HIT) return b.prim == NO_HIT && a.prim != NO_HIT;
  if (mode.arithmetic == Arithmetic::Exact && a.prim != b.prim) {
    const auto order = compare_t(ExactSight(ray, triangles[a.prim]), ExactSight(ray, triangles[b.prim]));
    return order < 0 || (order == 0 && a.prim < b.prim);
  }
  return a.t < b.t || (a.t == b.t && a.prim < b.prim);
}

}  // namespace

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

Query repair_query(Query query) {
  if (format_of(find_method(query.method).tree).collapsed) {  // pieces are subtrees of the binary tree
    query.method = kPlainestMethod;
    query.knobs = {};
  }
  query.knobs["launch"] = "plain";  // one invocation per ray, so that rays do not share the limit of loop iterations
  return query;
}

void Repair::trace_pieces(std::span<const Ray> part, std::uint64_t limit, std::vector<Hit>& best,
                          std::vector<bool>& cut, TraceTimes& times) {
  Buffer<Ray> rays(gpu_, part.size(), Access::Storage, "rays cut short");
  Buffer<Hit> hits(gpu_, part.size(), Access::Storage, "hits cut short");
  rays.upload(part);
  std::vector<Hit> found(part.size());
  const KernelConfig& config = job_.variant.config;
  for (const std::uint32_t root : pieces_of(tree_.pairs(config.layout, config.padding), limit)) {
    dispatcher_.run(job_, rays, hits, std::uint32_t(part.size()), root, times);
    hits.download(found);
    for (std::size_t i = 0; i < part.size(); ++i) {
      cut[i] = cut[i] || found[i].prim == UNFINISHED;
      if (cut[i]) continue;
      if (best[i].prim == NO_HIT && found[i].prim == NO_HIT) best[i] = found[i];
      if (better(part[i], tree_.triangles(), *job_.variant.numeric, found[i], best[i])) best[i] = found[i];
    }
  }
}

void Repair::run(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, TraceTimes& times) {
  std::vector<Hit> all(count);
  std::vector<Ray> all_rays(count);
  hits.download(all);
  rays.download(all_rays);
  std::vector<std::uint32_t> open;
  for (std::uint32_t i = 0; i < count; ++i)
    if (all[i].prim == UNFINISHED) open.push_back(i);
  times.retraced += open.size();
  for (const std::uint64_t limit : {~0ull, 8192ull, 1024ull, 128ull, 16ull, 0ull}) {
    std::vector<Ray> part;
    for (std::uint32_t i : open) part.push_back(all_rays[i]);
    std::vector<Hit> best(part.size(), Hit{0, NO_HIT, 0, 0});
    std::vector<bool> cut(part.size(), false);
    trace_pieces(part, limit, best, cut, times);
    std::vector<std::uint32_t> still;
    for (std::size_t i = 0; i < open.size(); ++i)
      if (cut[i])
        still.push_back(open[i]);
      else
        all[open[i]] = best[i];
    open = std::move(still);
    if (open.empty()) break;
  }
  if (!open.empty())
    fail(Failure::Work, "kernel {}: {} rays could not be finished on {}: its driver stops loops after a few iterations",
         job_.kernel->kernel->name(), open.size(), gpu_.info().name);
  hits.upload(all);
}

}  // namespace ballot
