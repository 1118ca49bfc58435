// The study of `ballot verify --origins`: it compares the origin offset policies of secondary rays over scene sizes and
// distances from the origin.
//
// A self hit is a ray whose closest hit is the triangle that it starts from. A lost contact is a ray that starts beyond
// the first hit of the ideal ray, which starts at the exact surface point in the same direction: that hit lies before
// the ray's origin or t_min (DeviceScene::check_origins).
#pragma once

#include <string>
#include <vector>

#include "engine/scene/device_scene.h"

namespace ballot::verify {

struct OriginStudyArgs {
  DeviceSceneOptions world;
  std::string json;                       // a file; "": none
  std::string command;                    // the command line, for the JSON
  std::uint32_t width = 32, height = 32;  // of the pictures, as in RenderOptions
  bool quick = false;                     // only a few sizes and distances
};

/// An offset policy and its options; for policy "constant" also its share of the scene's diagonal.
struct OriginPolicy {
  std::string label;
  RayKindOptions options;
};

/// The counts of one policy on one scene at one size and distance, for all views and ray kinds together.
struct OriginRecord {
  std::string policy, scene;
  double size = 0, distance = 0;  // size in scene units; distance as a multiple of the size
  std::uint64_t rays = 0, self_hits = 0, lost_contacts = 0;
  // Median offsets: as a share of the size, and in units in the last place of the largest coordinate.
  double offset_share = 0, offset_ulps = 0;
};

struct OriginStudy {
  std::string device, driver, commit, command;
  std::uint32_t subgroup_size = 0, width = 0, height = 0;
  std::vector<OriginRecord> records;
};

/// Traces the rays under a progress bar, prints a table by policy and writes the JSON file: the fields of OriginStudy
/// and of OriginRecord by their names, but `scene_size` for the record's size. Throws Error(Arguments) for a bad size
/// or file, Error(Work) if the device fails.
void run_origin_study(const OriginStudyArgs& args);

/// Returns the policies that the study compares.
std::vector<OriginPolicy> studied_policies();

}  // namespace ballot::verify
