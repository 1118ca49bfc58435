#include "engine/api/arrays.h"

#include <algorithm>
#include <atomic>
#include <limits>

#include "engine/api/in_double.h"
#include "engine/core/parallel.h"
#include "engine/model/hit_geometry.h"

namespace ballot::api {

namespace {

constexpr std::size_t kRow = 512;  // hits that are written at a time
static_assert(sizeof(BallotHit) == sizeof(Hit));

glm::vec3 normal_of(const Triangle& t) { return unit_normal(t[0], t[1], t[2]); }
glm::dvec3 area_of(const Triangle& t) { return area_vector(t[0], t[1], t[2]); }

/// Returns t of a hit in numeric mode double: of a flat scene, the one by which it was found.
double t_in_double(const SceneState& scene, const RayInDouble& ray, std::uint32_t prim, double t) {
  const CornersInDouble corners = corners_of(scene, prim);
  return scene.world->forest() ? t_of(ray, corners, t) : sight_in_double(ray, corners).t;
}

}  // namespace

HitArrays::HitArrays(const BallotHits& to, std::span<const WantedValues> values, SceneState& scene,
                     const RowOrder& order, std::size_t count, RaysOfHits of)
    : to_(to), scene_(scene), order_(order), of_(of), made_(to, values, scene, order, count) {
  if (!to.normals && !to.positions && !to.front && !to.t_double && !to.positions_double) return;
  const std::span<const Triangle> triangles = scene.world->scene().triangles;  // here, before several threads ask
  if (!to.normals || scene.world->forest() || count < triangles.size()) return;
  NormalTable& table = scene.normals;
  if (const std::uint64_t now = scene.world->tracer().tree().generation(); table.generation != now) {
    table.normals.resize(triangles.size());
    for_chunks(triangles.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) table.normals[i] = normal_of(triangles[i]);
    });
    table.generation = now;
  }
  all_normals_ = table.normals;
}

const glm::vec3& HitArrays::Normals::of(const Hit& hit) {
  static constexpr glm::vec3 kNone(0);
  const std::uint32_t prim = hit.prim;
  if (prim == NO_HIT) return kNone;
  if (!all_.empty()) return all_[prim];
  if (const std::optional<glm::vec3> normal = scene_.world->shape_normal(hit)) return of_shape_ = *normal;
  Entry& entry = entries_[prim % entries_.size()];
  if (entry.prim != prim) {
    entry = {prim, normal_of(scene_.world->triangle(prim))};
  }
  return entry.normal;
}

/// Writes what tells triangles, meshes and instances apart.
void HitArrays::write_places(std::size_t place, std::span<const Hit> hits) const {
  const PlaceTable& table = *scene_.places;
  std::uint32_t last = NO_HIT, near = 0;  // neighbours often hit one triangle
  std::uint32_t triangle = BALLOT_MISS, instance = BALLOT_MISS, id = BALLOT_MISS, material = BALLOT_MISS;
  const ballot::Scene& scene = scene_.world->scene_facts();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (const std::uint32_t prim = hits[i].prim; prim != last) {
      last = prim;
      triangle = instance = id = material = BALLOT_MISS;
      if (prim != NO_HIT) {
        near = table.placement_of(prim, near);
        triangle = prim - table.first_of(near);
        instance = table.instance_of(near);
        if (to_.mesh_ids) id = table.id_of(prim, near);
        if (to_.materials) material = scene.material(scene.instances.first[table.mesh_of(near)] + triangle);
      }
    }
    if (to_.prims) to_.prims[place + i] = triangle;
    if (to_.mesh_ids) to_.mesh_ids[place + i] = id;
    if (to_.instances) to_.instances[place + i] = instance;
    if (to_.materials) to_.materials[place + i] = material;
  }
}

