// Method auto at work: resolves it to a concrete query, by trials of its candidates on a sample of the rays.
#pragma once

#include <exception>
#include <functional>
#include <span>
#include <vector>

#include "engine/trace/auto/auto.h"
#include "engine/vk/buffer.h"

namespace ballot {

class Chooser {
 public:
  /// Traces rays [0, count) by a concrete query; returns device milliseconds.
  using Trace = std::function<double(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query&)>;

  Chooser(Context& gpu, const Bvh& bvh, Trace trace);

  /// Forgets what was chosen for another tree.
  void replace(const Bvh& bvh);

  /// The concrete query: itself, or for method auto what was chosen for its ray class, or else the plainest method.
  Query resolve(const Query& query) const;

  /// The same for rays [0, count) of `rays`. If nothing was chosen for their class and they are enough (2^15 on a CPU,
  /// 2^18 on a GPU), the candidates are timed on a sample of them, within about a second.
  Query resolve(Query query, const Buffer<Ray>& rays, std::size_t count);

  /// True if the choice for this query is final: it is concrete, or its trials are over.
  bool has_chosen(const Query& query) const;
  /// True if no trial is due for `most` rays of this query.
  bool is_resolved(const Query& query, std::size_t most) const;

  /// The class of these rays (coherence.h), from a sample of them.
  std::string ray_class(std::span<const Ray> rays) const;

  Choices& choices() { return choices_; }
  const Choices& choices() const { return choices_; }

  /// A candidate while it is tried.
  struct Trial {
    Candidate candidate;
    Query query;
    bool dropped;            // traces no round, or no further one
    std::vector<double> ms;  // of each round
  };

 private:
  bool try_out(const Query& query, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::exception_ptr& why);
  void race(std::vector<Trial>& trials, const std::vector<Buffer<Ray>>& samples, Buffer<Hit>& hits, double spent_s);
  Choice calibrate(const Query& query, const Buffer<Ray>& rays, std::size_t count);

  Context& gpu_;
  const Bvh* bvh_;
  Trace trace_;
  Choices choices_;
};

}  // namespace ballot
