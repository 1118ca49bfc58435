// The hard cases (tools/hard/hard.h), answered by entries and held to the exact oracle.
#pragma once

#include <exception>
#include <functional>
#include <vector>

#include "tools/bench/run.h"

namespace ballot::verify {

struct HardOptions {
  EngineOptions engine;
  bool quick = false;     // the small version of each case
  std::size_t cases = 8;  // wrong answers that each record lists at most
};

struct HardResult {
  std::vector<bench::HardRecord> records;
  std::vector<std::string> not_refused;  // scenes that should be errors and are not, a sentence each
  std::size_t messages = 0;              // of the validation layers
  bool interrupted = false;              // by SIGINT or SIGTERM; the records hold what was answered until then
};

/// Every entry on every set of rays of every case. begin sees the device before the first one. A case that cannot be
/// built or traced is a record that says why. Throws Error(Device).
HardResult run_hard_cases(const std::vector<bench::Entry>& entries, const HardOptions& options,
                          const std::function<void(const DeviceInfo&)>& begin);

/// What no mode may do, or this one promised not to: broken_promises, answers unlike those known by construction, in
/// conservative modes leaks and answers that depend on the entry; the largest of these counts, for one answer may be
/// several of them. A case that failed counts as 1.
std::uint64_t broken_promises(const bench::HardRecord& record);

}  // namespace ballot::verify
