"""Ambient occlusion baked to the vertices of a mesh: the share of the sky that each vertex sees.

>>> vertices, triangles = ground()
>>> seen = bake(ballot.Scene(vertices, triangles), vertices, triangles, samples=32)
>>> seen.shape == (len(vertices),), bool((seen >= 0).all() and (seen <= 1).all())
(True, True)

At the foot of the tower there is less sky than on its roof:

>>> foot = np.linalg.norm(vertices[:, :2] - (5.5, 3.4), axis=1).argmin()
>>> bool(seen[foot] < 0.8), bool(seen[-1] > 0.85)
(True, True)
"""

from __future__ import annotations

import numpy as np

import ballot
from ballot.examples._ground import ground


def vertex_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Returns unit normals (n, 3), each the mean over the triangles around the vertex, by their areas."""
    corners = vertices[triangles].astype(np.float64)
    normals = np.zeros((len(vertices), 3))
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], face)
    unit: np.ndarray = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return unit


def bake(
    scene: ballot.Scene, vertices: np.ndarray, triangles: np.ndarray, samples: int = 64, reach: float = 30.0
) -> np.ndarray:
    """Returns the share of unblocked directions for each vertex, (n,) float64 from 0 to 1."""
    normals = vertex_normals(vertices, triangles)
    over = ballot.frames(normals, vertices + 1e-3 * normals)  # off the surface
    blocked = scene.occluded(ballot.hemisphere(samples), poses=over, t=(0, reach))  # (n, samples)
    return np.asarray(1 - blocked.mean(axis=1))


if __name__ == "__main__":
    mesh = ground()
    share = bake(ballot.Scene(*mesh), *mesh)
    print(
        f"{len(share)} vertices see {share.min():.2f} to {share.max():.2f} of their sky, {share.mean():.2f} in the mean"
    )
