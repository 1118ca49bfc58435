"""Arrays of rays, hits, points and answers that stay on the device."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from . import _arrays, _ballot, _query
from ._arrays import HIT
from ._closable import Closable
from ._device import Device, device_or_default
from ._errors import Error

_CPU, _CUDA = 1, 2
_NO_END = np.finfo(np.float32).max  # a t_max that bounds no ray on the device, where an infinite one is dead
#: of each record its number in the extension, the type of its numbers, and how many there are
_RECORDS: dict[str, tuple[int, type, int]] = {
    "rays": (0, np.float32, 8), "hits": (1, np.float32, 4), "points": (2, np.float32, 4),
    "nearest": (3, np.float32, 8), "vertices": (6, np.float32, 3), "float32": (4, np.float32, 1),
    "float32x2": (7, np.float32, 2), "float32x3": (6, np.float32, 3), "uint32": (5, np.uint32, 1),
    "transforms": (9, np.float32, 12), "uint8": (8, np.uint8, 1), "int64": (10, np.int64, 1),
    "float64": (11, np.float64, 1), "float32x4": (12, np.float32, 4),
    "distances": (4, np.float32, 1), "inside": (5, np.uint32, 1),
}  # fmt: skip


def is_on_device(given: Any) -> bool:
    """Returns whether an array is CUDA's, or a ballot.Array that CUDA can read."""
    return hasattr(given, "__cuda_array_interface__")


