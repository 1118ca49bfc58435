"""Lists that a Scene answers with: crossings of rays, and triangles near points or in boxes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

import numpy as np

from . import _arrays, _ballot, _listed, _query, _sources
from ._array import Array, there
from ._arrays import HIT
from ._closable import Closable
from ._device import Device
from ._door import CrossingOptions, Times, documented
from ._listed import DeviceLists, Lists
from ._there import refuse_count

if TYPE_CHECKING:
    from typing_extensions import Unpack


def told(times: list[Times] | None, spent: Any) -> None:
    if times is not None:
        times.append(Times(*spent))


class ListAnswers(Closable):
    """The part of a Scene that lists triangles."""

    _handle: _ballot.Scene
    _device: Device | None

    @overload
    def within(
        self, points: Array, *, masks: Array | None = None, excluded: Array | None = None,
        groups: Array | None = None, times: list[Times] | None = None, progress: Any = None,
    ) -> DeviceLists: ...
    @overload
    def within(
        self, points: Any, radius: Any, *, masks: Any = None, excluded: Any = None, groups: Any = None,
        times: list[Times] | None = None, progress: Any = None,
    ) -> Lists: ...
    def within(
        self, points: Any, radius: Any = None, *, masks: Any = None, excluded: Any = None, groups: Any = None,
        times: list[Times] | None = None, progress: Any = None,
    ) -> Any:
        """Lists all triangles within a radius of each point, the nearest first: HIT with t the distance, within the
        bound of nearest(), and u = v = 0.

        points  as nearest()
        radius  a distance of at least 0, or an array that broadcasts to the points' shape; triangles at it count. In
                arrays a point of a negative or NaN radius is near nothing
        masks, excluded, groups  as nearest()

        Of points in a ballot.Array, whose limits are the radii, they are DeviceLists, as of crossings().

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> counts, hits = scene.within([[0.25, 0.25, 2], [0.25, 0.25, 3]], 2.5)
        >>> counts.tolist(), hits["t"].tolist()
        ([1, 0], [2.0])
        """
        filters = _sources.Filters(masks, excluded, groups)
        if on := there(points, "points", self._device):
            told = _query.progress_function(progress)
            return _listed.lists(self._handle, on, None, {"radius": radius}, filters, {}, told, times)
        source = _sources.points(points, radius, filters, least=True)
        return self._list(source, "within", True, {}, _query.progress_function(progress), times)

    def overlapping(
        self, low: Any, high: Any, *, masks: Any = None, excluded: Any = None, groups: Any = None,
        times: list[Times] | None = None, progress: Any = None,
    ) -> Lists:
        """Lists all triangles that have a point in common with each closed box, such as a voxel: HIT with t, u, v of 0,
        each box's in the order of prim. Exact arithmetic decides; touching counts.

        low, high  (..., 3): the corners, which broadcast; infinite: no bound. float64 is rounded outward. A box whose
                   low corner is above its high corner, or NaN, overlaps nothing
        masks, excluded, groups  as nearest()

        Raises ValueError for scenes with shapes, which have no triangles.

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> counts, hits = scene.overlapping([[0, 0, 0], [0.9, 0.9, 0]], [[0.1, 0.1, 1], [1, 1, 1]])
        >>> counts.tolist(), hits["prim"].tolist()
        ([1, 0], [0])
        """
        return self._overlaps(low, high, True, _sources.Filters(masks, excluded, groups), times, progress)

    def count_overlapping(
        self, low: Any, high: Any, *, masks: Any = None, excluded: Any = None, groups: Any = None,
        times: list[Times] | None = None, progress: Any = None,
    ) -> np.ndarray:
        """Returns how many triangles overlap each box: int64 of shape (...). Arguments as overlapping().

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> cells = 0.6 * np.indices((2, 2, 1)).transpose(1, 2, 3, 0)
        >>> scene.count_overlapping(cells, cells + 0.6)[..., 0].tolist()
        [[1, 1], [1, 0]]
        """
        return self._overlaps(low, high, False, _sources.Filters(masks, excluded, groups), times, progress).counts

    def _overlaps(
        self, low: Any, high: Any, lists: bool, filters: _sources.Filters, times: list[Times] | None, progress: Any
    ) -> Lists:
        source = _sources.boxes(low, high, filters)
        return self._list(source, "overlapping", lists, {}, _query.progress_function(progress), times)

    @overload
    def count_crossings(
        self, rays: Array, *, masks: Array | None = None, count: int | None = None,
        times: list[Times] | None = None, **options: Unpack[CrossingOptions],
    ) -> Array: ...
    @overload
    def count_crossings(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None, masks: Any = None,
        poses: Any = None, times: list[Times] | None = None, **options: Unpack[CrossingOptions],
    ) -> np.ndarray: ...
    @documented
    def count_crossings(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None, masks: Any = None,
        poses: Any = None, count: int | None = None, times: list[Times] | None = None,
        **options: Unpack[CrossingOptions],
    ) -> Any:
        """Returns how many triangles each ray crosses: int64 of shape (...). Rays, origins, directions, t, masks,
        poses as trace(). Of rays in a ballot.Array it is an Array of "uint32" there; masks are one too, of each ray or
        of one record.

        A ray through an edge or a vertex of a closed surface crosses it there once, or twice or not at all where it
        touches the surface from one side.

        {crossings_options}

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.count_crossings([[0.25, 0.25, 2, 0, 0, -1], [9, 9, 2, 0, 0, -1]]).tolist()
        [1, 0]
        """
        filters, (asked, progress) = _sources.filters(masks, options), _query.options(options, "crossings", True)
        if on := there(rays, "rays", self._device):
            beside = {"origins": origins, "directions": directions, "t": t, "poses": poses}
            return _listed.counts(self._handle, on, count, beside, filters, asked, progress, times)
        refuse_count(count)
        source = _sources.rays(rays, t, origins, directions, filters, poses)
        return self._list(source, "crossings", False, asked, progress, times).counts

    @overload
    def crossings(
        self, rays: Array, *, masks: Array | None = None, count: int | None = None,
        times: list[Times] | None = None, **options: Unpack[CrossingOptions],
    ) -> DeviceLists: ...
    @overload
    def crossings(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None, masks: Any = None,
        poses: Any = None, times: list[Times] | None = None, **options: Unpack[CrossingOptions],
    ) -> Lists: ...
    def crossings(
        self, rays: Any = None, *, origins: Any = None, directions: Any = None, t: Any = None, masks: Any = None,
        poses: Any = None, count: int | None = None, times: list[Times] | None = None,
        **options: Unpack[CrossingOptions],
    ) -> Any:
        """Finds all triangles that each ray crosses, or the `first` of each. Returns Lists (counts, hits): each ray's
        in the order of t, at equal t of prim. Arguments as count_crossings(). Of rays in a ballot.Array they are
        DeviceLists (counts, hits, offsets), of which the host sees the number of all alone: the rays are walked twice.

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> counts, hits = scene.crossings([[0.25, 0.25, 2, 0, 0, -1], [9, 9, 2, 0, 0, -1]])
        >>> counts.tolist(), hits["t"].tolist()
        ([1, 0], [2.0])
        """
        filters, (asked, progress) = _sources.filters(masks, options), _query.options(options, "crossings", True)
        if on := there(rays, "rays", self._device):
            beside = {"origins": origins, "directions": directions, "t": t, "poses": poses}
            return _listed.lists(self._handle, on, count, beside, filters, asked, progress, times)
        refuse_count(count)
        source = _sources.rays(rays, t, origins, directions, filters, poses)
        return self._list(source, "crossings", True, asked, progress, times)

    def compact(self, hits: Array, *, first: int = 1, count: int | None = None) -> tuple[Array, Array, int]:
        """Leaves the misses of an Array of "hits" out. Returns (hits, rays, number): Arrays of "hits" and "uint32" with
        those alone, the number of each one's ray, and how many there are; what lies behind them is unspecified.

        first  hits of a ray, as trace() was asked for (`first` or `last`)
        count  the first so many hits are looked at; None: all

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> hits = ballot.Array("hits", 2)
        >>> hits.write([[float("inf"), np.uint32(2**32 - 1).view(np.float32), 0, 0], [2, 0, 0.5, 0.25]])
        >>> alone, rays, number = scene.compact(hits)
        >>> number, int(rays.read()[0])
        (1, 1)
        """
        return _listed.compact(self._handle, hits, count, first)

    def _list(
        self, source: _sources.Source, what: str, lists: bool, asked: dict[str, Any], progress: Any,
        times: list[Times] | None,
    ) -> Lists:
        counts = _arrays.empty(source.shape, np.int64)
        hits: np.ndarray
        hits, spent = self._handle.list(source, what, lists, counts.reshape(-1), asked, progress)
        told(times, spent)
        return Lists(counts, hits.view(HIT).reshape(-1))
