// main() of the traversal kernels: subgroups take rays until none is left, walk them and write their hits. Every
// traversal kernel includes this file last.
//
// A lane's ray is its subgroup's base plus its number in the subgroup, so the rays of a packet are neighbours in the
// buffer. The pipeline has full subgroups, and the workgroup size is a multiple of the subgroup size.
//
// The reconvergence rule: a persistent subgroup loops on a base that is the same for all its lanes, and no lane leaves
// the loop or the kernel alone. A lane without a ray goes along with live = false. If the device supports it, the entry
// point declares subgroup-uniform control flow, which then guarantees that votes see all lanes.

// Loads ray number `index` and starts its walk state. Returns false if there is no such ray or the ray is dead.
bool take_ray(uint index, out Walker w, out Ray given) {
  bool inside = index < RAY_END;
  given = load_ray(inside ? index : push.ray_begin);
  bool live = inside && !is_dead(given);
  if (!live) given = Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 0.0);
  w = make_walker(given);
  COUNT_BEGIN()
  return live;
}

bool take_ray(uint index, out Walker w) {
  Ray given;
  return take_ray(index, w, given);
}

// Writes the hit of a ray, which is `finished` unless the driver cut its walk short. There is one store in every case:
// lavapipe runs both sides of a branch and stores lane by lane.
void write_hit(uint index, Walker w, float scale, bool finished) {
  Hit hit = finished_hit(w.hit, scale);
  if (!finished) hit.prim = UNFINISHED;
  store_hit(index, hit);
  COUNT_WRITE(index)
#if BALLOT_LISTS_RAYS
  if (finished && is_open(w.space, w.hit)) list_ray(index);
#endif
}

// Returns the factor from the t of a walk to that of its ray. The ray is loaded again, which costs less than to keep
// the factor. A computed camera ray is not computed again, which would cost more.
float scale_at_end(uint index, Walker w) {
#if BALLOT_CAMERA
  return w.scale;
#else
  return direction_scale(load_ray(index).dir);
#endif
}

void write_hit(uint index, Walker w) {
  write_hit(index, w, scale_at_end(index, w), finish_walks(1u));
}

#if BALLOT_INSTANCES
#include "trace_instances.glsl"
#endif

#ifdef METHOD_REFILLS
#include "refill.glsl"
#else
#if BALLOT_INSTANCES
void trace_ray(uint index) { trace_instances(index); }
#elif !defined(METHOD_PACKETS) || BALLOT_FALLBACK
void trace_ray(uint index) {
  Walker w;
  bool live = take_ray(index, w);
  traverse(w, live, push.root);
  if (index < RAY_END) write_hit(index, w);
}
#endif

// Traces a batch of a subgroup: a packet, or one ray a lane.
#ifdef METHOD_PACKETS
#include "main_packets.glsl"
#else
void trace_packet(uint base) { trace_ray(base + gl_SubgroupInvocationID); }
#endif

void trace_rays() {
#if BALLOT_LAUNCH == LAUNCH_PLAIN
  uint subgroup = gl_WorkGroupID.x * gl_NumSubgroups + gl_SubgroupID;
  trace_packet(push.ray_begin + subgroup * gl_SubgroupSize * BALLOT_RAYS);
#else
  for (uint batch = 0u; batch < push.max_batches; ++batch) {
    uint base = 0u;
    if (subgroupElect()) base = atomicAdd(work.next, gl_SubgroupSize * BALLOT_RAYS);
    base = subgroupBroadcastFirst(base);
    if (base >= RAY_END) break;
    trace_packet(base);
  }
#endif
}
#endif

#if BALLOT_UNIFORM_FLOW
void main() [[subgroup_uniform_control_flow]] {
#else
void main() {
#endif
#if BALLOT_INSTANCES
  push = whole_push;
#endif
#if BALLOT_DOUBTFUL == DOUBTFUL_TAKEN
  ray_end = min(push.ray_end, doubtful.count);
#elif BALLOT_INDIRECT
  ray_end = indirect[push.ray_end].count;
#endif
  trace_rays();
}
