// Measures the frames of an animation: the pose, the tree, tracing and shading apart, for every way to update the tree.
#pragma once

#include "tools/program/run_args.h"
#include "tools/render/frames.h"

namespace ballot::cli {

/// The options of `ballot bench --frames`, beside those of every bench.
struct BenchFrameArgs {
  FrameArgs frames;
  std::string updates{"auto,refit,rebuild"};

  void add_to(CLI::App& cmd);
};

/// Measures and prints a table, and writes the figures of each frame with --json. Returns the exit code. Throws
/// Error(Arguments) unless there is one scene, with such an animation.
int bench_frames(const RunArgs& run, const BenchFrameArgs& args);

}  // namespace ballot::cli
