#!/usr/bin/env python3
"""Draws the error of a picture over rendering time: RMSE, relative MSE and FLIP against the reference."""

import json
import sys
from pathlib import Path

from plot_common import COLOURS, MARKERS, panels, run, save

MEASURES = [("rmse", "RMSE"), ("relmse", "relative MSE"), ("flip", "FLIP, 67 pixels per degree")]


def draw(files: list[Path], folder: Path, written: list[str]) -> None:
    for file in files:
        document = json.loads(file.read_text(encoding="utf-8"))
        records = [r for r in document["records"] if r["seconds"] > 0]
        figure, (row,) = panels(1, len(MEASURES), 3.6, 3.2)
        for i, (key, label) in enumerate(MEASURES):
            points = [(r["seconds"], r[key]) for r in records if r[key] > 0]
            if points:
                row[i].plot(*zip(*points), color=COLOURS[i], marker=MARKERS[i], label=label)
                row[i].set_xscale("log")
                row[i].set_yscale("log")
            row[i].set_title(label, fontsize=10)
            row[i].set_xlabel("seconds of rendering")
            row[i].grid(True, color="#dddddd", linewidth=0.6)
        legend = ([line for axes in row for line in axes.get_lines()], [label for _, label in MEASURES])
        save(figure, file.name.removesuffix(".json"), f"Error of {document['picture']} over time", folder, legend,
             written)


if __name__ == "__main__":
    sys.exit(run(__doc__, "ERRORS.json", draw))
