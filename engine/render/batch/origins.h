// Checks the origins of secondary rays: each ray must leave its triangle and must not skip another surface.
#pragma once

#include <vector>

#include "engine/model/scene.h"
#include "engine/render/batch/batch.h"

namespace ballot {

/// The result for one ray.
struct OriginCheck {
  /// The nearest hit of the trace is the triangle that the ray starts from. This is an error: a ray that leaves a flat
  /// triangle never returns to it. Shadow rays to a light behind the surface cross it; their self hits do not count.
  bool self_hit;
  bool lost_contact;  // the first surface on the ideal ray lies before the origin or t_min (engine/oracle/contact.h)
  double offset;      // distance from the surface point to the origin, scene units
  double ulps;        // the same in float32 ulps of the point's largest coordinate
};

/// Returns true if `ray`, which starts at the hit of `primary` on the triangle, points to the side of the triangle that
/// `primary` did not come from.
bool goes_behind(const Triangle& triangle, const Ray& primary, const Ray& ray);

/// Checks the origin of every ray of a batch. The contract is that of DeviceScene::check_origins
/// (engine/scene/device_scene.h).
std::vector<OriginCheck> check_origins(Tracer& tracer, Batches& batches, const Scene& scene, const RayBatch& batch,
                                       const Query& query);

}  // namespace ballot
