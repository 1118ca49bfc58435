// The chooser: resolves method auto to a concrete query, by trials of its candidates on a sample of the rays.
#pragma once

#include <chrono>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/trace/auto/auto.h"
#include "engine/vk/buffer.h"

namespace ballot {

struct RaceHost;
struct Runner;

/// Chooses for the rays of one tree on one device. Belongs to the thread of its Context.
class Chooser {
 public:
  /// Traces rays [0, count) by a concrete query and returns the device milliseconds.
  using Trace = std::function<double(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query&)>;

  /// Begins to make the kernel of a concrete query on another thread.
  using Prepare = std::function<void(const Query&)>;

  /// Keeps references to gpu and bvh.
  Chooser(Context& gpu, const Bvh& bvh, Trace trace, Prepare prepare);

  /// Replaces the tree, and forgets the choices for the old one. Keeps a reference to bvh.
  void replace(const Bvh& bvh);

  /// Tells that the triangles have moved. The tree was refitted or built anew. From the first move on, candidates
  /// for which the host collapses the tree are left out, and choices are neither read from disk nor written there.
  /// Choices made after the first move stay. Keeps a reference to bvh.
  void moved(const Bvh& bvh);

  /// Returns the concrete query. If the method is not auto, that is the query itself. For auto it has the method and
  /// knobs that were chosen for its ray class or, before a choice, those of unmeasured().
  Query resolve(const Query& query) const;

  /// The same for rays [0, count) of `rays`, after a trial on them if one is due.
  Query resolve(Query query, const Buffer<Ray>& rays, std::size_t count);

  /// Begins a batch, rays [0, count) of `rays`. Names their class in the query if it has none and the rays are enough
  /// for a trial. Returns 0 if no trial is due on them. Else returns a number n: the caller traces rays [0, n) by
  /// resolve(query), then calls try_candidates(). Tracing them compiles the reference's kernel, while another thread
  /// makes the next candidate's. With Choices::try_all, begin() itself calls try_candidates() and returns 0.
  ///
  /// A trial needs 2^15 rays on a CPU, 2^18 on a GPU. It is due if the class has no choice yet, or if its choice was
  /// read from disk and candidates are left. Later in this process, candidates that are left are tried once a trial
  /// takes at most kShareOfTrials of the time that rays of the class took since the last one. Candidates that were put
  /// off are tried once Choice::paid_s() suffices. When none is left, the fastest race again whenever that takes at
  /// most kShareOfLooks: on the rays of another view another candidate may be the fastest.
  std::uint32_t begin(Query& query, const Buffer<Ray>& rays, std::size_t count);

  /// The trial: candidates race on samples of these rays (race.h), as many as fit into 0.3 s or, if that is longer,
  /// into 5 % of the batch's time or Choice::paid_s(). What does not fit is left to a later trial. A candidate that
  /// takes longer than the budget is put off at once. The kRunsOfTrials-th process puts off all that are left. They are
  /// tried once Choice::paid_s() suffices.
  void try_candidates(const Query& query, const Buffer<Ray>& rays, std::size_t count);

  /// Counts `count` rays that a query traces without begin().
  void note(const Query& query, std::size_t count) { choices_.note(query, count); }

  /// Returns true if the query is concrete, or if it has a choice and no trial is due. `count`: rays of the batch; 0 if
  /// that is not known.
  bool has_chosen(const Query& query, std::size_t count = 0) const;
  /// Returns true if no trial is due for up to `most` rays of this query.
  bool is_resolved(const Query& query, std::size_t most) const;

  /// Returns the class of these rays (coherence.h), found from a sample of them.
  std::string ray_class(std::span<const Ray> rays) const;

  /// Set for a forest: leaves out methods without kernels for instances, unless no other is left.
  bool has_instances = false;

  Choices& choices() { return choices_; }
  const Choices& choices() const { return choices_; }

 private:
  /// A class that was found for a buffer, and how often it has served since.
  struct Known {
    std::uint64_t buffer;
    std::size_t count;
    std::string rays;
    int uses;
  };
  /// What begin() has done for a trial.
  struct Begun {
    std::chrono::steady_clock::duration took{};   // of the trial's time
    std::chrono::steady_clock::time_point end{};  // the first rays are traced from then on
    std::size_t prepared = 0;                     // the candidate whose kernel it began to make; 0: none
    std::uint32_t rays = 0;                       // that are traced first; 0: there was no begin()
    double contention = 1;                        // before (contention.h)
  };
  std::string class_of(const Buffer<Ray>& rays, std::size_t count);
  std::vector<Candidate> candidates(const Query& query) const;
  bool is_due(const Choice& choice, std::size_t count) const;
  bool is_due(const Choice* known, const Buffer<Ray>& rays, std::size_t count) const;
  Choice choice_for(const Query& query) const;
  std::vector<Runner> runners_of(const Query& query, const std::vector<Candidate>& candidates) const;
  bool compile(const Query& query, const Buffer<Ray>& rays, Buffer<Hit>& hits, std::exception_ptr& why);
  struct Trial;
  RaceHost host_of(Trial& trial);

  Context& gpu_;
  const Bvh* bvh_;
  Trace trace_;
  Prepare prepare_;
  Choices choices_;
  std::optional<Buffer<Ray>> class_sample_;  // in the host's memory; made on first use
  std::vector<Known> known_;                 // of the last buffers
  bool moving_ = false;                      // moved() was called
  Begun begun_;                              // for the trial that follows
};

}  // namespace ballot
