"""Irradiance of each triangle by a lamp: sums of light paths, whose bits do not depend on the order of the paths.

Floating-point sums do: (a + b) + c is not a + (b + c). So power is counted in whole quanta, and integers are added by
atomics: each sum has 64 bits, of two words. What overflows the low word is carried to the high one, and the number of
carries does not depend on the order either.

>>> sums = [irradiance(paths=20000, step=step) for step in (1, 7919)]  # the same paths in two orders
>>> bool((sums[0] == sums[1]).all()), bool(sums[0].sum() > 0)
(True, True)
"""

from __future__ import annotations

import numpy as np

import ballot
from ballot.examples._paths import PATHS
from ballot.examples._room import room

GLSL = PATHS + """
readonly buffer Lamp { vec3 lamp[]; };  // a corner, two edges, the normal
readonly buffer Albedo { float albedo[]; };
readonly buffer Normals { vec3 normals[]; };
buffer Sums { uint sums[]; };           // low and high word of each triangle's
uniform uint paths, step;

const float QUANTA = 1048576.0;  // of a path's power
void add(uint prim, uint quanta) {
  uint before = atomicAdd(sums[2u * prim], quanta);
  if (before + quanta < before) atomicAdd(sums[2u * prim + 1u], 1u);
}

void main(uint index) {
  state = (index * step % paths) * 9781u + 1u;
  left_from = NO_HIT;
  float power = 1.0;
  Ray ray = Ray(lamp[0] + random() * lamp[1] + random() * lamp[2], 0.0, scattered(lamp[3]), 1e9);
  for (uint bounce = 0u; bounce < 8u; ++bounce) {
    Hit hit = nearest(ray);
    if (hit.prim == NO_HIT) return;
    add(hit.prim, uint(power * QUANTA));
    power *= albedo[hit.prim];
    left_from = hit.prim;
    vec3 normal = normals[hit.prim];
    ray = Ray(ray.origin + hit.t * ray.dir, 0.0, scattered(dot(normal, ray.dir) < 0.0 ? normal : -normal), 1e9);
  }
}
"""


def irradiance(watts: float = 60.0, paths: int = 1 << 18, step: int = 1) -> np.ndarray:
    """Returns the irradiance of each triangle of the room, (m,) float64 in W/m^2. `step` orders the paths."""
    corners, normals, albedo, _ = room()
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    lamp = np.array([[-0.3, 0.98, -0.3], [0.6, 0, 0], [0, 0, 0.6], [0, -1, 0]], np.float32)
    sums = np.zeros((len(corners), 2), np.uint32)
    buffers = {"lamp": lamp, "albedo": albedo.mean(axis=1), "normals": normals, "sums": sums}
    ballot.Kernel(GLSL, name="irradiance")(ballot.Scene(corners), paths, buffers, paths=paths, step=step)
    quanta = sums[:, 0] + 2.0**32 * sums[:, 1]
    return np.asarray(quanta / 2**20 * (watts / paths) / areas)


if __name__ == "__main__":
    found = irradiance()
    print(f"{len(found)} triangles get {found.min():.1f} to {found.max():.1f} W/m^2")
