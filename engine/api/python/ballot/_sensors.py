"""Sensors: patterns of beams with rings, times, limits, width and noise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

from . import _arrays, _clouds, _motion, _query, _scans, _sources
from ._door import HitOptions
from ._patterns import Pattern, frames, lidar
from ._scene import Scene

if TYPE_CHECKING:
    from typing_extensions import Unpack

_MOST_RAYS = 1 << 10
_MOST_RING = 0xFFFF
_GOLDEN = np.pi * (3 - np.sqrt(5))


class Beams(TypedDict, total=False):
    """Options of all sensors, which Sensor tells."""

    near: float
    far: float | None
    divergence: float
    rays: int
    noise: float


class Sensor:
    """A sensor: beams of a Pattern, such as a Camera (a depth camera, a panorama) or ballot.lidar(). spinning(),
    solid_state() and rosette() make usual ones. scan() takes it through a scene.

    pattern     the middles of the beams in the sensor's frame, of shape (beams...). A Camera's frame has its axis along
                +z, a lidar looks along +x with +z up
    rings       whole numbers 0 to 65535 that broadcast to the beams: their channels; None: their rows,
                of beams in one axis 0
    times       seconds after the beginning of a sweep, 0 to `period`, that broadcast to the beams; None: 0
    period      seconds of a sweep; None: the largest of the times
    near, far   the range of a return, along its ray, in scene units: 0 <= near < far; far None: no end
    divergence  the full angle of a beam's cone in radians, 0 to 1
    rays        of each beam, 1 to 1024: the first along its middle, the others as dense everywhere in the cone
    noise       standard deviation of ranges, in scene units

    Raises TypeError and ValueError for patterns without beams and numbers out of range.

    >>> scene = ballot.Scene([[-9, -9, 5], [9, -9, 5], [0, 9, 5]], [[0, 1, 2]])
    >>> camera = ballot.sensors.Sensor(ballot.Camera.pinhole(64, 48, fov=1), far=5.1)
    >>> cloud = camera.scan(scene, fields=("xyz", "depth", "ring"), organized=True)
    >>> cloud.shape, cloud["depth"][24, 32].round(5).item(), bool(np.isnan(cloud["x"][0, 0]))  # the corner is too far
    ((48, 64), 5.0, True)
    """

    #: the middles of the beams
    pattern: Pattern
    #: (beams...) uint16
    rings: np.ndarray
    #: float64, with as many axes as the beams, of which those along which they do not differ have length 1
    times: np.ndarray
    #: seconds
    period: float

    def __init__(
        self, pattern: Pattern, *, rings: Any = None, times: Any = None, period: float | None = None,
        near: float = 0.0, far: float | None = None, divergence: float = 0.0, rays: int = 1, noise: float = 0.0,
    ):
        if not isinstance(pattern, Pattern):
            raise TypeError(f"pattern: found {type(pattern).__name__}; expected a Pattern, such as a Camera")
        if not pattern.shape or 0 in pattern.shape:
            raise ValueError(f"pattern: shape is {pattern.shape}: no beams; expected one axis or more, and some beams")
        self.pattern = pattern
        self.near = _query.finite(near, "near")
        self.far = np.inf if far is None else _query.number(far, "far")
        if not 0 <= self.near < self.far:
            raise ValueError(f"near and far are {near} and {far}; expected 0 <= near < far, in scene units")
        self.divergence = _query.number(divergence, "divergence")
        if not 0 <= self.divergence <= 1:
            raise ValueError(f"divergence is {divergence}; expected a full angle of 0 to 1, in radians")
        self.rays = _query.integer(rays, "rays", 1, _MOST_RAYS)
        self.noise = _query.finite(noise, "noise")
        if self.noise < 0:
            raise ValueError(f"noise is {noise}; expected a standard deviation of at least 0, in scene units")
        self.rings = _rings(rings, pattern.shape)
        self.times = _times(times, len(pattern.shape), pattern.shape)
        latest = float(self.times.max())
        self.period = latest if period is None else _query.finite(period, "period")
        if self.period < latest:
            raise ValueError(f"period is {period}; expected at least {latest}, the largest of the times")

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the beams."""
        return self.pattern.shape

    def directions(self) -> np.ndarray:
        """Returns the directions of the rays in the sensor's frame, those of a beam side by side: (beams..., rays, 3),
        without the axis of length 1 if a beam is one ray. They are as long as those of the pattern."""
        middles = np.broadcast_to(self.pattern.directions, (*self.shape, 3))
        if self.rays == 1:
            return middles
        k = np.arange(self.rays)
        angle = self.divergence / 2 * np.sqrt(k / max(self.rays - 1, 1))
        x, y = np.sin(angle) * np.cos(_GOLDEN * k), np.sin(angle) * np.sin(_GOLDEN * k)
        cone = np.stack([x, y, np.cos(angle)], axis=-1)
        turns = frames(middles.astype(np.float64))[..., :3].astype(np.float64)
        length = np.linalg.norm(middles, axis=-1)[..., np.newaxis, np.newaxis]
        spread: np.ndarray = (np.einsum("...ij,kj->...ki", turns, cone) * length).astype(np.float32)
        spread[..., 0, :] = middles
        return spread

    def scan(
        self, scene: Scene, poses: Any = None, *, until: Any = None, motion: _motion.Motion | None = None,
        returns: int | str = "first", fields: Any = _scans.USUAL, frame: str = "scene", organized: bool = False,
        reflectance: str | None = None, depth: int | None = None, resolution: float = 0.0, seed: int = 0,
        masks: Any = None, **options: Unpack[HitOptions],
    ) -> np.ndarray:
        """Scans a scene from each pose. Returns the points as a structured array.

        poses        (..., 3, 4) or (..., 4, 4): rotations and shifts from the sensor's frame to the scene's; None: the
                     frames are the same. Those of `until`: where the sensor is when a sweep of `period` ends; between
                     them it turns and moves evenly, and each ray starts where it is at its time. None: it stands still
        motion       a Motion of instances during the sweep, the same one for each pose; None: they stand still
        returns      "first", "last", "strongest" of each beam, or 1 to 16: so many, the nearest first
        fields       names of FIELDS; "xyz" and "normal" stand for three
        frame        of x y z and normals: "scene" or "sensor", that of the ray's pose
        organized    True: an entry for each return of each beam, (poses..., beams...), with an axis more of `returns`
                     if that is a number; of returns that are not there floats are NaN and whole numbers ballot.MISS,
                     but for pose, beam, ring, time and return_number. False: those that are there: (n,)
        reflectance  "colors": the luminance of the base colour (Rec.709, linear), or the name of an attribute of one
                     number; 1 for meshes without it; None: 1
        depth        surfaces that a ray is followed through, 1 to 16; None: 1 if a beam has several rays, else as many
                     as there are returns, of "last" all, of "strongest" 16
        resolution   surfaces of a beam that are at most so far behind the first of them, in scene units, are one return
        seed         of the noise
        masks, groups  as Scene.trace(): numbers, or arrays that broadcast to the poses
        options      others of Scene.trace(), such as alpha=True; not first, last, any, excluded and progress

        A ray returns intensity reflectance * abs(cos(i)) from each surface that it is followed to, i being the angle
        between ray and normal; it does not fall with the range. A return of a beam of n rays has 1 / n of the sum over
        its surfaces, and their mean range, weighted by that; what else it tells is of the surface that adds most to it.
        Points lie on the middle of their beams, within about 2^-21 of their distance from the scene's origin.
        The noise is normal; ranges stay at least 0. It depends on seed and arguments alone.

        Raises ValueError for unknown names of fields, attributes and options, counts and poses that cannot be, and what
        Scene.trace_columns() raises. A scene that a motion moved is left as it is at the end of the sweep.
        """
        if not isinstance(scene, Scene):
            raise TypeError(f"scene: found {type(scene).__name__}; expected a ballot.Scene")
        asked = _scans.Asked(returns, fields, frame, organized, reflectance, depth, resolution, seed)
        return _scans.scan(self, scene, asked, poses, until, motion, masks, dict(options))

    def __repr__(self) -> str:
        return f"<ballot.sensors.Sensor of {' x '.join(map(str, self.shape))} beams>"


