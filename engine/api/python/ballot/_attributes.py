"""Attributes of meshes: numbers beside their geometry, which answers tell where they meet it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from . import _arrays, _ballot, _query
from ._array import Array, there
from ._device import Device

_OF = ("vertices", "prims", "mesh")  # in the order of BallotValuesOf
_MOST = 4


class Attribute(NamedTuple):
    """Numbers of a mesh, of its triangles or shapes, or of its vertices, as Scene, add_mesh() and set_attribute() take
    them.

    >>> heat = ballot.Attribute([0, 0, 1], "vertices")
    >>> scene = ballot.Scene([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]], attributes={"heat": heat})
    >>> scene.trace_columns([[1, 2, 5, 0, 0, -1]], ("heat",))["heat"].tolist()
    [0.5]
    """

    #: (n,) or (n, c) float32 or float64, c from 1 to 4; of a mesh one number, or (c,). Any numbers, NaN as well.
    #: float64 is rounded. Or an Array of "float32", "float32x2", ..., or float32 of CUDA's, copied on the device
    values: Any
    #: "vertices", in their order, those of triangles without indices being their corners; "prims": triangles or shapes;
    #: "mesh": the whole
    of: str = "vertices"
    #: of vertices: False: interpolated; True: that of the vertex whose weight is largest
    nearest: bool = False


#: an attribute as the extension takes it: name, number of `of`, components, nearest, values (n, c) or on the device
Passed = tuple[str, int, int, bool, Any]


def _on_device(given: Any, name: str, device: Device | None) -> Array | None:
    """Returns values that lie on the device; None: the host has them."""
    if isinstance(given, Array):
        return given
    interface = getattr(given, "__cuda_array_interface__", None)
    if interface is None:
        return None
    shape = tuple(interface["shape"])
    if len(shape) not in (1, 2) or not 1 <= (*shape, 1)[1] <= _MOST:
        raise ValueError(f"{name}: shape is {shape}; expected (n,) or (n, 1) to (n, {_MOST})")
    width = (*shape, 1)[1]
    return there(given, "float32" if width == 1 else f"float32x{width}", device)


def _on_host(given: Any, name: str, one: bool) -> np.ndarray:
    """Returns (n, c) float32. `one`: a value for all may come without its first axis."""
    array = _arrays.as_numpy(given, name)
    if one and array.ndim < 2:
        array = array.reshape(1, -1)
    elif array.ndim == 1:
        array = array[:, np.newaxis]
    if array.ndim != 2 or not 1 <= array.shape[1] <= _MOST:
        raise ValueError(f"{name}: shape is {array.shape}; expected (n,) or (n, 1) to (n, {_MOST})")
    return _arrays.contiguous(_arrays.floats(array, name, (array.shape[1],)))


def read(name: Any, given: Any, where: str, device: Device | None) -> Passed:
    """Returns an attribute, checked. What is no Attribute is of vertices."""
    text = _query.text(name, f"{where}: name of an attribute")
    values, of, nearest = given if isinstance(given, Attribute) else Attribute(given)
    what = f"{where}, attribute {text!r}"
    if of not in _OF:
        raise ValueError(f"{what}: of is {_query.shown(of)}; expected one of {', '.join(_OF)}")
    on = _on_device(values, what, device)
    array = _on_host(values, what, of == "mesh") if on is None else on
    components = array.shape[1] if len(array.shape) > 1 else 1
    return text, _OF.index(of), components, bool(nearest), array


def read_all(given: Any, where: str, device: Device | None) -> tuple[Passed, ...]:
    """Returns the attributes of a mesh, checked; None: it has none."""
    if given is None:
        return ()
    if not isinstance(given, Mapping):
        raise TypeError(f"{where}: attributes: found {type(given).__name__}; expected a dict, or None")
    return tuple(read(name, values, where, device) for name, values in given.items())


def passed(attribute: Passed) -> tuple[Any, ...]:
    """Returns an attribute as the extension takes it."""
    *words, values = attribute
    return (*words, values._handle if isinstance(values, Array) else values)


def components(handle: _ballot.Scene) -> dict[str, int]:
    """Returns the attributes of a scene's meshes by name, with the numbers of a value."""
    return {name: count for _, name, _, count, _, _ in handle.attributes()}


def columns(
    handle: _ballot.Scene, names: Iterable[str], known: Mapping[str, tuple[type, tuple[int, ...]]]
) -> dict[str, tuple[type, tuple[int, ...]]]:
    """Returns the known columns, and if others are named those of attributes."""
    if all(name in known for name in names):
        return dict(known)
    own = components(handle)
    return {**known, **{name: (np.float32, (count,) if count > 1 else ()) for name, count in own.items()}}
