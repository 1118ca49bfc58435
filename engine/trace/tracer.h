// A scene on the device: rays in, hits out.
#pragma once

#include <array>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/formats/bvh4.h"
#include "engine/formats/frontier.h"
#include "engine/formats/wide8.h"
#include "engine/trace/auto/auto.h"
#include "engine/trace/shear.h"
#include "shaders/shared/render.h"

namespace ballot {

struct TraceTimes {
  double device_ms = 0;  // of the traversal dispatches alone
  std::uint32_t dispatches = 0;
  std::uint64_t retraced = 0;  // rays that the driver cut short and that were traced again in pieces
};

/// Rays whose number the device knows: what an entry says.
struct IndirectRays {
  const Buffer<IndirectArgs>& args;  // Access::Groups too
  std::uint32_t index;
};

/// Rays that the kernel makes by itself, as shaders/rays/primary.comp makes them: those of a camera for listed pixels.
struct CameraRays {
  const Buffer<PrimaryPush>& cameras;
  std::uint32_t index;  // which
  const Buffer<std::uint32_t>& listed;
  CameraKind kind;
};

/// Workgroups for a number of rays: that many rays each, and at most so many workgroups.
struct RayGroups {
  std::uint32_t rays, most;
};

class Tracer {
 public:
  /// Keeps references to gpu, bvh and triangles. `tree`: what kernels are made for, the facts of `bvh` or more.
  Tracer(Context& gpu, const Bvh& bvh, std::span<const Triangle> triangles, const TreeFacts& tree);
  ~Tracer();

  /// Traces rays and writes, at the same index, what each one hits. Contract: engine/ballot.h.
  /// progress is called after each chunk of rays.
  TraceTimes trace(std::span<const Ray> rays, std::span<Hit> hits, const Query& query, const Progress& progress = {});

  /// The same on device buffers: rays [0, count) of `rays` to `hits`.
  TraceTimes trace(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query);

  /// Whether a trace of `most` rays at most can be recorded together with what follows it: no calibration is due, and the host
  /// need not look at what a dispatch leaves. query.rays names the ray class.
  bool can_record(const Query& query, std::uint32_t most) const;

  /// trace(), recorded where that can be done, else done at once; `done` is told device milliseconds as Context::pass() tells it.
  void record(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query, Context::Done done);

  /// Whether kernels had better make a camera's rays than read them. CPU devices read them as fast, and take seconds to compile one
  /// more kernel.
  bool makes_rays() const { return make_rays.value_or(!gpu_.info().is_cpu()); }

  /// The same for rays [0, count) of a camera; only where can_record() allows it.
  void record(const CameraRays& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query, Context::Done done);

  /// The same for as many rays as a call says, whose groups are as groups_of() says; only where can_record() allows it.
  void record(const Buffer<Ray>& rays, Buffer<Hit>& hits, const IndirectRays& indirect, const Query& query,
              Context::Done done);
  RayGroups groups_of(const Query& query) const;

  /// The same by the instrumented variant, which also writes a record a ray; `stats` holds at least count. A ray that the
  /// driver cut short has the counts of the walk that was cut.
  TraceTimes trace_counted(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                           Buffer<RayStats>& stats);

  /// What a query runs: itself, or for method auto what auto has chosen for its ray class, or runs unmeasured.
  Query resolve(const Query& query) const;

  /// The same for rays [0, count) of `rays`, which auto looks at: where it has not chosen for their sort and they are enough
  /// (2^15 on a CPU, 2^18 on a GPU), it samples them and times its candidates, within about a second. trace() calls this.
  Query resolve(Query query, const Buffer<Ray>& rays, std::size_t count);

  /// What ray class these are (coherence.h), from a sample of them.
  std::string ray_class(std::span<const Ray> rays) const;

  /// What auto has chosen so far.
  Choices& choices() { return choices_; }

  /// Rays that one dispatch takes at most.
  std::uint32_t chunk_rays() const;

  /// The kernel of a query, made on first use. For its name and compile times.
  const Kernel& kernel(const Query& query) { return *job(query).pipeline->kernel; }
  /// Of method auto: that of resolve().
  Variant variant(const Query& query, bool counters = false) const;

  /// Device arrays in one layout, made on first use; the oracle walks those without padding.
  const PairTree& pair_tree(NodeLayout layout, Padding padding = Padding::Ray);
  const PairTree& pair_tree(const KernelConfig& f) { return pair_tree(f.layout, f.padding); }

