"""Queries of points, and of all crossings of rays: methods of Scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from . import _arrays, _query, _sources
from ._array import Array
from ._arrays import HIT
from ._closable import Closable
from ._query import Times

Progress = Callable[[float], object]

_COLUMNS = {  # name: (dtype, shape of one point's entry)
    "distances": (np.float32, ()),
    "points": (np.float32, (3,)),
    "prims": (np.uint32, ()),
    "mesh_ids": (np.uint32, ()),
    "uvs": (np.float32, (2,)),
    "normals": (np.float32, (3,)),
    "inside": (np.bool_, ()),
    "signed_distances": (np.float32, ()),
}
_NAMES = {"points": "nearest"}  # as the extension has them
_SIGNS = {"parity": 0, "pseudonormal": 1}
_CULLS = {"none": 0, "back": 1, "front": 2}


def _masks(given: Any, shape: tuple[int, ...]) -> np.ndarray | None:
    """Returns masks of rays of this shape as a flat array."""
    if given is None:
        return None
    name = "ray_masks"
    masks = np.asarray(given) if isinstance(given, (list, tuple)) else _arrays.as_numpy(given, name)
    if masks.dtype.kind not in "iu" or (masks.size and not 0 <= int(masks.min()) <= int(masks.max()) < 2**32):
        wrong = f", {masks.min()} to {masks.max()}" if masks.size else ""
        raise ValueError(f"{name}: found {masks.dtype}{wrong}; expected whole numbers from 0 to 2^32 - 1")
    if masks.ndim != 1 and masks.shape != shape:
        raise ValueError(f"{name}: shape is {masks.shape}; expected {shape}")
    return _arrays.contiguous(masks, np.uint32).reshape(-1)


def _one_of(known: Mapping[str, int], value: Any, name: str) -> int:
    if value not in known:
        raise ValueError(f"{name} is {value!r}; expected one of {', '.join(known)}")
    return known[value]


def _filters(
    shape: tuple[int, ...], numeric: Any, cull: Any, ray_masks: Any, alpha: Any
) -> dict[str, Any]:
    """Returns the checked arguments that choose triangles, for rays of this shape."""
    return {
        "numeric": _query.text(numeric, "numeric"),
        "cull": _one_of(_CULLS, cull, "cull"),
        "ray_masks": _masks(ray_masks, shape),
        "alpha": bool(alpha),
    }


class Queries(Closable):
    """The queries that Scene has in addition to traces."""

    def nearest(
        self,
        points: Any,
        columns: Sequence[str] = ("distances", "points", "prims", "uvs"),
        *,
        limit: Any = math.inf,
        assume_closed: bool = False,
        numeric: str = "watertight",
        sign: str = "parity",
        out: Mapping[str, Any] | None = None,
        times: list[Times] | None = None,
        progress: Progress | None = None,
    ) -> dict[str, np.ndarray]:
        """Finds the nearest point of the scene for each point. Returns a dict of arrays.

        points   (..., 3) float32 or float64, read in place at any strides; one that is not finite is near nothing, and
                 outside
        columns  some of
                 "distances"         (...) float32: within 64 * 2^-24 (M + M') + 2^-85 R of the true one, M and M' being
                                     the largest distances of a vertex of the reported and of the nearest triangle,
                                     R that of a point of the scene along an axis
                 "points"            (..., 3) float32: the nearest point
                 "prims"             (...) uint32: its triangle, within its mesh; of those as near the smallest number
                 "mesh_ids"          (...) uint32: the id of its mesh
                 "uvs"               (..., 2) float32: weights of the vertices 1 and 2
                 "normals"           (..., 3) float32: unit normal of the triangle, by the right-hand rule
                 "inside"            (...) bool: by `sign`; by parity right for every point that is 16 * 2^-24 M away
                                     from the surface
                 "signed_distances"  (...) float32: negative inside
                 Without a triangle within the limit distances are inf, numbers ballot.MISS, the rest 0.
        limit    triangles farther away are not looked for: a number above 0, or an array that broadcasts to the points'
                 shape, where a point of a negative or NaN limit is near nothing; inf or None: there is no limit
        assume_closed  go on with a mesh that `sign` refuses; answers near its faults are then arbitrary
        numeric  "watertight", or "exact": the nearest triangle, and what is inside, are those of exact arithmetic; the
                 host decides what the device leaves open
        sign     what decides "inside" and "signed_distances". "parity": the number of crossings of one ray, of a
                 closed mesh. "pseudonormal": the side of the nearest triangle, at its corners and edges by the
                 angle-weighted sum of the normals there, of a mesh that may have open edges
        out, times, progress  as trace_columns()

        Raises ValueError if "inside" or "signed_distances" is asked for and an edge of the scene belongs to an odd
        number of triangles; with sign "pseudonormal", if two triangles run along an edge in the same direction.

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.nearest([[0.25, 0.25, 2]])["distances"].tolist()
        [2.0]
        """
        source = _sources.points(points, limit)
        arrays = _arrays.columns(columns, _COLUMNS, source.shape, source[1:], out)
        given = {_NAMES.get(name, name): _arrays.flat(array) for name, array in arrays.items()}
        spent = self._handle.query_points(
            source, bool(assume_closed), _query.progress_function(progress), _query.text(numeric, "numeric"),
            _one_of(_SIGNS, sign, "sign"), **given,
        )
        if times is not None:
            times.append(Times(*spent))
        return arrays

    def nearest_arrays(
        self, points: Array, answers: Array, count: int | None = None, *, assume_closed: bool = False,
        numeric: str = "watertight", sign: str = "parity",
    ) -> Times:
        """Answers the first `count` points (None: all) of an array on the device by another; the host sees neither.

        points   an Array of "points", in an order in which neighbours are near each other
        answers  an Array of "nearest", "distances" (negative inside) or "inside", which says what is asked
        All else as nearest(); limits are those of the points. Only numeric "exact" brings the points to the host.

        Returns Times once the answers are written. If another interface, such as CUDA, filled the points, wait for its
        stream first. Raises ValueError if an array is of another device, of the wrong kind or too small, and as
        nearest().

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> points, answers = ballot.Array("points", 1), ballot.Array("distances", 1)
        >>> points.write([[0.25, 0.25, -2]])
        >>> times = scene.nearest_arrays(points, answers, sign="pseudonormal")
        >>> answers.read().tolist()
        [-2.0]
        """
        for array, name in ((points, "points"), (answers, "answers")):
            if not isinstance(array, Array):
                raise TypeError(f"{name}: found {type(array).__name__}; expected a ballot.Array")
        number = len(points) if count is None else _query.integer(count, "count", 0, 2**32 - 1)
        spent = self._handle.query_point_arrays(
            points._handle, answers._handle, number, bool(assume_closed), _query.text(numeric, "numeric"),
            _one_of(_SIGNS, sign, "sign"),
        )
        return Times(*spent)

    def count_crossings(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None,
        numeric: str = "watertight", cull: str = "none", ray_masks: Any = None, alpha: bool = False,
        times: list[Times] | None = None, progress: Progress | None = None,
    ) -> np.ndarray:
        """Returns how many triangles each ray crosses: int64 of shape (...). Rays, origins, directions, t as trace().

        A ray through an edge or a vertex of a closed surface crosses it there once, or twice or not at all where it
        touches the surface from one side.

        numeric     "watertight", or "exact": numbers and order are those of exact arithmetic; the host decides what
                    the device leaves open
        cull        "back" or "front": leave out triangles that a ray meets from there. The front is the side from
                    which the vertices run counter-clockwise
        ray_masks   a whole number below 2^32 for each ray: instances whose masks (set_masks()) share no bit with it are
                    left out
        alpha       True: leave out a triangle where its surface stops nothing: where the alpha of material, texture and
                    vertex colours is below the cutoff of a mask, or 0. Changes nothing where all surfaces are opaque,
                    as in scenes from arrays. Not with numeric="exact", because textures are read in float32

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.count_crossings([[0.25, 0.25, 2, 0, 0, -1], [9, 9, 2, 0, 0, -1]]).tolist()
        [1, 0]
        """
        source = _sources.rays(rays, t, origins, directions)
        filters = _filters(source.shape, numeric, cull, ray_masks, alpha)
        counts = _arrays.empty(source.shape, np.int64)
        _, spent = self._handle.list_crossings(
            source, 0, False, _query.progress_function(progress), counts=counts.reshape(-1), **filters
        )
        if times is not None:
            times.append(Times(*spent))
        return counts

    def crossings(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None,
        first: int | None = None, numeric: str = "watertight", cull: str = "none", ray_masks: Any = None,
        alpha: bool = False, times: list[Times] | None = None, progress: Progress | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Finds all triangles that each ray crosses. Returns (counts, hits): how many crossings each ray has, int64 of
        shape (...), and those of all rays one after the other, ballot.HIT of shape (sum of counts,), each ray's in the
        order of t, at equal t of prim.

        first  list at most so many crossings of each ray, the nearest
        All else as count_crossings().

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> counts, hits = scene.crossings([[0.25, 0.25, 2, 0, 0, -1], [9, 9, 2, 0, 0, -1]])
        >>> counts.tolist(), hits["t"].tolist()
        ([1, 0], [2.0])
        """
        most = 0 if first is None else _query.integer(first, "first", 0, 2**32 - 2)
        source = _sources.rays(rays, t, origins, directions)
        if first == 0:
            return np.zeros(source.shape, np.int64), np.empty(0, HIT)
        filters = _filters(source.shape, numeric, cull, ray_masks, alpha)
        counts = _arrays.empty(source.shape, np.int64)
        hits: np.ndarray
        hits, spent = self._handle.list_crossings(
            source, most, True, _query.progress_function(progress), counts=counts.reshape(-1), **filters
        )
        if times is not None:
            times.append(Times(*spent))
        return counts, hits.view(HIT).reshape(-1)
