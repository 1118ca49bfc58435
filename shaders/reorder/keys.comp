#version 460
#extension GL_GOOGLE_include_directive : require
// Keys: for each ray a word, by which rays are sorted. Rays with near keys start near each other, and among those the
// ones with like directions are neighbours. Dead rays get the last key.
//
// A key has 24 bits: 16 of the Morton code of where the ray starts, above 8 of that of its direction on an octahedral
// map. A ray starts where it enters the bounds of the scene.
//
// Sources: Daniel Meister, Jakub Boksansky, Michael Guthe, Jiri Bittner. On Ray Reordering Techniques for Faster GPU
// Ray Tracing. I3D 2020 (keys of origin and direction); Zina Cigolle et al. A Survey of Efficient Representations for
// Independent Unit Vectors. JCGT 3(2), 2014 (octahedral map).
#include "../lib/reorder/frame.glsl"

RECORDS_IN(BIND_RAYS, Rays, rays)
layout(set = 0, binding = BIND_REORDER_KEYS, std430) writeonly buffer Keys { uint keys[]; };

const uint LAST_KEY = (1u << REORDER_KEY_BITS) - 1u;

// Spread the bits of x, so that two bits, or one, are free behind each.
uint spread_by_2(uint x) {
  x = (x | x << 8) & 0x300Fu;
  x = (x | x << 4) & 0x30C3u;
  return (x | x << 2) & 0x9249u;
}
uint spread_by_1(uint x) {
  x = (x | x << 2) & 0x33u;
  return (x | x << 1) & 0x55u;
}

// Returns the number of the cell of x in [0, 1]. Numbers beyond are moved to the ends, NaN to one of them.
uint cell_of(float x, uint cells) { return uint(clamp(x * float(cells), 0.0, float(cells - 1u))); }

// Returns where a ray enters the bounds of the scene, as far as that lies before it. It need not be accurate.
vec3 start_of(Ray r) {
  vec3 inv = 1.0 / r.dir, a = (push.lo - r.origin) * inv, b = (push.hi - r.origin) * inv;
  vec3 near = min(a, b);
  return r.origin + max(r.t_min, max(near.x, max(near.y, near.z))) * r.dir;
}

uint origin_code(Ray r) {
  vec3 sides = max(push.hi - push.lo, vec3(1e-30)), unit = (start_of(r) - push.lo) / sides;
  return spread_by_2(cell_of(unit.x, 64u)) | spread_by_2(cell_of(unit.y, 32u)) << 2 |
         spread_by_2(cell_of(unit.z, 32u)) << 1;
}

uint direction_code(vec3 dir) {
  vec3 n = dir / (abs(dir.x) + abs(dir.y) + abs(dir.z));
  vec2 folded = (1.0 - abs(n.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(n.xy, vec2(0.0)));
  vec2 unit = 0.5 * (n.z < 0.0 ? folded : n.xy) + 0.5;
  return spread_by_1(cell_of(unit.x, 16u)) << 1 | spread_by_1(cell_of(unit.y, 16u));
}

uint key_of(Ray r) {
  if (!(r.t_max > r.t_min)) return LAST_KEY;
  return origin_code(r) << 8 | direction_code(r.dir);
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= ray_count()) return;
  uint place = push.first + i;
  keys[i] = key_of(get_ray(rays, place));
}