  /// The wide tree, made on first use.
  const Wide8Tree& wide8_tree();

  /// A candidate of method auto while it is tried.
  struct Trial {
    Candidate candidate;
    Query query;
    bool out;                // traces no round, or no further one
    std::vector<double> ms;  // of each round
  };

  /// Tests only: hits are filled with this byte before a host-side trace, so that untouched records can be counted.
  std::optional<std::uint8_t> prefill;
  /// Tests only: rays are made on CPU devices too, or on none.
  std::optional<bool> make_rays;

 private:
  using Texels = Buffer<glm::uvec4>;
  struct Pipeline {
    std::unique_ptr<Kernel> kernel;
    const Texels *nodes = nullptr, *top = nullptr, *leaves = nullptr;  // those that the kernel reads
  };
  /// What one query runs: kernels are shared by queries that differ in thresholds only.
  struct Job {
    Variant variant;
    Pipeline* pipeline;
  };

  /// What a query comes to, found once: a frame asks thousands of times.
  struct Resolved {
    Query asked;
    Variant variant;
    bool chosen;  // auto measures such rays no more
    std::array<Pipeline*, 5>
        pipelines{};  // plain, with counters, indirect, of a camera's rays; null: not asked for yet
  };

  Pipeline& pipeline(const Variant& variant);
  /// Valid until it is called again.
  Resolved& resolved(const Query& query) const;
  Job job(const Query& query, bool counters = false, bool indirect = false, CameraKind camera = CameraKind::None);
  const Texels& node_buffer(const KernelConfig& f);
  const Texels& leaf_buffer(LeafFormat format, Fetch fetch);
  const Texels& wide_buffer(Fetch fetch);
  const Texels& quad_buffer(Fetch fetch);
  const Texels& frontier_buffer(const KernelConfig& f);
  void record(const Job& job, Buffer<Hit>& hits, const Context::Record& dispatch, Context::Done done);
  void record(const Job& job, Buffer<Hit>& hits, std::uint32_t count, std::uint32_t camera, Context::Done done);
  KernelConfig config_of(const Query& query) const;
  bool is_resolved(const Query& query, std::size_t most) const;
  bool is_chosen(const Query& query) const;
  bool reports(const Variant& v) const;
  std::uint32_t groups_for(const Variant& v, std::uint32_t rays) const;
  TracePush push_for(const Job& job, std::uint32_t root) const;
  Work dispatch(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, const TracePush& push, TraceTimes& times);
  Work run(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, std::uint32_t root,
           TraceTimes& times);
  TraceTimes trace(const Job& job, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query);
  bool try_out(const Query& query, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::exception_ptr& why);
  void race(std::vector<Trial>& trials, const std::vector<Buffer<Ray>>& samples, Buffer<Hit>& hits, double spent_s);
  Choice calibrate(const Query& query, const Buffer<Ray>& rays, std::size_t count);
  void finish(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query, TraceTimes& times);

  Context& gpu_;
  const Bvh& bvh_;
  std::span<const Triangle> triangles_;
  TreeFacts tree_;
  glm::vec3 box_origin_;  // what boxes on the device are measured from
  float padded_reach_;    // of rays that a padded tree serves; 0: of none
  ShearScale shear_;
  std::vector<Bounds> padded_;  // boxes, on first use
  std::map<std::pair<NodeLayout, Padding>, PairTree> layouts_;
  std::map<std::tuple<NodeLayout, Padding, Fetch>, Texels> node_buffers_;  // what a query needs, on first use
  std::map<std::pair<LeafFormat, Fetch>, Texels> leaf_buffers_;
  std::optional<Wide8Tree> wide_;
  std::map<Fetch, Texels> wide_buffers_;
  std::map<Fetch, Texels> quad_buffers_;
  std::map<std::tuple<std::uint32_t, NodeLayout, Padding, Fetch>, Texels> frontier_buffers_;
  std::map<std::string, Pipeline> pipelines_;
  Buffer<Work> work_;
  Choices choices_;
  mutable std::vector<Resolved> resolved_;
  mutable std::uint64_t resolved_by_ = 0;  // choices_.changes() when they were found
};

/// Roots of subtrees of at most `limit` steps (a step is an inner node or a triangle, and one for a leaf) that together
/// hold every leaf once.
std::vector<std::uint32_t> pieces_of(const PairTree& bvh, std::uint64_t limit);

}  // namespace ballot
