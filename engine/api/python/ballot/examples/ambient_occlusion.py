"""Ambient occlusion baked to the vertices of a mesh: the share of the sky that each vertex sees.

>>> vertices, triangles = ground()
>>> seen = bake(ballot.Scene(vertices, triangles), vertices, triangles, samples=32)
>>> seen.shape == (len(vertices),), bool((seen >= 0).all() and (seen <= 1).all())
(True, True)

At the foot of the tower there is less sky than on its roof:

>>> foot = np.linalg.norm(vertices[:, :2] - (5.5, 3.4), axis=1).argmin()
>>> bool(seen[foot] < 0.8), bool(seen[-1] > 0.9)
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


def cosine_directions(normals: np.ndarray, samples: int, seed: int = 0) -> np.ndarray:
    """Returns directions (n, samples, 3) around each normal, as many as diffuse light weighs them: by the cosine."""
    sphere = np.random.default_rng(seed).normal(size=(len(normals), samples, 3))
    sphere /= np.linalg.norm(sphere, axis=-1, keepdims=True)
    return normals[:, None] + 0.999 * sphere


def bake(
    scene: ballot.Scene, vertices: np.ndarray, triangles: np.ndarray, samples: int = 64, reach: float = 30.0
) -> np.ndarray:
    """Returns the share of unblocked directions for each vertex, (n,) float64 from 0 to 1."""
    normals = vertex_normals(vertices, triangles)
    above = (vertices + 1e-3 * normals)[:, None]  # off the surface, and one for all directions there
    blocked = scene.occluded(origins=above, directions=cosine_directions(normals, samples), t=(0, reach))
    return np.asarray(1 - blocked.mean(axis=1))


if __name__ == "__main__":
    mesh = ground()
    share = bake(ballot.Scene(*mesh), *mesh)
    print(
        f"{len(share)} vertices see {share.min():.2f} to {share.max():.2f} of their sky, {share.mean():.2f} in the mean"
    )
