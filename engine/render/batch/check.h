// Checks the hits of a batch against the CPU oracle.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/oracle/errors.h"
#include "engine/oracle/oracle.h"
#include "engine/render/batch/batch.h"

namespace ballot {

/// The rays of a batch and the oracle's hit of each. Making it takes long, so make it once for many queries.
struct Truth {
  std::vector<Ray> rays;
  std::vector<OracleHit> hits;
};

/// The result of checking a batch.
struct HitCheck {
  Judgement judgement;          // of all records, including the unwritten ones
  std::uint64_t unwritten = 0;  // records that the trace did not write
};

/// The rays of a batch and the exact hit of each (engine/oracle/exact.h). Make it once for many queries.
struct ExactTruth {
  std::vector<Ray> rays;
  std::vector<ExactHit> hits;
  ExactCounts counts;  // the exact oracle's counts for these rays
  double seconds = 0;  // wall time of the oracle
};

/// Traces batches and checks their hits against the CPU oracles of the scene. Belongs to the thread of the scene's
/// device; the oracles themselves run on all cores.
class HitChecker {
 public:
  /// Keeps references to both arguments.
  HitChecker(Tracer& tracer, Batches& batches);

  /// The double-precision oracle's hit of every ray (engine/oracle/oracle.h).
  Truth truth(const RayBatch& batch) const;
  /// Fills the hits with a pattern, traces the batch, and judges every record. `truth` must be of this batch. Throws as
  /// DeviceScene::trace() does.
  HitCheck check(RayBatch& batch, const Truth& truth, const Query& query) const;

  /// The exact hit of every ray (engine/oracle/exact.h): tens of thousands of rays a second and core. progress is
  /// called with the share done, from one thread at a time.
  ExactTruth exact_truth(const RayBatch& batch, const Progress& progress = {}) const;
  /// Fills the hits with a pattern, traces the batch, and compares every record to the exact truth. An unwritten record
  /// counts as the wrong answer that the pattern is, and in `unwritten`. Describes the first max_cases errors. Throws
  /// as DeviceScene::trace() does, and Error(Arguments) if `truth` is of another number of rays.
  ErrorFigures verify(RayBatch& batch, const ExactTruth& truth, const Query& query, std::size_t max_cases = 8) const;
  /// Compares given answers to the exact truth, without tracing. Among instances that of mode double is another, which
  /// is found here. Throws Error(Arguments) if the sizes differ.
  ErrorFigures judge(std::span<const Ray> rays, std::span<const Hit> answers, const ExactTruth& truth,
                     const Query& query, std::size_t max_cases = 8) const;

 private:
  std::vector<Hit> trace_over_pattern(RayBatch& batch, const Query& query) const;

  std::optional<Triangle> triangle(std::uint32_t prim) const;

  Batches& batches_;
  Oracle oracle_;
  ExactOracle exact_;
};

}  // namespace ballot
