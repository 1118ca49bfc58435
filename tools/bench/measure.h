// The measurement of all entries on all views of one scene and ray kind.
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <vector>

#include "tools/bench/plan.h"
#include "tools/bench/run.h"

namespace ballot::bench {

/// The exception that is thrown between two dispatches when the user has asked the run to end.
struct Interrupted {};

/// The engine, options and callbacks that the measurement of every block needs.
struct Surroundings {
  DeviceScene& world;
  const RunOptions& options;
  std::function<void()> step;   // called after every dispatch that counts as progress; may throw Interrupted
  std::function<void()> poll;   // called after other dispatches; may throw Interrupted
  std::function<void()> quiet;  // called before something is printed: hides the progress bar
};

struct Measured {
  std::vector<Record> records;
  std::uint64_t wrong = 0;
  bool no_rays = false;        // no view has such rays: nothing was measured, and a note says so
  std::exception_ptr stopped;  // Interrupted or Error; the records then hold the measurements so far
};

/// Returns the number of steps that measure() will take for this many views.
std::size_t steps_of(const Plan& plan, const RaySet& rays, const RunOptions& options, std::size_t views);
std::uint32_t sweep_repeats(const Plan& plan, const RunOptions& options);

/// Makes the batches, warms up, sweeps the thresholds, then measures all entries repeat by repeat and view by view.
/// Each time they run in another random order, so that no entry always follows the same one. The orders are the same in
/// every run.
Measured measure(const Surroundings& around, const Plan& plan, const RaySet& rays,
                 const std::vector<const View*>& views);

}  // namespace ballot::bench
