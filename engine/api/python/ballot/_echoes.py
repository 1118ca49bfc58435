"""Returns of beams: which surfaces become one, and which of them count."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

KINDS = ("first", "last", "strongest")


class Plan(NamedTuple):
    """Which returns of a beam are wanted."""

    kind: str  # of KINDS
    number: int  # returns of a beam
    width: float  # surfaces so near behind the first of them are one return
    weighed: bool  # energy is needed
    merged: bool  # there may be more surfaces than returns, or in another order
    surfaces: int  # of a beam


def of_beams(
    ranges: np.ndarray, energy: np.ndarray | None, plan: Plan
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None]:
    """Returns ranges, energy and the surfaces of the returns of beams (p, n, number) float32, float32, int64, of those
    of their surfaces (p, n, surfaces), where infinity stands for none. Surfaces None: as they come."""
    if not plan.merged or energy is None:
        return ranges, energy, None
    shape = (*ranges.shape[:2], plan.number)
    away, power, which = np.full(shape, np.inf, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.int64)
    rows = np.isfinite(ranges).any(axis=-1)
    away[rows], power[rows], which[rows] = _merged(ranges[rows], energy[rows], plan)
    return away, power, which


def _merged(ranges: np.ndarray, energy: np.ndarray, plan: Plan) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the same of beams (m, surfaces) that have some."""
    shape = (len(ranges), plan.number)
    away, power, which = np.full(shape, np.inf, np.float32), np.full(shape, -1, np.float32), np.zeros(shape, np.int64)
    left = np.isfinite(ranges)
    for k in range(plan.number if plan.kind == "first" else ranges.shape[1]):
        edge = np.where(left, ranges, np.inf).min(axis=-1, initial=np.inf)
        there = np.isfinite(edge)
        if not there.any():
            break
        mine = left & (ranges <= (edge + np.float32(plan.width))[:, np.newaxis])
        left &= ~mine
        part = np.where(mine, energy, 0)
        total = part.sum(axis=-1)
        weight = np.where((total > 0)[:, np.newaxis], part, mine)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = weight / weight.sum(axis=-1, keepdims=True, dtype=np.float32)
            mean = edge + (share * np.where(mine, ranges - edge[:, np.newaxis], 0)).sum(axis=-1)
        best = np.where(mine, energy, -1).argmax(axis=-1)
        column = min(k, plan.number - 1)
        better = there if plan.kind != "strongest" else there & (total > power[:, column])
        away[better, column], power[better, column], which[better, column] = mean[better], total[better], best[better]
    return away, power, which
