#!/usr/bin/env python3
"""Draws results of `ballot bench --builders`: time, memory and traced speed against triangles, time against
rays."""

import json
import sys
from pathlib import Path

from plot_common import Failed, panels, run, save, unique
from plot_scaling import draw_lines


def median(values: list[float]) -> float:
    ordered = sorted(values)
    return ordered[len(ordered) // 2]


def by_builder(records: list[dict], value) -> dict[str, list[tuple[float, float]]]:
    lines: dict[str, list[tuple[float, float]]] = {}
    for record in records:
        lines.setdefault(record["builder"], []).append((record["triangles"], value(record)))
    return lines


def draw_sizes(document: dict, out: Path, written: list[str]) -> None:
    records = document["records"]
    kinds = unique(kind for record in records for kind in record["mrays_per_s"])
    figure, (axes,) = panels(1, 2 + len(kinds), 4.0, 3.7)
    draw_lines(axes[0], by_builder(records, lambda r: 1e3 * median(r["build_s"])), "build, milliseconds", "triangles")
    draw_lines(axes[1], by_builder(records, lambda r: r["peak_mib"]), "peak memory of the build, MiB", "triangles")
    for axis, kind in zip(axes[2:], kinds):
        draw_lines(axis, by_builder(records, lambda r, kind=kind: r["mrays_per_s"][kind]), f"{kind} rays, Mrays/s",
                   "triangles")
    save(figure, "builders", f"Builders of trees\n{document['device']}, {document['driver']}", out, ([], []), written)


def draw_rays(document: dict, scene: str, out: Path, written: list[str]) -> None:
    """Draws the time of a build and of tracing against the number of rays."""
    records = [record for record in document["records"] if record["scene"] == scene]
    kinds = list(records[0]["mrays_per_s"])
    figure, (axes,) = panels(1, len(kinds), 4.0, 3.7)
    counts = [10 ** (k / 4) for k in range(16, 41)]
    for axis, kind in zip(axes, kinds):
        lines = {r["builder"]: [(n, median(r["build_s"]) + n * 1e-6 / r["mrays_per_s"][kind]) for n in counts]
                 for r in records if r["mrays_per_s"][kind] > 0}
        draw_lines(axis, lines, f"{kind} rays: build and trace, seconds", "rays")
    save(figure, f"builders-{scene}", f"{scene}, {records[0]['triangles']} triangles\n{document['device']}", out,
         ([], []), written)


def draw(files: list[Path], out: Path, written: list[str]) -> None:
    if len(files) != 1:
        raise Failed(f"found {len(files)} files, expected one")
    try:
        document = json.loads(files[0].read_text(encoding="utf-8"))
        draw_sizes(document, out, written)
        for scene in unique(record["scene"] for record in document["records"]):
            draw_rays(document, scene, out, written)
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise Failed(f"{files[0]}: expected JSON of 'ballot bench --builders'; {error!r}") from None


if __name__ == "__main__":
    sys.exit(run(__doc__, "BUILDERS.json", draw))
