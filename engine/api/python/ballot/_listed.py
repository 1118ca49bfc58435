"""Lists of questions, and those of questions on the device."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from . import _ballot, _query
from ._array import Array
from ._door import Times
from ._sources import Filters
from ._there import words


class Lists(NamedTuple):
    """A list of triangles for each question."""

    #: how many each has: int64 of the questions' shape
    counts: np.ndarray
    #: those of all questions one after the other: HIT of shape (sum of counts,)
    hits: np.ndarray

    @property
    def offsets(self) -> np.ndarray:
        """Where each list begins in hits, then their number: int64 of shape (questions + 1,)."""
        return np.concatenate([np.zeros(1, np.int64), np.cumsum(self.counts, dtype=np.int64)])


class DeviceLists(NamedTuple):
    """A list of triangles for each question on the device, as Lists; each a ballot.Array there."""

    #: how many each has: "uint32"
    counts: Array
    #: those of all questions one after the other: "hits"; None if there are none
    hits: Array | None
    #: where each list begins in hits, then their number: "int64", one more than questions
    offsets: Array


def _count_of(asked: Array, count: int | None, beside: Mapping[str, Any]) -> int:
    for name, value in beside.items():
        if value is not None:
            raise TypeError(f"{name}: found beside an array on the device, which has its own; expected None")
    return len(asked) if count is None else _query.integer(count, "count", 1, len(asked))


def _list(
    scene: _ballot.Scene, asked: Array, number: int, arrays: tuple[Array | None, Array | None, Array | None],
    filters: Filters, options: Mapping[str, Any], progress: Any, times: list[Times] | None,
) -> int:  # fmt: skip
    counts, offsets, hits = (None if a is None else a._handle for a in arrays)
    given = words(filters, asked.record)
    total, spent = scene.list_there(asked._handle, number, counts, offsets, hits, dict(options), progress, **given)
    if times is not None:
        times.append(Times(*spent))
    return int(total)


def counts(
    scene: _ballot.Scene, asked: Array, count: int | None, beside: Mapping[str, Any], filters: Filters,
    options: Mapping[str, Any], progress: Any, times: list[Times] | None,
) -> Array:  # fmt: skip
    """Returns how many triangles each question finds: an Array of uint32."""
    number = _count_of(asked, count, beside)
    found = Array("uint32", number, asked._device, asked.exported)
    _list(scene, asked, number, (found, None, None), filters, options, progress, times)
    return found


def lists(
    scene: _ballot.Scene, asked: Array, count: int | None, beside: Mapping[str, Any], filters: Filters,
    options: Mapping[str, Any], progress: Any, times: list[Times] | None,
) -> DeviceLists:  # fmt: skip
    """Returns the lists: asked for twice, first for their number."""
    number = _count_of(asked, count, beside)
    found = Array("uint32", number, asked._device, asked.exported)
    offsets = Array("int64", number + 1, asked._device, asked.exported)
    total = _list(scene, asked, number, (found, offsets, None), filters, options, progress, times)
    if total == 0:
        return DeviceLists(found, None, offsets)
    hits = Array("hits", total, asked._device, asked.exported)
    _list(scene, asked, number, (found, offsets, hits), filters, options, progress, times)
    return DeviceLists(found, hits, offsets)


def compact(scene: _ballot.Scene, hits: Array, count: int | None, first: int) -> tuple[Array, Array, int]:
    """Returns the hits that are no misses, the numbers of their rays, and how many they are."""
    number = _count_of(hits, count, {})
    alone = Array("hits", number, hits._device, hits.exported)
    rays = Array("uint32", number, hits._device, hits.exported)
    each = _query.integer(first, "first", 1, 2**32 - 2)
    found = scene.compact(hits._handle, number, each, alone._handle, rays._handle)
    return alone, rays, int(found)
