// The nearest or any hit of a ray among instances: the walks of meshes by a method's traverse(), one after the other.
#include "../tree/instances.glsl"

// Takes over what the walk of an instance has found.
void leave_instance(Walker w, inout bool live) {
#if BALLOT_LISTS_RAYS
  best_open = min(best_open, open_from(w.space));
#endif
  Hit hit = finished_hit(w.hit, object_scale);
  uint prim = first_prim + hit.prim;
#if BALLOT_TRIANGLE == TRIANGLE_DOUBLE
  double t = w.space.best_t;
  if (hit.prim != NO_HIT && (best.prim == NO_HIT || t < best_t || (t == best_t && prim < best.prim))) {
    best = Hit(hit.t, prim, hit.u, hit.v);
    best_t = t;
  }
#else
  if (hit.prim != NO_HIT && (hit.t < best.t || (hit.t == best.t && prim < best.prim)))
    best = Hit(hit.t, prim, hit.u, hit.v);
#endif
#if BALLOT_DOUBTFUL == DOUBTFUL_LIMITED
  live = live && !has_given_up();
#endif
#if BALLOT_ANY_HIT
  live = live && GOES_ON(best);
#endif
#if BALLOT_ANY_HIT || BALLOT_DOUBTFUL == DOUBTFUL_LIMITED
#if TOP_TOGETHER
  if (!subgroupAny(live)) top_node = END_OF_TREE;
#else
  if (!live) top_node = END_OF_TREE;
#endif
#endif
}

void write_found(uint index) {
  bool finished = finish_walks(1u);
  Hit hit = best.prim == NO_HIT ? Hit(MISS_T, NO_HIT, 0.0, 0.0)
                                 : Hit(best.t * world_scale, best.prim, best.u, best.v);
  if (!finished) hit.prim = UNFINISHED;
  store_hit(index, hit);
#if BALLOT_LISTS_RAYS
  bool settled = BALLOT_ANY_HIT != 0 && best.prim != NO_HIT;
  if (finished && !settled && best_open < 3.4e38 && best_open <= best_reach()) list_ray(index);
#endif
}

#ifndef METHOD_REFILLS
void trace_instances(uint index) {
  bool live = begin_instances(index), here;
  Walker w;
  uint root = next_instance(w, live, here);
  while (root != END_OF_TREE) {
    traverse(w, here, root);
    leave_instance(w, live);
    root = next_instance(w, live, here);
  }
  if (index < RAY_END) write_found(index);
}
#else
// The same for lanes that take new rays while others are under way: begin the walk of a ray, or continue it. Return the
// node at which the lane walks on; END_OF_TREE if its ray is done.
uint continue_instances(inout Walker w) {
  bool live = true, here;
  leave_instance(w, live);
  return next_instance(w, live, here);
}
uint take_instances(uint index, inout Walker w) {
  bool live = begin_instances(index), here;
  w.hit.prim = NO_HIT;  // nothing has been found for this ray, should it meet no instance
#if BALLOT_LISTS_RAYS
  w.space.open_t = NOTHING_OPEN;
  change_ray();
#endif
  return next_instance(w, live, here);
}
#endif
