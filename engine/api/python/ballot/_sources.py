"""Rays and points as callers have them: arrays that the extension reads where they lie, at any stride."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from . import _arrays, _query
from ._patterns import Grid, Pattern

_AXES = 8  # that the library walks
_MOST = float(np.finfo(np.float32).max)


class Source(NamedTuple):
    """Questions, as the extension reads them: a shape, and arrays of float32 or float64 whose axes broadcast to it."""

    shape: tuple[int, ...]
    first: np.ndarray  # rays of 8 or 6 numbers, origins or points; low corners of boxes; poses of scenes
    directions: np.ndarray | None = None  # or high corners
    low: np.ndarray | None = None  # t_min; None: 0
    high: np.ndarray | None = None  # t_max, or limits of points; None: no end
    masks: np.ndarray | None = None  # as Filters, these and the last two: uint32
    poses: np.ndarray | None = None  # 12 numbers each; None: none
    y: np.ndarray | None = None  # of points whose x is `first`
    z: np.ndarray | None = None
    weights: np.ndarray | None = None  # of rays whose sums are asked for; None: 1
    excluded: np.ndarray | None = None
    groups: np.ndarray | None = None


class Filters(NamedTuple):
    """What leaves out triangles, by a word of each question; None: nothing."""

    masks: Any = None
    excluded: Any = None
    groups: Any = None


def filters(masks: Any, options: Mapping[str, Any]) -> Filters:
    """Returns masks and what stands among options, which _query.options() leaves to this."""
    return Filters(masks, *(options.get(name) for name in _query.FILTERS))


def rays(
    given: Any, t: Any = None, origins: Any = None, directions: Any = None, filters: Filters = Filters(),
    poses: Any = None, weights: Any = None,
) -> Source:
    """Returns rays of 8 or 6 numbers, of a Pattern, or of origins and directions. `t` is the range (t_min, t_max) of
    all but those of 8 numbers. `filters`: whole numbers below 2^32. `poses`: matrices that broadcast; with a Pattern
    its rays from each. `weights`: numbers that broadcast."""
    moved = None if poses is None else matrices(poses, "poses")
    if isinstance(given, Pattern):
        if moved is not None:
            moved = moved.reshape(*moved.shape[:-1], *(1,) * len(given.shape), 12)
        if origins is None and directions is None:
            given, origins, directions = None, given.origins, given.directions
    if origins is None and directions is None:
        first, other = _arrays.numbers(_arrays.as_rows(given), "rays", (8, 6)), None
        shape = first.shape[:-1]
        if t is not None and first.shape[-1] == 8:
            raise ValueError(f"rays: shape is {first.shape}; t is for rays of 6 numbers: those of 8 have their own")
    else:
        first, other, shape = _pair(given, origins, directions)
    if moved is not None:
        shape = _broadcast(shape, moved, poses)
    if t is None:
        source = Source(shape, first, other)
    else:
        source = Source(shape, first, other, *_range(t, shape))
    if moved is not None:
        source = source._replace(poses=moved)
    source = _filtered(source, filters)
    if weights is not None:
        source = source._replace(weights=_weights(weights, shape))
    return source if len(shape) <= _AXES else _flattened(source)


def matrices(given: Any, name: str) -> np.ndarray:
    """Returns matrices as rows of 12 numbers: (..., 12). Copies only what is not contiguous."""
    array = _arrays.as_numpy(given, name)
    if array.ndim < 2 or array.shape[-2:] not in ((3, 4), (4, 4)):
        raise ValueError(f"{name}: shape is {array.shape}; expected (..., 3, 4) or (..., 4, 4)")
    array = _arrays.numbers(array, name, (4,))
    if array.shape[-2] == 4:
        wrong = np.any(array[..., 3, :] != (0, 0, 0, 1), axis=-1)
        if wrong.any():
            at = tuple(int(i) for i in np.argwhere(wrong)[0])
            row = array[(*at, 3)].tolist()
            raise ValueError(f"{name}: the last row of matrix {list(at)} is {row}; expected [0, 0, 0, 1]")
    with np.errstate(over="ignore"):
        if array.ndim == 2 and not np.isfinite(array.astype(np.float32)).all():
            raise ValueError(f"{name}: a number of the matrix is not finite; expected numbers that float32 can hold")
    return array[..., :3, :].reshape(*array.shape[:-2], 12)


def _broadcast(shape: tuple[int, ...], poses: np.ndarray, given: Any) -> tuple[int, ...]:
    """Returns the shape of rays of a shape that poses move."""
    try:
        return np.broadcast_shapes(shape, poses.shape[:-1])
    except ValueError:
        raise ValueError(
            f"poses: shape is {np.shape(given)}, of rays {shape}; expected axes before the last two that are as long "
            "as those of the rays, or 1"
        ) from None


def _pair(given: Any, origins: Any, directions: Any) -> tuple[np.ndarray, np.ndarray, tuple[int, ...]]:
    """Returns checked origins and directions, and the shape of their rays."""
    if given is not None:
        raise TypeError("rays: found beside origins and directions; expected the one or the others")
    if origins is None or directions is None:
        missing, there = ("origins", "directions") if origins is None else ("directions", "origins")
        raise TypeError(f"{missing}: found None beside {there}; expected both of them, or rays")
    o, d = _arrays.numbers(origins, "origins", (3,)), _arrays.numbers(directions, "directions", (3,))
    if o.shape == d.shape:
        return o, d, o.shape[:-1]
    try:
        return o, d, np.broadcast_shapes(o.shape[:-1], d.shape[:-1])
    except ValueError:
        raise ValueError(
            f"origins and directions: shapes are {o.shape} and {d.shape}; expected axes before the last that are as "
            "long, or 1"
        ) from None


def _range(t: Any, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Returns both ends of a range for rays of this shape."""
    try:
        t_min, t_max = t
    except (TypeError, ValueError):
        raise ValueError(f"t: found {_query.shown(t)}; expected (t_min, t_max)") from None
    low, high = _bound(t_min, "t: t_min", 0), _bound(t_max, "t: t_max", np.inf)
    if low.ndim == 0 and not np.isfinite(low):
        raise ValueError(f"t: t_min is {low}; expected a finite number, or None for 0")
    if high.ndim == 0 and np.isnan(high):
        raise ValueError(f"t: t_max is {high}; expected a number, or None for no end")
    if low.ndim == 0 and high.ndim == 0 and low > high:
        raise ValueError(f"t is ({low}, {high}); expected a t_min that is not above t_max")
    if low.ndim and low.dtype == np.float64 and np.fmin.reduce(low, axis=None, initial=0) < -_MOST:
        low = np.where(np.isfinite(low), np.maximum(low, -_MOST), low)
    ends = _fitted(low, shape), _fitted(high, shape)
    if ends[0] is None or ends[1] is None:
        raise ValueError(f"t: shapes {low.shape} and {high.shape}; expected numbers, or arrays of {shape}")
    return ends[0], ends[1]


