// The walk of a ray that looks for crossings among instances: from the walk of one mesh (walk_pairs.glsl,
// walk_bvh8.glsl) to that of the next. What is found is on the scale of `world` and numbered through the instances
// (SCENE_T and SCENE_PRIM of triangle_crossing.glsl).

// Begins the walk of the next mesh that the ray meets. Returns false if there is none.
bool walk_next(inout Walker w, bool live) {
  bool here;
  push.root = next_instance(w, live, here);
  begin_walk(here);
#if BALLOT_FIRST && BALLOT_EXACT
  // The mesh's walk has a range that ends at the reach. But what lies about the reach is not open.
  w.ray.t_max = clamp(world.t_max * object_inverse(), -3.4e38, 3.4e38);
#endif
  return here;
}

// Begins the walk of ray number `index` in the first of these meshes. Returns false if there is no such ray or the ray
// is dead.
bool begin_walks(uint index, out Walker w) {
  bool live = begin_instances(index);
  w = make_walker(Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 0.0));  // should it meet none
  walk_next(w, live);
  return live;
}
