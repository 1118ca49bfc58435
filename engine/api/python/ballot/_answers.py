"""Questions that a Scene answers: rays and points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from . import _arrays, _attributes, _query, _sources
from ._array import Array, there
from ._arrays import HIT
from ._door import CLEARANCE_COLUMNS, HIT_COLUMNS, POINT_COLUMNS, HitOptions, PointOptions, Times, documented
from ._job import Job
from ._lists import ListAnswers, told
from ._there import Asked, refuse_count

if TYPE_CHECKING:
    from typing_extensions import Unpack


class Answers(ListAnswers):
    """The part of a Scene that answers questions."""

    @overload
    def trace(
        self, rays: Array, *, masks: Array | None = None, count: int | None = None, out: Array | None = None,
        times: list[Times] | None = None, **options: Unpack[HitOptions],
    ) -> Array: ...
    @overload
    def trace(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None, masks: Any = None,
        poses: Any = None, out: Any = None, times: list[Times] | None = None, **options: Unpack[HitOptions],
    ) -> np.ndarray: ...
    @documented
    def trace(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None, masks: Any = None,
        poses: Any = None, count: int | None = None, out: Any = None, times: list[Times] | None = None,
        **options: Unpack[HitOptions],
    ) -> Any:
        """Traces rays and returns their hits.

        rays       (..., 8): origin x y z, t_min, direction x y z, t_max; or (..., 6): origin, direction, with t from 0
                   without a bound; or an array of dtype RAY; or a Pattern, such as a Camera. NumPy, DLPack on the CPU,
                   or nested lists. float32 and float64 are read in place, at any strides; float64 is rounded.
                   Neighbours share a subgroup: order rays for coherence
        origins, directions  instead of rays: (..., 3) each. Their other axes broadcast as NumPy's do: one origin for
                   all directions, one direction for all origins, each with each
        t          (t_min, t_max) for all but rays of 8 numbers: numbers, or arrays that broadcast to the rays' shape;
                   None: 0, and no end. A number that is NaN, or a t_min above t_max, is an error; in arrays it is a
                   dead ray
        masks      whole numbers below 2^32 that broadcast to the rays' shape: instances whose masks (set_masks()) share
                   no bit with a ray's are left out; None: all bits
        poses      (..., 3, 4) or (..., 4, 4): matrices whose axes broadcast to the rays', and move them: origins p to
                   m[:3, :3] @ p + m[:3, 3], directions d to m[:3, :3] @ d, in float32. With a Pattern its rays from
                   each pose: hits of shape (poses..., pattern...). None of these rays is made on the host for a GPU.
                   A pose for all is finite; a ray of one that is not is dead
        out        where hits go: an array of dtype HIT and the rays' shape, or float32 of shape (..., 4)
        count      of rays on the device: the first so many; None: all
        {hits_options}
        progress   called with the share done, 0 to 1, before the call waits and after about each million rays;
                   returning False ends the call with Error (Code.INTERRUPTED). It must not call ballot.
        times      a list that the Times of the call are appended to

        Returns HIT of shape (...), or (..., first), as `last` and `strongest`: t, prim, u, v. t counts multiples of the
        direction, of any length. On a miss prim is MISS, t infinity, u = v = 0. A ray is dead, and misses, if
        t_max <= t_min, if a number is NaN or infinite (but t_max), or if its direction is zero.

        Rays may be a ballot.Array: then hits are one of "hits", on the same device, and so is `out`, `first` records of
        each ray one after the other; `masks`, `excluded` and `groups` are each one of "uint32", of each ray or one
        record for all; t, origins, directions and poses are for rays of the host, and Times count no hits. Wait for the
        stream that filled the rays. Float32 (n, 8) of CUDA's (torch, cupy, Warp) is copied to such an Array there; so
        is (n, 4) where points are asked for.

        Memory of results that were let go of is kept for the next ones: up to a 32nd of the machine's, at most 1 GiB.
        Other threads run meanwhile. Ctrl-C ends the call, as every call of ballot, within half a second; `out` is then
        half-written, perhaps for some time yet.
        Raises TypeError and ValueError for wrong arguments, before anything is written.
        """
        if on := there(rays, "rays", self._device):
            given = None if out is None else {"hits": out}
            beside = {"origins": origins, "directions": directions, "t": t, "poses": poses}
            return self._traced(on, ("hits",), beside, masks, count, given, times, options)["hits"]
        refuse_count(count)
        source = _sources.rays(rays, t, origins, directions, _sources.filters(masks, options), poses)
        asked, progress = _query.options(options, "hits", True)
        hits = _arrays.out_array(out, _shape(source, asked), HIT, source[1:])
        told(times, self._handle.trace(source, {"hits": _arrays.flat(hits)}, asked, progress))
        return hits

    @overload
    def trace_columns(
        self, rays: Array, columns: Sequence[str] = ..., *, masks: Array | None = None, count: int | None = None,
        out: Mapping[str, Array] | None = None, times: list[Times] | None = None, **options: Unpack[HitOptions],
    ) -> dict[str, Array]: ...
    @overload
    def trace_columns(
        self, rays: Any = None, columns: Sequence[str] = ..., *, origins: Any = None, directions: Any = None,
        t: Any = None, masks: Any = None, poses: Any = None, out: Mapping[str, Any] | None = None,
        times: list[Times] | None = None, **options: Unpack[HitOptions],
    ) -> dict[str, np.ndarray]: ...
    @documented
    def trace_columns(
        self, rays: Any = None, columns: Sequence[str] = ("t", "prims", "mesh_ids", "uvs", "normals"), *,
        origins: Any = None, directions: Any = None, t: Any = None, masks: Any = None, poses: Any = None,
        count: int | None = None, out: Mapping[str, Any] | None = None, times: list[Times] | None = None,
        **options: Unpack[HitOptions],
    ) -> Any:
        """Traces rays and returns an array for each column that is asked for. Arguments as trace(), and

        columns  some of
        {hit_columns}
        NAME               (...) float32, or (..., c) of c numbers: the attribute of this name; NaN where there is none
                 With `first`, `last` or `strongest` they have an axis more: (..., first).
        out      arrays for some of the columns, by name

        Of rays in a ballot.Array the columns are ballot.Arrays with the same bits, bool as uint8; "hits" may be one of
        them. The scene then keeps 16 bytes a ray on the device unless it is, and for "normals", "positions" and "front"
        36 a triangle, unless it is flat and its tree was built there.

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> rays = ballot.Array("rays", 1)
        >>> rays.write([[0.25, 0.25, 2, 0, 0, 0, -1, 9]])
        >>> there = scene.trace_columns(rays, ("t", "normals"))
        >>> there["normals"].read().tolist()
        [[0.0, 0.0, 1.0]]
        """
        if on := there(rays, "rays", self._device):
            beside = {"origins": origins, "directions": directions, "t": t, "poses": poses}
            return self._traced(on, columns, beside, masks, count, out, times, options)
        refuse_count(count)
        source = _sources.rays(rays, t, origins, directions, _sources.filters(masks, options), poses)
        asked, progress = _query.options(options, "hits", True)
        known = _attributes.columns(self._handle, columns, HIT_COLUMNS)
        arrays = _arrays.columns(columns, known, _shape(source, asked), source[1:], out)
        flat = {name: _arrays.flat(array) for name, array in arrays.items()}
        told(times, self._handle.trace(source, flat, asked, progress))
        return arrays

    def _traced(
        self, rays: Array, columns: Sequence[str], beside: Mapping[str, Any], masks: Any, count: int | None,
        out: Mapping[str, Any] | None, times: list[Times] | None, options: Mapping[str, Any],
    ) -> dict[str, Array]:
        asked = Asked("rays", rays, count, beside, _sources.filters(masks, options))
        how = _query.options(options, "hits", True)
        return asked.answer(self._handle, self._handle.trace_there, columns, out, how, times)

    @overload
    def occluded(
        self, rays: Array, *, masks: Array | None = None, count: int | None = None, out: Array | None = None,
        times: list[Times] | None = None, **options: Unpack[HitOptions],
    ) -> Array: ...
    @overload
    def occluded(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None, masks: Any = None,
        poses: Any = None, out: Any = None, times: list[Times] | None = None, **options: Unpack[HitOptions],
    ) -> np.ndarray: ...
    def occluded(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None, masks: Any = None,
        poses: Any = None, count: int | None = None, out: Any = None, times: list[Times] | None = None,
        **options: Unpack[HitOptions],
    ) -> Any:
        """Returns True for each ray that hits something between its t_min and t_max: bool of shape (...).

        Arguments as trace(); `out` is bool or uint8, of rays in a ballot.Array one of "uint8" or "uint32". Some hit is
        often found several times as fast as the nearest.
        """
        options.setdefault("any", True)
        given = None if out is None else {"occluded": out}
        if on := there(rays, "rays", self._device):
            beside = {"origins": origins, "directions": directions, "t": t, "poses": poses}
            return self._traced(on, ("occluded",), beside, masks, count, given, times, options)["occluded"]
        refuse_count(count)
        return self.trace_columns(
            rays, ("occluded",), origins=origins, directions=directions, t=t, masks=masks, poses=poses,
            out=given, times=times, **options,
        )["occluded"]  # fmt: skip

    def submit(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None, masks: Any = None,
        poses: Any = None, out: Any = None, **options: Unpack[HitOptions],
    ) -> Job:
        """Begins a trace in the background. Arguments as trace(), without progress. Jobs of a device run in the order
        of their submission.

        `rays` and `out` must not change until the job has ended. Wrong names of methods and knobs raise ValueError in
        Job.wait().
        """
        source = _sources.rays(rays, t, origins, directions, _sources.filters(masks, options), poses)
        asked, progress = _query.options(options, "hits", True)
        if progress is not None:
            raise TypeError("progress: found a function; a job in the background has none: expected None")
        hits = _arrays.out_array(out, _shape(source, asked), HIT, source[1:])
        numbers = _arrays.flat(hits)
        return Job(self._handle.submit(source, {"hits": numbers}, asked, (source, numbers)), hits)

    @overload
    def nearest(
        self, points: Array, columns: Sequence[str] = ..., *, masks: Array | None = None, count: int | None = None,
        out: Mapping[str, Array] | None = None, times: list[Times] | None = None, **options: Unpack[PointOptions],
    ) -> dict[str, Array]: ...
    @overload
    def nearest(
        self, points: Any, columns: Sequence[str] = ..., *, limit: Any = None, masks: Any = None,
        out: Mapping[str, Any] | None = None, times: list[Times] | None = None, **options: Unpack[PointOptions],
    ) -> dict[str, np.ndarray]: ...
    @documented
    def nearest(
        self, points: Any, columns: Sequence[str] = ("distances", "points", "prims", "uvs"), *, limit: Any = None,
        masks: Any = None, count: int | None = None, out: Mapping[str, Any] | None = None,
        times: list[Times] | None = None, **options: Unpack[PointOptions],
    ) -> Any:
        """Finds the nearest point of the scene for each point. Returns a dict of arrays.

        points   (..., 3) float32 or float64, read in place at any strides; or a grid() of them. One that is not finite
                 is near nothing, and outside
        columns  some of
        {point_columns}
                 or names of attributes, as of trace_columns(). Without a triangle within the limit distances are inf,
                 numbers ballot.MISS, the rest 0. Distances are within 64 * 2^-24 (M + M') + 2^-85 R of the true ones, M
                 and M' being the largest distances of a vertex of the reported and of the nearest triangle, R that of a
                 point of the scene along an axis. By parity "inside" is right for every point that is 16 * 2^-24 M away
                 from the surface
        limit    triangles farther away are not looked for: a number above 0, or an array that broadcasts to the points'
                 shape, where a point of a negative or NaN limit is near nothing; inf or None: there is no limit
        masks    as trace(), that broadcast to the points' shape; not with "inside" and "signed_distances", which are
                 told of the whole scene. Of points in a ballot.Array an Array of "uint32"
        {points_options}
        count, out, times, progress  as trace_columns()

        Points in a ballot.Array of "points" have their limits there, and their columns are ballot.Arrays, bool as
        uint8; "nearest" is one more: whole records. A GPU finds an order in which neighbours are near each other;
        on a CPU put such points next to each other. Only numeric "exact" brings them to the host.

        Raises ValueError if "inside" or "signed_distances" is asked for and an edge of the scene belongs to an odd
        number of triangles; with sign "pseudonormal", if two triangles run along an edge in the same direction.

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.nearest([[0.25, 0.25, 2]])["distances"].tolist()
        [2.0]
        """
        filters = _sources.filters(masks, options)
        if on := there(points, "points", self._device):
            given, how = Asked("points", on, count, {"limit": limit}, filters), _query.options(options, "points", True)
            return given.answer(self._handle, self._handle.nearest_there, columns, out, how, times)
        refuse_count(count)
        source = _sources.points(points, limit, filters)
        asked, progress = _query.options(options, "points", True)
        known = _attributes.columns(self._handle, columns, POINT_COLUMNS)
        arrays = _arrays.columns(columns, known, source.shape, source[1:], out)
        flat = {name: _arrays.flat(array) for name, array in arrays.items()}
        told(times, self._handle.nearest(source, flat, asked, progress))
        return arrays

    @documented
    def clearance(
        self, other: Answers, columns: Sequence[str] = ("distances",), *, poses: Any = None, limit: Any = None,
        out: Mapping[str, Any] | None = None, times: list[Times] | None = None, progress: Any = None,
    ) -> dict[str, np.ndarray]:
        """Finds the smallest distance between this scene and another one, wherever poses place that: 0 if they touch or
        pass through each other. Returns a dict of arrays.

        other    a Scene on the same device
        columns  some of
        {clearance_columns}
                 Beyond the limit, or without a triangle, distances are inf, numbers ballot.MISS, the rest 0. With M the
                 largest distance of corners of the two triangles distances are off by 2^-49 M at most. Of pairs at the
                 same distance it is that of the smallest prim, then of the smallest other prim; of those at 0 some pair
        poses    (..., 3, 4) or (..., 4, 4): matrices that place the other scene, read in double, of numbers within
                 +-1e30; None: it stays where it is
        limit    what is farther away is not looked for: a number of at least 0, or an array that broadcasts to the
                 poses' shape; None: there is no limit
        out, times, progress  as trace_columns()

        The host finds it, in double precision, each pose by a thread. Raises ValueError for scenes with shapes.

        >>> triangle = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> above = np.tile(np.eye(4), (3, 1, 1))
        >>> above[:, 2, 3] = [0, 0.5, 2]
        >>> triangle.clearance(triangle, poses=above, limit=1)["distances"].tolist()
        [0.0, 0.5, inf]
        """
        if not isinstance(other, Answers):
            raise TypeError(f"other: found {type(other).__name__}; expected a ballot.Scene")
        source = _sources.poses(poses, limit)
        arrays = _arrays.columns(columns, CLEARANCE_COLUMNS, source.shape, source[1:], out)
        flat = {name: _arrays.flat(array) for name, array in arrays.items()}
        told(times, self._handle.clearance(other._handle, source, flat, _query.progress_function(progress)))
        return arrays


def _shape(source: _sources.Source, asked: Mapping[str, Any]) -> tuple[int, ...]:
    """Returns the shape of hits: with an axis more if several of each ray are asked for."""
    each = _query.hits_of_each(asked)
    return (*source.shape, each) if each else source.shape
