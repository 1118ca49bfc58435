"""Sums over rays, by what they end on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

import numpy as np

from . import _arrays, _ballot, _query, _sources
from ._array import Array, there
from ._closable import Closable
from ._device import Device
from ._door import HitOptions, SceneInfo, Times
from ._there import Asked, refuse_count

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: what sums are by: the number of entries of each in SceneInfo
_BY = {"prim": "instance_triangles", "instance": "instances", "mesh": "meshes"}


class Sums(Closable):
    """The part of a Scene that sums up."""

    _handle: _ballot.Scene
    _device: Device | None

    @overload
    def sums(
        self, rays: Array, weights: Array | None = None, by: str = "prim", *, masks: Array | None = None,
        count: int | None = None, out: Array | None = None, times: list[Times] | None = None,
        **options: Unpack[HitOptions],
    ) -> Array: ...
    @overload
    def sums(
        self, rays: Any = None, weights: Any = None, by: str = "prim", *, origins: Any = None, directions: Any = None,
        t: Any = None, masks: Any = None, poses: Any = None, out: Any = None, times: list[Times] | None = None,
        **options: Unpack[HitOptions],
    ) -> np.ndarray: ...
    def sums(
        self, rays: Any = None, weights: Any = None, by: str = "prim", *, origins: Any = None, directions: Any = None,
        t: Any = None, masks: Any = None, poses: Any = None, count: int | None = None, out: Any = None,
        times: list[Times] | None = None, **options: Unpack[HitOptions],
    ) -> Any:
        """Traces rays and adds the weight of each to the entry of what it hits. Returns float64 (entries + 1,): the
        last is of rays that hit nothing. With `first` or `last` a ray adds to the entry of each of its hits.

        weights  finite numbers that broadcast to the rays' shape, rounded to float32; None: 1, so that sums are numbers
                 of rays
        by       "prim": entries are triangles, as HIT's prim counts them; "instance": instances, "mesh": meshes, in the
                 order of their numbers
        out      where the sums go: an array of their dtype and shape

        The other arguments and options are those of trace(). Of rays in a ballot.Array the sums are an Array of
        "float64", and weights one of "float32", of each ray or of one record.

        The bits of sums depend on rays and weights alone, not on their order, nor on device or method: weights are
        rounded to whole multiples of 2^(e + ceil(log2 n) - 61), e being the exponent of the largest and n the number of
        rays, and added as integers. The largest ones lose nothing up to 2^38 rays.

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.sums([[0.25, 0.25, 2, 0, 0, -1], [9, 9, 2, 0, 0, -1]], [0.5, 3]).tolist()
        [0.5, 3.0]
        """
        if by not in _BY:
            raise ValueError(f"by is {_query.shown(by)}; expected one of {', '.join(_BY)}")
        entries = getattr(SceneInfo(*self._handle.info()), _BY[by]) + 1
        column, (asked, progress) = f"{by}_sums", _query.options(options, "hits", True)
        filters = _sources.filters(masks, options)
        if on := there(rays, "rays", self._device):
            beside = {"origins": origins, "directions": directions, "t": t, "poses": poses}
            given = Asked("rays", on, count, beside, filters)
            return given.sums(self._handle.trace_there, column, entries, weights, out, (asked, progress), times)
        refuse_count(count)
        source = _sources.rays(rays, t, origins, directions, filters, poses, weights)
        sums = _arrays.out_array(out, (entries,), np.dtype(np.float64), source[1:])
        spent = self._handle.trace(source, {column: _arrays.flat(sums)}, asked, progress)
        if times is not None:
            times.append(Times(*spent))
        return sums
