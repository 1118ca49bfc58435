"""Arrays in and out: checks shape and dtype, and copies only where the library cannot read the memory as it is."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from . import _ballot

#: dtype of a ray, 32 bytes: hits are sought at origin + t * dir, t in [t_min, t_max].
RAY = np.dtype([("origin", "<f4", 3), ("t_min", "<f4"), ("dir", "<f4", 3), ("t_max", "<f4")])
#: dtype of a hit, 16 bytes; Scene.trace() says what it holds.
HIT = np.dtype([("t", "<f4"), ("prim", "<u4"), ("u", "<f4"), ("v", "<f4")])
MISS = 0xFFFFFFFF  #: the number of no triangle, mesh or instance
SHARED = 0xFFFFFFFF  #: the group of instances that rays and points of all groups meet

FLOATS = (np.dtype(np.float32), np.dtype(np.float64))
_DEVICES = {2: "CUDA", 3: "CUDA, pinned", 7: "Vulkan", 8: "Metal", 10: "ROCm", 13: "CUDA, managed", 14: "oneAPI"}


def _check_on_host(given: Any, name: str) -> None:
    kind = given.__dlpack_device__()[0]
    device = int(getattr(kind, "value", kind))  # Open3D 0.20 gives an enumeration that is no integer
    if device != 1:
        raise TypeError(
            f"{name}: the array is on a device of kind {device} ({_DEVICES.get(device, 'unknown')}); expected one in "
            "the host's memory; Scene.trace(), trace_columns(), occluded() and nearest() take a ballot.Array on the GPU"
        )


def _exported(given: Any, name: str, view: Callable[[Any], np.ndarray]) -> tuple[np.ndarray | None, Exception | None]:
    """Returns the array over the memory that `given` offers by DLPack, or None and why it cannot. What it raises for
    another reason goes to the caller."""
    if not (hasattr(given, "__dlpack__") and hasattr(given, "__dlpack_device__")):
        return None, None
    _check_on_host(given, name)
    try:
        capsule = given.__dlpack__()  # here: a cast of the extension would take whatever it raises for a wrong type
    except (TypeError, BufferError, RuntimeError) as error:
        return None, error
    try:
        return view(capsule), None
    except (TypeError, BufferError, RuntimeError):  # such as a tensor of Open3D, which has a version of its own
        return None, None


def _check_interfaces(given: Any, name: str) -> None:
    """Raises what the array interfaces of an object raise, and TypeError for memory of a GPU."""
    if not hasattr(given, "__array_interface__") and hasattr(given, "__cuda_array_interface__"):
        raise TypeError(
            f"{name}: the array is in the memory of a GPU (CUDA); expected one in the host's memory; Scene.trace(), "
            "trace_columns(), occluded() and nearest() take a ballot.Array on the GPU"
        )


def as_numpy(given: Any, name: str) -> np.ndarray:
    """Returns an array of NumPy over the memory of `given` where it has one (NumPy, DLPack, the array protocol, tensors
    with a method numpy()), else a new one (sequences of numbers)."""
    if isinstance(given, np.ndarray):
        return given
    array, failed = _exported(given, name, _ballot.view)
    if array is not None:
        return array
    if callable(getattr(given, "numpy", None)):
        return np.asarray(given.numpy())
    _check_interfaces(given, name)
    try:
        array = np.asarray(given)
    except ValueError as error:
        if not isinstance(given, (list, tuple)):
            raise
        raise ValueError(f"{name}: not an array of numbers: {error}") from None
    if array.dtype == object and failed is not None:
        raise failed
    if array.dtype == object or array.dtype.kind not in "fiub":
        raise TypeError(f"{name}: found {type(given).__name__}; expected an array of float32")
    if isinstance(given, (list, tuple)) and array.dtype.kind == "i":
        array = array.astype(np.float64)  # numbers that somebody typed
    return array


def numbers(given: Any, name: str, widths: tuple[int, ...]) -> np.ndarray:
    """Returns an array of float32 or float64 whose last axis is one of `widths` long. Copies other orders of bytes
    alone."""
    array = as_numpy(given, name)
    if array.dtype not in FLOATS:
        native = array.dtype.newbyteorder("=")
        if native not in FLOATS:
            raise TypeError(f"{name}: dtype is {array.dtype}; expected float32 (float64 is converted)")
        array = array.astype(native)
    if array.ndim == 0 or array.shape[-1] not in widths:
        expected = " or ".join(f"(..., {w})" for w in widths)
        raise ValueError(f"{name}: shape is {array.shape}; expected {expected}")
    return array


def floats(given: Any, name: str, widths: tuple[int, ...]) -> np.ndarray:
    """Returns such an array of float32. Copies float64."""
    array = numbers(given, name, widths)
    with np.errstate(over="ignore"):  # infinity, which is refused where it matters
        return array.astype(np.float32, copy=False)


def contiguous(array: np.ndarray, dtype: Any = None) -> np.ndarray:
    """Returns the array as the library can read it: in C order, at an aligned address, and of `dtype` if that is given.
    Copies only what is not so."""
    return np.require(array, dtype, ["C", "A"])


def rows(array: np.ndarray) -> np.ndarray:
    """Returns an array of float32 as rows that the library can read: two axes, the numbers of a row side by side, rows
    in ascending order. Copies if the strides do not allow it."""
    width = array.shape[-1]
    flat = array.reshape(-1, width)
    step, item = flat.strides
    if (item == 4 or width == 1) and (step >= 4 * width or len(flat) < 2) and step % 4 == 0 and flat.flags.aligned:
        return flat
    return contiguous(flat)


def as_rows(given: Any) -> Any:
    """Returns rays of dtype RAY as rows of 8 numbers, and others as they are."""
    if isinstance(given, (np.ndarray, np.void)) and given.dtype == RAY:
        return np.asarray(given)[..., np.newaxis].view(np.float32)
    return given


def _offered(out: Any, name: str) -> np.ndarray:
    """Returns the array over the memory that an object offers for results."""
    array, failed = _exported(out, name, _ballot.view_writable)
    if failed is not None:
        raise failed
    if array is not None:
        return array
    _check_interfaces(out, name)
    try:
        return np.asarray(memoryview(out))
    except (TypeError, BufferError):
        raise TypeError(
            f"{name}: found {type(out).__name__}; expected an array of NumPy or DLPack that can be written"
        ) from None


def writable(out: Any, name: str) -> np.ndarray:
    """Returns the array that an object is or offers, which can be written as it lies."""
    array: np.ndarray = out if isinstance(out, np.ndarray) else _offered(out, name)
    if not array.flags.writeable:
        raise ValueError(f"{name}: the array is read-only; expected one that can be written")
    if not array.flags.c_contiguous or not array.flags.aligned:
        raise ValueError(f"{name}: strides are {array.strides}; expected a contiguous array (C order)")
    return array


_LARGE = 1 << 20  # bytes of results whose memory is kept for the next ones


def empty(shape: tuple[int, ...], dtype: Any) -> np.ndarray:
    """Returns a new array for results, with any content."""
    dtype = np.dtype(dtype)
    size = math.prod(shape) * dtype.itemsize
    if size < _LARGE:
        return np.empty(shape, dtype)
    array: np.ndarray = _ballot.result_bytes(size).view(dtype)
    return array.reshape(shape)


def out_array(
    out: Any, shape: tuple[int, ...], dtype: np.dtype, sources: Sequence[np.ndarray | None] = (), name: str = "out"
) -> np.ndarray:
    """Returns the array that results of this shape and dtype go to: a new one, or `out` once it has been checked. It
    must not overlap the sources."""
    if out is None:
        return empty(shape, dtype)
    array = writable(out, name)
    if dtype == HIT and array.dtype == np.float32 and array.shape == (*shape, 4):
        array = array.view(HIT).reshape(shape)
    if dtype == np.bool_ and array.dtype == np.uint8:
        array = array.view(np.bool_)
    if array.dtype != dtype:
        also = " or float32 of shape (..., 4)" if dtype == HIT else ""
        raise TypeError(f"{name}: dtype is {array.dtype}; expected {_text(dtype)}{also}")
    if array.shape != shape:
        raise ValueError(f"{name}: shape is {array.shape}; expected {shape}, that of the rays")
    if any(source is not None and np.may_share_memory(array, source) for source in sources):
        raise ValueError(f"{name}: it overlaps the rays; expected memory of its own")
    return array


def columns(
    names: Any, known: dict[str, tuple[Any, tuple[int, ...]]], shape: tuple[int, ...],
    sources: Sequence[np.ndarray | None], out: Any,
) -> dict[str, np.ndarray]:
    """Returns an array for each column that is asked for: a new one, or that of `out`. `known` has the dtype and the
    shape of an entry by name; `shape` is that of the questions, which lie in `sources`."""
    given = dict(out or {})
    arrays = {}
    for name in names:
        if name not in known:
            raise ValueError(f"columns: found {name!r}; expected some of {', '.join(known)}")
        dtype, entry = known[name]
        arrays[name] = out_array(given.pop(name, None), (*shape, *entry), np.dtype(dtype), sources, f"out[{name!r}]")
    if given:
        raise ValueError(f"out: it has {next(iter(given))!r}, which is not among the columns")
    return arrays


def _text(dtype: np.dtype) -> str:
    return "ballot.HIT" if dtype == HIT else str(dtype)


def flat(array: np.ndarray) -> np.ndarray:
    """Returns the numbers of a result array in one axis, in a type that the library writes."""
    array = array.reshape(-1)
    if array.dtype == HIT:
        return array.view(np.float32)
    return array.view(np.uint8) if array.dtype == np.bool_ else array


def indices(given: Any, name: str, each: int = 3, what: str = "triangles") -> np.ndarray:
    """Returns triangles, or what else has `each` corners, as flat uint16 or uint32.

    Copies other integers, and arrays that are not contiguous."""
    array = as_numpy(given, name)
    if isinstance(given, (list, tuple)) and array.dtype == np.float64 and np.all(array == np.floor(array)):
        array = array.astype(np.int64)
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name}: dtype is {array.dtype}; expected uint32, uint16 or another type of integers")
    if array.ndim != 2 or array.shape[1] != each:
        raise ValueError(f"{name}: shape is {array.shape}; expected (m, {each})")
    if array.shape[0] == 0:
        raise ValueError(f"{name}: no {what}; leave empty meshes out")
    if array.dtype not in (np.uint16, np.uint32) or not array.dtype.isnative:
        low, high = int(array.min()), int(array.max())
        if low < 0 or high > 0xFFFFFFFF:
            raise ValueError(f"{name}: they hold the index {low if low < 0 else high}; expected 0 to 2^32 - 1")
        array = array.astype(np.uint32)
    return contiguous(array).reshape(-1)