/// Writes where hits are, and whether rays come from the front.
void HitArrays::write_geometry(std::size_t place, std::span<const Hit> hits) const {
  const std::size_t first = place / of_.row;
  std::array<Ray, kRow> rays;
  of_.rays->read(first, std::span(rays).first((place + hits.size() - 1) / of_.row + 1 - first));
  const glm::dvec3 origin = of_.rays->recentring() ? of_.rays->recentring()->origin() : glm::dvec3(0);
  std::uint32_t last = NO_HIT;
  Triangle triangle{};
  glm::dvec3 area(0);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit& hit = hits[i];
    const Ray& ray = rays[(place + i) / of_.row - first];
    glm::dvec3 at(0);
    bool front = false;
    if (hit.prim != NO_HIT) {
      if (const std::optional<glm::vec3> normal = scene_.world->shape_normal(hit)) {
        at = position_along(ray, hit.t);
        front = is_front(glm::dvec3(*normal), ray);
      } else {
        if (hit.prim != last) triangle = scene_.world->triangle(hit.prim), area = area_of(triangle);
        last = hit.prim;
        at = position_of(triangle, hit.u, hit.v);
        front = is_front(area, ray);
      }
    }
    if (hit.prim != NO_HIT) at += origin;
    const glm::vec3 single = rounded(at);
    if (to_.positions) std::memcpy(to_.positions + 3 * (place + i), &single, sizeof single);
    if (to_.front) to_.front[place + i] = front;
  }
}

/// Writes t and positions in double.
void HitArrays::write_doubles(std::size_t place, std::span<const Hit> hits) const {
  const std::size_t first = place / of_.row;
  std::array<RayInDouble, kRow> rays;
  of_.rays->read_given(first, std::span(rays).first((place + hits.size() - 1) / of_.row + 1 - first));
  const Recentring* recentring = of_.rays->recentring();
  const glm::dvec3 origin = recentring ? recentring->origin() : glm::dvec3(0);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    RayInDouble ray = rays[(place + i) / of_.row - first];
    double t = std::numeric_limits<double>::infinity();
    glm::dvec3 at(0);
    if (hits[i].prim != NO_HIT) {
      double moved = 0;
      if (recentring) {
        recentring->ray(ray, moved);
        ray.origin = ray.origin - recentring->origin() + moved * ray.dir;
      }
      t = double(hits[i].t);
      if (of_.in_double)
        t = t_in_double(scene_, ray, hits[i].prim, t);
      else if (!scene_.world->shape_normal(hits[i]))
        t = t_of(ray, scene_.world->triangle(hits[i].prim), t);
      at = ray.origin + t * ray.dir + origin;
      t += moved;
    }
    if (to_.t_double) to_.t_double[place + i] = t;
    if (to_.positions_double) std::memcpy(to_.positions_double + 3 * (place + i), &at, sizeof at);
  }
}

/// Returns hits with the t of the rays as they were given, in `room` where these were moved.
std::span<const Hit> HitArrays::told(std::size_t place, std::span<const Hit> hits, std::span<Hit> room) const {
  if (!of_.rays || !of_.rays->recentring() || (!to_.hits && !to_.t)) return hits;
  const std::size_t first = place / of_.row;
  std::array<RayInDouble, kRow> rays;
  of_.rays->read_given(first, std::span(rays).first((place + hits.size() - 1) / of_.row + 1 - first));
  for (std::size_t i = 0; i < hits.size(); ++i) {
    double moved;
    of_.rays->recentring()->ray(rays[(place + i) / of_.row - first], moved);
    room[i] = hits[i];
    room[i].t = float(double(room[i].t) + moved);
  }
  return room.first(hits.size());
}

/// Has the processor fetch the triangles whose normals are wanted, which lie anywhere, while other results are written.
void HitArrays::fetch_triangles(std::span<const Hit> hits) const {
  const UnsetVector<Triangle>& triangles = scene_.world->scene().triangles;
  for (const Hit& hit : hits)
    if (hit.prim != NO_HIT) {
      __builtin_prefetch(&triangles[hit.prim]);
      __builtin_prefetch(&triangles[hit.prim][2][2]);
    }
}

