// Traces one ray by a method's traverse(): takes it, walks it and writes its hit.

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

#ifndef METHOD_REFILLS
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
#endif
