"""Lidar scans of a mesh: the points that a spinning sensor sees from each of its poses, and what it hit.

>>> scene = ballot.Scene(*ground())
>>> stops = ballot.frames([0, 0, 1], [[0, 0, 3], [0, -5, 3]])  # upright at two places
>>> points, stop, rings, triangles = scan(scene, stops, rings=16, columns=360)
>>> points.shape[1], len(points) == len(stop) == len(rings) == len(triangles), len(points) > 4000
(3, True, True)
>>> bool(np.linalg.norm(points - stops[stop, :, 3], axis=1).max() < 100)
True
"""

from __future__ import annotations

import numpy as np

import ballot
from ballot.examples._ground import ground


def scan(
    scene: ballot.Scene,
    poses: np.ndarray,
    rings: int = 64,
    columns: int = 1024,
    reach: float = 100.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns the points (n, 3) float32 that were hit from 0.1 to `reach` away, and of each the number of the pose, the
    ring and the triangle. `poses`: (k, 3, 4), which take the sensor's frame to the scene's."""
    beams = ballot.lidar(np.deg2rad(np.linspace(-25, 15, rings)), np.linspace(0, 2 * np.pi, columns, endpoint=False))
    hits = scene.trace(beams, poses=poses, t=(0.1, reach))
    pose, ring, column = np.nonzero(hits["prim"] != ballot.MISS)
    found, at = hits[pose, ring, column], poses[pose]
    directions = np.einsum("nij,nj->ni", at[:, :, :3], beams.directions[ring, column])
    return at[:, :, 3] + found["t"][:, None] * directions, pose, ring, found["prim"]


if __name__ == "__main__":
    points, _, rings, _ = scan(ballot.Scene(*ground()), ballot.frames([[0, 0, 1]], [[0, 0, 3]]))
    print(f"{len(points)} points in {len(np.unique(rings))} rings, from {points.min(axis=0)} to {points.max(axis=0)}")