/// Writes the results of rays that stand side by side, one array after the other: each loop then does one thing.
void HitArrays::write_row(std::size_t place, std::span<const Hit> hits, Normals& normals) const {
  const std::size_t n = hits.size();
  std::array<Hit, kRow> room;
  const std::span<const Hit> as_given = told(place, hits, room);
  if (to_.normals && all_normals_.empty() && !scene_.world->forest()) fetch_triangles(hits);
  if (to_.hits) std::memcpy(to_.hits + place, as_given.data(), hits.size_bytes());
  if (to_.t)
    for (std::size_t i = 0; i < n; ++i)
      to_.t[place + i] = hits[i].prim != NO_HIT ? as_given[i].t : std::numeric_limits<float>::infinity();
  if (to_.occluded)
    for (std::size_t i = 0; i < n; ++i) to_.occluded[place + i] = hits[i].prim != NO_HIT;
  if (to_.uvs)
    for (std::size_t i = 0; i < n; ++i) std::memcpy(to_.uvs + 2 * (place + i), &hits[i].u, 2 * sizeof(float));
  if (to_.prims || to_.mesh_ids || to_.instances || to_.materials) write_places(place, hits);
  if (to_.positions || to_.front) write_geometry(place, hits);
  if (to_.t_double || to_.positions_double) write_doubles(place, hits);
  if (to_.normals)
    for (std::size_t i = 0; i < n; ++i)
      std::memcpy(to_.normals + 3 * (place + i), &normals.of(hits[i]), sizeof(glm::vec3));
}

bool HitArrays::records_alone() const {
  if (of_.rays && of_.rays->recentring()) return false;
  return order_.width() == 0 && to_.hits && !to_.t && !to_.t_double && !to_.positions_double && !to_.occluded &&
         !to_.uvs && !to_.prims && !to_.mesh_ids && !to_.instances && !to_.normals && !to_.positions && !to_.front &&
         !to_.materials;
}

Hit* HitArrays::in_place(std::size_t first) const {
  return records_alone() ? reinterpret_cast<Hit*>(to_.hits) + first : nullptr;
}

void HitArrays::write(std::size_t first, std::span<const Hit> hits) {
  if (made_) made_.add(first, hits);
  const bool alone = records_alone(), there = alone && hits.data() == in_place(first);
  std::atomic<std::uint64_t> found{0};
  for_chunks(hits.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::uint64_t some = 0;
    for (std::size_t i = begin; i < end; ++i) some += hits[i].prim != NO_HIT;
    found += some;
    if (there) return;
    if (alone) {
      std::memcpy(to_.hits + first + begin, &hits[begin], (end - begin) * sizeof(Hit));
      return;
    }
    Normals normals(scene_, all_normals_);
    std::array<Hit, kRow> row;  // hits of rays that stand side by side
    std::size_t place = 0, n = 0;
    order_.for_rows(first + begin, end - begin, [&](std::size_t i, std::size_t at, std::size_t count) {
      for (std::size_t k = 0; k < count;) {
        if (n == kRow || (n && at + k != place + n)) {
          write_row(place, std::span(row).first(n), normals);
          n = 0;
        }
        if (n == 0) place = at + k;
        const std::size_t more = std::min(count - k, kRow - n);
        std::copy_n(&hits[begin + i + k], more, &row[n]);
        n += more;
        k += more;
      }
    });
    if (n) write_row(place, std::span(row).first(n), normals);
  });
  hits_ += found;
}

void Watch::operator()(double done) {
  done_ = done;
  ask();
}

void Watch::ask() const {
  if (!progress_) return;
  const double done = done_;
  const InCallback mark(*device_);
  if (progress_(user_, done))
    throw Refused(BALLOT_ERROR_INTERRUPTED, fmt::format("interrupted after {:.0f} % of the {}", 100 * done, what_));
}

std::vector<std::uint32_t> masks_of_triangles(const SceneState& scene) {
  const SceneInstances& all = scene.world->scene_facts().instances;
  if (std::ranges::all_of(all.placements, [](const Placement& p) { return p.mask == kMeetsAll; })) return {};
  std::vector<std::uint32_t> masks;
  for (const Placement& p : all.placements) masks.insert(masks.end(), all.triangles_of(p.mesh), p.mask);
  return masks;
}

}  // namespace ballot::api
