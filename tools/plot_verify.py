#!/usr/bin/env python3
"""Draws results of `ballot verify`: error rate against speed, with the Pareto front of methods and numeric modes."""

import json
import math
import sys
from pathlib import Path

from plot_common import COLOURS, MARKERS, Failed, panels, plain, pyplot, rays_of, run, save, unique

MODES = ["fast", "plain", "watertight", "exact"]  # these have the same colours in every plot
ZERO_BELOW = 0.8  # decades from the lowest rate on the axis down to the line of zero


class Point:
    """The result of an entry in one numeric mode, for all views of a scene and ray kind."""

    def __init__(self, records: list[dict]):
        self.label, self.mode = records[0]["label"], records[0]["numeric"]
        rays = sum(r["ray_count"] for r in records)
        self.mrays = rays / sum(r["trace_ms"]["median"] for r in records) * 1e-3
        wrong = sum(r["false_misses"] + r["false_hits"] + r["wrong_prims"] for r in records)
        self.rate = 1e6 * wrong / rays
        self.least = 1e6 / rays  # the rate of one wrong answer


class Platform:
    """The records that may be compared: those of one device and driver, clock and picture size."""

    def __init__(self, document: dict):
        self.title = (f"{document['device']}, {document['size'][0]} x {document['size'][1]}, "
                      f"subgroups of {document['subgroup_size']}")
        self.records: dict[tuple, dict] = {}  # the last record of each place, as in the tables

    def add(self, record: dict) -> None:
        key = record["scene"], rays_of(record), record["label"], record["numeric"], record["view"]
        self.records[key] = record

    def points(self) -> dict[tuple, list[Point]]:
        """Returns a dictionary from (scene, rays) to the points of a panel."""
        groups: dict[tuple, list[dict]] = {}
        for (scene, rays, label, mode, _), record in self.records.items():
            groups.setdefault((scene, rays, label, mode), []).append(record)
        points: dict[tuple, list[Point]] = {}
        for (scene, rays, _, _), records in groups.items():
            points.setdefault((scene, rays), []).append(Point(records))
        return points


def read_platforms(files: list[Path]) -> list[Platform]:
    platforms: dict[tuple, Platform] = {}
    for file in files:
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
            for document in content.get("documents", [content]):
                key = (document["device"], document["driver"], document["subgroup_size"], document["clock"],
                       *document["size"])
                for record in document["records"]:
                    if "verified_rays" in record:
                        platforms.setdefault(key, Platform(document)).add(record)
        except OSError as error:
            raise Failed(f"cannot read {file}: {error.strerror}") from None
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise Failed(f"{file}: expected JSON of 'ballot verify' or 'ballot report'; {error!r}") from None
    return list(platforms.values())


def front(points: list[Point]) -> list[Point]:
    """Returns the Pareto front: the points that no other beats in both speed and error, the fastest first."""
    best: list[Point] = []
    for point in sorted(points, key=lambda p: (-p.mrays, p.rate)):
        if not best or point.rate < best[-1].rate:
            best.append(point)
    return best


def decades(points: list[Point]) -> tuple[int, int]:
    """Returns the range of powers of ten that contains all rates above zero and the rate of one wrong answer."""
    rates = [p.rate for p in points if p.rate > 0] + [min(p.least for p in points)]
    low, high = math.floor(math.log10(min(rates))), math.ceil(math.log10(max(rates)))
    return low, max(high, low + 1)


def height(rate: float, low: int) -> float:
    return math.log10(rate) if rate > 0 else low - ZERO_BELOW


def rate_text(power: int) -> str:
    return f"{10 ** power:g}" if -3 <= power <= 5 else f"$10^{{{power}}}$"


def draw_front(axis, points: list[Point], low: int) -> None:
    """Draws the front as steps from each point to the next, open towards slower and towards worse."""
    best = front(points)
    left, right = axis.get_xlim()
    xs, ys = [best[0].mrays], [axis.get_ylim()[1]]
    for point in best:
        xs += [point.mrays, point.mrays]
        ys += [ys[-1], height(point.rate, low)]
    xs.append(left)
    ys.append(ys[-1])
    axis.plot(xs, ys, color="#888888", linewidth=1, zorder=1)
    axis.set_xlim(left, right)


def draw_panel(axis, points: list[Point], span: tuple[int, int], colour: dict, marker: dict) -> None:
    low, high = span
    zero = low - ZERO_BELOW
    axis.axhline(zero, color="black", linewidth=0.8, zorder=0)
    axis.axhspan(zero - 0.5, low - ZERO_BELOW / 2, color="#F2F2F2", zorder=-1)
    least = math.log10(min(p.least for p in points))
    axis.axhline(least, color="#BBBBBB", linewidth=0.8, linestyle=":", zorder=0)
    for point in points:
        axis.scatter(point.mrays, height(point.rate, low), s=38, color=colour[point.mode], marker=marker[point.label],
                     edgecolors="white", linewidths=0.5, zorder=3, clip_on=False)
    axis.set_ylim(zero - 0.5, high + 0.3)
    powers = range(low, high + 1, max(1, math.ceil((high - low) / 6)))
    axis.set_yticks([zero, *powers], ["0", *(rate_text(p) for p in powers)])
    axis.margins(x=0.12)
    axis.grid(axis="x", linewidth=0.3)
    axis.set_axisbelow(True)
    draw_front(axis, points, low)
    axis.annotate("one wrong answer", (0, least), xycoords=("axes fraction", "data"), ha="left", va="bottom",
                  fontsize=6, color="#777777", xytext=(2, 1), textcoords="offset points")


def plot_platform(platform: Platform, name: str, out: Path, written: list[str]) -> None:
    places = platform.points()
    scenes, kinds = unique(scene for scene, _ in places), unique(rays for _, rays in places)
    everything = [point for points in places.values() for point in points]
    modes = unique([m for m in MODES if any(p.mode == m for p in everything)] + [p.mode for p in everything])
    labels = unique(p.label for p in everything)
    colour = {mode: COLOURS[(MODES + modes).index(mode) % len(COLOURS)] for mode in modes}
    marker = {label: MARKERS[i % len(MARKERS)] for i, label in enumerate(labels)}
    figure, axes = panels(len(scenes), len(kinds), 3.1, 2.5)
    for row, scene in enumerate(scenes):
        span = decades([p for (s, _), points in places.items() if s == scene for p in points])
        for column, rays in enumerate(kinds):
            axis = axes[row][column]
            if (scene, rays) not in places:
                axis.set_visible(False)
                continue
            draw_panel(axis, places[scene, rays], span, colour, marker)
            axis.set_title(plain(f"{scene}, {rays}"), fontsize=9)
            if column == 0:
                axis.set_ylabel("wrong per million rays")
            if row == len(scenes) - 1:
                axis.set_xlabel("Mrays/s")
    handles = [pyplot.Rectangle((0, 0), 1, 1, color=colour[mode]) for mode in modes]
    handles += [pyplot.Line2D([], [], marker=marker[label], linestyle="", color="#555555") for label in labels]
    save(figure, name, f"Wrong answers against trace speed; the lines are the Pareto fronts\n{platform.title}", out,
         (handles, modes + labels), written)


def draw(files: list[Path], out: Path, written: list[str]) -> None:
    for i, platform in enumerate(read_platforms(files), 1):
        plot_platform(platform, f"accuracy-{i}", out, written)


if __name__ == "__main__":
    sys.exit(run(__doc__, "VERIFY.json", draw))
