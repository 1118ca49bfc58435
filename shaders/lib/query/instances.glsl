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

#if BALLOT_FILTERS >> FILTER_GROUP
// Begins with the trees over the instances of the ray's group and over the shared ones instead of the one over all,
// which lies above both: so the stack has room.
void begin_group(bool live, uint index) {
  uint group = group_root(question_groups[live ? index : whole_push.ray_begin]), others = shared_root();
  bool both = group != END_OF_TREE && others != END_OF_TREE;
  top_stack[1] = others;
  top_height = both && live ? 2u : 1u;
  top_node = !live ? END_OF_TREE : group != END_OF_TREE ? group : others;
}
#endif

// Begins the walk of ray number `index` in the first of these meshes. Returns false if there is no such ray or the ray
// is dead.
bool begin_walks(uint index, out Walker w) {
  bool live = begin_instances(index);
#if BALLOT_FILTERS >> FILTER_GROUP
  begin_group(live, index);
#endif
  w = make_walker(Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 0.0));  // should it meet none
  walk_next(w, live);
  return live;
}
