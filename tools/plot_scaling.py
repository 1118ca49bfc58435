#!/usr/bin/env python3
"""Draws results of `tools/dev.py scaling`: speed, time and memory against triangles and against rays."""

import json
import sys
from pathlib import Path

from plot_common import COLOURS, MARKERS, Failed, panels, plain, run, save, ticker, unique

PLAIN = ticker.FuncFormatter(lambda value, _: f"{value:g}")


def series_name(kind: str, method: str) -> str:
    return f"{kind} rays, {method}"


def draw_lines(axis, lines: dict[str, list[tuple[float, float]]], title: str, label: str, shift: int = 0) -> None:
    """Draws a log-log panel with a line for each name. Each has its own colour and marker; `shift` skips colours.

    A dotted vertical line marks a missing figure, whose step failed."""
    for x in sorted({x for points in lines.values() for x, y in points if y is None}):
        axis.axvline(x, color="#777777", linestyle=":", linewidth=1)
        axis.annotate("failed", (x, 0.02), xycoords=axis.get_xaxis_transform(), rotation=90, fontsize=8, ha="right",
                      color="#555555")
    for i, (name, points) in enumerate(lines.items(), shift):
        points = sorted((x, y) for x, y in points if y is not None and y > 0)
        if points:
            axis.plot(*zip(*points), label=plain(name), color=COLOURS[i % len(COLOURS)],
                      marker=MARKERS[i % len(MARKERS)], markersize=5, linewidth=1.3)
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_title(title, fontsize=10, loc="left")
    axis.set_xlabel(label)
    axis.grid(True, color="#dddddd", linewidth=0.6)
    axis.set_axisbelow(True)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    low, high = axis.get_ylim()
    if high / low < 1000:  # the axis has few powers of ten, or none
        axis.set_ylim(low / 1.25, high * 1.25)
        axis.yaxis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
        axis.yaxis.set_minor_formatter(ticker.NullFormatter())
    axis.yaxis.set_major_formatter(PLAIN)
    axis.legend(fontsize=8, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncol=2, columnspacing=1,
                handlelength=1.6)


def heading(document: dict, what: str) -> str:
    knobs = "".join(f", --knob {knob}" for knob in document["knobs"])
    return f"{what}\n{document['device']}, {document['driver']}{knobs}"


def column(rows: list[dict], name: str) -> list[tuple[float, float]]:
    return [(row["triangles"], row.get(name)) for row in rows]


def draw_triangles(document: dict, out: Path, written: list[str]) -> None:
    rows = document["triangles"]
    figure, ((speed, seconds, memory),) = panels(1, 3, 4.2, 3.7)
    kinds = unique((kind, method) for row in rows for kind, methods in row["mrays_per_s"].items() for method in methods)
    draw_lines(speed, {series_name(kind, method): [(row["triangles"], row["mrays_per_s"].get(kind, {}).get(method))
                                                   for row in rows] for kind, method in kinds},
               "Speed of tracing, Mrays/s", "triangles")
    draw_lines(seconds, {"BVH build": column(rows, "build_s"), "load of the scene file": column(rows, "load_s")},
               "Before the first ray, seconds", "triangles", 4)
    draw_lines(memory, {"peak resident, tracing": column(rows, "trace_peak_mib"),
                        "peak resident, load and build": column(rows, "build_peak_mib"),
                        "nodes and leaves on the device": column(rows, "device_mib")}, "Memory, MiB", "triangles", 6)
    save(figure, "scaling-triangles", heading(document, "Against the number of triangles"), out, ([], []), written)


def draw_rays(document: dict, out: Path, written: list[str]) -> None:
    rows = document["rays"]
    figure, axes = panels(1, 3, 4.2, 3.7)
    kinds = unique((row["kind"], row["method"]) for row in rows)
    for axis, (name, title) in zip(axes[0], (("mrays_per_s", "Speed of tracing, Mrays/s"),
                                             ("wall_s", "Wall time of the process, seconds"),
                                             ("peak_mib", "Peak resident memory, MiB"))):
        draw_lines(axis, {series_name(*key): [(row["rays"], row.get(name)) for row in rows
                                              if (row["kind"], row["method"]) == key] for key in kinds}, title, "rays")
    triangles = f"{document['ray_scene_triangles']:,}".replace(",", " ")
    save(figure, "scaling-rays", heading(document, f"Against the number of rays, {triangles} triangles"), out,
         ([], []), written)


def draw(files: list[Path], out: Path, written: list[str]) -> None:
    if len(files) != 1:
        raise Failed(f"found {len(files)} files, expected one")
    try:
        document = json.loads(files[0].read_text(encoding="utf-8"))
        if any("build_s" in row for row in document["triangles"]):
            draw_triangles(document, out, written)
        if document["rays"]:
            draw_rays(document, out, written)
    except (ValueError, KeyError, TypeError) as error:
        raise Failed(f"{files[0]}: expected JSON of 'tools/dev.py scaling'; {error!r}") from None


if __name__ == "__main__":
    sys.exit(run(__doc__, "SCALING.json", draw))
