// Why an answer is wrong, in a sentence. Internal to exact/.
#pragma once

#include <string>

#include "engine/oracle/errors.h"

namespace ballot {

/// In ulps of float32 at max(|t|, FLT_MIN).
double in_ulps(double difference, double t);

/// What the sentences are made from.
struct ReasonSources {
  const ExactOracle& exact;
  const Oracle& bound;
  Want want;
  Arithmetic arithmetic;
};

std::string reason_of(const ReasonSources& from, const ErrorCase& error);

}  // namespace ballot