def _rings(given: Any, shape: tuple[int, ...]) -> np.ndarray:
    if given is None:
        rows = shape[0] if len(shape) > 1 else 1
        if rows > _MOST_RING + 1:
            raise ValueError(f"rings: the pattern has {rows} rows; expected 65536 at most, or rings")
        given = np.arange(rows).reshape(-1, *(1,) * (len(shape) - 1))
    rings = np.asarray(given) if isinstance(given, (list, tuple, int)) else _arrays.as_numpy(given, "rings")
    if rings.dtype.kind not in "iu" or (rings.size and not 0 <= int(rings.min()) <= int(rings.max()) <= _MOST_RING):
        raise ValueError(f"rings: found {rings.dtype}; expected whole numbers from 0 to {_MOST_RING}")
    return _broadcast(rings.astype(np.uint16), shape, "rings")


def _times(given: Any, axes: int, shape: tuple[int, ...]) -> np.ndarray:
    times = np.asarray(0.0 if given is None else _arrays.as_numpy(given, "times"))
    if times.dtype.kind not in "fiu":
        raise TypeError(f"times: dtype is {times.dtype}; expected numbers")
    _broadcast(times, shape, "times")
    times = times.astype(np.float64).reshape(*(1,) * (axes - times.ndim), *times.shape)
    if not (np.isfinite(times).all() and (times >= 0).all()):
        raise ValueError("times: one is negative or not finite; expected seconds after the beginning of a sweep")
    return times


