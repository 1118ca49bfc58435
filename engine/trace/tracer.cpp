#include "engine/trace/tracer.h"

#include <algorithm>
#include <limits>

#include "engine/bvh/padding.h"
#include "engine/core/error.h"

namespace ballot {

Tracer::Tracer(Context& gpu, const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& tree)
    : gpu_(gpu),
      bvh_(bvh),
      triangles_(triangles),
      tree_(tree),
      box_origin_(box_origin(bvh.bounds)),
      padded_reach_(padded_reach(bvh.bounds)),
      shear_(shear_scale(bvh.bounds)),
      work_(gpu, 1, Access::Storage, "work counter"),
      choices_(gpu.info(), bvh.stats, bvh.bounds) {
  tree_.far |= box_origin_ != glm::vec3(0);
}

Tracer::~Tracer() = default;

namespace {

Access access_for(Fetch fetch) {
  switch (fetch) {
    case Fetch::Texel:
      return Access::Texel;
    case Fetch::Reference:
      return Access::Address;
    case Fetch::Storage:
      break;
  }
  return Access::Storage;
}

}  // namespace

const PairTree& Tracer::pair_tree(NodeLayout layout, Padding padding) {
  const auto key = std::pair(layout, padding);
  const auto found = layouts_.find(key);
  if (found != layouts_.end()) return found->second;
  if (padding == Padding::Tree && padded_.empty()) padded_ = padded_boxes(bvh_, triangles_);
  const std::span<const Bounds> boxes = padding == Padding::Tree ? padded_ : std::span<const Bounds>();
  return layouts_.emplace(key, encode_pairs(bvh_, triangles_, layout, boxes)).first->second;
}

const Tracer::Texels& Tracer::node_buffer(const KernelConfig& f) {
  const auto key = std::tuple(f.layout, f.padding, f.fetch);
  auto found = node_buffers_.find(key);
  if (found != node_buffers_.end()) return found->second;
  const PairTree& bvh = pair_tree(f);
  Texels made(gpu_, bvh.nodes.size(), access_for(f.fetch), "bvh nodes");
  made.upload(bvh.nodes);
  return node_buffers_.emplace(key, std::move(made)).first->second;
}

const Tracer::Texels& Tracer::leaf_buffer(LeafFormat format, Fetch fetch) {
  const auto key = std::pair(format, fetch);
  auto found = leaf_buffers_.find(key);
  if (found != leaf_buffers_.end()) return found->second;
  const PairTree& bvh = layouts_.empty() ? pair_tree(NodeLayout::Interleaved) : layouts_.begin()->second;
  const std::vector<glm::uvec4> affine =
      format == LeafFormat::Affine ? make_affine_leaves(bvh) : std::vector<glm::uvec4>();
  const std::vector<glm::uvec4>& texels = format == LeafFormat::Affine ? affine : bvh.leaves;
  Texels made(gpu_, texels.size(), access_for(fetch), "bvh leaves");
  made.upload(texels);
  return leaf_buffers_.emplace(key, std::move(made)).first->second;
}

const Wide8Tree& Tracer::wide8_tree() {
  if (!wide_) wide_ = encode_wide8(pair_tree(NodeLayout::Interleaved));
  return *wide_;
}

const Tracer::Texels& Tracer::wide_buffer(Fetch fetch) {
  const auto found = wide_buffers_.find(fetch);
  if (found != wide_buffers_.end()) return found->second;
  Texels made(gpu_, wide8_tree().nodes.size(), access_for(fetch), "wide bvh nodes");
  made.upload(wide8_tree().nodes);
  return wide_buffers_.emplace(fetch, std::move(made)).first->second;
}

const Tracer::Texels& Tracer::quad_buffer(Fetch fetch) {
  const auto found = quad_buffers_.find(fetch);
  if (found != quad_buffers_.end()) return found->second;
  const Bvh4Tree quad = encode_bvh4(pair_tree(NodeLayout::Interleaved));
  Texels made(gpu_, quad.nodes.size(), access_for(fetch), "quad bvh nodes");
  made.upload(quad.nodes);
  return quad_buffers_.emplace(fetch, std::move(made)).first->second;
}

const Tracer::Texels& Tracer::frontier_buffer(const KernelConfig& f) {
  const auto key = std::tuple(f.frontier, f.layout, f.padding, f.fetch);
  const auto found = frontier_buffers_.find(key);
  if (found != frontier_buffers_.end()) return found->second;
  const std::vector<glm::uvec4> frontier = encode_frontier(pair_tree(f), f.frontier);
  Texels made(gpu_, frontier.size(), access_for(f.fetch), "frontier of the bvh");
  made.upload(frontier);
  return frontier_buffers_.emplace(key, std::move(made)).first->second;
}

KernelConfig Tracer::config_of(const Query& query) const {
  KernelConfig f =
      kernel_config_for(find_method(query.method), find_numeric(query.numeric, gpu_.info()), gpu_.info(), query.knobs);
  if (f.padding == Padding::Ray || padded_reach_ > 0) return f;
  if (query.knobs.contains("padding") && !bvh_.nodes.empty())
    fail(Failure::Arguments,
         "--knob padding=tree: the longest side of the scene's bounds must lie between 2^-60 and 2^44 and no "
         "coordinate beyond 2^60; "
         "they are ({}, {}, {}) to ({}, {}, {}); leave the knob out",
         bvh_.bounds.lo.x, bvh_.bounds.lo.y, bvh_.bounds.lo.z, bvh_.bounds.hi.x, bvh_.bounds.hi.y, bvh_.bounds.hi.z);
  f.padding = Padding::Ray;
  return f;
}

Tracer::Resolved& Tracer::resolved(const Query& asked) const {
  constexpr std::size_t kKept = 32;
  if (resolved_by_ != choices_.changes() || resolved_.size() == kKept) resolved_.clear();
  resolved_by_ = choices_.changes();
  if (const auto found = std::ranges::find(resolved_, asked, &Resolved::asked); found != resolved_.end()) return *found;
  const Query query = resolve(asked);
  const Method& method = find_method(query.method);
  const NumericMode& numeric = find_numeric(query.numeric, gpu_.info());
  const KernelConfig how = config_of(query);
  return resolved_.emplace_back(Resolved{asked, {&method, &numeric, query.want, how}, is_chosen(asked)});
}

Variant Tracer::variant(const Query& asked, bool counters) const {
  Variant v = resolved(asked).variant;
  v.counters = counters;
  return v;
}

Tracer::Pipeline& Tracer::pipeline(const Variant& v) {
  const std::string key = fmt::format("{} subgroup={}", v.kernel_name(), v.how.subgroup);
  auto found = pipelines_.find(key);
  if (found != pipelines_.end() && found->second.kernel->generation() == gpu_.shader_generation()) return found->second;
  Pipeline made{found != pipelines_.end() ? std::move(found->second.kernel) : nullptr};
  const bool fresh = refresh(gpu_, made.kernel, kernel_source(v, gpu_.info(), tree_));
  if (!v.method->quads && (!v.method->wide || v.how.fallback)) made.nodes = &node_buffer(v.how);
  if (v.method->wide) made.top = &wide_buffer(v.how.fetch);
  if (v.method->quads) made.top = &quad_buffer(v.how.fetch);
  if (v.method->frontier) made.top = &frontier_buffer(v.how);
  made.leaves = &leaf_buffer(v.numeric->leaves, v.how.fetch);
  if (!fresh) return pipelines_[key] = std::move(made);
  if (v.how.fetch != Fetch::Reference) {
    if (made.nodes) made.kernel->bind(BIND_NODES, *made.nodes);
    if (made.top) made.kernel->bind(BIND_TOP, *made.top);
    made.kernel->bind(BIND_LEAVES, *made.leaves);
  }
  made.kernel->bind(BIND_WORK, work_);
  gpu_.save_pipeline_cache();
  return pipelines_[key] = std::move(made);
}

Tracer::Job Tracer::job(const Query& query, bool counters, bool indirect, CameraKind camera) {
  Resolved& found = resolved(query);
  Variant v = found.variant;
  v.counters = counters;
  v.indirect = indirect;
  v.camera = camera;
  Pipeline*& known = found.pipelines[camera != CameraKind::None ? 2 + int(camera) : indirect ? 2 : int(counters)];
  if (!known || known->kernel->generation() != gpu_.shader_generation()) known = &pipeline(v);
  return {v, known};
}

std::uint32_t Tracer::chunk_rays() const {
  // Bounded, so that no watchdog fires and progress shows; a CPU device takes about a second for this many.
  const std::uint64_t bounded = gpu_.info().is_cpu() ? 1u << 20 : 1u << 22;
  constexpr std::uint64_t kLargestRecord = sizeof(RayStats),
                          kSmallestGroup = 64;  // of what may go with a ray, or look at it
  return std::uint32_t(std::min(
      {bounded, gpu_.info().max_storage_range / kLargestRecord, gpu_.info().max_group_count_x * kSmallestGroup}));
}

std::uint32_t Tracer::groups_for(const Variant& v, std::uint32_t rays) const {
  const KernelConfig& f = v.how;
  const std::uint32_t packet = f.subgroup * v.rays_per_lane();
  rays = (rays + packet - 1) / packet * f.subgroup;  // as many as there are lanes to take them
  std::uint64_t lanes = rays;
  if (f.launch == Launch::Persistent) {
    // Twice what all rays need with the batches that a subgroup may take, so that threads which are ahead find more to do, but no
    // more than may be resident; what is left after that is dispatched again.
    lanes = 2 * ((std::uint64_t(rays) + f.batches - 1) / f.batches);
    if (f.batches == std::numeric_limits<std::uint32_t>::max()) lanes = rays;
    lanes = std::min<std::uint64_t>(lanes, std::max(f.resident_lanes, f.workgroup));
  }
  return std::uint32_t(std::min<std::uint64_t>((lanes + f.workgroup - 1) / f.workgroup, gpu_.info().max_group_count_x));
}

Work Tracer::dispatch(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, const TracePush& push,
                      TraceTimes& times) {
  Pipeline& p = *job.pipeline;
  p.kernel->bind(BIND_RAYS, rays);
  p.kernel->bind(BIND_HITS, hits);
  const bool reports = this->reports(job.variant);
  Work work{push.ray_begin, 0};
  if (reports) work_.upload(std::span(&work, 1));
  gpu_.submit(p.kernel->name(), [&](VkCommandBuffer cmd) {
    p.kernel->dispatch(cmd, groups_for(job.variant, push.ray_end - push.ray_begin), push);
  });
  times.device_ms += gpu_.last_ms();
  ++times.dispatches;
  if (reports) work_.download(std::span(&work, 1));
  return work;
}

// What has neither a counter of rays nor loops that a driver cuts short leaves no word behind; each transfer to and from a GPU
// would be a wait.
bool Tracer::reports(const Variant& v) const { return v.how.launch == Launch::Persistent || v.how.loops_cut; }

TracePush Tracer::push_for(const Job& job, std::uint32_t root) const {
  const Pipeline& p = *job.pipeline;
  const KernelConfig& f = job.variant.how;
  TracePush push{};
  push.scene_lo = bvh_.bounds.lo;
  push.scene_hi = bvh_.bounds.hi;
  push.box_origin = box_origin_;
  push.padded_reach = padded_reach_;
  push.shear_scale = shear_.scale;
  push.shear_near = shear_.near;
  push.root = root;
  push.max_batches = f.batches;
  push.threshold = f.threshold_lanes(*job.variant.method);
  const auto point = [](const Texels* texels, std::uint32_t& lo, std::uint32_t& hi) {
    if (!texels) return;
    lo = std::uint32_t(texels->address());
    hi = std::uint32_t(texels->address() >> 32);
  };
  point(p.nodes, push.nodes_lo, push.nodes_hi);
  point(p.top, push.top_lo, push.top_hi);
  point(p.leaves, push.leaves_lo, push.leaves_hi);
  return push;
}

Work Tracer::run(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, std::uint32_t root,
                 TraceTimes& times) {
  const Pipeline& p = *job.pipeline;
  const KernelConfig& f = job.variant.how;
  TracePush push = push_for(job, root);
  Work total{0, 0};
  while (push.ray_begin < count) {
    push.ray_end = count;
    const std::uint64_t most = std::uint64_t(gpu_.info().max_group_count_x) * f.workgroup * job.variant.rays_per_lane();
    if (f.launch == Launch::Plain && count - push.ray_begin > most) push.ray_end = push.ray_begin + std::uint32_t(most);
    const Work work = dispatch(job, rays, hits, push, times);
    total.unfinished += work.unfinished;
    // A bounded persistent kernel may leave rays; what it took, it finished.
    const std::uint32_t next = f.launch == Launch::Plain ? push.ray_end : std::min(work.next, push.ray_end);
    if (next <= push.ray_begin)
      fail(Failure::Work, "kernel {} took no ray of {} left on {}: the driver lost the dispatch", p.kernel->name(),
           count - push.ray_begin, gpu_.info().name);
    push.ray_begin = next;
  }
  return total;
}

TraceTimes Tracer::trace(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count,
                         const Query& query) {
  TraceTimes times;
  const Work work = run(job, rays, hits, count, pair_tree(job.variant.how).root, times);
  if (work.unfinished) finish(rays, hits, count, query, times);
  return times;
}

TraceTimes Tracer::trace(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query) {
  if (count == 0) return {};
  const Query resolved = resolve(query, rays, count);
  return trace(job(resolved), rays, hits, count, resolved);
}

TraceTimes Tracer::trace_counted(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                                 Buffer<RayStats>& stats) {
  if (stats.size() < count)
    fail(Failure::Arguments, "trace_counted: {} rays, but room for {} records", count, stats.size());
  if (count == 0) return {};
  const Query resolved = resolve(query, rays, count);
  const Job counted = job(resolved, true);
  counted.pipeline->kernel->bind(BIND_STATS, stats);
  return trace(counted, rays, hits, count, resolved);
}

TraceTimes Tracer::trace(std::span<const Ray> rays, std::span<Hit> hits, const Query& asked, const Progress& progress) {
  if (rays.size() != hits.size())
    fail(Failure::Arguments, "trace: {} rays, but room for {} hits", rays.size(), hits.size());
  TraceTimes times;
  variant(asked);  // an unknown method is an error even without rays
  if (rays.empty()) return times;
  Query query = asked;
  if (query.rays.empty() && find_method(query.method).chooses) query.rays = ray_class(rays);
  const std::size_t chunk = std::min<std::size_t>(chunk_rays(), rays.size());
  Buffer<Ray> ray_buffer(gpu_, chunk, Access::Storage, "rays");
  Buffer<Hit> hit_buffer(gpu_, chunk, Access::Storage, "hits");
  for (std::size_t first = 0; first < rays.size(); first += chunk) {
    const std::size_t count = std::min(chunk, rays.size() - first);
    ray_buffer.upload(rays.subspan(first, count));
    if (prefill) {
      std::vector<Hit> pattern(count);
      std::memset(static_cast<void*>(pattern.data()), *prefill, count * sizeof(Hit));
      hit_buffer.upload(pattern);
    }
    const TraceTimes part = trace(ray_buffer, hit_buffer, std::uint32_t(count), query);
    times.device_ms += part.device_ms;
    times.dispatches += part.dispatches;
    times.retraced += part.retraced;
    hit_buffer.download(hits.subspan(first, count));
    if (progress) progress(double(first + count) / double(rays.size()));
  }
  return times;
}

}  // namespace ballot