def there(given: Any, record: str, device: Device | None) -> Array | None:
    """Returns an Array as it is, and an array of CUDA's as a copy on the device that holds records; None: it is the
    host's."""
    if isinstance(given, Array):
        return given
    if not is_on_device(given):
        return None
    width = _RECORDS[record][2]
    made = Array(record, max(1, math.prod(given.__cuda_array_interface__["shape"]) // width), device, True)
    made.write(given)
    return made


class Array(Closable):
    """An array on a device: questions or answers of Scene.trace(), trace_columns(), occluded() and nearest(), vertices
    and indices of meshes, matrices of Scene.set_transforms(), or masks.

    record    "rays": rows of 8 float32, as Scene.trace() takes them, but with t_max finite; "hits": rows of 4, t, prim
              (its bits), u, v; "points": rows of 4, x, y, z, limit (inf: none); "nearest": rows of 8, x, y, z,
              distance, prim (its bits), u, v, nothing; "vertices": rows of 3, x, y, z; "transforms": rows of 12, a
              3 x 4 matrix row by row. As columns of answers have them: "float32", "uint32", "uint8", "int64" and
              "float64" of shape (count,), "float32x2" (count, 2), and so on to "float32x4"; "distances" is another name
              of "float32", "inside" of "uint32"
    count     number of records, 1 to 2^32 - 1
    device    a Device; None: the default one
    exported  True: other interfaces can use the memory; raises Error if the device cannot export. None: if it can.

    On a GPU of NVIDIA an exported array has __cuda_array_interface__ and __dlpack__, so that CuPy, PyTorch, JAX and
    Warp use it without a copy, with the shape and dtype above. On a CPU device the memory is the host's, and
    np.from_dlpack(array) and numpy() view it. Views keep the memory, so close() frees it once they are gone.

    Synchronisation: calls of ballot wait for the device before they return. Before a call that uses the array, wait for
    your own stream, as by torch.cuda.synchronize().

    >>> rays = ballot.Array("rays", 2)
    >>> rays.write([[0, 0, 5, 0, 0, 0, -1, 100], [9, 9, 5, 0, 0, 0, -1, 100]])
    >>> rays.read().shape
    (2, 8)
    """

    def __init__(self, record: str, count: int, device: Device | None = None, exported: bool | None = None):
        if _query.text(record, "record") not in _RECORDS:
            raise ValueError(f"record is {record!r}; expected one of {', '.join(_RECORDS)}")
        on = device_or_default(device)
        self._record = record
        self._count = _query.integer(count, "count", 1, 2**32 - 1)
        self._exported = on.info.exports if exported is None else bool(exported)
        self._is_cpu = on.info.is_cpu
        self._device = on
        self._handle = _ballot.Array(on._handle, _RECORDS[record][0], self._count, self._exported)

    @property
    def record(self) -> str:
        """What it holds, as it was made: "rays", "hits", ..."""
        return self._record

    @property
    def device(self) -> Device:
        """The device that it is on."""
        return self._device

    @property
    def shape(self) -> tuple[int, ...]:
        """(count, numbers of a record), or (count,) where a record is one number."""
        width = _RECORDS[self._record][2]
        return (self._count, width) if width > 1 else (self._count,)

    @property
    def dtype(self) -> np.dtype:
        """float32, uint32, uint8, int64 or float64."""
        return np.dtype(_RECORDS[self._record][1])

    @property
    def exported(self) -> bool:
        """Whether other interfaces can use the memory."""
        return self._exported

    def __len__(self) -> int:
        return self._count

    def write(self, records: Any, first: int = 0) -> None:
        """Copies records to number `first` on. Rays have 8 numbers, of Scene.trace()'s types; points of 3 numbers have
        no limit. An array of CUDA's (__cuda_array_interface__: torch, cupy, Warp) of this dtype and as many numbers a
        record, contiguous, is copied on the device; its own stream is to be waited for before. uint32 takes the bits of
        int32."""
        width = _RECORDS[self._record][2]
        if is_on_device(records):
            self._write_cuda(records.__cuda_array_interface__, width, first)
            return
        if self._record == "rays":
            array = _arrays.as_rows(records)
        elif self._record == "hits" and getattr(records, "dtype", None) == HIT:
            array = records.view(np.float32).reshape(-1, 4)
        elif self._record == "points":
            array = _limited(_arrays.floats(records, "records", (3, 4)))
        else:
            array = records if width > 1 or self.dtype.kind in "ui" else np.asarray(records)[..., np.newaxis]
        if self.dtype.kind in "ui":
            rows = _whole(array, self.dtype)
        else:
            taken = _arrays.numbers if self.dtype == np.float64 else _arrays.floats
            rows = _arrays.contiguous(taken(array, "records", (width,)).reshape(-1, width), self.dtype)
        if self._record == "rays" and np.isposinf(rows[:, 7]).any():
            rows = np.concatenate([rows[:, :7], np.minimum(rows[:, 7:], _NO_END)], axis=1)
        self._handle.write(rows, _query.integer(first, "first", 0, 2**32))

    def _write_cuda(self, given: dict[str, Any], width: int, first: int) -> None:
        shape, kind = tuple(given["shape"]), np.dtype(given["typestr"])
        numbers = math.prod(shape)
        steps = [math.prod(shape[k + 1 :]) * kind.itemsize for k in range(len(shape))]
        whole = given.get("strides") is None or list(given["strides"]) == steps
        rows = width == 1 or width in (math.prod(shape[1:]), *shape[-1:])
        same = kind == self.dtype or (self.dtype == np.uint32 and kind == np.int32)
        if not same or numbers % width or not rows or not whole:
            expected = f"{self.dtype}, contiguous, (n, {width})" if width > 1 else f"{self.dtype}, contiguous, (n,)"
            raise ValueError(f"records: found {kind} of shape {shape} on CUDA; expected {expected}")
        begin = _query.integer(first, "first", 0, 2**32)
        self._handle.write_cuda(given["data"][0], numbers // width, begin)

    def read(self, out: Any = None, first: int = 0, count: int | None = None) -> np.ndarray:
        """Copies records [first, first + count) to the host: hits as HIT of shape (count,), others in its dtype.

        out  where they go, of that dtype and shape; count None: the rest, or as many as `out` has room for
        """
        begin = _query.integer(first, "first", 0, self._count)
        if count is None:
            count = len(out) if out is not None else self._count - begin
        number = _query.integer(count, "count", 0, self._count - begin)
        dtype, shape = (HIT, (number,)) if self._record == "hits" else (self.dtype, (number, *self.shape[1:]))
        array = _arrays.out_array(out, shape, dtype)
        self._handle.read(_arrays.flat(array).reshape(number, _RECORDS[self._record][2]), begin)
        return array

    def numpy(self) -> np.ndarray:
        """Returns the memory itself, on a device that shares the host's.

        Raises Error on others; read() copies from those.
        """
        view: np.ndarray | None = self._handle.host()
        if view is None:
            raise Error("numpy(): the array is in the GPU's own memory; read() copies it")
        return view

    def fd(self) -> tuple[int, int]:
        """Returns a new file descriptor of the memory (VK_KHR_external_memory_fd, opaque), which the caller owns, and
        the size of the allocation in bytes."""
        descriptor, size = self._handle.fd()
        return int(descriptor), int(size)

    @property
    def cuda_address(self) -> int:
        """The address in CUDA's primary context of the same GPU. Raises Error without CUDA or if it is not exported."""
        return int(self._handle.cuda()[0])

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        if self._is_cpu or not self._exported:
            raise AttributeError("__cuda_array_interface__: the array is not exported, or not on a GPU")
        try:
            address = self.cuda_address
        except Error as error:  # so that hasattr() is False, such as on a GPU of another maker
            raise AttributeError(f"__cuda_array_interface__: {error}") from error
        return {
            "shape": self.shape,
            "typestr": self.dtype.str,
            "data": (address, False),
            "version": 3,
            "strides": None,
            "stream": None,
        }

    def __dlpack_device__(self) -> tuple[int, int]:
        return (_CPU, 0) if self._is_cpu else (_CUDA, self._handle.cuda()[1])

    def __dlpack__(self, **arguments: Any) -> Any:
        if self._is_cpu:
            return self.numpy().__dlpack__(**{k: v for k, v in arguments.items() if v is not None})
        arguments.pop("stream", None)  # nothing is pending on any stream
        return self._handle.cuda_view().__dlpack__(**arguments)

    def __repr__(self) -> str:
        state = ", closed" if self.closed else f", {self.dtype} of shape {self.shape}"
        return f"<ballot.Array of {self._count} {self._record}{state}>"


def _whole(given: Any, dtype: np.dtype) -> np.ndarray:
    """Returns integers or booleans (n,) as (n, 1) of a type."""
    array = _arrays.as_numpy(given, "records")
    if isinstance(given, (list, tuple)):
        array = np.asarray(given)  # numbers that somebody typed
    if array.dtype.kind not in "iub" or array.ndim != 1:
        raise ValueError(f"records: shape is {array.shape}, dtype {array.dtype}; expected (n,) integers or bool")
    most = int(np.iinfo(dtype).max)
    if array.size and not 0 <= int(array.min()) <= int(array.max()) <= most:
        raise ValueError(f"records: found {array.min()} to {array.max()}; expected 0 to {most}")
    return _arrays.contiguous(array, dtype).reshape(-1, 1)


def _limited(points: np.ndarray) -> np.ndarray:
    """Returns points with their limit: (..., 4)."""
    if points.shape[-1] == 4:
        return points
    full = np.full((*points.shape[:-1], 4), np.inf, np.float32)
    full[..., :3] = points
    return full
