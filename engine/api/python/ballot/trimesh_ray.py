"""Ray queries in the style of trimesh.ray, for meshes of trimesh.

    mesh.ray = ballot.trimesh_ray.RayMeshIntersector(mesh)
"""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from . import _adapters, _arrays, _mesh
from ._device import Device
from ._scene import Scene


class RayMeshIntersector:
    """Ray queries on a mesh of trimesh, or on anything that Scene takes as a mesh.

    geometry      the mesh. Queries follow it: the tree is made at the first one, and again at the first one after the
                  mesh changed, which its hash tells; meshes of other libraries are compared
    scale_to_box  accepted for trimesh's sake and not used
    device        a ballot.Device; None: the default one

    Rays are given as ray_origins (n, 3) and ray_directions (n, 3), of floats or integers; directions need not be of
    unit length. A mesh so far from the origin that float32 would move its vertices by more than 2^-20 of its size is
    moved to the origin in float64 first, and rays with it, so there is no PrecisionWarning. Names, order of arguments
    and results are those of trimesh.ray.ray_pyembree. Queries raise ValueError if shapes differ, and if the mesh is
    none that Scene takes.

    >>> import types
    >>> mesh = types.SimpleNamespace(vertices=[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2]])
    >>> ray = ballot.trimesh_ray.RayMeshIntersector(mesh)
    >>> ray.intersects_first([[0.2, 0.2, 1], [5, 5, 1]], [[0, 0, -1], [0, 0, -1]]).tolist()
    [0, -1]
    >>> mesh.vertices = [[4.0, 4, 0], [7, 4, 0], [4, 7, 0]]
    >>> ray.intersects_any([[0.2, 0.2, 1], [5, 5, 1]], [[0, 0, -1], [0, 0, -1]]).tolist()
    [False, True]
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True, *, device: Device | None = None):
        self.mesh = geometry
        self._device = device
        self._forget()

    def _forget(self) -> None:
        """Lets go of the scene, so that the next query makes one."""
        self._lock = threading.Lock()
        self._made: _Made | None = None

    def _read(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the mesh's vertices (n, 3) float64 and faces (m, 3)."""
        vertices, faces = _adapters.parts(self.mesh, "geometry")
        return _float64(vertices, "geometry: vertices"), _arrays.indices(faces, "geometry: faces").reshape(-1, 3)

    def _now(self) -> _Made:
        """Returns the scene of the mesh as it is now."""
        with self._lock:
            if self._made is None or not self._made.serves(self.mesh, self._read):
                self._made = _Made(self.mesh, *self._read(), self._device)
            return self._made

    def intersects_first(self, ray_origins: Any, ray_directions: Any) -> np.ndarray:
        """Returns the index of the first triangle that each ray hits: (n,) int64; -1 on a miss."""
        made = self._now()
        return _numbers(made.scene.trace(**made.rays(*_rays(ray_origins, ray_directions)))["prim"])

    def intersects_any(self, ray_origins: Any, ray_directions: Any) -> np.ndarray:
        """Returns whether each ray hits anything: (n,) bool."""
        made = self._now()
        blocked: np.ndarray = made.scene.occluded(**made.rays(*_rays(ray_origins, ray_directions)))
        return blocked

    def intersects_id(
        self,
        ray_origins: Any,
        ray_directions: Any,
        multiple_hits: bool = True,
        max_hits: int | None = None,
        return_locations: bool = False,
    ) -> tuple[np.ndarray, ...]:
        """Returns the triangles that were hit and the rays that hit them: index_tri (m,) int64, index_ray (m,) int64,
        and with return_locations the points (m, 3) float64.

        multiple_hits  True: every hit, ray by ray in the order of distance; False: the first of each ray that hits
        max_hits       at most so many hits of each ray, the nearest, from 0; None: all (trimesh's default is 100)
        """
        made = self._now()
        origins, directions = _rays(ray_origins, ray_directions)
        rays = made.rays(origins, directions)
        if not multiple_hits and max_hits != 0:
            max_hits = 1
        if max_hits == 1:
            found = made.scene.trace(**rays)
            index_ray = np.nonzero(found["prim"] != _arrays.MISS)[0]
            found = found[index_ray]
        else:
            asked = rays if max_hits is None else {**rays, "first": max(max_hits, 1)}
            counts, found = made.scene.crossings(**asked)
            if max_hits == 0:
                counts, found = np.zeros_like(counts), found[:0]
            index_ray = np.repeat(np.arange(len(origins)), counts)
        index_tri = _numbers(found["prim"])
        if not return_locations:
            return index_tri, index_ray
        return index_tri, index_ray, made.points(found, origins[index_ray], directions[index_ray])

    def intersects_location(
        self, ray_origins: Any, ray_directions: Any, multiple_hits: bool = True, max_hits: int | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the points (m, 3) float64, index_ray (m,) and index_tri (m,), as intersects_id()."""
        index_tri, index_ray, points = self.intersects_id(ray_origins, ray_directions, multiple_hits, max_hits, True)
        return points, index_ray, index_tri

    def contains_points(self, points: Any) -> np.ndarray:
        """Returns whether each point (n, 3) is inside of the mesh: (n,) bool.

        A mesh that is not closed is taken as it is, as by trimesh: inside is then where a line through the point
        crosses it an odd number of times on both sides, and near its gaps answers are arbitrary.
        """
        made, at = self._now(), _float64(points, "points")
        if at.ndim != 2 or at.shape[1] != 3:
            raise ValueError(f"points: shape is {at.shape}; expected (n, 3)")
        if made.closed():
            return made.scene.nearest(at - made.origin, ("inside",))["inside"]
        inside, open_ones = np.zeros(len(at), bool), np.arange(len(at))
        for line in ((0.44, 0.62, 0.65), (-0.71, 0.33, 0.62)):  # another one where both sides of the first disagree
            both = np.multiply.outer([1.0, -1.0], line)[:, np.newaxis]
            ahead, behind = made.scene.count_crossings(**made.rays(at[open_ones], both))
            inside[open_ones] = (ahead % 2 == 1) & (behind % 2 == 1)
            open_ones = open_ones[(ahead % 2 != behind % 2) & (ahead > 0) & (behind > 0)]
        return inside

    def __getstate__(self) -> dict[str, Any]:
        return {"mesh": self.mesh, "device": self._device}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.mesh, self._device = state["mesh"], state["device"]
        self._forget()

    def __repr__(self) -> str:
        return f"<ballot.trimesh_ray.RayMeshIntersector of a {type(self.mesh).__name__}>"


class _Made:
    """A scene, and the state of the mesh that it was made of."""

    def __init__(self, mesh: Any, vertices: np.ndarray, faces: np.ndarray, device: Device | None):
        self._mesh, self._hash = mesh, _hash(mesh)
        self._closed: bool | None = None  # unknown
        self._vertices, self._faces = vertices.copy(), faces.copy()
        far = _mesh.rounding(vertices)
        self.origin = vertices.min(axis=0) / 2 + vertices.max(axis=0) / 2 if far else np.zeros(3)
        self.scene = Scene(vertices - self.origin, faces, device=device)

    def serves(self, mesh: Any, read: Any) -> bool:
        """Returns whether the mesh is as it was. `read` returns its arrays."""
        if mesh is not self._mesh:
            return False
        if self._hash is not None:
            return _hash(mesh) == self._hash
        vertices, faces = read()
        return np.array_equal(vertices, self._vertices) and np.array_equal(faces, self._faces)

    def closed(self) -> bool:
        """Returns whether the mesh has an inside, which an edge of an odd number of triangles forbids."""
        if self._closed is None:
            try:
                self.scene.nearest(np.zeros((1, 3), np.float32), ("inside",))
                self._closed = True
            except ValueError:
                self._closed = False
        return self._closed

    def rays(self, origins: np.ndarray, directions: np.ndarray) -> dict[str, Any]:
        """Returns origins and directions for the scene. The directions are at most 1 along each axis."""
        longest = np.abs(directions).max(axis=-1, keepdims=True)
        usable = (longest > 0) & np.isfinite(longest)
        unit = np.divide(directions, longest, out=np.zeros(directions.shape), where=usable)
        return {"origins": origins - self.origin, "directions": unit}

    def points(self, hits: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Returns where rays (n, 3) hit, (n, 3) float64: on the line in float64, or by the triangle's weights where the
        two are nearly parallel."""
        a, b, c = np.moveaxis(self._vertices[self._faces[hits["prim"]]], 1, 0)
        u, v = hits["u"].astype(np.float64)[:, None], hits["v"].astype(np.float64)[:, None]
        by_weights = a * (1 - u - v) + b * u + c * v
        normal = np.cross(b - a, c - a)
        slope = (normal * directions).sum(-1)
        steep = np.abs(slope) > 1e-4 * np.linalg.norm(normal, axis=-1) * np.linalg.norm(directions, axis=-1)
        t = np.divide((normal * (a - origins)).sum(-1), slope, out=np.zeros_like(slope), where=steep)
        found: np.ndarray = np.where(steep[:, None], origins + directions * t[:, None], by_weights)
        return found


def _hash(mesh: Any) -> int | None:
    """Returns the hash of a mesh of trimesh, which tells its content; None for others."""
    if any(kind.__module__.split(".")[0] == "trimesh" for kind in type(mesh).__mro__):
        return hash(mesh)
    return None


def _numbers(prims: np.ndarray) -> np.ndarray:
    """Returns triangles as int64, with -1 for a miss."""
    return np.where(prims == _arrays.MISS, -1, prims.astype(np.int64))


def _float64(given: Any, name: str) -> np.ndarray:
    """Returns floats or integers as float64."""
    array = _arrays.as_numpy(given, name)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: dtype is {array.dtype}; expected floats or integers")
    return np.asarray(array, np.float64)


def _rays(origins: Any, directions: Any) -> tuple[np.ndarray, np.ndarray]:
    """Returns checked origins and directions (n, 3) float64."""
    o, d = _float64(origins, "ray_origins"), _float64(directions, "ray_directions")
    if o.ndim != 2 or o.shape[1] != 3 or o.shape != d.shape:
        raise ValueError(f"ray_origins and ray_directions: shapes are {o.shape} and {d.shape}; expected (n, 3) of each")
    return o, d
