// The study of `ballot verify --origins`: where rays from hits start, by every policy, over scales and distances.
//
// Self hit: the ray's nearest hit is the triangle that it starts from. Lost contact: what the ideal ray, from the exact
// surface point along the same direction, meets first lies before the ray's origin or t_min (Engine::check_origins).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "engine/ballot.h"

namespace ballot::verify {

struct OriginStudyArgs {
  EngineOptions engine;
  std::string json, report;               // a file, a folder; "": none
  std::string command;                    // that the JSON names
  std::uint32_t width = 32, height = 32;  // of the pictures, as RenderOptions
  bool quick = false;                     // few sizes and distances
};

/// A policy, and for "constant" the share of the diagonal.
struct OriginPolicy {
  std::string label;
  RayKindOptions options;
};

/// One policy on one scene at one size and distance, all views and ray kinds together.
struct OriginRecord {
  std::string policy, scene;
  double size = 0, distance = 0;  // scene units; multiples of the size
  std::uint64_t rays = 0, self_hits = 0, lost_contacts = 0;
  double offset_share = 0, offset_ulps = 0;  // medians: of the size; units in the last place of the largest coordinate
};

struct OriginStudy {
  std::string device, driver, commit, command;
  std::uint32_t subgroup_size = 0, width = 0, height = 0;
  std::vector<OriginRecord> records;
};

/// Traces the rays and prints the tables; writes the JSON file, and to the report's folder origins.md, origins.json and
/// origins.png. Shows progress. Throws Error(Arguments) for a bad size or file, Error(Work) if the device fails.
void run_origin_study(const OriginStudyArgs& args);

/// The policies that the study compares.
std::vector<OriginPolicy> studied_policies();

/// A summary by policy, then self hits, lost contacts and median offsets by size and distance; Markdown.
std::string origin_tables(const OriginStudy& study);
nlohmann::json to_json(const OriginStudy& study);

}  // namespace ballot::verify
