"""Cameras: the rays of pixels, from the parameters that calibrations give."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _arrays, _query
from ._patterns import Pattern

_CONVENTIONS = ("opencv", "opengl")
_MOST_PIXELS = 1 << 16  # of a side
_STEPS = 60  # of an iteration, after which it does not converge
_EXACT = 1e-12


class Camera(Pattern):
    """The rays of a camera's pixels, a Pattern of shape (height, width), the top row first. Made by pinhole(),
    orthographic(), fisheye() and panorama().

    Rays go through the middles of pixels; the picture reaches from 0 to width and from 0 to height, so the middle of
    the first pixel is (0.5, 0.5). (Where a calibration has it at (0, 0), as OpenCV does, add 0.5 to cx and cy.) Tables
    are computed in float64 and rounded once.

    convention  "opencv": the camera looks along +z, x to the right, y down; "opengl": along -z, x to the right, y up

    Poses take the camera's frame to the scene's. Raises ValueError for pictures without pixels, a singular K, angles
    out of range, and distortions that cannot be undone.

    >>> scene = ballot.Scene([[-9, -9, 5], [9, -9, 5], [0, 9, 5]], [[0, 1, 2]])
    >>> camera = ballot.Camera.pinhole(64, 48, fov=1)
    >>> scene.trace(camera)["t"][24, 32].item()  # t is the depth
    5.0
    >>> poses = np.tile(np.eye(4), (7, 1, 1))
    >>> scene.trace(camera, poses=poses).shape
    (7, 48, 64)
    """

    @classmethod
    def pinhole(
        cls, width: int, height: int, K: Any = None, *, fov: float | None = None, distortion: Sequence[float] = (),
        convention: str = "opencv", normalized: bool = False,
    ) -> Camera:
        """Returns the rays of a pinhole camera.

        width, height  pixels, at least 1
        K           (3, 3): [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in pixels
        fov         instead of K: the full vertical angle in radians, above 0 and below pi; pixels are square
        distortion  k1, k2, p1, p2, and perhaps k3, and perhaps k4, k5, k6: Brown and Conrady's, in OpenCV's order
        normalized  True: unit directions, t is the range; False: t is the depth along the camera's axis
        """
        x, y = _on_plane(width, height, _intrinsics(width, height, K, fov, np.pi, _pinhole_focal))
        if len(distortion):
            x, y = _undistorted(x, y, _coefficients(distortion, (4, 5, 8)))
        return cls(_table(x, y, np.ones_like(x), convention, normalized))

    @classmethod
    def orthographic(cls, width: int, height: int, size: float, *, convention: str = "opencv") -> Camera:
        """Returns parallel rays of unit length, whose origins lie in the camera's plane.

        size  the height of the picture in scene units; pixels are square
        """
        side = _query.number(size, "size")
        if not 0 < side < np.inf:
            raise ValueError(f"size is {size}; expected a height above 0, in scene units")
        u, v = _pixels(width, height)
        pixel = side / height
        origins = _table((u - width / 2) * pixel, (v - height / 2) * pixel, np.zeros_like(u), convention)
        return cls(_table(np.zeros(()), np.zeros(()), np.ones(()), convention), origins)

    @classmethod
    def fisheye(
        cls, width: int, height: int, K: Any = None, *, fov: float | None = None, distortion: Sequence[float] = (),
        convention: str = "opencv",
    ) -> Camera:
        """Returns the rays of a fisheye lens: unit directions, at an angle to the axis in proportion to the distance
        from the middle (equidistant). Pixels beyond the angle pi have a direction of NaN, whose rays miss.

        K           (3, 3), as of pinhole()
        fov         instead of K: the full vertical angle in radians, above 0 and at most 2 pi
        distortion  k1, k2, k3, k4 of Kannala and Brandt, as OpenCV's fisheye model has them
        """
        k = _intrinsics(width, height, K, fov, np.nextafter(2 * np.pi, 7), _fisheye_focal)
        x, y = _on_plane(width, height, k)
        bent = np.hypot(x, y)
        angle = _straightened(bent, _coefficients(distortion, (4,))) if len(distortion) else bent
        angle = np.where(angle <= np.pi, angle, np.nan)
        along = np.divide(np.sin(angle), bent, out=np.ones_like(bent), where=bent != 0)
        return cls(_table(x * along, y * along, np.cos(angle), convention))

    @classmethod
    def panorama(
        cls, width: int, height: int, *, vertical: tuple[float, float] = (-np.pi / 2, np.pi / 2),
        convention: str = "opencv",
    ) -> Camera:
        """Returns the rays of an equirectangular picture all around: unit directions, the middle column ahead.

        vertical  the elevations of the lower and the upper edge in radians, in [-pi/2, pi/2]
        """
        low, high = (_query.number(angle, "vertical") for angle in vertical)
        if not -np.pi / 2 <= low < high <= np.pi / 2:
            raise ValueError(f"vertical is ({low}, {high}); expected (low, high), -pi/2 to pi/2, in radians")
        u, v = _pixels(width, height)
        around, up = (u / width - 0.5) * 2 * np.pi, high - (high - low) * v / height
        return cls(
            _table(np.sin(around) * np.cos(up), -np.sin(up), np.cos(around) * np.cos(up), convention)
        )


def _pixels(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns the middles of pixels: u and v of (height, width)."""
    w = _query.integer(width, "width", 1, _MOST_PIXELS)
    h = _query.integer(height, "height", 1, _MOST_PIXELS)
    u, v = np.meshgrid(np.arange(w) + 0.5, np.arange(h) + 0.5)
    return u, v


def _table(x: np.ndarray, y: np.ndarray, z: np.ndarray, convention: str, normalized: bool = False) -> np.ndarray:
    """Returns vectors of OpenCV's frame in that of a convention: (..., 3) float32."""
    if convention not in _CONVENTIONS:
        raise ValueError(f"convention is {_query.shown(convention)}; expected one of {', '.join(_CONVENTIONS)}")
    v = np.stack([x, y, z], axis=-1)
    if convention == "opengl":
        v = v * (1, -1, -1)
    if normalized:
        v = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return (v + 0.0).astype(np.float32)  # no zero is negative


def _pinhole_focal(height: int, fov: float) -> float:
    return float(height / 2 / np.tan(fov / 2))


def _fisheye_focal(height: int, fov: float) -> float:
    return height / fov


def _intrinsics(width: int, height: int, K: Any, fov: float | None, end: float, focal: Any) -> np.ndarray:
    """Returns the matrix of a camera. `fov` lies below `end`."""
    if (K is None) == (fov is None):
        found = "neither K nor fov" if K is None else "both K and fov"
        raise TypeError(f"camera: found {found}; expected one of them")
    if fov is not None:
        angle = _query.number(fov, "fov")
        if not 0 < angle < end:
            raise ValueError(f"fov is {fov}; expected an angle above 0 and below {end:.4f}, in radians")
        w, h = _query.integer(width, "width", 1, _MOST_PIXELS), _query.integer(height, "height", 1, _MOST_PIXELS)
        f = focal(h, angle)
        return np.array([[f, 0, w / 2], [0, f, h / 2], [0, 0, 1]])
    k = _arrays.as_numpy(K, "K").astype(np.float64)
    if k.shape != (3, 3):
        raise ValueError(f"K: shape is {k.shape}; expected (3, 3)")
    if not np.isfinite(k).all() or k[1, 0] != 0 or k[2].tolist() != [0, 0, 1]:
        raise ValueError(f"K is {k.tolist()}; expected [[fx, skew, cx], [0, fy, cy], [0, 0, 1]], all finite")
    if k[0, 0] == 0 or k[1, 1] == 0:
        raise ValueError(f"K is singular: fx is {k[0, 0]} and fy {k[1, 1]}; expected numbers other than 0")
    return k


def _on_plane(width: int, height: int, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns where pixels lie on the plane at depth 1."""
    u, v = _pixels(width, height)
    y = (v - k[1, 2]) / k[1, 1]
    return (u - k[0, 2] - k[0, 1] * y) / k[0, 0], y


def _coefficients(given: Sequence[float], lengths: tuple[int, ...]) -> list[float]:
    numbers = [_query.number(k, "distortion") for k in given]
    if len(numbers) not in lengths or not np.isfinite(numbers).all():
        expected = " or ".join(str(n) for n in lengths)
        raise ValueError(f"distortion is {_query.shown(numbers)}; expected {expected} finite numbers")
    return numbers


def _refuse(open_: np.ndarray) -> None:
    """Raises ValueError if some pixels have no ray."""
    if not open_.any():
        return
    row, column = (int(i) for i in np.argwhere(open_)[0])
    raise ValueError(
        f"distortion: it cannot be undone at {int(open_.sum())} pixels, such as row {row}, column {column}; expected "
        "coefficients under which the picture does not fold; make the picture smaller, or check K"
    )


def _undistorted(x_bent: np.ndarray, y_bent: np.ndarray, given: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Undoes Brown and Conrady's distortion by Newton's iteration."""
    k1, k2, p1, p2, k3, k4, k5, k6 = given + [0.0] * (8 - len(given))
    x, y, fine = x_bent.copy(), y_bent.copy(), np.zeros(x_bent.shape, bool)
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            r = x * x + y * y
            above, below = 1 + r * (k1 + r * (k2 + r * k3)), 1 + r * (k4 + r * (k5 + r * k6))
            radial = above / below
            slope = (k1 + r * (2 * k2 + r * 3 * k3) - radial * (k4 + r * (2 * k5 + r * 3 * k6))) / below
            off_x = x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x) - x_bent
            off_y = y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y - y_bent
            xx = radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x
            yy = radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x
            xy = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y
            area = xx * yy - xy * xy
            far = np.maximum(np.abs(off_x), np.abs(off_y)) > _EXACT * np.maximum(1, np.hypot(x_bent, y_bent))
            fine = ~far & (area > 0) & (radial > 0) & (below > 0)
            if not far.any():
                break
            x -= np.where(far, (yy * off_x - xy * off_y) / area, 0)
            y -= np.where(far, (xx * off_y - xy * off_x) / area, 0)
    _refuse(~fine)
    return x, y


def _straightened(bent: np.ndarray, given: list[float]) -> np.ndarray:
    """Undoes Kannala and Brandt's distortion of angles by Newton's iteration."""
    k1, k2, k3, k4 = given
    angle: np.ndarray = np.minimum(bent, np.pi)
    fine = np.zeros(bent.shape, bool)
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            s = angle * angle
            off = angle * (1 + s * (k1 + s * (k2 + s * (k3 + s * k4)))) - bent
            slope = 1 + s * (3 * k1 + s * (5 * k2 + s * (7 * k3 + s * 9 * k4)))
            far = np.abs(off) > _EXACT * np.maximum(1, bent)
            fine = ~far & (slope > 0) & (angle >= 0)
            if not far.any():
                break
            angle = angle - np.where(far, off / slope, 0)
    _refuse(~fine)
    return angle
