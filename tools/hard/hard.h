// The hard-case suite: scenes, rays and points on which ray tracers and point queries are known to fail. A case
// reproduces a report of such a failure, or what this project's own design has to fear.
//
// All cases are generated from fixed seeds with arithmetic that rounds the same on every IEEE machine, so a case is the
// same everywhere. A new case is one function in a make_*.cpp, its declaration in generate.h and one line in cases.cpp;
// the tests and `ballot verify --hard` then run it; cases of points need --queries.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/device_scene.h"

namespace ballot {

constexpr std::uint32_t kSomePrim = 0xFFFFFFFEu;  // in HardRays::answers: a hit of any triangle

/// One set of rays of a case.
struct HardRays {
  std::string name;
  std::vector<Ray> rays = {};
  Want want = Want::Nearest;
  bool closed = false;  // every ray must hit before t_max (most start inside a closed mesh): a miss is a leak
  // The answers that every numeric mode must give by construction: float32 rounds nothing on these rays and triangles,
  // or no ray is a borderline case. For each ray its prim, NO_HIT or kSomePrim; empty if the answers are not known.
  std::vector<std::uint32_t> answers = {};
};

/// A finished scene (finish_scene), its rays, and the build settings of its tree.
struct HardScene {
  Scene scene;
  std::vector<HardRays> rays;
  BuildSettings build = {};
};

struct HardCase {
  std::string_view name;          // letters, digits and dashes
  std::string_view from;          // the source: project and issue; author, title, venue; "Ballot, design"
  std::string_view what;          // the failure, in a sentence
  HardScene (*make)(bool quick);  // quick: up to about a thousand rays per set; else 5e4
};

/// One set of points of a case.
struct HardPoints {
  std::string name;
  std::vector<ProbePoint> points = {};
};

/// A finished scene and its points.
struct HardPointScene {
  Scene scene;
  std::vector<HardPoints> sets;
};

/// A hard case of point queries; its parts are those of HardCase.
struct HardPointCase {
  std::string_view name, from, what;
  HardPointScene (*make)(bool quick);
};

/// Vertices and rays that float32 does not hold, in the world. No ray passes an edge so near that the answer is in
/// doubt.
struct HardDoubleScene {
  std::vector<CornersInDouble> triangles;
  std::vector<RayInDouble> rays;
};

/// A hard case of coordinates in double; its parts are those of HardCase. Quick: up to about a thousand rays, else 2e4.
struct HardDoubleCase {
  std::string_view name, from, what;
  HardDoubleScene (*make)(bool quick);
};

/// A scene that must be refused: finish_scene or build_bvh must throw Error with a text that contains `says`.
struct HardRefusal {
  std::string_view name, from, what, says;
  Scene (*make)();  // not finished
};

/// Returns all cases in a fixed order. Thread-safe.
std::span<const HardCase> hard_cases();
std::span<const HardPointCase> hard_point_cases();
std::span<const HardDoubleCase> hard_double_cases();
std::span<const HardRefusal> hard_refusals();

/// Returns points that are hard on any mesh: at corners, on edges of and inside triangles, an ulp beside these, and
/// around the mesh; none for an empty mesh. They are asked on the scenes of hard_cases().
std::vector<HardPoints> hard_points_of(std::span<const Triangle> triangles, bool quick);

}  // namespace ballot