def _bound(given: Any, name: str, none: float) -> np.ndarray:
    """Returns one end of a range, of a number for all rays or an array of one for each. `none` stands for None. A
    finite number stays finite as float32."""
    given = none if given is None else given
    if isinstance(given, (int, float, str)):
        number = _query.number(given, name)
        return np.array(number if math.isinf(number) else min(max(number, -_MOST), _MOST), np.float32)
    array = _array(given, name)
    if array.ndim and array.dtype in _arrays.FLOATS:
        return array
    with np.errstate(over="ignore"):
        rounded = array.astype(np.float32)
    return np.where(np.isinf(rounded) & np.isfinite(array), np.copysign(_MOST, array), rounded).astype(np.float32)


def _array(given: Any, name: str) -> np.ndarray:
    """Returns numbers in the order of bytes that the extension reads."""
    array = _arrays.as_numpy(given, name)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: found {_query.shown(given)}; expected a number, an array of numbers, or None")
    return array if array.dtype.isnative else array.astype(array.dtype.newbyteorder("="))


def _fitted(array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray | None:
    """Returns an array that broadcasts to this shape, with no more axes; None if it does not."""
    while array.ndim > len(shape) and array.shape[0] == 1:
        array = array[0]
    if array.ndim > len(shape) or any(n not in (1, m) for n, m in zip(array.shape[::-1], shape[::-1])):
        return None
    return array


def _filtered(source: Source, filters: Filters) -> Source:
    """Returns questions with the words that filters read."""

    def words(name: str) -> np.ndarray | None:
        given = getattr(filters, name)
        return None if given is None else _words(given, name, source.shape)

    return source._replace(masks=words("masks"), excluded=words("excluded"), groups=words("groups"))


def _words(given: Any, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Returns words that broadcast to this shape."""
    words = np.asarray(given) if isinstance(given, (list, tuple, int)) else _arrays.as_numpy(given, name)
    if words.dtype.kind not in "iu" or (words.size and not 0 <= int(words.min()) <= int(words.max()) < 2**32):
        wrong = f", {words.min()} to {words.max()}" if words.size else ""
        raise ValueError(f"{name}: found {words.dtype}{wrong}; expected whole numbers from 0 to 2^32 - 1")
    fitted = _fitted(words, shape)
    if fitted is None:
        raise ValueError(f"{name}: shape is {words.shape}; expected a number, or an array of {shape}")
    return fitted.astype(np.uint32, copy=False)


def _weights(given: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Returns weights that broadcast to this shape."""
    array = _array(np.asarray(given) if isinstance(given, (list, tuple, int, float)) else given, "weights")
    fitted = _fitted(array, shape)
    if fitted is None:
        raise ValueError(f"weights: shape is {array.shape}; expected a number, or an array of {shape}")
    return fitted if fitted.dtype in _arrays.FLOATS else fitted.astype(np.float32)


def points(given: Any, limit: Any, filters: Filters = Filters(), least: bool = False) -> Source:
    """Returns points with their limit: None, a number above 0 for all, or an array of one for each. `least`: there is
    one, and it may be 0."""
    y = z = None
    if isinstance(given, Grid):
        shape, (first, y, z) = given.shape, np.ix_(given.x, given.y, given.z)
    else:
        first = _arrays.numbers(given, "points", (3,))
        shape = first.shape[:-1]
    return _flat_enough(_filtered(Source(shape, first, high=_limit(limit, shape, least), y=y, z=z), filters))


def boxes(low: Any, high: Any, filters: Filters = Filters()) -> Source:
    """Returns boxes of their corners, which broadcast."""
    first, last = _arrays.numbers(low, "low", (3,)), _arrays.numbers(high, "high", (3,))
    try:
        shape = np.broadcast_shapes(first.shape[:-1], last.shape[:-1])
    except ValueError:
        raise ValueError(
            f"low and high: shapes are {first.shape} and {last.shape}; expected axes before the last that are as long, "
            "or 1"
        ) from None
    return _flat_enough(_filtered(Source(shape, first, last), filters))


def poses(given: Any, limit: Any) -> Source:
    """Returns matrices that place a scene, and the limit of each: None, a number of at least 0, or an array."""
    first = matrices(np.eye(4)[:3] if given is None else given, "poses")
    shape = first.shape[:-1]
    if limit is None:
        return _flat_enough(Source(shape, first))
    far = np.asarray(limit, np.float64)
    fitted = _fitted(far, shape)
    if fitted is None:
        raise ValueError(f"limit: shape is {far.shape}; expected a number, or an array of {shape}")
    return _flat_enough(Source(shape, first, high=fitted))


def _flat_enough(source: Source) -> Source:
    return source if len(source.shape) <= _AXES else _flattened(source)


def _limit(given: Any, shape: tuple[int, ...], least: bool) -> np.ndarray | None:
    if given is None and not least:
        return None
    if not isinstance(given, (list, tuple)) and not getattr(given, "ndim", 0):
        bound = _query.number(given, "limit")
        if least and bound >= 0:
            return np.array(bound, np.float32)
        if least or not np.float32(min(bound, _MOST)) > 0:
            expected = "of at least 0" if least else "above 0, or None"
            raise ValueError(f"limit is {given}; expected a distance {expected}")
        return np.array(bound, np.float32) if bound <= _MOST else None
    array = _array(given, "limit")
    fitted = _fitted(array, shape)
    if fitted is None:
        raise ValueError(f"limit: shape is {array.shape}; expected a number, or an array of {shape}")
    return fitted if fitted.dtype in _arrays.FLOATS else fitted.astype(np.float32)


def _flattened(source: Source) -> Source:
    """Returns questions of more axes than the library walks with arrays of one axis. Copies what has no single stride.
    """
    shape, count = source.shape, math.prod(source.shape)

    def flat(array: np.ndarray | None, *width: int) -> np.ndarray | None:
        return None if array is None else np.broadcast_to(array, (*shape, *width)).reshape(count, *width)

    first = flat(source.first, source.first.shape[-1])
    assert first is not None
    return Source(
        shape, first, flat(source.directions, 3), flat(source.low), flat(source.high), flat(source.masks),
        flat(source.poses, 12), weights=flat(source.weights),
        excluded=flat(source.excluded), groups=flat(source.groups),
    )  # fmt: skip
