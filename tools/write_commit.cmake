# Writes the header OUT, which defines BALLOT_COMMIT as the commit of the checkout SOURCE, or as what the file COMMIT of
# a source package says. OUT is left alone if the commit did not change.
# Usage: cmake -DSOURCE=... -DOUT=... -P write_commit.cmake
if(EXISTS ${SOURCE}/COMMIT)
  file(STRINGS ${SOURCE}/COMMIT commit LIMIT_COUNT 1)
else()
  execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12 OUTPUT_VARIABLE commit
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT commit)
  set(commit unknown)
endif()
file(CONFIGURE OUTPUT ${OUT} CONTENT "#pragma once\n#define BALLOT_COMMIT \"${commit}\"\n")
