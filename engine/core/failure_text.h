// What people are told of an exception: the words of Ballot, never those of a library.
#pragma once

#include <string>

#include "engine/core/error.h"

namespace ballot {

struct FailureText {
  Failure kind = Failure::Work;
  bool memory = false;  // the host has too little of it
  std::string text;     // as Error has it; of one line
};

/// Returns what there is to say about the exception that is being handled.
FailureText failure_text();

}  // namespace ballot
