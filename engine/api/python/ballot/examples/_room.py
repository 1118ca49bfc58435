"""A scene for the examples: a room, open towards +z, with two blocks and a light below its ceiling."""

from __future__ import annotations

import numpy as np

_FACES = ([0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6])
_WHITE, _RED, _GREEN = (0.75, 0.75, 0.75), (0.65, 0.06, 0.05), (0.1, 0.5, 0.1)


def _box(low: tuple[float, ...], high: tuple[float, ...], turn: float = 0.0) -> np.ndarray:
    """Returns the six faces of a box, (6, 4, 3), turned about +y: -x, +x, -y, +y, -z, +z."""
    corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])
    middle, c, s = corners.mean(axis=0), np.cos(turn), np.sin(turn)
    turned: np.ndarray = (corners - middle) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) + middle
    return turned[list(_FACES)]


def room() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns corners (m, 3, 3), unit normals, albedo and emitted radiance (m, 3) of the triangles, all float32."""
    walls = _box((-1, -1, -1), (1, 1, 1))[:5]
    blocks = [_box((-0.7, -1, -0.65), (-0.1, 0.25, -0.05), 0.3), _box((0.1, -1, 0.0), (0.65, -0.4, 0.55), -0.3)]
    light = np.array([[[-0.3, 0.99, -0.3], [0.3, 0.99, -0.3], [0.3, 0.99, 0.3], [-0.3, 0.99, 0.3]]])
    quads = np.concatenate([walls, *blocks, light])
    albedo = np.full((len(quads), 3), _WHITE)
    albedo[:2] = _RED, _GREEN
    emitted = np.zeros((len(quads), 3))
    emitted[-1] = 12.0
    corners = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    albedo, emitted = np.repeat(albedo, 2, axis=0), np.repeat(emitted, 2, axis=0)
    return corners.astype(np.float32), normals.astype(np.float32), albedo.astype(np.float32), emitted.astype(np.float32)
