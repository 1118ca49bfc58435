// The results of one run of `ballot bench` or `ballot verify`, and the JSON that --json writes.
//
// The JSON of a run of methods has `kind` "methods", the fields of Document by their names here (`longest_pass` for
// `longest`), and two or three lists of objects:
//   scenes    name; triangles, degenerate, references, nodes, leaves, depth, sah, bytes, build_s, from_cache, builder;
//             load_s
//   records   an entry on the rays of one view: the fields of Record by their names here. `trace_ms` and `frame_ms` are
//             objects of median, p10, p90 and samples; `counters` holds means a ray, but for active_share, packet_share
//             and stack_max; `check` holds rays, same, tie, false_misses, false_hits, wrong_prims, wrong_t, unwritten.
//             Of `verify`: verified_rays, the counts of ErrorFigures (engine/oracle/errors.h) and t_ulp, image_rmse of
//             primary rays, and cases: index, kind, within_bound, reason, ray, answer, truth
//   hard      of `verify --hard`: case, from, what, rays, any, closed, label, method, knobs, numeric, ray_count, leaks,
//             unlike_known, differing, failed, and the figures of `verify`
// Times are milliseconds, or seconds where a name ends in _s. Fields that a run has no value for are left out; NaN is
// null. The other kinds, "builders", "frames", "queries" and "origins", have `device`, `driver`, `commit`, `command`
// and records of their own (tools/bench/bench_builders.cpp and so on). tools/report reads all of them.
#pragma once

#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/device_scene.h"

namespace ballot::bench {

/// The repeated measurements of one time, in milliseconds.
struct Times {
  double median = 0, p10 = 0, p90 = 0;
  std::vector<double> samples;  // in the order of measurement
};
Times times_of(std::vector<double> samples);

/// Returns the quantile at `share`, 0 to 1, interpolated linearly between neighbours. Needs at least one value.
double quantile(std::vector<double> values, double share);

/// The role of an entry.
enum class Role {
  Method,  // a method with given knobs
  Sweep,   // one threshold of a sweep
  Best     // a method with the best threshold of its sweep
};

/// The threshold at which a hybrid method switches: its knob and the value.
struct ThresholdValue {
  std::string knob;
  double value = 0;
};

/// The measurements of one entry on the rays of one view.
struct Record {
  std::string scene, view, rays;  // rays: name of a ray kind or of a .npy file
  bool any = false;
  std::string label, method, numeric;
  std::string runs;  // the method that ran: that of `method`, or what auto chose
  Role role = Role::Method;
  Knobs knobs;
  std::optional<ThresholdValue> threshold;  // sweep records always have one
  std::string variant;
  std::uint32_t workgroup = 0, subgroup = 0, resident_lanes = 0;
  std::uint64_t ray_count = 0;
  Times trace;
  std::optional<Times> frame;  // from ray generation to film; none for sweeps and for rays of .npy files
  std::map<std::string, double>
      counters;  // by name: means per ray of kCounters; also active_share, packet_share and stack_max
  std::optional<HitCheck> check;
  std::optional<ErrorFigures> errors;  // of `ballot verify`; none for sweeps
  std::optional<double> image_rmse;    // tools/bench/image_error.h; primary rays of `ballot verify` only
};

/// The answers of one entry on one set of rays of a hard case (tools/hard/hard.h). It has no times.
struct HardRecord {
  std::string name, from, what;  // of the case; "case" in JSON
  std::string rays;
  bool any = false, closed = false;  // closed: the rays start inside a closed mesh, so every miss is a leak
  std::string label, method, numeric;
  Knobs knobs;
  std::uint64_t leaks = 0;
  std::uint64_t unlike = 0;     // "unlike_known" in JSON: answers that differ from those known by construction
  std::uint64_t differing = 0;  // answers that differ in a bit from those of this mode's first entry; for any hit: in
                                // hit or miss
  ErrorFigures errors;
  std::string failed;  // the reason if the case could not be traced; then there is no entry and no figure
};

/// Adds the counts of other answers. Of errors in ulp the largest remain; cases are left out.
void add(ErrorFigures& sum, const ErrorFigures& other);

/// Returns the number of false misses, false hits and wrong prims.
std::uint64_t wrong_of(const ErrorFigures& errors);

/// Returns the number of answers that break the promise of the numeric mode. Mode exact promises the exact answer, ties
/// included. Conservative modes promise that their error bound explains each wrong answer, and that no value is beyond
/// it. The other modes promise only that every record is written. (A record that was not written is beyond every bound,
/// too.)
std::uint64_t broken_promises(const ErrorFigures& errors, const std::string& numeric);

struct SceneFigures {
  std::string name;
  BvhStats bvh;
  double load_s = 0;
};

nlohmann::json scene_json(const SceneFigures& scene);
nlohmann::json longest_json(const Context::Timed& pass);

struct Document {
  std::string device, driver, commit, command, clock, date;
  bool cpu = false;
  std::map<std::string, std::string> environment;  // the variables of kEnvironment that were set
  std::uint32_t subgroup_size = 0;
  std::array<std::uint32_t, 2> size{};
  std::uint32_t ao_rays = 8;  // this and the next two as in RayKindOptions
  double ao_radius = 0.05;
  std::string offset{kDefaultOffset};
  std::uint32_t repeats = 0, sweep_repeats = 0;
  bool partial = false;
  Context::Timed longest = {};  // the pass that took longest on the device
  std::vector<SceneFigures> scenes;
  std::vector<Record> records;
  std::vector<HardRecord> hard;  // the results of `ballot verify --hard`
};

/// The environment variables that decide which driver and which shaders are measured.
inline constexpr const char* kEnvironment[] = {"VK_DRIVER_FILES", "VK_ICD_FILENAMES", "LP_NATIVE_VECTOR_WIDTH",
                                               "BALLOT_SHADERS"};

nlohmann::json to_json(const Document& document);

}  // namespace ballot::bench
