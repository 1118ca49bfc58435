// Hits of a batch held to the CPU oracle.
#pragma once

#include <vector>

#include "engine/bvh/oracle.h"
#include "engine/render/batch.h"

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

class HitChecker {
 public:
  /// Keeps references to both.
  HitChecker(Tracer& tracer, Batches& batches);

  Truth truth(const RayBatch& batch) const;
  /// Fills the hits with a pattern, traces, and judges every record. truth is of this batch.
  HitCheck check(RayBatch& batch, const Truth& truth, const Query& query) const;

 private:
  Batches& batches_;
  Oracle oracle_;
};

}  // namespace ballot
