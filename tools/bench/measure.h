// All entries on all views of one scene and ray kind.
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <vector>

#include "tools/bench/plan.h"
#include "tools/bench/run.h"

namespace ballot::bench {

/// Thrown between two dispatches when the user wants the run to end.
struct Interrupted {};

/// What the measuring of every block needs.
struct Surroundings {
  Engine& engine;
  const RunOptions& options;
  std::function<void()> step;   // after every dispatch that counts: draws progress, throws Interrupted
  std::function<void()> poll;   // after other dispatches: throws Interrupted
  std::function<void()> quiet;  // before something is printed
};

struct Measured {
  std::vector<Record> records;
  std::uint64_t wrong = 0;
  bool no_rays = false;        // in no view: nothing was measured, and a note says so
  std::exception_ptr stopped;  // Interrupted or Error; the records then hold what was measured until then
};

/// Steps that measure() will take with this many views.
std::size_t steps_of(const Plan& plan, const RaySet& rays, const RunOptions& options, std::size_t views);
std::uint32_t sweep_repeats(const Plan& plan, const RunOptions& options);

/// Makes the batches, warms up, sweeps, then takes all entries repeat by repeat, view by view, each time in another
/// random order, so that no entry always follows the same one. The orders are the same in every run.
Measured measure(const Surroundings& around, const Plan& plan, const RaySet& rays,
                 const std::vector<const View*>& views);

}  // namespace ballot::bench
