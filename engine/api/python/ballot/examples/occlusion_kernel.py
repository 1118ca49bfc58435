"""Ambient occlusion by a kernel: as ambient_occlusion, but no ray leaves the device, nor is one made on the host.

>>> from ballot.examples import ambient_occlusion
>>> vertices, triangles = ground()
>>> scene = ballot.Scene(vertices, triangles)
>>> seen = bake(scene, vertices, triangles, samples=256)
>>> other = ambient_occlusion.bake(scene, vertices, triangles, samples=256)
>>> bool(abs(seen - other).max() < 0.2), bool(abs(seen.mean() - other.mean()) < 0.005)
(True, True)
"""

from __future__ import annotations

import numpy as np

import ballot
from ballot.examples._ground import ground
from ballot.examples.ambient_occlusion import vertex_normals

GLSL = """
readonly buffer Points { vec3 points[]; };
readonly buffer Normals { vec3 normals[]; };
buffer Seen { float seen[]; };
uniform uint samples;
uniform float reach;

vec3 direction(vec3 normal, uint i) {  // by the cosine, from the R2 sequence (Roberts 2018), turned for each point
  vec2 at = fract(vec2(0.7548776662, 0.5698402910) * float(i) + fract(dot(normal, vec3(91.7, 53.3, 17.9))));
  float z = 2.0 * at.x - 1.0, phi = 6.2831853 * at.y, r = sqrt(1.0 - z * z);
  return normal + 0.999 * vec3(r * cos(phi), r * sin(phi), z);
}

void main(uint index) {
  vec3 normal = normals[index], from = points[index] + 1e-3 * normal;
  uint open = 0u;
  for (uint i = 0u; i < samples; ++i) open += uint(!any(Ray(from, 0.0, direction(normal, i), reach)));
  seen[index] = float(open) / float(samples);
}
"""


def bake(
    scene: ballot.Scene, vertices: np.ndarray, triangles: np.ndarray, samples: int = 64, reach: float = 30.0
) -> np.ndarray:
    """Returns the share of unblocked directions for each vertex, (n,) float32 from 0 to 1."""
    seen = np.zeros(len(vertices), np.float32)
    buffers = {"points": vertices, "normals": vertex_normals(vertices, triangles), "seen": seen}
    ballot.Kernel(GLSL, name="occlusion")(scene, len(vertices), buffers, samples=samples, reach=reach)
    return seen


if __name__ == "__main__":
    mesh = ground()
    share = bake(ballot.Scene(*mesh), *mesh)
    print(f"{len(share)} vertices see {share.min():.2f} to {share.max():.2f} of their sky")
