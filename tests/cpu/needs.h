// A test that needs something of the machine fails in CI where it is missing; elsewhere it is skipped with the reason.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>

#define BALLOT_NEEDS(condition, why)      \
  if (!(condition)) {                     \
    if (std::getenv("CI")) FAIL() << why; \
    GTEST_SKIP() << why;                  \
  }
