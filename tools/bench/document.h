// What one run of `ballot bench` or `ballot verify` measured, and its JSON file: written by the runner, read by report and
// comparison.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/ballot.h"
#include "tools/bench/accuracy.h"

namespace ballot::bench {

/// Repeated measurements of one thing, in milliseconds.
struct Times {
  double median = 0, p10 = 0, p90 = 0;
  std::vector<double> samples;  // in the order they were taken
};
Times times_of(std::vector<double> samples);

/// The value at `share` of the sorted values, between neighbours by interpolation. Needs one value at least.
double quantile(std::vector<double> values, double share);

/// Hits held to the oracle.
struct Checked {
  std::uint64_t rays = 0, same = 0, tie = 0, false_misses = 0, false_hits = 0, wrong_prims = 0, wrong_t = 0,
                unwritten = 0;
  std::uint64_t errors() const { return false_misses + false_hits + wrong_prims + wrong_t + unwritten; }
};

enum class Role {
  Method,
  Sweep,
  Best
};                                 // an entry; one threshold of a sweep; an entry with the sweep's best threshold
const char* role_name(Role role);  // as JSON and CSV have it

/// The knob that a hybrid switches by, as a number.
struct ThresholdValue {
  std::string knob;
  double value = 0;
};

/// One entry on the rays of one view.
struct Record {
  std::string scene, view, rays;  // rays: name of a ray kind or of a .npy file
  bool any = false;
  std::string label, method, numeric;
  Role role = Role::Method;
  Knobs knobs;
  std::optional<ThresholdValue> threshold;  // of sweep records always
  std::string variant;
  std::uint32_t workgroup = 0, subgroup = 0, resident_lanes = 0;
  std::uint64_t ray_count = 0;
  Times trace;
  std::optional<Times> frame;  // generation to film; none for sweeps and foreign rays
  std::map<std::string, double>
      counters;  // by name; of kCounters means per ray; also active_share, packet_share and stack_max
  std::optional<Checked> check;
  std::optional<Accuracy> accuracy;  // from `ballot verify`; none for sweeps

  double mrays_per_s() const { return double(ray_count) / trace.median * 1e-3; }
};

/// One entry on one set of rays of a hard case (tools/hard/hard.h): answers, no times.
struct HardRecord {
  std::string name, from, what;  // of the case
  std::string rays;
  bool any = false, closed = false;  // closed: rays start within a closed mesh, so that every miss is a leak
  std::string label, method, numeric;
  Knobs knobs;
  std::uint64_t leaks = 0;
  std::uint64_t unlike = 0;  // answers unlike those that are known by construction
  std::uint64_t differing =
      0;  // answers unlike those of the first entry in this mode, in a bit; of any: in being a hit
  Accuracy accuracy;
  std::string failed;  // why the case could not be traced; then there is no entry and no figure
};

struct SceneFigures {
  std::string name;
  BvhStats bvh;
  double load_s = 0;
};

nlohmann::json scene_json(const SceneFigures& scene);

struct Document {
  std::string source;  // the file it was read from
  std::string device, driver, commit, command, clock, date;
  bool cpu = false;
  std::map<std::string, std::string> environment;  // variables of kEnvironment that were set
  std::uint32_t subgroup_size = 0;
  std::array<std::uint32_t, 2> size{};
  std::uint32_t ao_rays = 8;  // as RayKindOptions
  double ao_radius = 0.05;
  std::string offset{kDefaultOffset};
  std::uint32_t repeats = 0, sweep_repeats = 0;
  bool partial = false;
  std::vector<SceneFigures> scenes;
  std::vector<Record> records;
  std::vector<HardRecord> hard;  // of `ballot verify --hard`
};

/// Variables that decide which driver and which shaders are measured.
inline constexpr const char* kEnvironment[] = {"VK_DRIVER_FILES", "VK_ICD_FILENAMES", "LP_NATIVE_VECTOR_WIDTH",
                                               "BALLOT_SHADERS"};

nlohmann::json to_json(const Document& document);

/// The documents of a file: one object as --json of `ballot bench` and `ballot verify` writes it, or several under "documents" as in the
/// results.json of a report. Throws Error(Work) that names file, place, what was found and what was expected.
std::vector<Document> read_documents(const std::filesystem::path& path);

/// One document as it is, several under "documents".
nlohmann::json to_json(const std::vector<Document>& documents);

}  // namespace ballot::bench
