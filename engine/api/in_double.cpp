#include "engine/api/in_double.h"

#include "engine/api/meshes.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "engine/core/interruption.h"
#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"
#include "engine/model/instances.h"
#include "engine/tree/host/build.h"

namespace ballot::api {

namespace {

constexpr std::size_t kAtOnce = 1 << 16, kOfThread = 1 << 6;  // questions that are answered at a time; by a thread
constexpr Hit kNoHit{std::numeric_limits<float>::infinity(), NO_HIT, 0, 0};

/// Writes the corners of a mesh's triangles in double.
void write_corners(MeshState& mesh, std::span<const Triangle> rounded, std::span<CornersInDouble> to) {
  if (!mesh.in_double && !mesh.heights) {
    std::ranges::transform(rounded, to.begin(), widened);
    return;
  }
  const MeshIndices indices = indices_of(mesh);
  for (std::size_t i = 0; i < to.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t vertex = indices.all.empty() ? 3 * i + k : indices.all[3 * i + k];
      to[i][k] = mesh.heights ? mesh.heights->at(vertex) - mesh.origin : (*mesh.in_double)[vertex];
    }
}

/// Returns the largest sum of magnitudes of a row of an instance's matrix.
double largest_row(const SceneInstances& all) {
  double most = 0;
  for (const Placement& p : all.placements)
    for (const auto& row : p.transform.m)
      most = std::max(most, double(std::abs(row[0])) + double(std::abs(row[1])) + double(std::abs(row[2])));
  return most;
}

/// What the host answers by.
class OnHost {
 public:
  OnHost(SceneState& scene, const char* what, std::span<const std::uint32_t> masks = {})
      : tree_(tree_of(scene, what)),
        oracle_(*tree_.oracle_scene().trees()[0], tree_.triangles(),
                tree_.doubles() ? tree_.doubles()->here() : std::span<const CornersInDouble>()),
        judge_(nullptr, masks) {}

  const OracleInDouble& oracle() const { return oracle_; }
  const FilterJudge& judge() const { return judge_; }

  /// Calls part(first, count), which answers a part of `count` questions, one after the other.
  template <class Part>
  TraceTimes run(std::size_t count, Watch& watch, const Part& part) {
    const Stopwatch walked(tree_.walked_s());
    for (std::size_t first = 0; first < count; first += kAtOnce) {
      part(first, std::min(kAtOnce, count - first));
      if (watch) watch(double(std::min(count, first + kAtOnce)) / double(count));
    }
    return {};
  }
  /// Calls answer(i) for all questions of a part, by all cores.
  template <class Answer>
  static void each(std::size_t count, const Answer& answer) {
    for_chunks(count, kOfThread, [&](std::size_t begin, std::size_t end) {
      check_interruption();
      for (std::size_t i = begin; i < end; ++i) answer(i);
    });
  }

 private:
  static DeviceTree& tree_of(SceneState& scene, const char* what) {
    DeviceTree& tree = scene.world->tracer().tree();
    if (tree.forest())
      refuse(fmt::format("numeric is 'double': {} of scenes with instances are in watertight and exact alone", what));
    check_takes(find_numeric("double"), tree.facts().shapes);
    take_doubles(scene);
    return tree;
  }

  DeviceTree& tree_;
  OracleInDouble oracle_;
  FilterJudge judge_;
};

std::vector<Hit> hits_from(const std::vector<CrossingInDouble>& crossings) {
  std::vector<Hit> hits;
  for (const CrossingInDouble& c : crossings) hits.push_back({float(c.t), c.prim, float(c.u), float(c.v)});
  return hits;
}

/// Finds the crossings of rays, and passes on those of each part of them.
template <class Take>
TraceTimes find_crossings(SceneState& scene, const RayArray& rays, const RowOrder& order, const CrossingQuery& query,
                          Watch& watch, const Take& take) {
  if (query.alpha) refuse("alpha is 1 and numeric is 'double'; expected one of them: textures are read in float32");
  OnHost host(scene, "crossings", query.triangle_masks);
  const FilterReaders readers = rays.filters().readers(order);
  return host.run(rays.count(), watch, [&](std::size_t first, std::size_t count) {
    std::vector<RayInDouble> given(count);
    rays.read_in_double(order, first, given);
    const FilterWords words = readers.read(first, count);
    std::vector<std::vector<Hit>> found(count);
    OnHost::each(count, [&](std::size_t i) {
      const auto keep = [&](std::uint32_t prim, bool front) {
        return query.cull != (front ? Cull::Front : Cull::Back) && host.judge().keeps(words, i, prim);
      };
      const std::size_t most = query.any ? 1 : query.most == kAllHits ? ~std::size_t{0} : query.most;
      found[i] = hits_from(host.oracle().list(given[i], keep, most, query.last));
    });
    take(first, found);
  });
}

}  // namespace

bool is_double(const BallotQuery& query) { return query.numeric && std::string_view(query.numeric.text) == "double"; }

bool rounds_flat(MeshState& mesh, const VerticesInDouble& vertices) {
  if (!vertices) return false;
  const MeshIndices made = indices_of(mesh);
  const std::span<const std::uint32_t> indices = made.all;
  std::atomic<bool> found = false;
  for_chunks(mesh.triangles, kOfThread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end && !found; ++i) {
      CornersInDouble v;
      for (std::size_t k = 0; k < 3; ++k) v[k] = (*vertices)[indices.empty() ? 3 * i + k : indices[3 * i + k]];
      if (is_degenerate({glm::vec3(v[0]), glm::vec3(v[1]), glm::vec3(v[2])}) &&
          glm::cross(v[1] - v[0], v[2] - v[0]) != glm::dvec3(0))
        found = true;
    }
  });
  return found;
}

