"""Ray queries in the style of trimesh.ray, for meshes of trimesh.

    mesh.ray = ballot.trimesh_ray.RayMeshIntersector(mesh)
"""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _arrays, _mesh
from ._device import Device
from ._scene import Scene


class RayMeshIntersector:
    """Ray queries on a mesh of trimesh, or on anything with vertices (n, 3) and faces (m, 3).

    The mesh is read once; make a new one after changing it. Coordinates are float32 on the device. Rays are given as
    ray_origins (n, 3) and ray_directions (n, 3), float32 or float64; directions need not be of unit length.

    >>> import types
    >>> mesh = types.SimpleNamespace(vertices=[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2]])
    >>> ray = ballot.trimesh_ray.RayMeshIntersector(mesh)
    >>> ray.intersects_first([[0.2, 0.2, 1], [5, 5, 1]], [[0, 0, -1], [0, 0, -1]]).tolist()
    [0, -1]
    """

    def __init__(self, geometry: Any, device: Device | None = None, **_ignored: Any):
        self.mesh = geometry
        vertices, faces = _mesh.parts(geometry, "geometry")
        self._scene = Scene(vertices, faces, device=device)

    def _hits(self, origins: Any, directions: Any) -> tuple[np.ndarray, np.ndarray]:
        rays = _rays(origins, directions)
        return rays, self._scene.trace(rays)

    def intersects_first(self, ray_origins: Any, ray_directions: Any) -> np.ndarray:
        """Returns the index of the first triangle that each ray hits: (n,) int64; -1 on a miss."""
        _, hits = self._hits(ray_origins, ray_directions)
        first = hits["prim"].astype(np.int64)
        first[hits["prim"] == _arrays.MISS] = -1
        return first

    def intersects_any(self, ray_origins: Any, ray_directions: Any) -> np.ndarray:
        """Returns whether each ray hits anything: (n,) bool."""
        return self._scene.occluded(_rays(ray_origins, ray_directions))

    def intersects_id(
        self,
        ray_origins: Any,
        ray_directions: Any,
        return_locations: bool = False,
        multiple_hits: bool = True,
        **_ignored: Any,
    ) -> tuple[np.ndarray, ...]:
        """Returns the triangles that were hit and the rays that hit them: index_tri (m,) int64, index_ray (m,) int64,
        and with return_locations the points (m, 3) float64. With multiple_hits every hit is listed, ray by ray in the
        order of distance; without, the first of each ray that hits.
        """
        if multiple_hits:
            counts, found = self._scene.crossings(_rays(ray_origins, ray_directions))
            index_ray = np.repeat(np.arange(len(counts)), counts)
        else:
            _, hits = self._hits(ray_origins, ray_directions)
            index_ray = np.nonzero(hits["prim"] != _arrays.MISS)[0]
            found = hits[index_ray]
        index_tri = found["prim"].astype(np.int64)
        if not return_locations:
            return index_tri, index_ray
        corners = self._scene.triangles()[index_tri].astype(np.float64)
        u, v = found["u"].astype(np.float64)[:, None], found["v"].astype(np.float64)[:, None]
        points = corners[:, 0] * (1 - u - v) + corners[:, 1] * u + corners[:, 2] * v
        return index_tri, index_ray, points

    def intersects_location(
        self, ray_origins: Any, ray_directions: Any, multiple_hits: bool = True, **_ignored: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the points (m, 3) float64, index_ray (m,) and index_tri (m,), as intersects_id()."""
        index_tri, index_ray, points = self.intersects_id(
            ray_origins, ray_directions, return_locations=True, multiple_hits=multiple_hits
        )
        return points, index_ray, index_tri

    def contains_points(self, points: Any) -> np.ndarray:
        """Returns whether each point (n, 3) is inside of the mesh: (n,) bool. Raises ValueError if the mesh is not
        closed."""
        return self._scene.nearest(points, ("inside",))["inside"]


def _rays(origins: Any, directions: Any) -> np.ndarray:
    o, d = _arrays.floats(origins, "ray_origins", (3,)), _arrays.floats(directions, "ray_directions", (3,))
    if o.ndim != 2 or o.shape != d.shape:
        raise ValueError(f"ray_origins and ray_directions: shapes are {o.shape} and {d.shape}; expected (n, 3) of each")
    return np.concatenate([o, d], axis=1)
