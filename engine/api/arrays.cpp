#include "engine/api/arrays.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "engine/core/parallel.h"

namespace ballot::api {

namespace {

constexpr std::size_t kChunk = 1 << 14;  // rays that a thread takes at a time
constexpr float kNoBound = std::numeric_limits<float>::max();
static_assert(sizeof(BallotRay) == sizeof(Ray) && sizeof(BallotHit) == sizeof(Hit));

/// Runs work(begin, end) over [0, count), by several threads if there is enough of it.
template <class Work>
void over(std::size_t count, const Work& work) {
  if (count > kChunk)
    for_chunks(count, kChunk, work);
  else if (count)
    work(0, count);
}

/// Returns the unit normal of a triangle; zero if it has no area.
glm::vec3 unit_normal(const Triangle& t) {
  const glm::dvec3 a{t[0]}, n = glm::cross(glm::dvec3{t[1]} - a, glm::dvec3{t[2]} - a);
  const double length = glm::length(n);
  return length > 0 ? glm::vec3(n / length) : glm::vec3(0);
}

}  // namespace

RayArray::RayArray(const BallotRays& rays)
    : data_(reinterpret_cast<const char*>(rays.data)), count_(rays.count), full_(rays.format == BALLOT_RAYS_FULL) {
  if (rays.format != BALLOT_RAYS_FULL && rays.format != BALLOT_RAYS_UNBOUNDED)
    throw Refused(
        BALLOT_ERROR_ARGUMENT,
        fmt::format("rays: format is {}; expected BALLOT_RAYS_FULL or BALLOT_RAYS_UNBOUNDED", int(rays.format)));
  const std::size_t bytes = (full_ ? 8 : 6) * sizeof(float);
  stride_ = rays.stride ? rays.stride : bytes;
  if (count_ && !data_)
    throw Refused(BALLOT_ERROR_ARGUMENT, fmt::format("rays: data is NULL, but count is {}", count_));
  if (stride_ < bytes || stride_ % sizeof(float))
    throw Refused(BALLOT_ERROR_ARGUMENT,
                  fmt::format("rays: stride is {} bytes; expected a multiple of 4, at least {}", stride_, bytes));
}

void RayArray::read(std::size_t first, std::span<Ray> rays) const {
  over(rays.size(), [&](std::size_t begin, std::size_t end) {
    const char* from = data_ + (first + begin) * stride_;
    if (full_ && stride_ == sizeof(Ray)) {
      std::memcpy(static_cast<void*>(&rays[begin]), from, (end - begin) * sizeof(Ray));
    } else {
      for (std::size_t i = begin; i < end; ++i, from += stride_) {
        const float* f = reinterpret_cast<const float*>(from);
        rays[i] = full_ ? Ray{{f[0], f[1], f[2]}, f[3], {f[4], f[5], f[6]}, f[7]}
                        : Ray{{f[0], f[1], f[2]}, 0, {f[3], f[4], f[5]}, kNoBound};
      }
    }
    if (full_)
      for (std::size_t i = begin; i < end; ++i)
        if (rays[i].t_max > kNoBound) rays[i].t_max = kNoBound;
  });
}

const MeshState& HitArrays::mesh_of(std::uint32_t prim) const {
  if (scene_.meshes.size() == 1) return scene_.meshes[0];
  return *std::prev(std::ranges::upper_bound(scene_.meshes, prim, {}, &MeshState::first));
}

void HitArrays::write(std::size_t at, const Hit& hit) const {
  const bool found = hit.prim != NO_HIT;
  if (to_.hits) to_.hits[at] = {hit.t, hit.prim, hit.u, hit.v};
  if (to_.t) to_.t[at] = found ? hit.t : std::numeric_limits<float>::infinity();
  if (to_.occluded) to_.occluded[at] = found;
  if (to_.uvs) to_.uvs[2 * at] = hit.u, to_.uvs[2 * at + 1] = hit.v;
  if (to_.prims || to_.mesh_ids) {
    const MeshState* mesh = found ? &mesh_of(hit.prim) : nullptr;
    if (to_.prims) to_.prims[at] = mesh ? std::uint32_t(hit.prim - mesh->first) : BALLOT_MISS;
    if (to_.mesh_ids) to_.mesh_ids[at] = mesh ? mesh->id : BALLOT_MISS;
  }
  if (to_.normals) {
    const glm::vec3 n = found ? unit_normal(scene_.engine->scene().triangles[hit.prim]) : glm::vec3(0);
    for (int axis = 0; axis < 3; ++axis) to_.normals[3 * at + std::size_t(axis)] = n[axis];
  }
}

void HitArrays::write(std::size_t first, std::span<const Hit> hits) {
  const bool records_alone =
      !to_.t && !to_.occluded && !to_.uvs && !to_.prims && !to_.mesh_ids && !to_.normals && to_.hits;
  std::atomic<std::uint64_t> found{0};
  over(hits.size(), [&](std::size_t begin, std::size_t end) {
    std::uint64_t some = 0;
    for (std::size_t i = begin; i < end; ++i) some += hits[i].prim != NO_HIT;
    found += some;
    if (records_alone)
      std::memcpy(to_.hits + first + begin, &hits[begin], (end - begin) * sizeof(Hit));
    else
      for (std::size_t i = begin; i < end; ++i) write(first + i, hits[i]);
  });
  hits_ += found;
}

Query query_of(const BallotQuery& q) {
  Query query;
  if (q.any) query.want = Want::Any;
  if (q.method) query.method = q.method;
  if (q.numeric) query.numeric = q.numeric;
  if (q.knob_count) need(q.knobs, "BallotQuery", "knobs");
  for (std::size_t i = 0; i < q.knob_count; ++i) {
    need(q.knobs[i].name, "BallotQuery", "the name of a knob");
    need(q.knobs[i].value, "BallotQuery", "the value of a knob");
    query.knobs[q.knobs[i].name] = q.knobs[i].value;
  }
  if (q.ray_class) query.rays = q.ray_class;
  return query;
}

void Watch::operator()(double done) const {
  if (progress_ && progress_(user_, done))
    throw Refused(BALLOT_ERROR_INTERRUPTED, fmt::format("interrupted after {:.0f} % of the rays", 100 * done));
}

}  // namespace ballot::api
