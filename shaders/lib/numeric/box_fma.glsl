// Box test "fma": one multiply-add a plane, lo * inv - origin * inv. The products cancel if the ray starts near a plane
// and far from the origin that boxes are measured from, so the error follows the coordinates, not the distance.
//
// Source: Timo Aila, Samuli Laine. Understanding the Efficiency of Ray Traversal on GPUs. HPG 2009.

struct Slabs {
  vec3 scaled_origin, inv;  // origin * inv
};

Slabs make_slabs(Ray ray) {
  vec3 inv = reciprocal_direction(ray.dir);
  return Slabs(from_box_origin(ray.origin) * inv, inv);
}

vec2 box_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  return cut_interval(fma(lo, s.inv, -s.scaled_origin), fma(hi, s.inv, -s.scaled_origin), t_min, t_max);
}

Slabs mirrored(Slabs s, bvec3 down) { return Slabs(s.scaled_origin, abs(s.inv)); }

vec2 forward_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  return cut_axes(fma(lo, s.inv, -s.scaled_origin), fma(hi, s.inv, -s.scaled_origin), t_min, t_max);
}

vec2 centred_interval(Slabs s, vec3 centre, vec3 extent, float t_min, float t_max) {
  vec3 middle = fma(centre, s.inv, -s.scaled_origin), a = abs(s.inv);
  return cut_axes(fma(-extent, a, middle), fma(extent, a, middle), t_min, t_max);
}

// Returns the padding of a ray segment for the rounding of its ends.
vec3 segment_pad(Ray ray) { return 2.4e-7 * (abs(from_box_origin(ray.origin)) + abs(ray.t_max * ray.dir)); }

// Widens by the rounding of the product with the origin, which moves planes by up to 2^-24 of it.
void slab_origins(Slabs s, Ray ray, out vec3 lo, out vec3 hi) {
  vec3 origin = from_box_origin(ray.origin), slack = 2.4e-7 * abs(origin);
  // Mirrors the origin along the mirrored axes.
  origin = mix(origin, -origin, notEqual(lessThan(s.inv, vec3(0.0)), lessThan(ray.dir, vec3(0.0))));
  lo = origin + slack;
  hi = origin - slack;
}

void first_planes(Slabs s, vec3 at, vec3 step, out vec3 near, out vec3 far) {
  near = far = fma(at, s.inv, -s.scaled_origin);
}

float stretched_end(float end) { return end; }
