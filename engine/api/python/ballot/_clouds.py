"""Point clouds: structured arrays, and plain structs like those of ROS."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

#: the fields of points, and their types
FIELDS = {
    "x": "<f4", "y": "<f4", "z": "<f4", "range": "<f4", "depth": "<f4", "intensity": "<f4", "time": "<f4",
    "normal_x": "<f4", "normal_y": "<f4", "normal_z": "<f4", "id": "<u4", "instance": "<u4", "prim": "<u4",
    "material": "<u4", "pose": "<u4", "beam": "<u4", "ring": "<u2", "return_number": "u1",
}  # fmt: skip
_SHORT = {"xyz": ("x", "y", "z"), "normal": ("normal_x", "normal_y", "normal_z")}
# ROS's numbers of types, as sensor_msgs/PointField has them
_ROS = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
_NUMPY = {number: name for name, number in _ROS.items()}


def dtype_of(fields: Iterable[str]) -> np.dtype:
    """Returns the type of points with these fields, each at a multiple of its size."""
    names = [fields] if isinstance(fields, str) else list(fields)
    known = [*FIELDS, *_SHORT]
    wrong = next((name for name in names if name not in known), None)
    if wrong is not None or not names:
        found = "none" if not names else repr(wrong)
        raise ValueError(f"fields: found {found}; expected some of {', '.join(known)}")
    all_names = [part for name in names for part in _SHORT.get(name, (name,))]
    twice = next((name for name in all_names if all_names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"fields: found {twice!r} twice; expected each once")
    return np.dtype([(name, FIELDS[name]) for name in all_names], align=True)


@dataclass(frozen=True)
class PointField:
    """A field of points: the members of ROS's sensor_msgs/PointField."""

    name: str  #: its name
    offset: int  #: bytes from the beginning of a point
    datatype: int  #: 1 int8, 2 uint8, 3 int16, 4 uint16, 5 int32, 6 uint32, 7 float32, 8 float64
    count: int = 1  #: how many numbers it has


@dataclass(frozen=True)
class PointCloud2:
    """Points as a plain struct: the members of ROS's sensor_msgs/PointCloud2, but for its header. Needs no ROS: there,
    give its members to a message of the same names.

    >>> points = np.zeros(2, ballot.sensors.point_dtype(("xyz", "ring")))
    >>> cloud = ballot.sensors.PointCloud2.of(points)
    >>> cloud.height, cloud.width, cloud.point_step, [(f.name, f.offset, f.datatype) for f in cloud.fields]
    (1, 2, 16, [('x', 0, 7), ('y', 4, 7), ('z', 8, 7), ('ring', 12, 4)])
    >>> bool((cloud.points() == points).all())
    True
    """

    height: int  #: rows; 1: the points have no order
    width: int  #: points of a row
    fields: tuple[PointField, ...]  #: what a point holds
    is_bigendian: bool  #: False
    point_step: int  #: bytes of a point
    row_step: int  #: bytes of a row
    data: bytes  #: row_step * height of them
    is_dense: bool  #: True: no coordinate is NaN

    @classmethod
    def of(cls, points: Any) -> PointCloud2:
        """Returns points of a structured array (n,) or (height, width), such as of scan(). Copies them. Other axes but
        the last are rows one after the other. Raises TypeError for other arrays, and for fields that ROS has not."""
        if not isinstance(points, np.ndarray) or points.dtype.names is None:
            found = getattr(points, "dtype", type(points).__name__)
            raise TypeError(f"points: found {found}; expected a structured array, as of scan()")
        fields, known = [], points.dtype.fields or {}
        for name in points.dtype.names:
            of, offset = known[name][:2]
            base, shape = of.subdtype or (of, ())
            if base.str[1:] not in _ROS or base.str[0] == ">":
                raise TypeError(f"points: field {name!r} is {base}; expected integers of up to 32 bits, or floats")
            fields.append(PointField(name, int(offset), _ROS[base.str[1:]], int(np.prod(shape, dtype=int))))
        width = points.shape[-1] if points.ndim else 1
        step, height = points.dtype.itemsize, points.size // width if width else 1
        dense = all(bool(np.isfinite(points[n]).all()) for n in "xyz" if n in points.dtype.names)
        return cls(height, width, tuple(fields), False, step, step * width, points.tobytes(), dense)

    def points(self) -> np.ndarray:
        """Returns the points as a structured array (n,), or (height, width) of several rows. It shares the bytes, and
        cannot be written."""
        order = ">" if self.is_bigendian else "<"
        dtype = np.dtype({
            "names": [f.name for f in self.fields],
            "formats": [np.dtype((order + _NUMPY[f.datatype], (f.count,) if f.count > 1 else ())) for f in self.fields],
            "offsets": [f.offset for f in self.fields],
            "itemsize": self.point_step,
        })  # fmt: skip
        flat = np.frombuffer(self.data, dtype, self.height * self.width)
        return flat if self.height == 1 else flat.reshape(self.height, self.width)
