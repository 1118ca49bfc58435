// `ballot check`: the edges of a mesh.
#include "tools/cli.h"

namespace ballot::cli {

namespace {

struct CheckArgs {
  std::string scene, json;
  bool allow_outside = false;
};

nlohmann::json record_of(const std::vector<FaultyEdge>& edges) {
  nlohmann::json all = nlohmann::json::array();
  for (const FaultyEdge& e : edges)
    all.push_back({{"from", {e.from.x, e.from.y, e.from.z}},
                   {"to", {e.to.x, e.to.y, e.to.z}},
                   {"triangles", e.triangles},
                   {"prim", e.prim}});
  return all;
}

void print_edges(const char* what, std::uint64_t count, const std::vector<FaultyEdge>& edges) {
  if (count == 0) return;
  say("{} {}{}:\n", count, what, count > edges.size() ? fmt::format("; the first {}", edges.size()) : "");
  for (const FaultyEdge& e : edges)
    say("  ({}, {}, {}) to ({}, {}, {}): {} triangle{}, triangle {}\n", e.from.x, e.from.y, e.from.z, e.to.x, e.to.y,
        e.to.z, e.triangles, e.triangles == 1 ? "" : "s, the first is", e.prim);
}

int run_check(CheckArgs& args) {
  CommandFiles files;
  files.reads("SCENE", args.scene);
  args.json = files.writes("--json", args.json).string();
  const Scene scene = load_scene(args.scene, {.allow_outside = args.allow_outside, .instances = InstancePolicy::Copy});
  files.check_read();
  for (const std::string& note : scene.notes) say_aside("ballot: {}: {}\n", args.scene, note);
  const Topology t = topology_of(scene.triangles);
  const auto yes = [](bool answer) { return answer ? "yes" : "no"; };
  say("{}: {} triangles, {} edges\nclosed: {}\nmanifold: {}\nconsistently wound: {}\n", args.scene, t.triangles,
      t.edges, yes(t.closed()), yes(t.manifold()), yes(t.wound()));
  if (t.flat) say("{} triangles without area, with three corners, are left out\n", t.flat);
  print_edges("edges of one triangle", t.boundary, t.first_boundary);
  print_edges("edges of more than two triangles", t.nonmanifold, t.first_nonmanifold);
  print_edges("edges whose two triangles run the same way along them", t.flipped, t.first_flipped);
  write_json(args.json, {{"scene", scene.name},
                         {"triangles", t.triangles},
                         {"flat", t.flat},
                         {"edges", t.edges},
                         {"closed", t.closed()},
                         {"manifold", t.manifold()},
                         {"wound", t.wound()},
                         {"open_edges", t.open},
                         {"boundary_edges", t.boundary},
                         {"nonmanifold_edges", t.nonmanifold},
                         {"flipped_edges", t.flipped},
                         {"first_boundary", record_of(t.first_boundary)},
                         {"first_nonmanifold", record_of(t.first_nonmanifold)},
                         {"first_flipped", record_of(t.first_flipped)}});
  return t.closed() && t.manifold() && t.wound() ? 0 : int(Failure::Work);
}

}  // namespace

void add_check(CLI::App& app, int& result) {
  auto args = std::make_shared<CheckArgs>();
  CLI::App* cmd = app.add_subcommand("check", "tells whether a mesh is closed, manifold and consistently wound");
  cmd->footer(
      "Vertices are one if their coordinates are equal. Closed: every edge belongs to an even number of triangles.\n"
      "Manifold: to two at most. Consistently wound: two triangles run along their edge in opposite directions.\n"
      "The exit code is 0 if the mesh is all three, else 1. Needs no device.");
  cmd->add_option("SCENE", args->scene, "scene file, one of: " + scene_extensions())->required();
  cmd->add_option("--json", args->json, "also write the figures to this file");
  add_allow_outside(*cmd, args->allow_outside);
  add_memory(*cmd);
  cmd->callback([args, &result] { result = run_check(*args); });
}

}  // namespace ballot::cli
