// The run of the hard cases (tools/hard/hard.h): entries answer them, and the exact oracle checks the answers.
#pragma once

#include <exception>
#include <functional>
#include <vector>

#include "tools/bench/run.h"

namespace ballot::verify {

struct HardOptions {
  DeviceSceneOptions world;
  bool quick = false;      // run the small version of each case
  std::size_t listed = 8;  // wrong answers that each record lists, at most
};

struct HardResult {
  std::vector<bench::HardRecord> records;
  std::vector<std::string> not_refused;   // scenes that should have been refused and were not, a sentence each
  std::size_t messages = 0;               // messages of the validation layers
  Context::Timed longest = {};            // the pass that took longest on the device
  std::shared_ptr<Context> context = {};  // the device
  int signal = 0;                         // that ended the run early; the records hold the answers so far
};

/// Traces the rays of every case with every entry. Calls `begin` with the device before the first trace. A case that
/// cannot be built or traced gives a record that says why. Throws Error(Device) if there is no usable device.
HardResult run_hard_cases(const std::vector<bench::Entry>& entries, const HardOptions& options,
                          const std::function<void(const DeviceInfo&)>& begin);

/// Returns the number of answers that break the promise of the record's numeric mode, or that no mode may give. It is
/// the largest of these counts, because one answer may be in several: bench::broken_promises; answers that differ from
/// those known by construction; in conservative modes leaks, and answers that depend on the entry. A case that failed
/// counts as 1.
std::uint64_t broken_promises(const bench::HardRecord& record);

}  // namespace ballot::verify
