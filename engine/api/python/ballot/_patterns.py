"""Questions by what they share: tables of rays that poses move, and grids of points."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _arrays, _query

_GOLDEN = (np.sqrt(5) - 1) / 2


class Pattern:
    """Rays in a frame of their own, such as those of a camera's pixels or of a turning scanner. Goes where rays go:
    scene.trace(pattern, poses=T) traces them from each of the poses T, (..., 3, 4), and returns hits of shape
    (poses..., pattern...); without poses they are traced as they are.

    directions  (..., 3) float32 or float64, of any length
    origins     (..., 3): their other axes broadcast with those of the directions

    A GPU makes the rays: of camera and poses, no array of rays is made on the host. Raises ValueError if the shapes do
    not fit.

    >>> scene = ballot.Scene([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> pattern = ballot.Pattern([[0, 0, 1], [0, 0.1, 1], [9, 0, 1]])
    >>> back = np.float32([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -5]])
    >>> scene.trace(pattern, poses=[back, back])["t"].tolist()
    [[5.0, 5.0, inf], [5.0, 5.0, inf]]
    """

    #: (..., 3)
    directions: np.ndarray
    #: (..., 3)
    origins: np.ndarray
    #: the shape of the rays
    shape: tuple[int, ...]

    def __init__(self, directions: Any, origins: Any = (0.0, 0.0, 0.0)):
        self.directions = _arrays.numbers(directions, "directions", (3,))
        self.origins = _arrays.numbers(origins, "origins", (3,))
        try:
            self.shape = np.broadcast_shapes(self.directions.shape[:-1], self.origins.shape[:-1])
        except ValueError:
            raise ValueError(
                f"origins and directions: shapes are {self.origins.shape} and {self.directions.shape}; expected axes "
                "before the last that are as long, or 1"
            ) from None

    def __repr__(self) -> str:
        return f"<ballot.{type(self).__name__} of shape {self.shape}>"


class Grid:
    """The points of a grid. Goes where points go; see grid()."""

    #: the axes: (n,) each
    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    #: the lengths of the axes
    shape: tuple[int, int, int]

    def __init__(self, x: Any, y: Any, z: Any):
        self.x, self.y, self.z = _axis(x, "x"), _axis(y, "y"), _axis(z, "z")
        self.shape = (len(self.x), len(self.y), len(self.z))

    def __repr__(self) -> str:
        return f"<ballot.Grid of shape {self.shape}>"


def _axis(given: Any, name: str) -> np.ndarray:
    array = _numbers(given, name)
    if array.ndim != 1:
        raise ValueError(f"{name}: shape is {array.shape}; expected (n,)")
    return array


def _numbers(given: Any, name: str) -> np.ndarray:
    """Returns an array of float32 or float64."""
    array = _arrays.as_numpy(given, name)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: dtype is {array.dtype}; expected numbers")
    return array if array.dtype in _arrays.FLOATS else array.astype(np.float64)


def grid(x: Any, y: Any, z: Any) -> Grid:
    """Returns the points (x[i], y[j], z[k]) of a grid, which no array is made of. Answers have the shape
    (len(x), len(y), len(z)).

    x, y, z  (n,) float32 or float64 each; float64 is rounded to float32

    Raises ValueError if one has other axes, TypeError if it is not of numbers.

    >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> scene.nearest(ballot.grid([0.25], [0.25, 0.5], [1, 2, 3]))["distances"].tolist()
    [[[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]]]
    """
    return Grid(x, y, z)


def lidar(elevations: Any, azimuths: Any) -> Pattern:
    """Returns the rays of a scanner that looks along +x, with +y to its left and +z up: of shape (rings, columns), or
    as the angles broadcast.

    elevations  (rings,) angles above the horizon in radians
    azimuths    (columns,) angles from +x towards +y in radians. If one of the two has other axes they broadcast: each
                ring may have an offset

    Directions have unit length, so t is the range. A scanner that moves while it turns has a pose for each column:
    scene.trace(origins=(0, 0, 0), directions=ballot.lidar(e, a).directions, poses=poses_of_columns).

    >>> ballot.lidar(np.deg2rad([-10, 0, 10]), np.linspace(0, 2 * np.pi, 360, endpoint=False)).shape
    (3, 360)
    """
    e, a = _numbers(elevations, "elevations").astype(np.float64), _numbers(azimuths, "azimuths").astype(np.float64)
    if e.ndim == 1 and a.ndim == 1:
        e = e[:, np.newaxis]
    try:
        e, a = np.broadcast_arrays(e, a)
    except ValueError:
        raise ValueError(
            f"elevations and azimuths: shapes are {e.shape} and {a.shape}; expected axes that are as long, or 1"
        ) from None
    return Pattern(
        np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=-1).astype(np.float32)
    )


def hemisphere(n: int, seed: int = 0) -> Pattern:
    """Returns n unit directions about +z, as dense as the cosine of their angle to it: of shape (n,). The mean of what
    rays along them see is irradiance over pi, or of those that hit nothing the share of the sky.

    n     at least 1
    seed  a whole number: each turns the set about +z by another angle

    A golden-ratio lattice of the square, mapped to the disc and up (Malley's method). With frames() they stand over
    points:

    >>> scene = ballot.Scene([[-9, -9, 2], [9, -9, 2], [0, 9, 2]], [[0, 1, 2]])
    >>> over = ballot.frames([[0, 0, 1], [0, 0, -1]], [[0, 0, 0], [0, 0, 0]])
    >>> dark = scene.occluded(ballot.hemisphere(64), poses=over, t=(1e-4, None)).mean(axis=-1)
    >>> bool(dark[0] > 0.8), float(dark[1])
    (True, 0.0)
    """
    count = _query.integer(n, "n", 1, 2**31)
    turn = _query.integer(seed, "seed", 0, 2**63 - 1) * np.sqrt(2) % 1
    i = np.arange(count)
    u, angle = (i + 0.5) / count, 2 * np.pi * ((i * _GOLDEN + turn) % 1)
    r = np.sqrt(u)
    return Pattern(np.stack([r * np.cos(angle), r * np.sin(angle), np.sqrt(1 - u)], axis=-1).astype(np.float32))


def frames(normals: Any, points: Any = (0.0, 0.0, 0.0)) -> np.ndarray:
    """Returns poses that turn +z to normals and move the origin to points: (..., 3, 4) float32.

    normals  (..., 3), of any length. One of zero, as of a miss, or that is not finite has a pose of NaN, whose rays
             miss
    points   (..., 3); the other axes broadcast with those of the normals

    Source: Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin. Building an Orthonormal Basis, Revisited. JCGT,
    2017.

    >>> ballot.frames([0, 0, 2], [1, 2, 3]).tolist()
    [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 2.0], [0.0, 0.0, 1.0, 3.0]]
    """
    n = _arrays.numbers(normals, "normals", (3,)).astype(np.float64)
    p = _arrays.numbers(points, "points", (3,))
    try:
        shape = np.broadcast_shapes(n.shape, p.shape)
    except ValueError:
        raise ValueError(
            f"normals and points: shapes are {n.shape} and {p.shape}; expected axes before the last that are as long, "
            "or 1"
        ) from None
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        x, y, z = np.moveaxis(n / np.linalg.norm(n, axis=-1, keepdims=True), -1, 0)
        sign = np.copysign(1.0, z)
        a = -1 / (sign + z)
        b = x * y * a
        right = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=-1)
        ahead = np.stack([b, sign + y * y * a, -y], axis=-1)
        axes = np.stack([right, ahead, np.stack([x, y, z], axis=-1)], axis=-1)
        poses = np.empty((*shape[:-1], 3, 4), np.float32)
        poses[..., :3], poses[..., 3] = axes + 0.0, p  # no zero is negative
    return poses
