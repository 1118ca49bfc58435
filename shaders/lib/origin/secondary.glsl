// The frame of the secondary ray generators, whose rays start at primary hits. A generator is one file under
// shaders/rays/ that includes this file and defines
//
//   Ray ray_from(Surface s, Draw draw)    returns a ray that leaves the hit; its direction has unit length
//
// with the help of lib/origin/surface.glsl.
//
// One invocation makes one ray: ray r of the hits listed in `starts` is ray r % rays_per_hit of start r / rays_per_hit.
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "../../shared/render.h"
#include "../frame/records.glsl"
#include "../frame/compact_records.glsl"
#include "../shade/random.glsl"

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { SecondaryPush push; };
RECORDS_OUT(BIND_RAYS, Rays, rays)
RECORDS_IN(BIND_HITS, Hits, primary_hits)
RECORDS_IN(BIND_PRIMARY, Primary, primary_rays)
layout(set = 0, binding = BIND_STARTS, scalar) readonly buffer Starts { Start starts[]; };
#include "surface.glsl"

// The random numbers of a ray: the k-th ray of the hits of a pixel.
struct Draw {
  uint pixel;
  uint k;
};

Ray ray_from(Surface s, Draw draw);

void main() {
  uint index = put_index(), ray = push.first + index;
  bool wanted = index < push.count;
  // If a start is listed for every pixel, the primary rays that missed start dead rays.
  Ray made = Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 0.0);
  if (wanted) {
    Start start = starts[ray / push.rays_per_hit];
    Draw draw = Draw(start.pixel, push.sample_index * push.rays_per_hit + ray % push.rays_per_hit);
    Hit hit = get_hit(primary_hits, start.ray);
    if (hit.prim != NO_HIT) made = ray_from(surface_of(get_ray(primary_rays, start.ray), hit), draw);
  }
  PUT_RECORDS(rays, push.offset + index - gl_SubgroupInvocationID, wanted, made)
}
