"""Kernels of the user: GLSL that asks a scene."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from . import _arrays, _ballot, _query
from ._array import Array
from ._arrays import HIT, RAY
from ._closable import Closable
from ._device import Device, device_or_default
from ._door import InputInfo, Times
from ._scene import Scene

_SCALARS = {"float": np.dtype(np.float32), "int": np.dtype(np.int32), "uint": np.dtype(np.uint32)}
_VECTORS = {"vec": "float", "ivec": "int", "uvec": "uint"}
_RECORDS = {"Ray": 8, "Hit": 4, "Nearest": 8}  # numbers of each


class Kernel(Closable):
    """GLSL of yours that asks a scene, for each index of a run.

    source      the text, or the path of a file (os.PathLike): GLSL 460 for Vulkan with `void main(uint index)`. It may
                call nearest(ray), any(ray), count(ray), closest(point) of the scene, and declares what it works on:
                `readonly buffer Rays { Ray rays[]; };`, without readonly if it writes the array, and
                `uniform float reach;` for a number. shaders/user_kernels.md has the calls and hooks
    name        in messages
    file        the file that the text is from, in messages of the compiler; None: "kernel.glsl", or the path
    first_line  of the text in that file
    numeric     the numeric mode of nearest() and any(): "watertight", "plain" or "fast"
    device      a Device; None: the default one

    Raises ValueError with the compiler's messages, which name file and line, if the text does not compile.

    kernel(scene, count, buffers, ...) calls main() for each index below count, in no order, and returns its Times. The
    scene is as it was committed last, of the same device. The first call with a scene compiles what it needs.

    buffers     the arrays by their names in the text: a ballot.Array, whose bytes are taken as they are and stay on the
                device, or an array that is copied there, and back into it if the text writes it: of float, int, uint
                (n,), also of any shape, of vec3 (n, 3), of Ray (n, 8) or RAY, of Hit (n, 4) or HIT, of Nearest (n, 8),
                of a struct any whose bytes are whole elements. What is only read is converted to float32, int32 or
                uint32; what is written has to be of that dtype
    progress    called with the share done; returning False ends the call with Error (Code.INTERRUPTED)
    **numbers   the numbers by their names: a number, or as many as the vector has

    An index beyond the end of an array reads any number and writes nothing, on lavapipe and on devices with
    VK_EXT_pipeline_robustness; on others, which `ballot info` names, the device may be lost. Calls go in launches of
    about 0.1 s; an invocation that never ends is ended by the system alone, if it is.

    >>> scene = ballot.Scene([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> kernel = ballot.Kernel('''
    ... readonly buffer Points { vec3 points[]; };
    ... buffer Heights { float heights[]; };
    ... uniform float most;
    ... void main(uint index) { heights[index] = nearest(Ray(points[index], 0.0, vec3(0, 0, -1), most)).t; }
    ... ''')
    >>> heights = np.zeros(2, np.float32)
    >>> times = kernel(scene, 2, {"points": [[0, 0, 3], [0, 0, 9]], "heights": heights}, most=5)
    >>> heights.tolist()
    [3.0, inf]
    """

    def __init__(
        self,
        source: str | os.PathLike[str],
        *,
        name: str = "kernel",
        file: str | None = None,
        first_line: int = 1,
        numeric: str = "watertight",
        device: Device | None = None,
    ):
        if not isinstance(source, str):
            if not isinstance(source, os.PathLike):
                raise TypeError(f"source: found {type(source).__name__}; expected the text, or the path of a file")
            path = os.fspath(source)
            with open(path, encoding="utf-8") as text:
                file, source = os.fsdecode(path) if file is None else file, text.read()
        self._handle = _ballot.Kernel(
            device_or_default(device)._handle,
            _query.text(source, "source"),
            _query.text(name, "name"),
            _query.text("kernel.glsl" if file is None else file, "file"),
            _query.integer(first_line, "first_line", 1, 2**31),
            _query.text(numeric, "numeric"),
        )
        self._name = name
        self._inputs = [InputInfo(*one) for one in self._handle.inputs()]
        for one in self._inputs:
            if one.name in ("buffers", "progress") and not one.is_array:
                raise ValueError(f"kernel {name}: number {one.name!r}: the name is an argument's; take another")

    @property
    def inputs(self) -> list[InputInfo]:
        """The arrays and numbers that the text declares, arrays first."""
        return list(self._inputs)

    def __call__(
        self,
        scene: Scene,
        count: int,
        buffers: Mapping[str, Any] | None = None,
        *,
        progress: Callable[[float], object] | None = None,
        **numbers: Any,
    ) -> Times:
        if not isinstance(scene, Scene):
            raise TypeError(f"scene: found {type(scene).__name__}; expected a ballot.Scene")
        given = dict(buffers or {})
        arrays, values = [], {}
        for one in self._inputs:
            what, among = ("array", given) if one.is_array else ("number", numbers)
            if one.name not in among:
                raise TypeError(f"kernel {self._name}: {what} {one.name!r} ({one.type}) is not given")
            value = among.pop(one.name)
            if one.is_array:
                memory = value._handle if isinstance(value, Array) else _bytes(value, one)
                arrays.append((one.name, memory, one.written))
            else:
                values[one.name] = _number(value, one)
        for what, among in (("array", given), ("number", numbers)):
            if among:
                known = ", ".join(one.name for one in self._inputs if one.is_array == (what == "array")) or "none"
                raise TypeError(f"kernel {self._name}: found {what} {next(iter(among))!r}; its text declares {known}")
        times = self._handle.run(
            scene._handle,
            _query.integer(count, "count", 0, 2**32 - 1),
            arrays,
            values,
            _query.progress_function(progress),
        )
        return Times(*times)

    def __repr__(self) -> str:
        state = ", closed" if self.closed else f" of {', '.join(one.name for one in self._inputs) or 'nothing'}"
        return f"<ballot.Kernel {self._name!r}{state}>"


def _layout(kind: str) -> tuple[np.dtype | None, int]:
    """Returns the dtype of a type's numbers and how many it has; None: it is a struct of the text."""
    if kind in _SCALARS:
        return _SCALARS[kind], 1
    if kind in _RECORDS:
        return _SCALARS["float"], _RECORDS[kind]
    vector = re.fullmatch(r"([iu]?vec)([234])", kind)
    return (_SCALARS[_VECTORS[vector[1]]], int(vector[2])) if vector else (None, 0)


def _converted(given: Any, name: str, dtype: np.dtype) -> np.ndarray:
    """Returns numbers that are only read, in a dtype: floats are rounded, integers have to fit."""
    array = _arrays.as_numpy(given, name)
    if array.dtype == dtype:
        return array
    if dtype.kind == "f":
        if array.dtype.kind not in "fiu":
            raise TypeError(f"{name}: dtype is {array.dtype}; expected {dtype}")
        with np.errstate(over="ignore"):
            return array.astype(dtype)
    typed = not isinstance(given, np.ndarray) and array.dtype == np.float64  # numbers that somebody typed
    if array.dtype.kind not in "iub" and not (typed and np.all(array == np.floor(array))):
        raise TypeError(f"{name}: dtype is {array.dtype}; expected {dtype}")
    bounds = np.iinfo(dtype)
    if array.size and not (bounds.min <= array.min() and array.max() <= bounds.max):
        raise ValueError(f"{name}: they reach from {array.min()} to {array.max()}; expected {dtype}")
    return array.astype(dtype)


def _bytes(given: Any, one: InputInfo) -> np.ndarray:
    """Returns the bytes of an array of the host's for an array of a kernel."""
    name = f"buffers[{one.name!r}]"
    dtype, width = _layout(one.type)
    record = {"Ray": RAY, "Hit": HIT}.get(one.type)
    array = _arrays.writable(given, name) if one.written else _arrays.as_numpy(given, name)
    if dtype is not None and (record is None or array.dtype != record):
        if not one.written:
            array = _converted(given, name, dtype)
        elif array.dtype != dtype:
            raise TypeError(f"{name}: dtype is {array.dtype}; the kernel writes {one.type}: expected {dtype}")
        if width > 1 and (array.ndim == 0 or array.shape[-1] != width):
            raise ValueError(f"{name}: shape is {array.shape}; expected (..., {width}) for {one.type}")
    if array.nbytes == 0 or array.nbytes % one.bytes:
        raise ValueError(
            f"{name}: {array.nbytes} bytes; expected some elements of {one.bytes} bytes each, for {one.type}"
        )
    return _arrays.contiguous(array).reshape(-1).view(np.uint8)


def _number(given: Any, one: InputInfo) -> bytes:
    dtype, width = _layout(one.type)
    assert dtype is not None  # the library refuses others
    if isinstance(given, (bool, np.bool_, int, float, np.number)):
        given = [given]
    array = _converted(list(given) if isinstance(given, tuple) else given, one.name, dtype)
    if array.shape != (width,):
        expected = "a number" if width == 1 else f"{width} numbers"
        raise ValueError(f"{one.name}: shape is {array.shape}; expected {expected} for {one.type}")
    return array.tobytes()
