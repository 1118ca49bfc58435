// Queries of points: `ballot distance` and `ballot inside`.
#include <cmath>
#include <limits>

#include "tools/cli.h"
#include "tools/help.h"
#include "tools/interrupt.h"
#include "tools/shell_word.h"

namespace ballot::cli {

namespace {

struct PointArgs {
  EngineArgs engine;
  std::string points, out, numeric{kDefaultNumeric};
  double limit = 0;
  bool signed_distance = false, assume_closed = false;

  PointQuery query() const { return {.exact = numeric == "exact"}; }
};

void note_files(PointArgs& args) {
  args.engine.note_files();
  args.engine.files.reads("--points", args.points);
  args.out = args.engine.files.must_write("--out", args.out).string();
}

/// Refuses the inside test of a mesh with open edges.
void need_closed(Engine& engine, const PointArgs& args) {
  if (args.assume_closed) return;
  const Topology& t = engine.topology();
  if (!t.closed())
    fail(Failure::Arguments,
         "{}: the mesh is not closed: {} of its {} edges belong to an odd number of triangles; `ballot check {}` lists "
         "some; --assume-closed goes on, and answers near the gaps are then arbitrary",
         args.engine.scene, t.open, t.edges, shell_word(args.engine.scene));
}

/// Prints what was done.
void print_points(Engine& engine, const PointArgs& args, std::size_t points, const std::string& found,
                  const TraceTimes& spent) {
  say("{}: {} points, {}, {:.3f} ms on the device, {:.2f} million points/s\n", args.out, points, found, spent.device_ms,
      spent.device_ms > 0 ? double(points) / spent.device_ms * 1e-3 : 0);
  say("  on {} ({})\n", engine.device().name, engine.device().driver);
  if (spent.retraced) say("  {} walks were cut short by the driver and done again in pieces\n", spent.retraced);
}

PointStream stream_of(const std::vector<glm::vec3>& points, float limit, ProgressBar& bar,
                      const InterruptGuard& interrupt) {
  PointStream stream;
  stream.count = points.size();
  stream.read = [&points, limit](std::uint64_t first, std::span<ProbePoint> room) {
    for (std::size_t i = 0; i < room.size(); ++i) room[i] = {points[std::size_t(first) + i], limit};
  };
  stream.progress = [&bar, &interrupt, count = points.size()](std::uint64_t done) {
    interrupt.stop("the query");
    bar.update(double(done) / double(count));
  };
  return stream;
}

std::vector<std::uint32_t> inside_of(Engine& engine, const std::vector<glm::vec3>& points, const PointQuery& query,
                                     TraceTimes& spent) {
  ProgressBar bar("inside");
  const InterruptGuard interrupt;
  std::vector<std::uint32_t> inside(points.size());
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> found) {
    std::ranges::copy(found, inside.begin() + std::ptrdiff_t(first));
  };
  const TraceTimes times = engine.points().inside(stream_of(points, 0, bar, interrupt), take, query);
  spent.device_ms += times.device_ms;
  spent.retraced += times.retraced;
  return inside;
}

int run_distance(PointArgs& args) {
  args.engine.prefer_copies();
  note_files(args);
  if (args.limit < 0 || std::isnan(args.limit))
    fail(Failure::Arguments, "--limit {}: expected a distance above 0", args.limit);
  const std::vector<glm::vec3> points = read_points(args.points);
  Opened opened = open_scene(args.engine);
  Engine& engine = *opened.engine;
  if (args.signed_distance) need_closed(engine, args);
  std::vector<float> distances(points.size());
  std::size_t near = 0;
  TraceTimes spent;
  {
    ProgressBar bar("distance");
    const InterruptGuard interrupt;
    const float limit = args.limit > 0 ? float(args.limit) : std::numeric_limits<float>::infinity();
    const auto take = [&](std::uint64_t first, std::span<const Nearest> found) {
      for (std::size_t i = 0; i < found.size(); ++i) {
        distances[std::size_t(first) + i] = found[i].distance;
        near += found[i].prim != NO_HIT;
      }
    };
    spent = engine.points().nearest(stream_of(points, limit, bar, interrupt), take, args.query());
  }
  if (args.signed_distance) {
    const std::vector<std::uint32_t> inside = inside_of(engine, points, args.query(), spent);
    for (std::size_t i = 0; i < points.size(); ++i)
      if (inside[i]) distances[i] = -distances[i];
  }
  write_numbers(args.out, std::span<const float>(distances));
  print_points(engine, args, points.size(), fmt::format("{} with a triangle", near), spent);
  return finish(engine);
}

int run_inside(PointArgs& args) {
  args.engine.prefer_copies();
  note_files(args);
  const std::vector<glm::vec3> points = read_points(args.points);
  Opened opened = open_scene(args.engine);
  Engine& engine = *opened.engine;
  need_closed(engine, args);
  TraceTimes spent;
  const std::vector<std::uint32_t> inside = inside_of(engine, points, args.query(), spent);
  const std::vector<std::uint8_t> flags(inside.begin(), inside.end());
  write_flags(args.out, flags);
  print_points(engine, args, points.size(), fmt::format("{} inside", std::ranges::count(flags, 1)), spent);
  return finish(engine);
}

void add_point_options(CLI::App& cmd, PointArgs& args, const char* out) {
  args.engine.add_to(cmd, true);
  cmd.add_option("--points", args.points, "FILE.npy with the points, float32 or float64 (n,3); '-': standard input")
      ->required();
  cmd.add_option("--out", args.out, out)->required();
  cmd.add_option("--numeric", args.numeric,
                 fmt::format("'{}', or 'exact': decided as by exact arithmetic [{}]", kDefaultNumeric, kDefaultNumeric))
      ->check(CLI::IsMember({std::string(kDefaultNumeric), std::string("exact")}));
  cmd.add_flag("--assume-closed", args.assume_closed,
               "find what is inside although edges are open; answers near a gap are then arbitrary");
}

}  // namespace

