// Where rays from hits start, held to what they should do: leave their triangle, and lose nothing else.
#pragma once

#include <vector>

#include "engine/render/batch/batch.h"
#include "engine/scene/scene.h"

namespace ballot {

struct OriginCheck {
  // The nearest hit that the trace gives is the triangle that the ray starts from: an error, as no ray that leaves a flat
  // triangle returns to it. Shadow rays to a light behind the surface do not leave it; their hits are right.
  bool self_hit;
  bool lost_contact;  // what the ray should meet first lies before its origin or its t_min (engine/oracle/contact.h)
  double offset;      // distance of the origin from the surface point, scene units
  double ulps;        // the same in float32 units in the last place of the point's largest coordinate
};

/// Whether a ray that starts where `primary` hits the triangle points away from the side that `primary` came from.
bool goes_behind(const Triangle& triangle, const Ray& primary, const Ray& ray);

/// Contract: Engine::check_origins (engine/ballot.h).
std::vector<OriginCheck> check_origins(Tracer& tracer, Batches& batches, const Scene& scene, const RayBatch& batch,
                                       const Query& query);

}  // namespace ballot
