"""Measures methods on a scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _query
from ._array import Array
from ._door import Times
from ._scene import Scene


def bench(
    scene: Scene,
    methods: Sequence[str] = ("auto",),
    kinds: Sequence[str] = ("primary",),
    numeric: str | Sequence[str] = "watertight",
    size: tuple[int, int] = (512, 512),
    repeats: int = 5,
    *,
    view: Any = None,
    knobs: Mapping[str, Any] | None = None,
) -> list[dict[str, Any]]:
    """Measures each method with each kind of rays and numeric mode, and returns a record for each.

    methods  as Scene.trace()
    kinds    kinds of rays, as Scene.make_rays(); shadow and ao are traced for any hit
    numeric  a numeric mode or several
    size     width and height of the view
    repeats  measurements of each; they take turns, so that all of them meet the same load of the machine
    view     as render()
    knobs    settings of every method

    A record holds method, kind, numeric, any, rays, repeats, device_ms (the median of the times of the traversal on the
    device; copies are not in it), spread (largest less smallest time, over the median) and mrays, 10^6 rays a second. A
    first, unmeasured trace of each compiles its kernel.
    """
    if not isinstance(scene, Scene):
        raise TypeError(f"scene: found {type(scene).__name__}; expected a ballot.Scene")
    number = _query.integer(repeats, "repeats", 1, 10**6)
    modes = [numeric] if isinstance(numeric, str) else list(numeric)
    runs = [
        _Run(rays, hits, {"method": method, "kind": kind, "numeric": mode, "any": any_hit})
        for kind, any_hit, rays, hits in _batches(scene, kinds, view, size)
        for mode in modes
        for method in methods
    ]
    for turn in range(number + 1):
        for run in runs:
            ms = run.measure(scene, knobs)
            if turn:
                run.times.append(ms)
    return [run.record() for run in runs]


_ANY_HIT = ("shadow", "ao")


def _batches(
    scene: Scene, kinds: Sequence[str], view: Any, size: tuple[int, int]
) -> list[tuple[str, bool, Array, Array]]:
    batches = []
    for kind in kinds:
        made = scene.make_rays(view, kind, *size)
        if len(made) == 0:
            raise ValueError(f"kinds: the view has no rays of kind {kind!r}; choose a view that sees the scene")
        rays = Array("rays", len(made), scene._device)
        rays.write(made)
        batches.append((kind, kind in _ANY_HIT, rays, Array("hits", len(made), scene._device)))
    return batches


class _Run:
    """Measurements of one method, kind and mode."""

    def __init__(self, rays: Array, hits: Array, what: dict[str, Any]):
        self.rays, self.hits, self.what = rays, hits, what
        self.times: list[float] = []

    def measure(self, scene: Scene, knobs: Mapping[str, Any] | None) -> float:
        asked = {k: self.what[k] for k in ("method", "numeric", "any")}
        times: list[Times] = []
        scene.trace(self.rays, out=self.hits, times=times, knobs=knobs, ray_class=self.what["kind"], **asked)
        return times[0].device_ms

    def record(self) -> dict[str, Any]:
        median = float(np.median(self.times))
        return {
            **self.what,
            "rays": len(self.rays),
            "repeats": len(self.times),
            "device_ms": median,
            "spread": (max(self.times) - min(self.times)) / median if median else 0.0,
            "mrays": len(self.rays) / median / 1e3 if median else 0.0,
        }
