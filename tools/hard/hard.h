// The hard-case suite: scenes and rays on which ray tracers are known to fail, each after a report of one that did.
//
// Everything is made from fixed seeds by arithmetic that rounds the same on every IEEE machine, so a case is the same
// everywhere. A new case is one function in a make_*.cpp and one line in cases.cpp; the test and `ballot verify --hard`
// then run it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/ballot.h"

namespace ballot {

constexpr std::uint32_t kSomePrim = 0xFFFFFFFEu;  // in HardRays::answers: a hit, whichever triangle it names

/// One set of rays of a case.
struct HardRays {
  std::string name;
  std::vector<Ray> rays = {};
  Want want = Want::Nearest;
  bool closed = false;  // every ray surely meets a closed mesh before t_max (most start inside one): a miss is a leak
  // What every numeric mode must answer, by construction: float32 rounds nothing on these rays and triangles, or they
  // are far from any decision. Of each ray the prim, NO_HIT or kSomePrim; empty where it is not known.
  std::vector<std::uint32_t> answers = {};
};

/// A finished scene (finish_scene), its rays, and how its tree is to be built.
struct HardScene {
  Scene scene;
  std::vector<HardRays> rays;
  BuildSettings build = {};
};

struct HardCase {
  std::string_view name;          // letters, digits and dashes
  std::string_view from;          // who reported it: project and issue, or author, title, venue
  std::string_view what;          // what breaks, a sentence
  HardScene (*make)(bool quick);  // quick: a thousand or so rays a set; else about 1e5 a case
};

/// A scene that must be refused: finish_scene, or else build_bvh, throws Error with a text that holds `says`.
struct HardRefusal {
  std::string_view name, from, what, says;
  Scene (*make)();  // not finished
};

/// All cases, in a fixed order. Thread-safe.
std::span<const HardCase> hard_cases();
std::span<const HardRefusal> hard_refusals();

}  // namespace ballot
