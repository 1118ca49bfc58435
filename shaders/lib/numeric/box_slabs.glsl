// Box test "slabs": subtract, then multiply, with boxes as they are. The test is conservative only up to rounding: a
// ray along a face of a box may miss what lies in that face.
//
// Source: Timothy L. Kay, James T. Kajiya. Ray Tracing Complex Scenes. SIGGRAPH 1986.

struct Slabs {
  vec3 origin, inv;
};

Slabs make_slabs(Ray ray) { return Slabs(from_box_origin(ray.origin), reciprocal_direction(ray.dir)); }

vec2 box_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  return cut_interval((lo - s.origin) * s.inv, (hi - s.origin) * s.inv, t_min, t_max);
}

Slabs mirrored(Slabs s, bvec3 down) { return Slabs(mix(s.origin, -s.origin, down), abs(s.inv)); }

vec2 forward_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  return cut_axes((lo - s.origin) * s.inv, (hi - s.origin) * s.inv, t_min, t_max);
}

vec2 centred_interval(Slabs s, vec3 centre, vec3 extent, float t_min, float t_max) {
  return cut_centred((centre - s.origin) * s.inv, extent * abs(s.inv), t_min, t_max);
}

// Returns the padding of a ray segment for the rounding of its ends.
vec3 segment_pad(Ray ray) { return 2.4e-7 * (abs(from_box_origin(ray.origin)) + abs(ray.t_max * ray.dir)); }

void slab_origins(Slabs s, Ray ray, out vec3 lo, out vec3 hi) { lo = hi = s.origin; }

void first_planes(Slabs s, vec3 at, vec3 step, out vec3 near, out vec3 far) { near = far = (at - s.origin) * s.inv; }

float stretched_end(float end) { return end; }
