// Hits of a batch held to the CPU oracle.
#pragma once

#include <span>
#include <vector>

#include "engine/oracle/errors.h"
#include "engine/oracle/oracle.h"
#include "engine/render/batch/batch.h"

namespace ballot {

/// The rays of a batch and what the oracle says of each; takes long to make, so make it once for many queries.
struct Truth {
  std::vector<Ray> rays;
  std::vector<OracleHit> hits;
};

struct HitCheck {
  Judgement judgement;          // of all records, the unwritten ones too
  std::uint64_t unwritten = 0;  // records that the trace left as they were
};

/// The rays of a batch and what each hits exactly (engine/oracle/exact.h); make it once for many queries.
struct ExactTruth {
  std::vector<Ray> rays;
  std::vector<ExactHit> hits;
  ExactCounts counts;  // of these rays
  double seconds = 0;  // wall time of the oracle
};

class HitChecker {
 public:
  /// Keeps references to both.
  HitChecker(Tracer& tracer, Batches& batches);

  Truth truth(const RayBatch& batch) const;
  /// Fills the hits with a pattern, traces, and judges every record. truth is of this batch.
  HitCheck check(RayBatch& batch, const Truth& truth, const Query& query) const;

  ExactTruth exact_truth(const RayBatch& batch, const Progress& progress) const;
  /// Fills the hits with a pattern, traces, and holds every record to the exact truth, unwritten ones too.
  ErrorFigures verify(RayBatch& batch, const ExactTruth& truth, const Query& query, std::size_t max_cases) const;
  ErrorFigures judge(std::span<const Ray> rays, std::span<const Hit> answers, const ExactTruth& truth,
                     const Query& query, std::size_t max_cases) const;

 private:
  std::vector<Hit> trace_over_pattern(RayBatch& batch, const Query& query) const;

  Batches& batches_;
  Oracle oracle_;
  ExactOracle exact_;
};

}  // namespace ballot