void forget_doubles(SceneState& scene) { scene.world->tracer().tree().set_doubles(nullptr); }

void take_doubles(SceneState& scene) {
  DeviceTree& tree = scene.world->tracer().tree();
  const auto has = [](const auto& mesh) {
    return mesh.second.in_double || (mesh.second.heights && mesh.second.rounding > 0);
  };
  if (tree.doubles() || std::ranges::none_of(scene.meshes, has)) return;
  const ballot::Scene& world = scene.world->scene();
  const SceneInstances& all = world.instances;
  std::vector<CornersInDouble> corners(world.triangles.size());
  for (std::size_t m = 0; m < all.meshes(); ++m) {
    const std::size_t first = all.first[m], count = all.triangles_of(m);
    write_corners(scene.meshes.at(all.mesh_labels[m].number), std::span(world.triangles).subspan(first, count),
                  std::span(corners).subspan(first, count));
  }
  std::vector<std::size_t> first{0};
  float top_room = 0;
  if (tree.forest()) {
    first = tree_layout(world).first;
    first.pop_back();
    double largest = 0;
    for (const CornersInDouble& triangle : corners)
      for (const glm::dvec3& v : triangle) largest = std::max({largest, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    top_room = float(kRoundedToSingle * largest * largest_row(all));
  }
  tree.set_doubles(std::make_shared<DoubleCorners>(std::move(corners), std::move(first), top_room));
}

CornersInDouble corners_of(const SceneState& scene, std::uint32_t prim) {
  const DeviceTree& tree = scene.world->tracer().tree();
  if (!tree.doubles()) return widened(scene.world->triangle(prim));
  if (!tree.forest()) return tree.doubles()->here()[prim];
  const PlaceTable& places = *scene.places;
  const SceneInstances& all = scene.world->scene_facts().instances;
  const std::uint32_t at = places.placement_of(prim, 0);
  CornersInDouble corners = tree.doubles()->here()[all.first[places.mesh_of(at)] + prim - places.first_of(at)];
  const auto& m = all.placements[at].transform.m;
  for (glm::dvec3& v : corners) {
    const glm::dvec3 from = v;
    for (int row = 0; row < 3; ++row)
      v[row] = double(m[row][0]) * from.x + double(m[row][1]) * from.y + double(m[row][2]) * from.z + double(m[row][3]);
  }
  return corners;
}

TraceTimes list_in_double(SceneState& scene, const RayArray& rays, const RowOrder& order, const CrossingQuery& query,
                          Watch& watch, const TakeLists& take) {
  std::vector<std::uint32_t> counts;
  std::vector<Hit> hits;
  return find_crossings(scene, rays, order, query, watch,
                        [&](std::size_t first, const std::vector<std::vector<Hit>>& found) {
                          counts.clear(), hits.clear();
                          for (const std::vector<Hit>& of_ray : found) {
                            counts.push_back(std::uint32_t(of_ray.size()));
                            hits.insert(hits.end(), of_ray.begin(), of_ray.end());
                          }
                          take(first, counts, hits);
                        });
}

TraceTimes first_in_double(SceneState& scene, const RayArray& rays, const CrossingQuery& query, Watch& watch,
                           const TakeFirst& take) {
  std::vector<Hit> rows;
  return find_crossings(scene, rays, RowOrder(), query, watch,
                        [&](std::size_t first, const std::vector<std::vector<Hit>>& found) {
                          rows.assign(found.size() * query.most, kNoHit);
                          for (std::size_t i = 0; i < found.size(); ++i)
                            std::ranges::copy(found[i], rows.begin() + std::ptrdiff_t(i * query.most));
                          take(first, rows);
                        });
}

TraceTimes nearest_in_double(SceneState& scene, const PointArray& points, Watch& watch,
                             const std::function<void(std::uint64_t first, std::span<const Nearest>)>& take) {
  const std::vector<std::uint32_t> masks =
      points.filters().has(FILTER_MASK) ? masks_of_triangles(scene) : std::vector<std::uint32_t>();
  OnHost host(scene, "points", masks);
  const FilterReaders readers = points.filters().readers();
  return host.run(points.count(), watch, [&](std::size_t first, std::size_t count) {
    std::vector<ProbePoint> asked(count);
    std::vector<glm::dvec3> given(count);
    points.read(first, asked);
    points.read_given(first, given);
    const FilterWords words = readers.read(first, count);
    std::vector<Nearest> found(count);
    OnHost::each(count, [&](std::size_t i) {
      const auto keep = [&](std::uint32_t prim) { return host.judge().keeps(words, i, prim); };
      const ClosestInDouble c = host.oracle().closest(given[i] - points.origin(), double(asked[i].limit), keep);
      found[i] = {glm::vec3(c.at), float(c.distance), c.prim, float(c.u), float(c.v), 0};
    });
    take(first, found);
  });
}

TraceTimes inside_in_double(SceneState& scene, const PointArray& points, Watch& watch,
                            const std::function<void(std::uint64_t first, std::span<const std::uint32_t>)>& take) {
  OnHost host(scene, "points");
  return host.run(points.count(), watch, [&](std::size_t first, std::size_t count) {
    std::vector<glm::dvec3> given(count);
    points.read_given(first, given);
    std::vector<std::uint32_t> found(count);
    OnHost::each(count, [&](std::size_t i) { found[i] = host.oracle().inside(given[i] - points.origin()); });
    take(first, found);
  });
}

}  // namespace ballot::api
