// Distances of scenes by the C interface.
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/answer/clearance.h"
#include "engine/api/arrays.h"
#include "engine/core/parallel.h"

namespace ballot::api {
namespace {

constexpr double kMostPose = 1e30;  // of a number

/// The poses of a call.
class PoseArray {
 public:
  /// Throws Refused if the description is wrong.
  explicit PoseArray(const BallotPoses& given)
      : shape_(read_shape("poses", given.shape)),
        pose_(read_column({"poses", "pose", 12}, shape_, given.pose), shape_),
        limit_(read_column({"poses", "limit"}, shape_, given.limit), shape_) {}
  std::size_t count() const { return shape_.count; }
  /// Returns a pose. Throws Refused if a number is larger than kMostPose, so that products of four coordinates stay in
  /// range (engine/core/triangle_distance.h).
  PoseInDouble pose(std::size_t i) const {
    PoseInDouble pose{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    pose_.for_doubles(i, 1, [&](std::size_t, const auto& v) {
      for (std::size_t k = 0; k < 12; ++k) {
        if (!(std::abs(v[k]) <= kMostPose))
          refuse(fmt::format("poses: number {} of pose {} is {}; expected finite numbers within +-{:g}", k, i, v[k],
                             kMostPose));
        pose[k / 4][k % 4] = v[k];
      }
    });
    return pose;
  }
  double limit(std::size_t i) const {
    double limit = std::numeric_limits<double>::infinity();
    limit_.for_doubles(i, 1, [&](std::size_t, const auto& v) { limit = v[0]; });
    if (!(limit >= 0))
      refuse(fmt::format("poses: limit of pose {} is {}; expected a distance of at least 0", i, limit));
    return limit;
  }

 private:
  Shape shape_;
  Lane pose_, limit_;
};

/// Returns a pose between scenes whose numbers are counted from origins.
PoseInDouble about_origins(PoseInDouble pose, const glm::dvec3& scene, const glm::dvec3& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    auto& row = pose[k];
    row[3] += row[0] * other.x + row[1] * other.y + row[2] * other.z - scene[glm::length_t(k)];
  }
  return pose;
}

void write(const BallotClearance& to, std::size_t i, const std::optional<Clearance>& found, const glm::dvec3& origin) {
  const auto put = [i](double* points, const glm::dvec3& at) {
    if (points) std::memcpy(points + 3 * i, &at, sizeof at);
  };
  if (to.distances) to.distances[i] = found ? found->distance : std::numeric_limits<double>::infinity();
  if (to.prims) to.prims[i] = found ? found->prim : NO_HIT;
  if (to.other_prims) to.other_prims[i] = found ? found->other_prim : NO_HIT;
  put(to.points, found ? found->at + origin : glm::dvec3(0));
  put(to.other_points, found ? found->other_at + origin : glm::dvec3(0));
}

const OracleScene& triangles_of(SceneState& scene, const char* which) {
  if (scene.world->features().tree.shapes)
    refuse(fmt::format("distance of scenes: {} has shapes; expected triangles alone", which));
  return scene.world->tracer().tree().oracle_scene();
}

BallotTimes find_clearance(SceneState& scene, SceneState& other, const PoseArray& poses, const BallotClearance& to,
                           Watch& watch) {
  const Clock clock;
  const ClearanceWalk walk(triangles_of(scene, "the scene"), triangles_of(other, "the other scene"));
  const glm::dvec3 origin = scene.world->scene_facts().origin, other_origin = other.world->scene_facts().origin;
  std::atomic<std::uint64_t> found{0};
  std::atomic<std::size_t> done{0};
  for_chunks(poses.count(), 1, [&](std::size_t begin, std::size_t end) {
    check_interruption();
    for (std::size_t i = begin; i < end; ++i) {
      const auto pair = walk.find(about_origins(poses.pose(i), origin, other_origin), poses.limit(i));
      write(to, i, pair, origin);
      found += pair.has_value();
    }
    done += end - begin;
  });
  if (watch && poses.count()) watch(1);
  return clock.times({}, found);
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_clearance(BallotScene* scene, BallotScene* other, const BallotPoses* poses,
                              const BallotClearance* to, const BallotQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(other, "ballot_clearance", "other");
    need(to, "ballot_clearance", "to");
    const std::shared_ptr<SceneState> second = use(other);
    if (second->device != state->device)
      refuse("ballot_clearance: the other scene is of another device; expected scenes of one device");
    BallotPoses given = read_struct(poses, "BallotPoses");
    if (!poses) given.shape[0] = 1;
    const PoseArray array(given);
    const BallotClearance out = read_struct(to, "BallotClearance");
    run_call(*state, query, kClearanceKind, "poses", times, [&](const BallotQuery&, Watch& watch) {
      keep_fit(*second);
      return find_clearance(*state, *second, array, out, watch);
    });
  });
}
