"""View factors: the share of the radiation that leaves a triangle and arrives at another, as for heat exchange.

Two squares of side 1 that face each other at a distance of 1 see 0.1998 of each other (Howell, A Catalog of Radiation
Heat Transfer Configuration Factors, C-11):

>>> square = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]]).reshape(2, 3, 3)
>>> factors = view_factors(np.concatenate([square, square[:, ::-1] + np.float32([0, 0, 1])]), rays=20000)
>>> bool(abs(factors[:2, 2:].sum() / 2 - 0.1998) < 0.005), float(factors[0, :2].sum())
(True, 0.0)

In a closed box everything arrives:

>>> closed = view_factors(box(), rays=1000)
>>> bool(abs(closed.sum(axis=1) - 1).max() < 1e-12)
True
"""

from __future__ import annotations

import numpy as np

import ballot
from ballot.examples._paths import PATHS

GLSL = PATHS + """
readonly buffer Corners { vec3 corners[]; };  // three of each triangle
buffer Counts { uint counts[]; };             // rays from each triangle to each
uniform uint triangles, rays;

void main(uint index) {
  uint from = index / rays;
  state = index * 9781u + 1u;
  left_from = from;
  vec3 a = corners[3u * from], ab = corners[3u * from + 1u] - a, ac = corners[3u * from + 2u] - a;
  float u = random(), v = random();  // a point of the triangle
  if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
  Hit hit = nearest(Ray(a + u * ab + v * ac, 0.0, scattered(normalize(cross(ab, ac))), 1e9));
  if (hit.prim != NO_HIT) atomicAdd(counts[from * triangles + hit.prim], 1u);
}
"""


def view_factors(corners: np.ndarray, rays: int = 10000) -> np.ndarray:
    """Returns the factors (m, m) float64, from row to column, of triangles (m, 3, 3) that radiate from their front."""
    m = len(corners)
    counts = np.zeros((m, m), np.uint32)
    kernel = ballot.Kernel(GLSL, name="view factors")
    kernel(ballot.Scene(corners), m * rays, {"corners": corners, "counts": counts}, triangles=m, rays=rays)
    return np.asarray(counts / rays)


def box() -> np.ndarray:
    """Returns the triangles (12, 3, 3) of a box of 2 x 1 x 1, which face its inside."""
    faces = np.array([[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]])
    corners = np.array([[2 * (i & 1), i >> 1 & 1, i >> 2] for i in range(8)], np.float32)
    triangles: np.ndarray = corners[faces[:, [0, 2, 1, 0, 3, 2]]].reshape(-1, 3, 3)
    return triangles


if __name__ == "__main__":
    found = view_factors(box())
    print(f"a triangle at an end of a box sees at most {found[0].max():.3f} of another, {found[0].sum():.3f} of all")
