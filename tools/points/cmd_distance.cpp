// Queries of points: `ballot distance` and `ballot inside`.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "tools/points/field_slice.h"
#include "tools/program/cli.h"
#include "tools/program/help.h"
#include "tools/program/interrupt.h"
#include "tools/program/option_rows.h"
#include "tools/program/shell_word.h"

namespace ballot::cli {

namespace {

struct PointArgs {
  SceneArgs world;
  OptionRows rows;  // numeric, assume_closed, sign
  std::string points, out, slice, png;
  double limit = 0;
  std::uint32_t grid = 0;  // points along each axis; 0: the points of a file
  bool signed_distance = false, distances_double = false;

  /// Returns true if the nearest triangle's side gives a distance its sign.
  bool by_sides() const { return query().sides; }
  PointQuery query() const {
    PointQuery query = api::point_query(rows.query());
    if (query.sides && !signed_distance)
      fail(Failure::Arguments, "--sign {}: give --signed too", rows.query().sign.text);
    return query;
  }
};

constexpr std::uint32_t kMostGrid = 4096;
constexpr std::size_t kFilled = 1 << 14;  // points that a thread makes at a time

/// Points of a file, or those of a regular grid: a cube about the bounds of a scene, a tenth of its side wider on each
/// side, in rows of x, then y, then z.
class AskedPoints {
 public:
  explicit AskedPoints(PointsOfFile points) : points_(std::move(points)) {}
  AskedPoints(const Bounds& bounds, std::uint32_t side) : side_(side) {
    const glm::vec3 middle = 0.5f * bounds.lo + 0.5f * bounds.hi, sides = bounds.hi - bounds.lo;
    const float size = 1.2f * std::max({sides.x, sides.y, sides.z});
    lo_ = middle - glm::vec3(0.5f * size);
    step_ = size / float(side - 1);
  }
  std::uint64_t count() const { return side_ ? std::uint64_t(side_) * side_ * side_ : points_.count(); }
  /// Has them counted from the origin of a scene, as a grid is.
  void ask(const Scene& scene) { origin_ = scene.origin; }
  glm::vec3 at(std::uint64_t i) const {
    if (!side_) return points_.about(origin_, std::size_t(i));
    const std::uint64_t row = i / side_;
    return lo_ + step_ * glm::vec3(float(i % side_), float(row % side_), float(row / side_));
  }
  /// Returns a point of a file about the origin, not rounded.
  glm::dvec3 in_double(std::uint64_t i) const { return points_.about_in_double(origin_, std::size_t(i)); }
  nlohmann::json grid() const {
    if (!side_) return {};
    const glm::dvec3 first = glm::dvec3(lo_) + origin_;
    return {{"side", side_}, {"first", {first.x, first.y, first.z}}, {"step", step_}};
  }

