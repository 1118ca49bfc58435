// The run of the hard cases of coordinates in double (tools/hard/hard.h): what each way to ask them costs and errs.
#pragma once

#include <string>
#include <vector>

#include "tools/hard/hard.h"

namespace ballot::verify {

/// How the rays of a case were answered by one way, beside tests of every triangle in long double.
struct DoubleRecord {
  std::string name, way;
  std::uint64_t rays = 0;
  std::uint64_t other_hits = 0, other_prims = 0;  // hits for misses and the reverse; hits of other triangles
  std::uint64_t unlike = 0;     // of mode double: answers that are not those of the same arithmetic over every triangle
  double median = 0, most = 0;  // how far hits lie from the true ones, scene units
  double rays_per_s = 0;
};

/// A case on a device: its scene about an origin, with vertices in double, and what the rays truly hit.
class DoubleCase {
 public:
  /// Throws Error(Device) if there is no usable device.
  DoubleCase(const HardDoubleCase& hard, DeviceSceneOptions options, bool quick);
  /// Answers by a numeric mode, rays and vertices moved to the origin; in mode double they are not rounded.
  DoubleRecord answer(const std::string& numeric);
  /// Answers in mode watertight where nothing is moved before it is rounded to float32.
  DoubleRecord answer_rounded();
  /// Answers in float64 by tests of every triangle, on all cores.
  DoubleRecord answer_by_all();
  const std::shared_ptr<Context>& context() const { return world_->context(); }

 private:
  struct Found {
    double t = 0;
    std::uint32_t prim = NO_HIT;
  };
  /// Returns the nearest hit in long double.
  Found true_hit(const RayInDouble& ray) const;
  DoubleRecord compare(const std::string& way, std::span<const Found> found, double seconds) const;
  std::vector<Found> trace_in_double(double& seconds);
  std::vector<Found> trace_moved(const std::string& numeric, double& seconds);

  std::string name_;
  DeviceSceneOptions options_;
  HardDoubleScene given_;
  std::vector<CornersInDouble> about_;  // the triangles about the origin
  std::vector<Found> truth_;
  std::optional<DeviceScene> world_;
};

/// Returns a table of records, as text.
std::string double_table(const std::vector<DoubleRecord>& records);

/// Runs all cases: as float32 has them, in the conservative ones of these modes that the device has, and by tests of
/// every triangle. `progress` is called with the share done.
std::vector<DoubleRecord> run_double_cases(const std::vector<std::string>& modes, const DeviceSceneOptions& options,
                                           bool quick, const Progress& progress);

}  // namespace ballot::verify
