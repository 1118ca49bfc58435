"""A class with the interface of Open3D's open3d.t.geometry.RaycastingScene."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from . import _adapters, _arrays, _mesh, _query
from ._answer import Answer, answer, answers
from ._device import Device, device_or_default
from ._door import Times
from ._scene import Scene

_RESULTS = {
    "t_hit": "t",
    "geometry_ids": "mesh_ids",
    "primitive_ids": "prims",
    "primitive_uvs": "uvs",
    "primitive_normals": "normals",
}
_MANY = 3 << 18  # numbers of points for which edges are looked at
_CLOSEST = {
    "points": "points",
    "geometry_ids": "mesh_ids",
    "primitive_ids": "prims",
    "primitive_uvs": "uvs",
    "primitive_normals": "normals",
}


class RaycastingScene:
    """Ray queries with the names, argument shapes, dtypes and miss values of Open3D's class.

    Results are arrays of NumPy with the methods numpy() and cpu(); an element is such an array without axes.

    nthreads      accepted for Open3D's sake and not used: the device's driver takes what it needs
    device        a ballot.Device; None: the default one; or Open3D's device or its name, which says where arrays are:
                  "CPU:0" alone, and the default one traces
    builder       as Scene
    numeric       as Scene.trace(): "watertight", or "exact", whose triangle is the one of exact arithmetic

    Differences: t_hit, uvs and normals are not bit for bit Embree's, and a ray in the plane of a triangle misses it. A
    watertight query may report the neighbour where a ray meets an edge, 1 ray in a million; an exact one does not.
    Arrays of NumPy, DLPack on the CPU and Open3D's tensors are taken, float64 too, which is rounded. The scene is built
    when it is first cast in, and again after add_triangles(). It may be used from any thread, and pickled.

    Signs of a mesh that is not closed are Open3D's: the parity of one ray along (1, 1, 1), from which Open3D's differs
    by up to 0.001 along each axis. Near the shadow of an edge along that line they may differ.

    >>> scene = ballot.RaycastingScene()
    >>> scene.add_triangles(np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.uint32([[0, 1, 2]]))
    0
    >>> answer = scene.cast_rays(np.float32([[0.2, 0.2, 1, 0, 0, -1], [5, 5, 1, 0, 0, -1]]))
    >>> answer["t_hit"].tolist(), answer["primitive_ids"].tolist()
    ([1.0, inf], [0, 4294967295])
    """

    INVALID_ID = 4294967295  #: the ID of no geometry and no primitive

    def __init__(
        self, nthreads: int = 0, device: Any = None, *, builder: str | None = None, numeric: str = "watertight"
    ):
        _query.integer(nthreads, "nthreads", 0, 2**31 - 1)
        self._device = _device(device)
        self._builder = builder
        self._numeric = numeric
        self._meshes: list[tuple[np.ndarray, np.ndarray]] = []
        self._scene: Scene | None = None
        self._closed_scene: Scene | None = None  # the same if it is known to be closed
        self._lock = threading.Lock()
        self.times: Times | None = None  #: of the last call, in whichever thread

    def add_triangles(self, vertex_positions: Any, triangle_indices: Any = None) -> int:
        """Adds a mesh and returns its geometry ID: 0 for the first, then 1, ...

        vertex_positions  (n, 3) float32 or float64; or without triangle_indices a mesh that Scene takes
        triangle_indices  (m, 3) uint32 or other integers

        Copies both. The first question gives a PrecisionWarning as Scene does. Raises ValueError if a coordinate is not
        finite, an index is out of range, or there are none.
        """
        vertices, triangles = vertex_positions, triangle_indices
        if triangles is None:
            vertices, triangles = _adapters.parts(vertex_positions, "vertex_positions")
        v = np.array(_mesh.positions(vertices, "vertex_positions"), order="C")
        t = np.array(_arrays.indices(triangles, "triangle_indices")).reshape(-1, 3)
        if len(v) == 0 or not np.isfinite(v).all():
            raise ValueError("vertex_positions: expected at least three, of finite numbers")
        if int(t.max()) >= len(v):
            raise ValueError(f"triangle_indices: they hold the index {int(t.max())}, but there are {len(v)} vertices")
        with self._lock:
            self._meshes.append((v, t))
            self._scene = None
            return len(self._meshes) - 1

    def _built(self) -> Scene:
        with self._lock:
            if self._scene is None:
                self._scene = Scene(meshes=self._meshes, device=self._device, builder=self._builder)
            return self._scene

    def cast_rays(self, rays: Any, nthreads: int = 0) -> dict[str, Answer]:
        """Finds the first intersection of each ray.

        rays  (..., 6) float32 (float64 is converted): origin and direction, which need not be of unit length

        Returns a dict of
            t_hit              (...) float32: in multiples of the direction; inf on a miss
            geometry_ids       (...) uint32: INVALID_ID on a miss
            primitive_ids      (...) uint32: the triangle within its mesh; INVALID_ID on a miss
            primitive_uvs      (..., 2) float32: weights of vertices 1 and 2; 0 on a miss
            primitive_normals  (..., 3) float32: unit normal by the right-hand rule; 0 on a miss
        """
        _query.integer(nthreads, "nthreads", 0, 2**31 - 1)
        times: list[Times] = []
        found = self._built().trace_columns(_rays(rays), tuple(_RESULTS.values()), numeric=self._numeric, times=times)
        self.times = times[0]
        return answers({name: found[column] for name, column in _RESULTS.items()})

    def test_occlusions(
        self, rays: Any, tnear: float = 0.0, tfar: float = float("inf"), nthreads: int = 0
    ) -> Answer:
        """Returns True for each ray that hits something at tnear <= t <= tfar: bool (...). Rays as cast_rays()."""
        _query.integer(nthreads, "nthreads", 0, 2**31 - 1)
        whole = tnear in (None, 0) and tfar in (None, float("inf"))
        bounds = None if whole else (tnear, tfar)
        times: list[Times] = []
        found = self._built().occluded(_rays(rays), t=bounds, numeric=self._numeric, times=times)
        self.times = times[0]
        return answer(found)

    def count_intersections(self, rays: Any, nthreads: int = 0) -> Answer:
        """Returns the number of intersections of each ray: int32 (...). Rays as cast_rays(). A ray through an edge or a
        vertex of a closed surface intersects it there once."""
        _query.integer(nthreads, "nthreads", 0, 2**31 - 1)
        times: list[Times] = []
        counts = self._built().count_crossings(_rays(rays), numeric=self._numeric, times=times)
        self.times = times[0]
        return answer(counts.astype(np.int32))

    def list_intersections(self, rays: Any, nthreads: int = 0) -> dict[str, Answer]:
        """Lists all intersections of each ray, in the order of t. Rays as cast_rays().

        Returns a dict of, with n intersections of all rays,
            ray_splits      (number of rays + 1,) uint32: those of ray i are [ray_splits[i], ray_splits[i + 1])
            ray_ids         (n,) uint32
            t_hit           (n,) float32
            geometry_ids    (n,) uint32
            primitive_ids   (n,) uint32: the triangle within its mesh
            primitive_uvs   (n, 2) float32
        """
        _query.integer(nthreads, "nthreads", 0, 2**31 - 1)
        scene = self._built()
        times: list[Times] = []
        counts, hits = scene.crossings(_rays(rays), numeric=self._numeric, times=times)
        self.times = times[0]
        flat = counts.reshape(-1)
        firsts = np.array([m.first for m in scene.meshes], np.int64)
        mesh = np.searchsorted(firsts, hits["prim"], side="right") - 1
        splits = np.zeros(len(flat) + 1, np.uint32)
        np.cumsum(flat, out=splits[1:])
        found = {
            "ray_splits": splits,
            "ray_ids": np.repeat(np.arange(len(flat), dtype=np.uint32), flat),
            "t_hit": np.ascontiguousarray(hits["t"]),
            "geometry_ids": mesh.astype(np.uint32),
            "primitive_ids": (hits["prim"] - firsts[mesh]).astype(np.uint32),
            "primitive_uvs": np.stack([hits["u"], hits["v"]], axis=-1),
        }
        return answers(found)

    def _nearest(self, points: Any, columns: tuple[str, ...], nthreads: int, **query: Any) -> dict[str, np.ndarray]:
        _query.integer(nthreads, "nthreads", 0, 2**31 - 1)
        times: list[Times] = []
        found = self._built().nearest(_points(points), columns, numeric=self._numeric, times=times, **query)
        self.times = times[0]
        return found

    def compute_closest_points(self, query_points: Any, nthreads: int = 0) -> dict[str, Answer]:
        """Finds the closest point of the scene for each point.

        query_points  (..., 3) float32 (float64 is converted)

        Returns a dict of points (..., 3), geometry_ids (...), primitive_ids (...), primitive_uvs (..., 2) and
        primitive_normals (..., 3), as cast_rays().
        """
        found = self._nearest(query_points, tuple(_CLOSEST.values()), nthreads)
        return answers({name: found[column] for name, column in _CLOSEST.items()})

    def compute_distance(self, query_points: Any, nthreads: int = 0) -> Answer:
        """Returns the distance of each point from the scene: float32 (...). Points as compute_closest_points()."""
        return answer(self._nearest(query_points, ("distances",), nthreads)["distances"])

    def _inside(self, points: Any, nthreads: int, nsamples: int, assume_closed: bool, sign: str) -> np.ndarray:
        """Returns whether each point is inside."""
        if _query.integer(nsamples, "nsamples", 1, 2**31 - 1) % 2 == 0:
            raise ValueError(f"nsamples is {nsamples}; expected an odd number")
        if sign == "parity" and assume_closed and np.size(points) >= _MANY and self._is_closed():
            assume_closed = False  # any one ray tells, so the scene may look many points up
        if sign != "parity" or not assume_closed:
            query = {"assume_closed": assume_closed, "sign": sign}
            return self._nearest(points, ("inside",), nthreads, **query)["inside"]
        source = _points(points)
        rays = np.concatenate([source, np.ones_like(source)], axis=-1)
        return (self.count_intersections(rays, nthreads).numpy() & 1).astype(bool)

    def compute_signed_distance(
        self, query_points: Any, nthreads: int = 0, nsamples: int = 1, *, assume_closed: bool = True,
        sign: str = "parity",
    ) -> Answer:
        """Returns the distance of each point from the scene, negative inside: float32 (...).

        nsamples       accepted for Open3D's sake, an odd number: one ray a point decides, not a vote
        assume_closed  False: raise ValueError, as Scene.nearest(), if the scene is not closed; True: count as Open3D
        sign           as Scene.nearest(): "pseudonormal" takes meshes with open edges
        """
        inside = self._inside(query_points, nthreads, nsamples, assume_closed, sign)
        before = self.times
        distances = self._nearest(query_points, ("distances",), nthreads)["distances"]
        if before is not None and self.times is not None:
            seconds, device_ms, hits = self.times
            self.times = Times(before.seconds + seconds, before.device_ms + device_ms, hits)
        return answer(np.where(inside, -distances, distances))

    def compute_occupancy(
        self, query_points: Any, nthreads: int = 0, nsamples: int = 1, *, assume_closed: bool = True,
        sign: str = "parity",
    ) -> Answer:
        """Returns 1 for each point inside of the scene, else 0: float32 (...). Arguments and errors as
        compute_signed_distance()."""
        inside = self._inside(query_points, nthreads, nsamples, assume_closed, sign)
        return answer(inside.astype(np.float32))

    def _is_closed(self) -> bool:
        """Returns whether Scene.nearest() takes the scene for closed."""
        if self._closed_scene is not self._built():
            self._closed_scene = None
            try:
                self._built().nearest([[0, 0, 0]], ("inside",))
                self._closed_scene = self._built()
            except ValueError:
                return False
        return True

    @staticmethod
    def create_rays_pinhole(*args: Any, **kwargs: Any) -> Answer:
        """Returns the rays of a pinhole camera: (height_px, width_px, 6) float32. Called as either

        create_rays_pinhole(intrinsic_matrix, extrinsic_matrix, width_px, height_px)
            (3, 3) upper triangular, and (4, 4) from world to camera, as in computer vision: x right, y down, z ahead
        create_rays_pinhole(fov_deg, center, eye, up, width_px, height_px)
            the horizontal field of view in degrees, the point looked at, the camera's position and the direction up;
            the picture is turned by 180 degrees, as Open3D's is
        """
        names = ["fov_deg", "center", "eye", "up", "width_px", "height_px"]
        if len(args) + len(kwargs) == 4:
            names = ["intrinsic_matrix", "extrinsic_matrix", "width_px", "height_px"]
        given = dict(zip(names, args))
        if len(args) > len(names) or set(given) & set(kwargs) or {*given, *kwargs} != set(names):
            raise TypeError(
                "create_rays_pinhole: expected (intrinsic_matrix, extrinsic_matrix, width_px, height_px) or "
                "(fov_deg, center, eye, up, width_px, height_px)"
            )
        given.update(kwargs)
        width = _query.integer(given.pop("width_px"), "width_px", 1, 2**20)
        height = _query.integer(given.pop("height_px"), "height_px", 1, 2**20)
        if "eye" in given:
            return answer(_pinhole(*_matrices(width, height, **given), width, height))
        intrinsic = _matrix(given["intrinsic_matrix"], (3, 3), "intrinsic_matrix")
        extrinsic = _matrix(given["extrinsic_matrix"], (4, 4), "extrinsic_matrix")
        return answer(_pinhole(intrinsic, extrinsic, width, height))

    def __repr__(self) -> str:
        triangles = sum(len(t) for _, t in self._meshes)
        return f"<ballot.RaycastingScene of {len(self._meshes)} geometries, {triangles} triangles>"

    def __getstate__(self) -> dict[str, Any]:
        kept = {"device": self._device, "builder": self._builder, "numeric": self._numeric}
        return {**kept, "meshes": list(self._meshes)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        RaycastingScene.__init__(self, 0, state["device"], builder=state["builder"], numeric=state["numeric"])
        self._meshes = state["meshes"]


def _rays(given: Any) -> np.ndarray:
    rays = _arrays.numbers(given, "rays", (6,))
    if rays.ndim < 2:
        raise ValueError(f"rays: shape is {rays.shape}; expected (..., 6) with at least two axes")
    return rays


def _points(given: Any) -> np.ndarray:
    points = _arrays.numbers(given, "query_points", (3,))
    if points.ndim < 2:
        raise ValueError(f"query_points: shape is {points.shape}; expected (..., 3) with at least two axes")
    return points


def _device(given: Any) -> Device | None:
    """Returns the device that traces for a device of Ballot or of Open3D."""
    if given is None or isinstance(given, Device):
        return given
    if str(given).upper().partition(":")[0] == "CPU":  # Open3D's
        return None
    if isinstance(given, str) or hasattr(given, "get_type"):
        raise ValueError(f"device is {given}; expected a ballot.Device, or 'CPU:0': arrays are in the host's memory")
    return device_or_default(given)


def _matrix(given: Any, shape: tuple[int, ...], name: str) -> np.ndarray:
    matrix = np.asarray(_arrays.as_numpy(given, name), np.float64)
    if matrix.shape != shape:
        raise ValueError(f"{name}: shape is {matrix.shape}; expected {shape}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name}: it holds {matrix[~np.isfinite(matrix)][0]}; expected finite numbers")
    return matrix


def _matrices(width: int, height: int, fov_deg: Any, center: Any, eye: Any, up: Any) -> tuple[np.ndarray, np.ndarray]:
    """Returns the intrinsic and the extrinsic matrix of a camera that looks from eye to center."""
    at, target, above = (_matrix(v, (3,), n) for v, n in ((eye, "eye"), (center, "center"), (up, "up")))
    angle = _query.number(fov_deg, "fov_deg")
    if not 0 < angle < 180:
        raise ValueError(f"fov_deg is {angle}; expected degrees between 0 and 180")
    focal = 0.5 * width / np.tan(0.5 * np.deg2rad(angle))
    intrinsic = np.array([[focal, 0, 0.5 * width], [0, focal, 0.5 * height], [0, 0, 1]])
    ahead = target - at
    if not np.linalg.norm(ahead) > 0:
        raise ValueError("create_rays_pinhole: eye and center are the same point")
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(above, ahead)  # as Open3D has it: the picture is turned by 180 degrees
    if not np.linalg.norm(right) > 1e-12 * np.linalg.norm(above):
        raise ValueError("create_rays_pinhole: up is parallel to the view direction")
    right /= np.linalg.norm(right)
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = np.stack([right, np.cross(ahead, right), ahead])
    extrinsic[:3, 3] = -extrinsic[:3, :3] @ at
    return intrinsic, extrinsic


def _pinhole(intrinsic: np.ndarray, extrinsic: np.ndarray, width: int, height: int) -> np.ndarray:
    if not (intrinsic[0, 0] and intrinsic[1, 1] and intrinsic[2, 2]):
        raise ValueError("intrinsic_matrix: a number of its diagonal is 0; expected the focal lengths and 1")
    turn = extrinsic[:3, :3]
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    pixels = np.stack([x, y, np.ones_like(x)], axis=-1)
    rays = np.empty((height, width, 6), np.float32)
    rays[..., :3] = -turn.T @ extrinsic[:3, 3]
    rays[..., 3:] = pixels @ np.linalg.inv(intrinsic).T @ turn
    return rays