 private:
  PointsOfFile points_;
  glm::dvec3 origin_{0};
  glm::vec3 lo_{0};
  float step_ = 0;
  std::uint32_t side_ = 0;
};

/// Checks --points and --grid, and returns the points of the file if it is that.
std::optional<AskedPoints> points_of_file(const PointArgs& args) {
  if (args.points.empty() == (args.grid == 0)) fail(Failure::Arguments, "--points and --grid: give one of them");
  if (args.grid == 0) return AskedPoints(read_points(args.points));
  if (args.grid < 2 || args.grid > kMostGrid)
    fail(Failure::Arguments, "--grid {}: expected 2 to {} points along each axis", args.grid, kMostGrid);
  const std::uint64_t bytes = std::uint64_t(args.grid) * args.grid * args.grid * sizeof(float);
  need_memory(bytes, fmt::format("--grid {}", args.grid));
  return {};
}

/// Writes a column, or a grid as a volume: NumPy's of shape (z, y, x), or bare float32 if the name ends in .raw; and
/// the picture of --slice.
void write_distances(const PointArgs& args, std::span<const double> distances) { write_numbers(args.out, distances); }
void write_distances(const PointArgs& args, std::span<const float> distances) {
  if (args.grid == 0) return write_numbers(args.out, distances);
  write_volume(args.out, distances, args.grid);
  if (args.png.empty()) return;
  write_png(args.png, draw_slice(distances, args.grid, parse_slice(args.slice, args.grid)));
}

/// Checks --slice and --png.
void check_slice(const PointArgs& args) {
  if (args.slice.empty() != args.png.empty())
    fail(Failure::Arguments, "--slice and --png: give both, such as --slice z=0.5 --png slice.png");
  if (args.slice.empty()) return;
  if (args.grid == 0) fail(Failure::Arguments, "--slice {}: of a field alone: give --grid", args.slice);
  parse_slice(args.slice, args.grid);
}

void note_files(PointArgs& args) {
  args.world.note_files();
  if (!args.points.empty()) args.world.files.reads("--points", args.points);
  args.out = args.world.files.must_write("--out", args.out).string();
  if (!args.png.empty()) args.world.files.writes("--png", args.png);
}

/// Refuses the inside test of a mesh with open edges, and signs by pseudonormals of one that is not wound alike.
void need_closed(DeviceScene& world, const PointArgs& args) {
  if (args.rows.query().assume_closed) return;
  const Topology& t = world.topology();
  const std::string& scene = args.world.scene;
  if (!args.by_sides() && (world.features().tree.shapes >> SHAPE_DISC & 1))
    fail(Failure::Arguments, "{}: the scene has discs, which have no inside; --assume-closed leaves them out", scene);
  if (args.by_sides() && !t.consistently_wound())
    fail(Failure::Arguments,
         "{}: triangles are wound against each other: at {} of the {} edges both run in the same direction; `ballot "
         "check {}` lists some; --assume-closed goes on, and signs near these are then arbitrary",
         scene, t.flipped, t.edges, shell_word(scene));
  if (!args.by_sides() && !t.closed())
    fail(Failure::Arguments,
         "{}: the mesh is not closed: {} of its {} edges belong to an odd number of triangles; `ballot check {}` lists "
         "some; `ballot distance --signed --sign pseudonormal` takes the side of the nearest triangle instead; "
         "{}--assume-closed goes on, and answers near the gaps are then arbitrary",
         scene, t.open, t.edges, shell_word(scene),
         world.forest() ? "--instances copy joins meshes that are closed together; " : "");
}

/// Prints what was done.
void print_points(DeviceScene& world, const PointArgs& args, const AskedPoints& asked, const std::string& found,
                  const TraceTimes& spent) {
  const std::uint64_t points = asked.count();
  say("{}: {} points, {}, {:.3f} ms on the device, {:.2f} million points/s\n", args.out, points, found, spent.device_ms,
      spent.device_ms > 0 ? double(points) / spent.device_ms * 1e-3 : 0);
  say("  on {} ({})\n", world.device().name, world.device().driver);
  if (spent.retraced) say("  {} walks were cut short by the driver and done again in pieces\n", spent.retraced);
  write_json(args.world.json, {{"scene", world.scene_facts().name},
                               {"device", world.device().name},
                               {"driver", world.device().driver},
                               {"numeric", args.query().exact ? "exact" : kDefaultNumeric},
                               {"points", points},
                               {"grid", asked.grid()},
                               {"device_ms", spent.device_ms},
                               {"retraced", spent.retraced}});
}

template <class Answer, class Take>
Stream<ProbePoint, Answer> stream_of(const AskedPoints& points, float limit, const Take& take, ProgressBar& bar,
                                     const InterruptGuard& interrupt) {
  Stream<ProbePoint, Answer> stream{.most = points.count(), .take = take};
  stream.next = [&points, limit](std::uint64_t first, std::span<ProbePoint> room) {
    for_chunks(room.size(), kFilled, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) room[i] = {points.at(first + i), limit};
    });
    return room.size();
  };
  stream.progress = [&bar, &interrupt, count = stream.most](std::uint64_t done) {
    interrupt.stop("the query");
    bar.update(double(done) / double(count));
  };
  return stream;
}

