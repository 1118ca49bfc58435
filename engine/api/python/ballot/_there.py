"""Questions and answers in arrays on the device."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from . import _attributes, _ballot, _query
from ._array import Array
from ._door import HIT_COLUMNS, POINT_COLUMNS, Times
from ._sources import Filters

_RECORDS: dict[tuple[type, tuple[int, ...]], str] = {
    (np.float32, ()): "float32", (np.float32, (2,)): "float32x2", (np.float32, (3,)): "float32x3",
    (np.float32, (4,)): "float32x4", (np.uint32, ()): "uint32", (np.bool_, ()): "uint8",
}  # fmt: skip
#: of each kind of question the columns, and the records of whole answers
_COLUMNS = {"rays": (HIT_COLUMNS, "hits"), "points": (POINT_COLUMNS, "nearest")}


def words(filters: Filters, kind: str) -> dict[str, _ballot.Array | None]:
    """Returns the words of questions on the device that filters read, as the extension takes them."""
    return {name: _beside(given, name, "uint32", kind) for name, given in filters._asdict().items()}


def _beside(given: Any, name: str, record: str, kind: str) -> _ballot.Array | None:
    if given is None:
        return None
    if not isinstance(given, Array):
        found = type(given).__name__
        raise TypeError(f"{name}: found {found}; expected a ballot.Array of {record}, where the {kind} are")
    handle: _ballot.Array = given._handle
    return handle


class Asked:
    """Questions in an array on the device.

    kind    "rays" or "points"
    count   the first so many; None: all
    beside  arguments that say more of questions of the host, by name: not to be given
    filters  Arrays of "uint32", or None
    """

    def __init__(
        self, kind: str, array: Array, count: int | None, beside: Mapping[str, Any], filters: Filters = Filters()
    ):
        for name, given in beside.items():
            if given is not None:
                raise TypeError(f"{name}: found beside {kind} in a ballot.Array, which have their own; expected None")
        self._kind, self._array, self._words = kind, array, words(filters, kind)
        self._count = len(array) if count is None else _query.integer(count, "count", 0, 2**32 - 1)

    def answer(
        self, scene: _ballot.Scene, ask: Callable[..., Any], columns: Sequence[str], out: Mapping[str, Any] | None,
        options: tuple[dict[str, Any], Any], times: list[Times] | None,
    ) -> dict[str, Array]:
        """Returns an array on the device for each column: a new one, or that of `out`, filled by a call of the
        extension."""
        hits = max(_query.hits_of_each(options[0]), 1)
        arrays = self._arrays(scene, columns, dict(out or {}), self._count * hits)
        self._fill(ask, arrays, None, options, times)
        return arrays

    def sums(
        self, ask: Callable[..., Any], column: str, entries: int, weights: Any, out: Any,
        options: tuple[dict[str, Any], Any], times: list[Times] | None,
    ) -> Array:
        """Returns sums on the device, in a new array or in `out`, as answer() does."""
        if out is not None:
            self._check_out(out, "out")
        array = Array("float64", entries, self._array.device, self._array.exported) if out is None else out
        self._fill(ask, {column: array}, _beside(weights, "weights", "float32", self._kind), options, times)
        return array

    def _fill(
        self, ask: Callable[..., Any], arrays: Mapping[str, Array], weights: _ballot.Array | None,
        options: tuple[dict[str, Any], Any], times: list[Times] | None,
    ) -> None:
        to = {name: array._handle for name, array in arrays.items()}
        spent = ask(self._array._handle, self._count, to, *options, weights=weights, **self._words)
        if times is not None:
            times.append(Times(*spent))

    def _check_out(self, given: Any, name: str) -> None:
        if not isinstance(given, Array):
            found = type(given).__name__
            raise TypeError(f"{name}: found {found}; expected a ballot.Array, as the {self._kind} are")

    def _arrays(
        self, scene: _ballot.Scene, columns: Sequence[str], given: dict[str, Any], count: int
    ) -> dict[str, Array]:
        table, whole = _COLUMNS[self._kind]
        others = _attributes.columns(scene, [name for name in columns if name != whole], table)
        known = {whole: whole, **{name: _RECORDS[column] for name, column in others.items() if column in _RECORDS}}
        for name in columns:
            if name not in known:
                raise ValueError(f"columns: found {name!r}; expected some of {', '.join(known)}")
            if name in given:
                self._check_out(given[name], f"out[{name!r}]")
        for name in given:
            if name not in columns:
                raise ValueError(f"out: it has {name!r}, which is not among the columns")
        of = self._array
        return {
            name: given[name] if name in given else Array(known[name], count, of.device, of.exported)
            for name in columns
        }


def refuse_count(count: int | None) -> None:
    """Refuses a number of questions that lie on the host."""
    if count is not None:
        raise TypeError("count: it is for questions in a ballot.Array; slice arrays of the host")
