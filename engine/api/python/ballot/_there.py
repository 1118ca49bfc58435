"""Questions and answers in arrays on the device."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from . import _ballot, _query
from ._array import Array
from ._door import HIT_COLUMNS, POINT_COLUMNS, Times

_RECORDS: dict[tuple[type, tuple[int, ...]], str] = {
    (np.float32, ()): "float32", (np.float32, (2,)): "float32x2", (np.float32, (3,)): "float32x3",
    (np.uint32, ()): "uint32", (np.bool_, ()): "uint8",
}  # fmt: skip
#: of each kind of question the records of its columns, and of whole answers
_COLUMNS = {
    "rays": {"hits": "hits", **{name: _RECORDS[column] for name, column in HIT_COLUMNS.items()}},
    "points": {"nearest": "nearest", **{name: _RECORDS[column] for name, column in POINT_COLUMNS.items()}},
}


def words(masks: Any, kind: str) -> _ballot.Array | None:
    """Returns the masks of questions on the device, as the extension takes them."""
    if masks is None:
        return None
    if not isinstance(masks, Array):
        found = type(masks).__name__
        raise TypeError(f"masks: found {found}; expected a ballot.Array of uint32, where the {kind} are")
    handle: _ballot.Array = masks._handle
    return handle


class Asked:
    """Questions in an array on the device.

    kind    "rays" or "points"
    count   the first so many; None: all
    beside  arguments that say more of questions of the host, by name: not to be given
    masks   an Array of "uint32", or None
    """

    def __init__(self, kind: str, array: Array, count: int | None, beside: Mapping[str, Any], masks: Any = None):
        for name, given in beside.items():
            if given is not None:
                raise TypeError(f"{name}: found beside {kind} in a ballot.Array, which have their own; expected None")
        self._kind, self._array, self._words = kind, array, words(masks, kind)
        self._count = len(array) if count is None else _query.integer(count, "count", 0, 2**32 - 1)

    def answer(
        self, ask: Callable[..., Any], columns: Sequence[str], out: Mapping[str, Any] | None,
        options: tuple[dict[str, Any], Any], times: list[Times] | None,
    ) -> dict[str, Array]:
        """Returns an array on the device for each column: a new one, or that of `out`, filled by a call of the
        extension."""
        arrays = self._arrays(columns, dict(out or {}), self._count * options[0].get("first", 1))
        to = {name: array._handle for name, array in arrays.items()}
        spent = ask(self._array._handle, self._count, to, *options, self._words)
        if times is not None:
            times.append(Times(*spent))
        return arrays

    def _arrays(self, columns: Sequence[str], given: dict[str, Any], count: int) -> dict[str, Array]:
        known = _COLUMNS[self._kind]
        for name in columns:
            if name not in known:
                raise ValueError(f"columns: found {name!r}; expected some of {', '.join(known)}")
            if not isinstance(given.get(name, self._array), Array):
                found = type(given[name]).__name__
                raise TypeError(f"out[{name!r}]: found {found}; expected a ballot.Array, as the {self._kind} are")
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
