"""A path tracer in GLSL: the light of a lamp in a room, scattered by walls and blocks.

>>> picture = render(width=48, height=36, samples=16)
>>> left, right = picture[:, 6:14].mean(axis=(0, 1)), picture[:, 34:42].mean(axis=(0, 1))
>>> bool(left[0] > 1.5 * left[1]), bool(right[1] > 1.5 * right[0])  # a red wall and a green one
(True, True)
"""

from __future__ import annotations

import sys

import numpy as np

import ballot
from ballot.examples._paths import PATHS
from ballot.examples._room import room

GLSL = PATHS + """
struct Surface { vec3 normal, albedo, emitted; };
readonly buffer Surfaces { Surface surfaces[]; };  // of each triangle
buffer Pixels { vec4 pixels[]; };
uniform uvec2 size;
uniform vec3 lamp;  // a corner of a square that shines downwards
uniform float lamp_side, radiance, samples;

vec3 light_along(Ray ray) {
  vec3 sum = vec3(0.0), weight = vec3(1.0);
  for (uint bounce = 0u; bounce < 6u; ++bounce) {
    Hit hit = nearest(ray);
    if (hit.prim == NO_HIT) break;
    Surface s = surfaces[hit.prim];
    if (bounce == 0u) sum += s.emitted;  // later on it is counted at the point before
    weight *= s.albedo;
    left_from = hit.prim;
    vec3 at = ray.origin + hit.t * ray.dir, normal = dot(s.normal, ray.dir) < 0.0 ? s.normal : -s.normal;
    vec3 to = lamp + lamp_side * vec3(random(), 0.0, random()) - at;
    float facing = dot(normal, to) * to.y, shape = lamp_side * lamp_side / (3.1415927 * dot(to, to) * dot(to, to));
    if (facing > 0.0 && !any(Ray(at, 0.0, to, 0.999))) sum += weight * radiance * facing * shape;
    ray = Ray(at, 0.0, scattered(normal), 1e9);
  }
  return sum;
}
void main(uint index) {
  vec3 sum = vec3(0.0);
  state = index * 9781u + 1u;
  for (float i = 0.0; i < samples; ++i) {
    left_from = NO_HIT;
    vec2 at = vec2(index % size.x, index / size.x) + vec2(random(), random()) - 0.5 * vec2(size);
    sum += light_along(Ray(vec3(0.0, 0.0, 3.6), 0.0, vec3(at.x, -at.y, -1.28 * float(size.y)), 1e9));
  }
  pixels[index] = vec4(sum / samples, 1.0);
}
"""


def render(width: int = 240, height: int = 240, samples: int = 64) -> ballot.Picture:
    """Returns the picture of the room."""
    corners, *surface = room()
    pixels = np.zeros((height, width, 4), np.float32)
    numbers = {"size": (width, height), "samples": samples, "lamp": corners[-1, 0], "lamp_side": 0.6, "radiance": 12}
    buffers = {"surfaces": np.concatenate(surface, axis=1), "pixels": pixels}
    ballot.Kernel(GLSL, name="path tracer")(ballot.Scene(corners), width * height, buffers, **numbers)
    return pixels.view(ballot.Picture)


if __name__ == "__main__":
    made = render()
    made.to_png(sys.argv[1] if len(sys.argv) > 1 else "room.png", tone="neutral")
    print(f"{made.shape[1]} x {made.shape[0]} pixels, {made[..., :3].mean():.3f} in the mean")
