// Rays whose traversal a driver cut short are traced again, in pieces that are short enough.
//
// Mesa 22.3's lavapipe gives all loops of an invocation 65 535 iterations together and then silently stops looping. The
// kernels notice (shaders/lib/frame/main.glsl) and mark such rays. The answer is the smallest (t, prim) over all leaves
// whatever the order, so the tree may be cut into subtrees, each traced by a dispatch of its own, and the answers
// merged.
#include <algorithm>

#include "engine/core/error.h"
#include "engine/formats/pair_decode.h"
#include "engine/oracle/predicates.h"
#include "engine/trace/tracer.h"

namespace ballot {

namespace {

std::uint64_t leaf_steps(std::uint32_t leaf) { return 1 + leaf_count(leaf); }

// Whether a hit comes before another one of the same ray. Where the mode decides exactly, t as it was before rounding
// counts.
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

void Tracer::finish(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                    TraceTimes& times) {
  std::vector<Hit> all(count);
  std::vector<Ray> all_rays(count);
  hits.download(all);
  rays.download(all_rays);
  std::vector<std::uint32_t> open;
  for (std::uint32_t i = 0; i < count; ++i)
    if (all[i].prim == UNFINISHED) open.push_back(i);
  times.retraced += open.size();
  Query plain = query;
  if (const Method& m = find_method(query.method); m.wide || m.quads) {  // pieces are of the binary tree
    plain.method = kPlainestMethod;
    plain.knobs = {};
  }
  plain.knobs["launch"] = "plain";  // an invocation a ray, so that rays do not share what loops are allowed
  const Job job = this->job(plain);
  const PairTree& bvh = pair_tree(job.variant.how);
  for (const std::uint64_t limit : {~0ull, 8192ull, 1024ull, 128ull, 16ull, 0ull}) {
    std::vector<Ray> part;
    for (std::uint32_t i : open) part.push_back(all_rays[i]);
    Buffer<Ray> part_rays(gpu_, part.size(), Access::Storage, "rays cut short");
    Buffer<Hit> part_hits(gpu_, part.size(), Access::Storage, "hits cut short");
    part_rays.upload(part);
    std::vector<Hit> best(part.size(), Hit{0, NO_HIT, 0, 0}), found(part.size());
    std::vector<bool> cut(part.size(), false);
    for (const std::uint32_t root : pieces_of(bvh, limit)) {
      run(job, part_rays, part_hits, std::uint32_t(part.size()), root, times);
      part_hits.download(found);
      for (std::size_t i = 0; i < part.size(); ++i) {
        cut[i] = cut[i] || found[i].prim == UNFINISHED;
        if (cut[i]) continue;
        if (best[i].prim == NO_HIT && found[i].prim == NO_HIT) best[i] = found[i];
        if (better(part[i], triangles_, *job.variant.numeric, found[i], best[i])) best[i] = found[i];
      }
    }
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
         job.pipeline->kernel->name(), open.size(), gpu_.info().name);
  hits.upload(all);
}

}  // namespace ballot
