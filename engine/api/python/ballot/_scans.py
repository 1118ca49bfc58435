"""Scans: what the beams of a sensor bring back from a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import _clouds, _echoes, _motion, _query

if TYPE_CHECKING:
    from ._scene import Scene
    from ._sensors import Sensor

USUAL = ("x", "y", "z", "range", "intensity", "ring", "time", "id")  # fields, unless others are asked for
_MOST = 16  # returns, and surfaces of a ray
_BATCH = 1 << 21  # surfaces that are looked at at a time, about
_WORDS = {"id": "mesh_ids", "instance": "instances", "prim": "prims", "material": "materials"}  # columns of fields
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # Rec.709
_REFUSED = ("first", "last", "any", "excluded", "progress")


class Asked(NamedTuple):
    """Arguments of Sensor.scan(), not checked."""

    returns: Any
    fields: Any
    frame: Any
    organized: Any
    reflectance: Any
    depth: Any
    resolution: Any
    seed: Any


class _Plan(NamedTuple):
    """What a scan does."""

    dtype: np.dtype  # of points
    several: bool  # returns are an axis
    echoes: _echoes.Plan
    in_scene: bool  # the frame of points
    organized: bool
    reflectance: str | None
    seed: int
    columns: tuple[str, ...]
    options: dict[str, Any]  # of the trace
    each: int  # hits of a ray


class _Rays(NamedTuple):
    """Rays of beams of some shape, with an axis more if a beam has several."""

    directions: np.ndarray  # (beams..., [rays], 3)
    origins: np.ndarray  # (3,), or as directions with rays 1
    lengths: np.ndarray  # (beams..., [rays]), or (): all are 1
    times: np.ndarray  # shares of the sweep, which broadcast to the beams

    def some(self, which: np.ndarray, beams: tuple[int, ...]) -> _Rays:
        """Returns those of the beams that are named, in one axis."""

        def of(array: np.ndarray) -> np.ndarray:
            found: np.ndarray = array.reshape(-1, *array.shape[len(beams) :])[which]
            return found

        origins = of(self.origins) if self.origins.ndim > 1 else self.origins
        lengths = of(self.lengths) if self.lengths.ndim else self.lengths
        return _Rays(of(self.directions), origins, lengths, np.broadcast_to(self.times, beams).reshape(-1)[which])


def scan(
    sensor: Sensor, scene: Scene, asked: Asked, poses: Any, until: Any, motion: _motion.Motion | None,
    masks: Any, options: dict[str, Any],
) -> np.ndarray:
    """Does what Sensor.scan() says."""
    given = {"masks": masks, "groups": options.pop("groups", None)}
    plan, slices = _plan(sensor, asked, options), _motion.slices_of(motion)
    first, last, outer = _places(poses, until)
    words = {name: _of_poses(w, name, outer) for name, w in given.items() if w is not None}
    rays, random = _rays(sensor), np.random.default_rng(plan.seed)
    count = int(np.prod(sensor.shape))
    step, parts = max(1, _BATCH // (count * plan.echoes.surfaces)), []
    for a in range(0, len(first), step):
        at = slice(a, a + step)
        look = _Look(sensor, scene, plan, rays, first[at], None if last is None else last[at])
        beside = {name: w[at] for name, w in words.items()}
        found = look.met(beside) if motion is None else look.met_moving(motion, slices, beside)
        parts.append(look.points(found, a, random))
    inner = (plan.echoes.number,) if plan.several else ()
    if not parts:
        return np.empty((*outer, *sensor.shape, *inner) if plan.organized else 0, plan.dtype)
    whole = parts[0] if len(parts) == 1 else np.concatenate(parts)
    return whole.reshape(*outer, *sensor.shape, *inner) if plan.organized else whole


class _Look:
    """A part of the poses, and what is seen from there."""

    def __init__(
        self, sensor: Sensor, scene: Scene, plan: _Plan, rays: _Rays, first: np.ndarray, last: np.ndarray | None
    ):
        self._sensor, self._scene, self._plan, self._rays = sensor, scene, plan, rays
        self._first, self._last = first, last

    def met(self, beside: dict[str, Any]) -> dict[str, np.ndarray]:
        """Returns columns of what all rays meet: (poses, beams, surfaces of a beam, ...)."""
        return self._traced(self._rays, beside)

    def met_moving(self, motion: _motion.Motion, slices: int, beside: dict[str, Any]) -> dict[str, np.ndarray]:
        """Returns the same of a scene whose instances move."""
        beams, whole = self._sensor.shape, np.broadcast_to(self._rays.times, self._sensor.shape).reshape(-1)
        numbers = None if motion.instances is None else np.atleast_1d(np.asarray(motion.instances))
        stops = np.append((np.arange(slices) + 0.5) / slices, 1)
        *stations, end = _motion.places(motion, stops)
        found: dict[str, np.ndarray] = {}
        slot = np.minimum((whole * slices).astype(np.int64), slices - 1)
        try:
            for k, station in enumerate(stations):
                which = np.flatnonzero(slot == k)
                if not len(which):
                    continue
                self._scene.set_transforms(station, numbers)
                self._scene.commit()
                for name, part in self._traced(self._rays.some(which, beams), beside).items():
                    if name not in found:
                        found[name] = np.empty((part.shape[0], len(whole), *part.shape[2:]), part.dtype)
                    found[name][:, which] = part
        finally:
            self._scene.set_transforms(end, numbers)
            self._scene.commit()
        return found

    def _traced(self, rays: _Rays, beside: dict[str, Any]) -> dict[str, np.ndarray]:
        several = self._sensor.rays > 1
        beams = rays.directions.shape[: -2 if several else -1]
        poses = self._poses(rays.times, len(beams))
        if several:
            poses = poses[..., np.newaxis, :, :]
        inner = (1,) * (len(beams) + several)
        words = {name: w.reshape(-1, *inner) for name, w in beside.items()}
        limits = self._limits(rays)
        columns = self._scene.trace_columns(
            origins=rays.origins, directions=rays.directions, poses=poses, t=limits, **words,
            columns=self._plan.columns, **self._plan.options,
        )  # fmt: skip
        shape = (len(self._first), int(np.prod(beams)), self._sensor.rays, self._plan.each)
        axes = 1 + len(inner) + (_query.hits_of_each(self._plan.options) > 0)
        found = {name: c.reshape(*shape, *c.shape[axes:]) for name, c in columns.items()}
        return self._with_energy(found, rays, poses)

    def _with_energy(
        self, found: dict[str, np.ndarray], rays: _Rays, poses: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Returns columns of surfaces of beams, with "ranges", and "energy" if that is needed."""
        t = found.pop("t")
        if rays.lengths.ndim:
            t = t * rays.lengths.reshape(1, -1, self._sensor.rays, 1)
        shape = (*t.shape[:2], -1)
        if self._plan.echoes.weighed:
            ahead = _turned(poses, rays.directions).reshape(*t.shape[:1], *t.shape[1:3], 1, 3)
            normals = found["normals"]
            cosine = sum(normals[..., k] * ahead[..., k] for k in range(3))
            energy = np.abs(cosine)
            if rays.lengths.ndim:
                energy /= rays.lengths.reshape(1, -1, self._sensor.rays, 1)
            np.minimum(energy, 1, out=energy)
            if self._plan.reflectance is not None:
                energy *= _reflectance(self._plan.reflectance, found.pop(self._plan.reflectance))
            found["energy"] = energy
        if "normals" in found and not self._plan.in_scene:
            back = np.swapaxes(poses[..., :3], -1, -2).astype(np.float32)
            back = np.broadcast_to(back, (*poses.shape[:1], *rays.directions.shape[:-1], 3, 3))
            found["normals"] = np.einsum("...ij,...kj->...ki", back.reshape(*t.shape[:3], 3, 3), found["normals"])
        found["ranges"] = t
        return {name: c.reshape(*shape, *c.shape[4:]) for name, c in found.items()}

    def _poses(self, shares: np.ndarray, axes: int) -> np.ndarray:
        """Returns the poses of beams at shares of the sweep: (poses, ..., 3, 4), axes that broadcast to the beams."""
        if self._last is None:
            return self._first.reshape(-1, *(1,) * axes, 3, 4)
        return _motion.between(self._first, self._last, shares, "poses")

    def _limits(self, rays: _Rays) -> tuple[Any, Any]:
        near, far = self._sensor.near, self._sensor.far
        if not rays.lengths.ndim:
            return near, far
        with np.errstate(divide="ignore", invalid="ignore"):
            low, high = (np.asarray(end / rays.lengths, np.float32)[np.newaxis] for end in (near, far))
        return low, high

    def points(self, found: dict[str, np.ndarray], first_pose: int, random: np.random.Generator) -> np.ndarray:
        """Returns the points of what was met, in one axis."""
        plan, sensor = self._plan, self._sensor
        ranges, energy, which = _echoes.of_beams(found["ranges"], found.get("energy"), plan.echoes)
        if sensor.noise:
            away = random.standard_normal(ranges.shape, np.float32) * np.float32(sensor.noise)
            ranges = np.maximum(ranges + away, 0)
        at = np.arange(ranges.size) if plan.organized else np.flatnonzero(np.isfinite(ranges))
        r, beam = ranges.reshape(-1)[at], at // plan.echoes.number
        points = np.empty(len(at), plan.dtype)
        names = set(plan.dtype.names or ())
        there = np.isfinite(r) if plan.organized else None
        r = r if there is None else np.where(there, r, np.float32(np.nan))

        def put(name: str, values: np.ndarray) -> None:
            none: Any = np.nan if points[name].dtype.kind == "f" else np.iinfo(points[name].dtype).max
            points[name] = values if there is None else np.where(there, values, none)

        surface = beam * found["ranges"].shape[2] + (which.reshape(-1)[at] if which is not None else at % plan.each)
        if names & {"x", "y", "z"}:
            origins, ahead = self._middles()
            for k, name in enumerate("xyz"):
                if name in names:
                    put(name, origins[..., k].reshape(-1)[beam] + ahead[..., k].reshape(-1)[beam] * r)
        for k, name in enumerate(("normal_x", "normal_y", "normal_z")):
            if name in names:
                put(name, found["normals"][..., k].reshape(-1)[surface])
        for name in names & set(_WORDS):
            put(name, found[_WORDS[name]].reshape(-1)[surface])
        if "intensity" in names and energy is not None:
            put("intensity", energy.reshape(-1)[at] / np.float32(sensor.rays))
        if "range" in names:
            put("range", r)
        one = beam % ranges.shape[1]
        if "depth" in names:
            lengths = np.linalg.norm(sensor.pattern.directions.astype(np.float64), axis=-1)
            put("depth", r / np.broadcast_to(lengths, sensor.shape).reshape(-1)[one])
        for name, values in (("ring", sensor.rings), ("time", np.broadcast_to(sensor.times, sensor.shape))):
            if name in names:
                points[name] = values.reshape(-1)[one]
        for name, numbers in (("beam", one), ("pose", beam // ranges.shape[1] + first_pose),
                              ("return_number", at % plan.echoes.number + 1)):  # fmt: skip
            if name in names:
                points[name] = numbers
        return points

    def _middles(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns where the middles of beams begin and their unit directions, in the frame of points: (poses, beams, 3)
        float32 each."""
        pattern, beams = self._sensor.pattern, self._sensor.shape
        ahead = np.broadcast_to(pattern.directions, (*beams, 3)).astype(np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            ahead = (ahead / np.linalg.norm(ahead, axis=-1, keepdims=True)).astype(np.float32)
        poses = self._poses(self._rays.times, len(beams))
        if not self._plan.in_scene:
            poses = np.broadcast_to(np.eye(3, 4), poses.shape)
        shape = (len(self._first), *beams, 3)
        origins = _turned(poses, np.broadcast_to(pattern.origins, (*beams, 3))) if pattern.origins.any() else 0.0
        begin = np.broadcast_to((origins + poses[..., 3]).astype(np.float32), shape)
        return begin.reshape(len(self._first), -1, 3), _turned(poses, ahead).reshape(len(self._first), -1, 3)


def _turned(poses: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Returns vectors (beams..., 3) turned by poses (p, ..., 3, 4), whose axes broadcast: (p, beams..., 3) float32."""
    turn = poses[..., :3].astype(np.float32)
    if turn.size == 9 * len(turn):
        across = np.ascontiguousarray(np.swapaxes(turn.reshape(-1, 3, 3), -1, -2))  # matrices that BLAS takes
        flat = vectors.reshape(-1, 3).astype(np.float32) @ across
        return flat.reshape(len(turn), *vectors.shape)
    moved: np.ndarray = np.einsum("...ij,...j->...i", turn, vectors.astype(np.float32))
    return moved


def _reflectance(name: str, column: np.ndarray) -> np.ndarray:
    """Returns shares of energy that surfaces return, of colours or of an attribute."""
    if column.ndim == 5:
        if name != "colors":
            raise ValueError(f"reflectance: attribute {name!r} has {column.shape[-1]} numbers; expected one")
        light: np.ndarray = column[..., :3] @ _LUMINANCE
        return light
    return np.where(np.isnan(column), np.float32(1), column)


def _rays(sensor: Sensor) -> _Rays:
    directions, origins = sensor.directions(), sensor.pattern.origins
    if origins.ndim > 1:
        origins = np.broadcast_to(origins, (*sensor.shape, 3))
        origins = origins[..., np.newaxis, :] if sensor.rays > 1 else origins
    lengths = np.linalg.norm(directions.astype(np.float64), axis=-1)
    if bool((np.abs(lengths - 1) < 2e-7).all()):
        lengths = np.ones(())
    shares = sensor.times / sensor.period if sensor.period else sensor.times
    return _Rays(directions, origins, lengths.astype(np.float32), shares)


def _places(poses: Any, until: Any) -> tuple[np.ndarray, np.ndarray | None, tuple[int, ...]]:
    """Returns the first and the last poses (p, 3, 4) float64, and the axes of the poses."""
    if poses is None and until is not None:
        raise TypeError("poses: found None beside until; expected both")
    first = np.eye(3, 4) if poses is None else _motion.matrices(poses, "poses")
    _motion.check_rigid(first, "poses")
    if until is None:
        return first.reshape(-1, 3, 4), None, first.shape[:-2]
    last = _motion.matrices(until, "until")
    _motion.check_rigid(last, "until")
    if last.shape != first.shape:
        raise ValueError(f"until: shape is {last.shape}; expected {first.shape}, that of poses")
    return first.reshape(-1, 3, 4), last.reshape(-1, 3, 4), first.shape[:-2]


def _of_poses(given: Any, name: str, outer: tuple[int, ...]) -> np.ndarray:
    try:
        return np.broadcast_to(np.asarray(given), outer).reshape(-1)
    except ValueError:
        raise ValueError(f"{name}: shape is {np.shape(given)}; expected a number, or one for each pose") from None


def _plan(sensor: Sensor, asked: Asked, options: dict[str, Any]) -> _Plan:
    for name in _REFUSED:
        if options.get(name) is not None:
            raise TypeError(f"{name}: found an argument that scans do not take; expected returns to say how many")
    dtype = _clouds.dtype_of(asked.fields)
    names, kind = set(dtype.names or ()), asked.returns
    if isinstance(kind, str):
        if kind not in _echoes.KINDS:
            raise ValueError(f"returns is {kind!r}; expected {', '.join(_echoes.KINDS)}, or 1 to {_MOST}")
        count, several = 1, False
    else:
        count, several, kind = _query.integer(kind, "returns", 1, _MOST), True, "first"
    width = _query.finite(asked.resolution, "resolution")
    if width < 0:
        raise ValueError(f"resolution is {asked.resolution}; expected at least 0, in scene units")
    if asked.frame not in ("scene", "sensor"):
        raise ValueError(f"frame is {_query.shown(asked.frame)}; expected scene or sensor")
    last = kind == "last" and asked.depth is None and sensor.rays == 1 and not width
    if asked.depth is None:
        each = 1 if sensor.rays > 1 or last else _MOST if kind != "first" else count
    else:
        each = _query.integer(asked.depth, "depth", 1, _MOST)
    merged = sensor.rays > 1 or width > 0 or each != count
    weighed = "intensity" in names or merged
    reflectance = None if asked.reflectance is None else _query.text(asked.reflectance, "reflectance")
    columns = ["t", *sorted(_WORDS[n] for n in names & set(_WORDS))]
    if weighed or names & {"normal_x", "normal_y", "normal_z"}:
        columns.append("normals")
    if weighed and reflectance is not None:
        columns.append(reflectance)
    found = {"last": 1} if last else {"first": each} if each > 1 else {}
    return _Plan(
        dtype, several, _echoes.Plan(kind, count, width, weighed, merged, each * sensor.rays), asked.frame == "scene",
        bool(asked.organized), reflectance if weighed else None, _query.integer(asked.seed, "seed", 0, 2**63 - 1),
        tuple(columns), {**options, **found}, each,
    )  # fmt: skip
