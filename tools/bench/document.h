// The results of one run of `ballot bench` or `ballot verify`, and its JSON file, which the runner writes and the
// report and the comparison read.
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

/// The repeated measurements of one time, in milliseconds.
struct Times {
  double median = 0, p10 = 0, p90 = 0;
  std::vector<double> samples;  // in the order of measurement
};
Times times_of(std::vector<double> samples);

/// Returns the quantile at `share`, 0 to 1, interpolated linearly between neighbours. Needs at least one value.
double quantile(std::vector<double> values, double share);

/// The counts of hits checked against the CPU oracle.
struct Checked {
  std::uint64_t rays = 0, same = 0, tie = 0, false_misses = 0, false_hits = 0, wrong_prims = 0, wrong_t = 0,
                unwritten = 0;
  std::uint64_t errors() const { return false_misses + false_hits + wrong_prims + wrong_t + unwritten; }
};

/// The role of an entry.
enum class Role {
  Method,  // a method with given knobs
  Sweep,   // one threshold of a sweep
  Best     // a method with the best threshold of its sweep
};
const char* role_name(Role role);  // the name in JSON and CSV

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
  std::optional<Checked> check;
  std::optional<Accuracy> accuracy;  // of `ballot verify`; none for sweeps

  double mrays_per_s() const { return double(ray_count) / trace.median * 1e-3; }
};

/// The answers of one entry on one set of rays of a hard case (tools/hard/hard.h). It has no times.
struct HardRecord {
  std::string name, from, what;  // of the case
  std::string rays;
  bool any = false, closed = false;  // closed: the rays start inside a closed mesh, so every miss is a leak
  std::string label, method, numeric;
  Knobs knobs;
  std::uint64_t leaks = 0;
  std::uint64_t unlike = 0;  // answers that differ from those known by construction
  std::uint64_t differing =
      0;  // answers that differ in a bit from those of this mode's first entry; for any hit: in hit or miss
  Accuracy accuracy;
  std::string failed;  // the reason if the case could not be traced; then there is no entry and no figure
};

struct SceneFigures {
  std::string name;
  BvhStats bvh;
  double load_s = 0;
};

nlohmann::json scene_json(const SceneFigures& scene);
nlohmann::json longest_json(const Context::Timed& pass);

struct Document {
  std::string source;  // the file that it was read from
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

/// Reads the documents of a file: one object as `ballot bench --json` and `ballot verify --json` write it, or several
/// under "documents" as in the results.json of a report. Throws Error(Work) that names the file, the place in it, what
/// was found and what was expected.
std::vector<Document> read_documents(const std::filesystem::path& path);

/// Returns a single document as its object, several ones under "documents".
nlohmann::json to_json(const std::vector<Document>& documents);

}  // namespace ballot::bench
