"""A mesh for the examples: hilly ground with a tower on it."""

from __future__ import annotations

import numpy as np


def ground(cells: int = 48, size: float = 40.0) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices (n, 3) float32 in metres, z up, and triangles (m, 3) uint32."""
    line = np.linspace(-size / 2, size / 2, cells + 1)
    x, y = np.meshgrid(line, line)
    z = np.sin(0.35 * x) * np.cos(0.3 * y)
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    i = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = i[:-1, :-1], i[:-1, 1:], i[1:, :-1], i[1:, 1:]
    triangles = np.concatenate([np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)])
    corners = np.array([[x, y, z] for z in (-2, 9) for y in (4, 7) for x in (4, 7)], float)
    sides = np.array(
        [[0, 1, 5], [0, 5, 4], [1, 3, 7], [1, 7, 5], [3, 2, 6], [3, 6, 7], [2, 0, 4], [2, 4, 6], [4, 5, 7], [4, 7, 6]]
    )
    vertices = np.concatenate([vertices, corners]).astype(np.float32)
    return vertices, np.concatenate([triangles, sides + len(vertices) - 8]).astype(np.uint32)
