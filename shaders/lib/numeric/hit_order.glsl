// The order of hits for tests whose t is final: by t, and by prim where t is equal.

bool may_count(RaySpace space, float t, Ray ray, Hit best) { return t >= ray.t_min && t <= best.t; }

bool nearer(inout RaySpace space, float t, uint place, Hit best) {
  return t < best.t || (t == best.t && prim_at(place) < prim_at(best.prim));
}

float reach(RaySpace space, Hit best) { return best.t; }
