// Writes hits to a caller's arrays, by all cores; the progress function of a call.
#pragma once

#include <array>
#include <chrono>
#include <functional>
#include <optional>
#include <span>

#include "engine/api/query.h"
#include "engine/api/sources.h"
#include "engine/api/state.h"
#include "engine/api/values.h"
#include "engine/core/interruption.h"

namespace ballot::api {

/// The rays of hits, of which each has a row.
struct RaysOfHits {
  const RayArray* rays = nullptr;  // null: hits are of points
  std::size_t row = 1;
  bool in_double = false;  // they were found in numeric mode double
};

/// The result arrays of a call. Keeps the caller's pointers and references to the scene and the rays.
class HitArrays {
 public:
  /// `values` are those of `to`; `count`: of the hits that will come.
  HitArrays(const BallotHits& to, std::span<const WantedValues> values, SceneState& scene, const RowOrder& order,
            std::size_t count, RaysOfHits of);
  /// Writes the hits of the rays from number `first` of the order on. hits() counts the rays that hit.
  void write(std::size_t first, std::span<const Hit> hits);
  /// Returns where the hits from number `first` on belong, if the caller wants them as records in this order and no
  /// other results; null if not. write() does not copy hits that lie there.
  Hit* in_place(std::size_t first) const;
  std::uint64_t hits() const { return hits_; }
  /// Writes what the device makes of all hits, and adds what that takes.
  void end(TraceTimes& times) { made_.end(times); }

 private:
  /// Normals, and those of triangles that were hit last: rays of a tile hit the same ones again and again.
  class Normals {
   public:
    Normals(const SceneState& scene, std::span<const glm::vec3> all) : scene_(scene), all_(all) {}
    /// Returns the unit normal where a ray hits, or zero for a miss. Valid until the next call.
    const glm::vec3& of(const Hit& hit);

   private:
    struct Entry {
      std::uint32_t prim = NO_HIT;
      glm::vec3 normal{0};
    };
    const SceneState& scene_;
    const std::span<const glm::vec3> all_;  // of all triangles, or none
    std::array<Entry, 256> entries_;
    glm::vec3 of_shape_{0};
  };

  void fetch_triangles(std::span<const Hit> hits) const;
  void write_row(std::size_t place, std::span<const Hit> hits, Normals& normals) const;
  void write_places(std::size_t place, std::span<const Hit> hits) const;
  void write_geometry(std::size_t place, std::span<const Hit> hits) const;
  void write_doubles(std::size_t place, std::span<const Hit> hits) const;
  std::span<const Hit> told(std::size_t place, std::span<const Hit> hits, std::span<Hit> room) const;
  bool records_alone() const;

  BallotHits to_;
  const SceneState& scene_;
  RowOrder order_;
  std::span<const glm::vec3> all_normals_;  // none: they are found as they are hit
  std::uint64_t hits_ = 0;
  RaysOfHits of_;
  MadeColumns made_;
};

/// Returns the options of a call; null: the defaults. Throws if one is set that its kind does not have.
inline BallotQuery read_query(const BallotQuery* given, const Kind& kind) {
  BallotQuery query = read_struct(given, "BallotQuery");
  check_options(query, kind);
  return query;
}

/// Returns the mask of each triangle's instance, counted through the instances; none: all bits.
std::vector<std::uint32_t> masks_of_triangles(const SceneState& scene);

/// The filters of questions about triangles. Keeps a reference to them.
class TriangleFilters {
 public:
  TriangleFilters(const SceneState& scene, const FilterColumns& words) : words_(words) {
    if (words.has(FILTER_MASK)) of_triangles_ = masks_of_triangles(scene);
  }
  /// Returns a query with these filters, if there are any.
  PointQuery on(PointQuery query) const {
    query.triangle_masks = of_triangles_;
    query.filters = words_.readers();
    return query;
  }

 private:
  const FilterColumns& words_;
  std::vector<std::uint32_t> of_triangles_;
};

/// Measures a call.
class Clock {
 public:
  BallotTimes times(const TraceTimes& trace, std::uint64_t hits) const {
    BallotTimes t = BALLOT_INIT(BallotTimes);
    t.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    t.device_ms = trace.device_ms;
    t.hits = hits;
    return t;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// The progress function of a call on a device. Throws Refused(BALLOT_ERROR_INTERRUPTED) when it asks to stop.
class Watch {
 public:
  /// `with` has `progress`, as BallotQuery. `what` is counted: "rays".
  template <class With>
  Watch(const With& with, const DeviceState& device, const char* what = "rays")
      : progress_(with.progress.call), user_(with.progress.user), device_(&device), what_(what) {}
  void operator()(double done);
  /// Calls it with the share that was done last.
  void ask() const;
  explicit operator bool() const { return progress_ != nullptr; }

 private:
  int (*progress_)(void*, double);
  void* user_;
  const DeviceState* device_;
  const char* what_;
  double done_ = 0;
};

/// Returns what the building of a tree tells its progress.
inline Progress build_progress(Watch& watch) {
  if (!watch) return {};
  return [&watch](double done) { watch(done); };
}

/// While it lives, the engine's work in this thread asks the progress function of a call now and then.
class Watched {
 public:
  explicit Watched(const Watch& watch) : ask_([&watch] { watch.ask(); }) {
    if (watch) work_.emplace(ask_);
  }

 private:
  std::function<void()> ask_;
  std::optional<Interruptible> work_;
};

/// Runs answer(query, watch), which returns the times of a call, on a scene's device: with the options of the call, and
/// its progress function at hand. `what` is counted: "rays".
template <class Answer>
void run_call(SceneState& scene, const BallotQuery* query, const Kind& kind, const char* what, BallotTimes* times,
              const Answer& answer) {
  const BallotQuery q = read_query(query, kind);
  Watch watch(q, *scene.device, what);
  const Watched watched(watch);
  const DeviceUse use(*scene.device);
  keep_fit(scene);
  write_struct(times, answer(q, watch), "BallotTimes");
}

}  // namespace ballot::api