/// Finds which points are inside, and calls take with the answers.
template <class Take>
void find_inside(DeviceScene& world, const AskedPoints& points, const PointQuery& query, const Take& take,
                 TraceTimes& spent) {
  ProgressBar bar("inside");
  const InterruptGuard interrupt;
  const TraceTimes times = world.points().inside(stream_of<std::uint32_t>(points, 0, take, bar, interrupt), query);
  spent.device_ms += times.device_ms;
  spent.retraced += times.retraced;
}

/// Returns a distance that was found, in float32 or, from where the point is in double to the nearest one, in double.
void tell(const DeviceScene&, const AskedPoints&, std::uint64_t, const Nearest& found, float& distance) {
  distance = found.distance;
}
void tell(const DeviceScene& world, const AskedPoints& points, std::uint64_t i, const Nearest& found,
          double& distance) {
  distance = double(found.distance);
  if (found.prim != NO_HIT && !world.shape_normal({0, found.prim, found.u, found.v}))
    distance = glm::length(points.in_double(i) - position_of(world.triangle(found.prim), found.u, found.v));
}

/// Finds the distances. Returns how many points have a triangle.
template <class Number>
std::size_t find_distances(DeviceScene& world, const PointArgs& args, const AskedPoints& points,
                           std::vector<Number>& distances, TraceTimes& spent) {
  ProgressBar bar("distance");
  const InterruptGuard interrupt;
  const float limit = args.limit > 0 ? float(args.limit) : std::numeric_limits<float>::infinity();
  std::size_t near = 0;
  const auto take = [&](std::uint64_t first, std::span<const Nearest> found) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      Number& distance = distances[std::size_t(first) + i];
      tell(world, points, first + i, found[i], distance);
      if (found[i].behind) distance = -distance;
      near += found[i].prim != NO_HIT;
    }
  };
  spent = world.points().nearest(stream_of<Nearest>(points, limit, take, bar, interrupt), args.query());
  return near;
}

/// Finds the distances, with their signs, and writes them.
template <class Number>
int answer_distances(DeviceScene& world, const PointArgs& args, const AskedPoints& points) {
  std::vector<Number> distances(std::size_t(points.count()));
  TraceTimes spent;
  const std::size_t near = find_distances(world, args, points, distances, spent);
  if (args.signed_distance && !args.by_sides()) {
    const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> inside) {
      for (std::size_t i = 0; i < inside.size(); ++i)
        if (inside[i]) distances[std::size_t(first) + i] *= -1;
    };
    find_inside(world, points, args.query(), take, spent);
  }
  write_distances(args, distances);
  print_points(world, args, points, fmt::format("{} with a triangle", near), spent);
  return finish(world);
}

int run_distance(PointArgs& args) {
  note_files(args);
  args.query();
  if (args.limit < 0 || std::isnan(args.limit))
    fail(Failure::Arguments, "--limit {}: expected a distance above 0", args.limit);
  if (args.distances_double && args.grid)
    fail(Failure::Arguments, "--distances-double: of --points alone; a field of --grid is float32");
  check_slice(args);
  const std::optional<AskedPoints> of_file = points_of_file(args);
  Opened opened = open_scene(args.world);
  DeviceScene& world = *opened.world;
  if (args.signed_distance) need_closed(world, args);
  const Bounds& bounds = world.forest() ? world.scene_facts().bounds : world.bvh().bounds;
  AskedPoints points = of_file ? *of_file : AskedPoints(bounds, args.grid);
  points.ask(world.scene_facts());
  if (args.distances_double) return answer_distances<double>(world, args, points);
  return answer_distances<float>(world, args, points);
}

