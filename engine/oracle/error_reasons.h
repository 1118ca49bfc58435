// Explains in a sentence why an answer is wrong. Internal to engine/oracle.
#pragma once

#include <string>

#include "engine/oracle/errors.h"

namespace ballot {

/// The inputs that the sentences are made from.
struct ReasonSources {
  const ExactOracle& exact;
  const Oracle& bound;
  Want want;
  Arithmetic arithmetic;
};

/// Returns the reason of an error, as ErrorCase::reason holds it.
std::string reason_of(const ReasonSources& from, const ErrorCase& error);

}  // namespace ballot
