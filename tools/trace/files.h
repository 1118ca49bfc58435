// Traces a file of rays to a file of hits in bounded memory: reading, tracing and writing overlap.
#pragma once

#include <functional>
#include <future>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/device_scene.h"

namespace ballot::cli {

/// Reads rays ahead, Ray or RayInDouble: while a block is used, another thread reads the next one.
template <class Kind>
class ReadAhead {
 public:
  /// Takes the file over.
  explicit ReadAhead(RayFile file);
  /// Returns the rays that come next, as many as fit. Throws what reading threw.
  std::size_t next(std::span<Kind> room);
  /// Returns the dead rays of the file. Call it behind the last ray.
  const DeadRays& dead() const { return file_.dead(); }

 private:
  void begin();

  RayFile file_;
  std::uint64_t left_;              // rays that nobody reads yet
  std::vector<Kind> block_, next_;  // used; read
  std::size_t used_ = 0;            // rays of block_
  std::future<void> reading_;       // next_; waits at its end, so before the others
};

/// Writes bytes behind: while a block is written by another thread, the next one is made.
class WriteBehind {
 public:
  using Write = std::function<void(std::span<const std::byte>)>;
  explicit WriteBehind(Write write) : write_(std::move(write)) {}
  /// Takes a copy. Throws what writing threw.
  void add(std::span<const std::byte> bytes);
  /// Waits until everything is written. Throws what writing threw.
  void finish();

 private:
  Write write_;
  std::vector<std::byte> block_, next_;  // written; copied to
  std::future<void> writing_;            // block_; waits at its end, so before the others
};

/// What tracing a file gave.
struct FileTrace {
  std::uint64_t rays = 0, hits = 0;
  TraceTimes times;
  DeadRays dead;
  std::string ray_class;  // of the first rays, if the query's method is auto
};

/// Traces the rays of a file and writes their hits to `to`, with t as float32 or, if `t_double`, in double: an open
/// stream such as /dev/stdout gets them as they come, a file appears when it is complete. The memory does not depend on
/// the number of rays: about 0.4 GiB on the host, as much on a GPU. Throws Error.
FileTrace trace_file(DeviceScene& world, RayFile from, const std::string& to, const Query& query, bool t_double,
                     const Progress& progress);

}  // namespace ballot::cli