int run_inside(PointArgs& args) {
  note_files(args);
  AskedPoints points = *points_of_file(args);
  Opened opened = open_scene(args.world);
  DeviceScene& world = *opened.world;
  need_closed(world, args);
  points.ask(world.scene_facts());
  TraceTimes spent;
  std::vector<std::uint8_t> flags(std::size_t(points.count()));
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> inside) {
    std::ranges::copy(inside, flags.begin() + std::ptrdiff_t(first));
  };
  find_inside(world, points, args.query(), take, spent);
  write_flags(args.out, flags);
  print_points(world, args, points, fmt::format("{} inside", std::ranges::count(flags, 1)), spent);
  return finish(world);
}

void add_point_options(CLI::App& cmd, PointArgs& args, const char* out) {
  args.world.add_to(cmd, true);
  cmd.add_option("--points", args.points, "FILE.npy with the points, float32 or float64 (n,3); '-': standard input");
  cmd.add_option("--out", args.out, out)->required();
  args.rows.add_to(cmd, {"numeric", "assume_closed"});
}

}  // namespace

void add_distance(CLI::App& app, int& result) {
  const auto [cmd, args] = add_command<PointArgs>(app, result, "distance", run_distance,
                                                  "finds how far points are from a mesh: NumPy arrays in and out");
  cmd->footer(
      "Examples: ballot distance bunny.glb --points points.npy --out distances.npy --signed\n"
      "          ballot distance bunny.glb --grid 256 --signed --sign pseudonormal --out field.npy --slice z=0.5 --png "
      "s.png\n"
      "Distances are within 64 * 2^-24 (M + M') + 2^-85 R of the true ones. M and M' are the largest distances of a "
      "vertex\n"
      "of the reported and of the nearest triangle, R that of a point of the scene along an axis. A point that is not\n"
      "finite has an infinite distance.");
  add_point_options(*cmd, *args, "FILE.npy for the distances, float32 (n,); with --grid (N,N,N), or FILE.raw");
  cmd->add_option(
      "--grid", args->grid,
      "a distance field instead of --points: N points along each axis of a cube about the scene, 1.2 times\n"
      "as wide as its longest side, written as a volume [z][y][x]. --json has its first point and step");
  cmd->add_option(
      "--slice", args->slice,
      "of --grid: the plane that --png shows, as x, y or z and where it lies from the first point, 0, to the\n"
      "last, 1: z=0.5");
  cmd->add_option("--png", args->png, "FILE.png of the slice, a pixel a point: blue outside, orange inside");
  cmd->add_flag("--signed", args->signed_distance, "negative inside of the mesh, as --sign says");
  args->rows.add_to(*cmd, {"sign"});
  cmd->add_flag("--distances-double", args->distances_double,
                "float64: from the point as it was given to the nearest one of the triangle");
  cmd->add_option("--limit", args->limit, "look no farther than this; distances beyond are infinite");
  show_first(*cmd, {"--points", "--grid", "--out", "--signed", "--sign", "--slice", "--png", "--limit",
                    "--distances-double", "--assume-closed", "--numeric", "--device", "--json"});
}

void add_inside(CLI::App& app, int& result) {
  const auto [cmd, args] = add_command<PointArgs>(
      app, result, "inside", run_inside, "finds which points are inside of a closed mesh: NumPy arrays in and out");
  cmd->footer(
      "Example: ballot inside bunny.glb --points points.npy --out inside.npy\n"
      "A point is inside if a ray from it crosses the mesh an odd number of times; one through an edge or a vertex\n"
      "counts once there. The answer is right for points that are 16 * 2^-24 M away from the surface, with M the\n"
      "largest distance of a vertex of a triangle that near.");
  add_point_options(*cmd, *args, "FILE.npy for the answers, bool (n,)");
  show_first(*cmd, {"--points", "--out", "--assume-closed", "--numeric", "--device", "--json"});
}

}  // namespace ballot::cli
