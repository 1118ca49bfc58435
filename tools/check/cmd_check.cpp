// `ballot check`: the edges of a mesh, and triangles that pass through each other.
#include <algorithm>

#include "tools/check/picture.h"
#include "tools/program/cli.h"
#include "tools/program/help.h"
#include "tools/program/interrupt.h"

namespace ballot::cli {

namespace {

struct CheckArgs {
  std::string scene, json, picture;
  bool allow_outside = false;
};

constexpr std::size_t kNamed = 10;            // faults of a sort that are printed
constexpr std::uint32_t kPictureSize = 1024;  // pixels

nlohmann::json record_of(const std::vector<FaultyEdge>& edges) {
  nlohmann::json all = nlohmann::json::array();
  for (const FaultyEdge& e : std::span(edges).first(std::min(kNamed, edges.size())))
    all.push_back({{"from", {e.from.x, e.from.y, e.from.z}},
                   {"to", {e.to.x, e.to.y, e.to.z}},
                   {"triangles", e.triangles},
                   {"prim", e.prim}});
  return all;
}

void print_edges(const char* what, std::uint64_t count, const std::vector<FaultyEdge>& edges) {
  if (count == 0) return;
  say("{} {}{}:\n", count, what, count > kNamed ? fmt::format("; the first {}", kNamed) : "");
  for (const FaultyEdge& e : std::span(edges).first(std::min(kNamed, edges.size())))
    say("  ({}, {}, {}) to ({}, {}, {}): {} triangle{}, triangle {}\n", e.from.x, e.from.y, e.from.z, e.to.x, e.to.y,
        e.to.z, e.triangles, e.triangles == 1 ? "" : "s, the first is", e.prim);
}

/// Finds what is wrong with a mesh. All faulty edges are named if a picture is to show them.
MeshFaults faults_of(const CheckArgs& args, std::span<const Triangle> triangles) {
  MeshFaults faults;
  faults.topology = topology_of(triangles, args.picture.empty() ? kNamed : triangles.size());
  ProgressBar bar("triangles that pass through each other");
  const InterruptGuard interrupt;
  faults.crossed = self_crossings(triangles, [&](double share) { interrupt.stop("the check"), bar.update(share); });
  return faults;
}

void print_faults(const CheckArgs& args, const MeshFaults& faults) {
  const Topology& t = faults.topology;
  const SelfCrossings& crossed = faults.crossed;
  const auto yes = [](bool answer) { return answer ? "yes" : "no"; };
  say("{}: {} triangles, {} edges\nclosed: {}\nmanifold: {}\nconsistently wound: {}\nself-intersecting: {}\n",
      args.scene, t.triangles, t.edges, yes(t.closed()), yes(t.manifold()), yes(t.consistently_wound()),
      crossed.whole || crossed.pairs ? yes(crossed.pairs != 0) : "not known");
  if (t.flat) say("{} triangles without area, with three corners, are left out\n", t.flat);
  print_edges("edges of one triangle", t.boundary, t.first_boundary);
  print_edges("edges of more than two triangles", t.nonmanifold, t.first_nonmanifold);
  print_edges("edges whose two triangles run the same way along them", t.flipped, t.first_flipped);
  if (!crossed.whole)
    say("too many triangles overlap: the search ended with {} pairs that pass through each other (it counts {} at "
        "most); "
        "there may be more\n",
        crossed.pairs, kMostCrossingPairs);
  if (crossed.prims.empty()) return;
  say("{}{} triangles that pass through another; the first pairs:\n", crossed.whole ? "" : "at least ",
      crossed.prims.size());
  for (const auto& [a, b] : crossed.first) say("  {} and {}\n", a, b);
}

int run_check(CheckArgs& args) {
  CommandFiles files;
  files.reads("SCENE", args.scene);
  args.json = files.writes("--json", args.json).string();
  args.picture = files.writes("--picture", args.picture).string();
  const Scene scene = load_scene(args.scene, {.allow_outside = args.allow_outside, .instances = InstancePolicy::Copy});
  files.check_read();
  for (const std::string& note : scene.notes) say_aside("ballot: {}: {}\n", args.scene, note);
  need_triangles(scene, "the check of edges");
  const MeshFaults faults = faults_of(args, scene.triangles);
  const Topology& t = faults.topology;
  print_faults(args, faults);
  if (!args.picture.empty()) {
    draw_faults(args.picture, scene.triangles, faults, kPictureSize);
    say("wrote {}\n", args.picture);
  }
  write_json(args.json, {{"scene", scene.name},
                         {"triangles", t.triangles},
                         {"flat", t.flat},
                         {"edges", t.edges},
                         {"closed", t.closed()},
                         {"manifold", t.manifold()},
                         {"wound", t.consistently_wound()},
                         {"open_edges", t.open},
                         {"boundary_edges", t.boundary},
                         {"nonmanifold_edges", t.nonmanifold},
                         {"flipped_edges", t.flipped},
                         {"first_boundary", record_of(t.first_boundary)},
                         {"first_nonmanifold", record_of(t.first_nonmanifold)},
                         {"first_flipped", record_of(t.first_flipped)},
                         {"self_intersecting", faults.crossed.prims},
                         {"first_pairs", faults.crossed.first},
                         {"pairs", faults.crossed.pairs},
                         {"all_pairs", faults.crossed.whole}});
  const bool whole = faults.crossed.whole && faults.crossed.prims.empty();
  return t.closed() && t.manifold() && t.consistently_wound() && whole ? 0 : int(Failure::Work);
}

}  // namespace

void add_check(CLI::App& app, int& result) {
  const auto [cmd, args] =
      add_command<CheckArgs>(app, result, "check", run_check,
                             "tells whether a mesh is closed, manifold, consistently wound and self-intersecting");
  cmd->footer(
      "Vertices are one if their coordinates are equal. Closed: every edge belongs to an even number of triangles.\n"
      "Manifold: to two at most. Consistently wound: two triangles run along their edge in opposite directions.\n"
      "Self-intersecting: an edge of a triangle passes through the inside of another one, decided without rounding;\n"
      "triangles that only touch, or overlap in a plane, do not count. Where very many triangles overlap the search\n"
      "ends early and says so: its numbers are then \"at least\".\n"
      "The exit code is 0 if the mesh is the first three and not the last, else 1. Needs no device.");
  cmd->add_option("SCENE", args->scene, "scene file, one of: " + scene_extensions())->required();
  cmd->add_option(
      "--picture", args->picture,
      "FILE.png of the mesh in grey with its faults: edges of one triangle red, of more than two orange, of\n"
      "two that run the same way blue; triangles that pass through another yellow");
  cmd->add_option("--json", args->json, "also write the figures to this file");
  add_allow_outside(*cmd, args->allow_outside);
  add_memory(*cmd);
}

}  // namespace ballot::cli
