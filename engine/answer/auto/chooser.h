// The chooser: resolves method auto to a concrete query, by the table of auto.h and what it has seen of the rays.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "engine/answer/auto/auto.h"
#include "engine/answer/stream.h"
#include "engine/gpu/buffer.h"
#include "engine/tree/host/bvh.h"

namespace ballot {

/// Returns the class of rays (coherence.h), found from a sample of them.
std::string ray_class(const Questions<Ray>& rays);

/// Chooses for the rays of one tree on one device. Belongs to the thread of its Context.
class Chooser {
 public:
  /// Traces rays [0, count) by a concrete query and returns the device milliseconds.
  using Trace = std::function<double(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query&)>;

  /// Keeps references to gpu, device, which is gpu's, and bvh. Without triangles the tree is a forest's.
  Chooser(Context& gpu, const DeviceInfo& device, const Bvh& bvh, std::optional<std::span<const Triangle>> triangles,
          Trace trace);

  /// Replaces the tree, and forgets what was compared on the old one. Keeps references as the constructor does.
  void replace(const Bvh& bvh, std::optional<std::span<const Triangle>> triangles);

  /// Tells that the triangles have moved. The tree was refitted or built anew. From the first move on, methods for
  /// which the host collapses the tree are left out. Keeps a reference to bvh.
  void moved(const Bvh& bvh);

  /// Returns the concrete query for a batch of `count` rays. If the method is not auto, that is the query itself. Else
  /// the ray class is that of query.rays; any other name stands for rays of any class.
  Query resolve(const Query& query, std::size_t count = kManyRays) const;

  /// The same for rays [0, count) of `rays`. Looks at them if query.rays names no class. If the choice has a rival that
  /// was not compared yet, traces them a few times by both, and keeps to the faster from then on. `batch`: the rays of
  /// the whole batch, of which these may be a part; 0: these.
  Query resolve(Query query, const Buffer<Ray>& rays, std::size_t count, std::size_t batch = 0);

  /// Returns true if resolve() has nothing left to compare for a batch of up to `most` rays.
  bool is_resolved(const Query& query, std::size_t most) const;

  /// Names the class of rays in a query of method auto that names none, by a look at a sample of them. Where kernels
  /// take minima of integers and some rays begin behind their origins, it gets knob minmax=builtin
  /// (shaders/lib/numeric/box.glsl). Does nothing if the batch is too small for a difference. `batch`: as above.
  void classify(Query& query, const Questions<Ray>& rays, std::size_t batch = 0) const;

 private:
  /// What a sample of rays tells: their class, and whether some begin behind their origins.
  struct Seen {
    explicit Seen(std::span<const Ray> sample);
    std::string rays;
    bool behind;
  };
  /// What was seen of a buffer, and how often it has served since.
  struct Known {
    std::uint64_t buffer;
    std::size_t count;
    Seen seen;
    int uses;
  };
  Seen look_at(const Buffer<Ray>& rays, std::size_t count);
  void note(Query& query, const Seen& seen) const;
  AutoChoice choice_for(const Query& query, std::size_t count) const;
  Candidate faster(const AutoChoice& choice, const Query& query, const Buffer<Ray>& rays, std::size_t count);

  Context& gpu_;
  const DeviceInfo& device_;
  const Bvh* bvh_ = nullptr;
  Trace trace_;
  bool has_instances_ = false;
  double even_ = 0;                          // even_triangles() of the scene
  bool moving_ = false;                      // moved() was called
  std::map<std::string, bool> rival_wins_;   // what was compared, by key_of() of the query
  std::optional<Buffer<Ray>> class_sample_;  // in the host's memory; made on first use
  std::vector<Known> known_;                 // of the last buffers
};

}  // namespace ballot
