"""Poses between two: of sensors that move while they sweep, and of instances that do."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import _query, _sources

_RIGID = 1e-3  # by how much the squares of a rotation's axes may differ from 1
_MOST_SLICES = 1 << 12


class Motion(NamedTuple):
    """Instances that move and turn evenly while a sensor sweeps: Sensor.scan(motion=...). The sweep is cut into slices
    of equal time. The rays of each meet the instances where they are in its middle, by one commit a slice. So an
    instance is met at most 1 / (2 slices) of its motion away from where it was. After the scan they are at the end."""

    #: their numbers: one, or (k,) integers; None: all
    instances: Any
    #: (k, 3, 4) or (k, 4, 4): their matrices when the sweep begins; of one instance its matrix
    start: Any
    #: as start: when it ends. From one to the other is a rotation of less than half a turn, and a shift
    end: Any
    #: 1 to 4096
    slices: int = 16


def matrices(given: Any, name: str) -> np.ndarray:
    """Returns poses as (..., 3, 4) float64."""
    flat = _sources.matrices(given, name).astype(np.float64)
    return flat.reshape(*flat.shape[:-1], 3, 4)


def check_rigid(poses: np.ndarray, name: str) -> None:
    """Raises ValueError if a finite matrix of poses (..., 3, 4) is no rotation and shift."""
    turn = poses[..., :3]
    with np.errstate(all="ignore"):
        off = np.abs(np.swapaxes(turn, -1, -2) @ turn - np.eye(3)).max(axis=(-1, -2))
        wrong = (off > _RIGID) | (np.linalg.det(turn) < 0)
    if wrong.any():
        at = tuple(int(i) for i in np.argwhere(wrong)[0])
        raise ValueError(f"{name}: matrix {list(at)} scales, shears or mirrors; expected a rotation and a shift")


def between(start: np.ndarray, end: np.ndarray, shares: np.ndarray, name: str) -> np.ndarray:
    """Returns the matrices at shares of the way from start to end, (..., 3, 4) each: (..., shares..., 3, 4) float64.
    The rotation between them turns evenly about one axis, the last column moves on a straight line."""
    if start.shape != end.shape:
        raise ValueError(f"{name}: shapes are {start.shape} and {end.shape}; expected the same number of matrices")
    with np.errstate(all="ignore"):
        flat = np.linalg.det(start[..., :3]) == 0
    if flat.any():
        raise ValueError(f"{name}: a matrix of start cannot be inverted; expected others")
    turn = end[..., :3] @ np.linalg.inv(start[..., :3])
    check_rigid(np.concatenate([turn, np.zeros((*turn.shape[:-1], 1))], axis=-1), f"{name}: from start to end")
    x, y, z = (turn[..., 2, 1] - turn[..., 1, 2], turn[..., 0, 2] - turn[..., 2, 0], turn[..., 1, 0] - turn[..., 0, 1])
    sine, cosine = np.sqrt(x * x + y * y + z * z) / 2, (np.trace(turn, axis1=-2, axis2=-1) - 1) / 2
    if ((cosine < 0) & (sine < 1e-3)).any():
        raise ValueError(f"{name}: from start to end is half a turn; expected less: whose axis can be told")
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    cross = cross / np.maximum(2 * sine, 1e-300)[..., np.newaxis, np.newaxis]
    within = (*(1,) * shares.ndim, 3, 3)
    cross, first = (a.reshape(*start.shape[:-2], *within) for a in (cross, start[..., :3]))
    angle = np.multiply.outer(np.arctan2(sine, cosine), shares)[..., np.newaxis, np.newaxis]
    turned = (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)) @ first
    a, b = (m[..., 3].reshape(*start.shape[:-2], *within[:-1]) for m in (start, end))
    moved = a + (b - a) * shares[..., np.newaxis]
    return np.concatenate([turned, moved[..., np.newaxis]], axis=-1)


def slices_of(motion: Any) -> int:
    """Returns the number of slices of a motion, which is checked; None: 1."""
    if motion is None:
        return 1
    if not isinstance(motion, Motion):
        raise TypeError(f"motion: found {type(motion).__name__}; expected a ballot.sensors.Motion, or None")
    return _query.integer(motion.slices, "motion: slices", 1, _MOST_SLICES)


def places(motion: Motion, shares: np.ndarray) -> np.ndarray:
    """Returns where instances are at shares (s,) of the sweep: (s, k, 3, 4)."""
    start, end = (matrices(m, f"motion: {n}") for m, n in ((motion.start, "start"), (motion.end, "end")))
    return np.moveaxis(between(start.reshape(-1, 3, 4), end.reshape(-1, 3, 4), shares, "motion"), -3, 0)
