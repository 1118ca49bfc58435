"""What the tests share: small meshes, rays, and a search for hits without a tree, in float64."""

import os

import numpy as np

CUBE_VERTICES = np.float32(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
)
CUBE_TRIANGLES = np.uint32(
    [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
     [3, 6, 2], [3, 7, 6], [1, 2, 6], [1, 6, 5], [0, 4, 7], [0, 7, 3]]
)  # fmt: skip
MISS = 0xFFFFFFFF
# True if the library is compiled with a sanitizer, whose code is larger and which keeps freed memory for a while.
SANITIZED = "BALLOT_PRELOAD" in os.environ


def soup(triangles: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Returns scattered triangles: vertices (3 m, 3) float32 and triangles (m, 3) uint32."""
    random = np.random.default_rng(seed)
    corners = random.uniform(-1, 1, (triangles, 1, 3)) + random.normal(0, 0.3, (triangles, 3, 3))
    return corners.reshape(-1, 3).astype(np.float32), np.arange(3 * triangles, dtype=np.uint32).reshape(-1, 3)


def random_rays(count: int, seed: int = 2) -> np.ndarray:
    """Returns rays (count, 6) float32 that start on a sphere of radius 3 and go through its middle part."""
    random = np.random.default_rng(seed)
    origins = random.normal(size=(count, 3))
    origins *= 3 / np.linalg.norm(origins, axis=1, keepdims=True)
    return np.concatenate([origins, random.uniform(-1, 1, (count, 3)) - origins], axis=1).astype(np.float32)


def at_odd_address(array: np.ndarray) -> np.ndarray:
    """Returns a copy that lies at no multiple of its items' size."""
    copy = np.empty(array.nbytes + 1, np.uint8)[1:].view(array.dtype).reshape(array.shape)
    copy[...] = array
    return copy


def brute(corners: np.ndarray, rays: np.ndarray) -> dict[str, np.ndarray]:
    """Returns t, prim, u, v and margin of the nearest hits of rays (n, 6) among triangles (m, 3, 3), by Moeller and
    Trumbore's test in float64. margin tells how far a hit is from being another one: where it is tiny, rounding may
    change the answer."""
    c, r = corners.astype(np.float64), rays.astype(np.float64)
    e1, e2 = c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]
    origins, directions = r[:, None, :3], r[:, None, 3:]
    p = np.cross(directions, e2[None])
    det = (p * e1[None]).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = origins - c[None, :, 0]
        u = (s * p).sum(-1) / det
        q = np.cross(s, e1[None])
        v = (directions * q).sum(-1) / det
        t = (e2[None] * q).sum(-1) / det
    inside = np.minimum(np.minimum(u, v), np.minimum(1 - u - v, t))
    hit = inside >= 0
    distance = np.where(hit, t, np.inf)
    order = np.sort(distance, axis=1)
    prim = distance.argmin(axis=1)
    row = np.arange(len(r))
    found = np.isfinite(distance[row, prim])
    with np.errstate(invalid="ignore"):
        gap = (
            np.where(np.isfinite(order[:, 0]), order[:, 1] - order[:, 0], np.inf)
            if len(c) > 1
            else np.full(len(r), 1.0)
        )
    margin = np.minimum(np.abs(np.nan_to_num(inside, nan=0.0)).min(axis=1), np.abs(gap))
    return {
        "t": np.where(found, distance[row, prim], np.inf),
        "prim": np.where(found, prim, MISS).astype(np.uint32),
        "u": np.where(found, u[row, prim], 0),
        "v": np.where(found, v[row, prim], 0),
        "margin": margin,
    }


def all_hits(corners: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns which triangles (m, 3, 3) each ray (n, 6) hits, bool (n, m), in float64, and for which rays (n,) rounding
    changes nothing."""
    hit = np.zeros((len(rays), len(corners)), bool)
    sure = np.ones(len(rays), bool)
    for i, corner in enumerate(corners):
        one = brute(corner[None], rays)
        hit[:, i] = one["prim"] != MISS
        sure &= one["margin"] > 1e-5
    return hit, sure


def move(scene, mesh, vertices):
    """Moves the vertices of a mesh at once."""
    scene.set_vertices(mesh, vertices)
    scene.commit()


def place(scene, transforms):
    """Moves all instances at once."""
    scene.set_transforms(transforms)
    scene.commit()
