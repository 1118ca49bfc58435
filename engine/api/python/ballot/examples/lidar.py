"""A lidar scan of a mesh: the points that a spinning sensor sees, and what it hit.

>>> scene = ballot.Scene(*ground())
>>> points, rings, triangles = scan(scene, position=(0, 0, 3), rings=16, columns=360)
>>> points.shape[1], len(points) == len(rings) == len(triangles), len(points) > 2000
(3, True, True)
>>> bool(np.linalg.norm(points - (0, 0, 3), axis=1).max() < 100)
True

The sensor moves; the scene does not have to be made again:

>>> ahead, _, _ = scan(scene, position=(0, -5, 3), rings=16, columns=360)
>>> len(ahead) > 2000
True
"""

from __future__ import annotations

import numpy as np

import ballot
from ballot.examples._ground import ground


def directions(rings: int, columns: int, lowest: float = -25.0, highest: float = 15.0) -> np.ndarray:
    """Returns unit directions (rings, columns, 3) float32. Angles in degrees above the horizon."""
    up = np.deg2rad(np.linspace(lowest, highest, rings))[:, None]
    around = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None, :]
    return np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up) + 0 * around], -1).astype(
        np.float32
    )


def scan(
    scene: ballot.Scene,
    position: tuple[float, float, float],
    rings: int = 64,
    columns: int = 1024,
    reach: float = 100.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the points (n, 3) float32 that were hit from 0.1 to `reach` away, the ring and the triangle of each."""
    beams = directions(rings, columns)
    hits = scene.trace(origins=position, directions=beams, t=(0.1, reach))  # neighbours point alike: coherent
    ring, column = np.nonzero(hits["prim"] != ballot.MISS)
    found = hits[ring, column]
    return np.array(position, np.float32) + found["t"][:, None] * beams[ring, column], ring, found["prim"]


if __name__ == "__main__":
    points, rings, _ = scan(ballot.Scene(*ground()), (0, 0, 3))
    print(f"{len(points)} points in {len(np.unique(rings))} rings, from {points.min(axis=0)} to {points.max(axis=0)}")