void add_distance(CLI::App& app, int& result) {
  auto args = std::make_shared<PointArgs>();
  CLI::App* cmd = app.add_subcommand("distance", "finds how far points are from a mesh: NumPy arrays in and out");
  cmd->footer(
      "Example: ballot distance bunny.glb --points points.npy --out distances.npy --signed\n"
      "Distances are within 64 * 2^-24 (M + M') of the true ones, with M and M' the largest distances of a vertex of\n"
      "the reported and of the nearest triangle. A point that is not finite has an infinite distance.");
  add_point_options(*cmd, *args, "FILE.npy for the distances, float32 (n,)");
  cmd->add_flag("--signed", args->signed_distance, "negative inside of the mesh, which must be closed");
  cmd->add_option("--limit", args->limit, "look no farther than this; distances beyond are infinite");
  show_first(*cmd, {"--points", "--out", "--signed", "--limit", "--assume-closed", "--numeric", "--device", "--json"});
  cmd->callback([args, &result] { result = run_distance(*args); });
}

void add_inside(CLI::App& app, int& result) {
  auto args = std::make_shared<PointArgs>();
  CLI::App* cmd =
      app.add_subcommand("inside", "finds which points are inside of a closed mesh: NumPy arrays in and out");
  cmd->footer(
      "Example: ballot inside bunny.glb --points points.npy --out inside.npy\n"
      "A point is inside if a ray from it crosses the mesh an odd number of times; one through an edge or a vertex\n"
      "counts once there. The answer is right for points that are 16 * 2^-24 M away from the surface, with M the\n"
      "largest distance of a vertex of a triangle that near.");
  add_point_options(*cmd, *args, "FILE.npy for the answers, bool (n,)");
  show_first(*cmd, {"--points", "--out", "--assume-closed", "--numeric", "--device", "--json"});
  cmd->callback([args, &result] { result = run_inside(*args); });
}

}  // namespace ballot::cli
