// BALLOT_NEEDS: skips a test, with the reason, if the machine lacks something that the test needs. In CI the test fails
// instead.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>

#define BALLOT_NEEDS(condition, why)      \
  if (!(condition)) {                     \
    if (std::getenv("CI")) FAIL() << why; \
    GTEST_SKIP() << why;                  \
  }