def _broadcast(array: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
    try:
        return np.broadcast_to(array, shape)
    except ValueError:
        raise ValueError(f"{name}: shape is {array.shape}; expected one that broadcasts to {shape}") from None


def spinning(
    elevations: Any, columns: int = 1800, *, offsets: Any = 0.0, period: float = 0.1, **beams: Unpack[Beams],
) -> Sensor:
    """Returns a lidar that turns about +z, from +x towards +y: beams of shape (rings, columns).

    elevations  (rings,) angles above the horizon in radians
    columns     firings of a turn, 1 to 2^20; ring i fires all its beams at the same time
    offsets     (rings,) angles by which rings are ahead, in radians, or one for all
    period      seconds of a turn
    beams       options of Sensor: near, far, divergence, rays, noise

    >>> sensor = ballot.sensors.spinning(np.deg2rad(np.linspace(-25, 15, 64)), 1800, near=0.5, far=100)
    >>> sensor
    <ballot.sensors.Sensor of 64 x 1800 beams>
    """
    n = _query.integer(columns, "columns", 1, 1 << 20)
    e = _angles(elevations, "elevations").reshape(-1, 1)
    ahead = _angles(offsets, "offsets").reshape(-1, 1)
    turn, seconds = np.arange(n) / n, _seconds(period)
    if len(ahead) not in (1, len(e)):
        raise ValueError(f"offsets: found {len(ahead)}; expected one for all, or {len(e)}")
    return Sensor(lidar(e, 2 * np.pi * turn + ahead), times=turn * seconds, period=seconds, **beams)


def solid_state(
    rows: int, columns: int, *, horizontal: float = np.deg2rad(120.0), vertical: float = np.deg2rad(25.0),
    period: float = 0.1, **beams: Unpack[Beams],
) -> Sensor:
    """Returns a lidar without turning parts, which scans a window about +x row by row, the upper row first, each from
    left to right: beams of shape (rows, columns). Angles between neighbours are equal.

    rows, columns         1 to 65536 each
    horizontal, vertical  full angles of the window in radians, above 0; at most 2 pi and pi
    period                seconds of a sweep
    beams                 options of Sensor: near, far, divergence, rays, noise

    >>> ballot.sensors.solid_state(126, 600, far=200).shape
    (126, 600)
    """
    h, w = _query.integer(rows, "rows", 1, 1 << 16), _query.integer(columns, "columns", 1, 1 << 16)
    wide, high = _query.number(horizontal, "horizontal"), _query.number(vertical, "vertical")
    if not (0 < wide <= 2 * np.pi and 0 < high <= np.pi):
        raise ValueError(f"horizontal and vertical are {wide} and {high}; expected (0, 2 pi] and (0, pi], in radians")
    seconds = _seconds(period)
    down, right = (0.5 - (np.arange(h) + 0.5) / h) * high, (0.5 - (np.arange(w) + 0.5) / w) * wide
    times = np.arange(h * w).reshape(h, w) / (h * w) * seconds
    return Sensor(lidar(down, right), times=times, period=seconds, **beams)


def rosette(
    count: int, *, cone: float = np.deg2rad(70.0), turns: tuple[float, float] = (7.0, -4.6), period: float = 0.1,
    **beams: Unpack[Beams],
) -> Sensor:
    """Returns a lidar that bends its beam about +x by two wedges that turn (Risley prisms), each by a quarter of the
    cone's angle: a pattern of petals, of shape (count,).

    count   beams of a sweep, 1 to 2^24
    cone    the full angle of what it sees in radians, above 0 and below pi
    turns   of the first and the second wedge in a sweep; negative ones turn the other way
    period  seconds of a sweep
    beams   options of Sensor: near, far, divergence, rays, noise

    >>> ballot.sensors.rosette(20000, far=200).shape
    (20000,)
    """
    n, angle = _query.integer(count, "count", 1, 1 << 24), _query.number(cone, "cone")
    if not 0 < angle < np.pi:
        raise ValueError(f"cone is {cone}; expected an angle above 0 and below pi, in radians")
    share, seconds = np.arange(n) / n, _seconds(period)
    first, second = (2 * np.pi * _query.finite(t, "turns") * share for t in turns)
    y, z = (angle / 4 * (f(first) + f(second)) for f in (np.cos, np.sin))
    away = np.hypot(y, z)
    bend = np.sinc(away / np.pi)  # sin(away) / away
    directions = np.stack([np.cos(away), bend * y, bend * z], axis=-1).astype(np.float32)
    return Sensor(Pattern(directions), times=share * seconds, period=seconds, **beams)


def _angles(given: Any, name: str) -> np.ndarray:
    array = _arrays.as_numpy(given, name)
    if array.dtype.kind not in "fiu" or array.ndim > 1 or not np.isfinite(array).all():
        raise ValueError(f"{name}: shape is {array.shape}, dtype {array.dtype}; expected (rings,) finite angles")
    return array.astype(np.float64)


def _seconds(given: Any) -> float:
    seconds = _query.finite(given, "period")
    if seconds < 0:
        raise ValueError(f"period is {given}; expected seconds of at least 0")
    return seconds


def point_dtype(fields: Any = _scans.USUAL) -> np.dtype:
    """Returns the dtype of points with fields, as scan() has them. Raises ValueError for unknown names."""
    return _clouds.dtype_of(fields)
