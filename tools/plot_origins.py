#!/usr/bin/env python3
"""Draws results of `ballot verify --origins`: self hits against distance, lost contacts against size."""

import json
import sys
from pathlib import Path

from plot_common import Failed, panels, run, save

# Okabe and Ito's colours, which most colour-blind readers can distinguish; markers differ too.
COLOURS = ["#E69F00", "#D55E00", "#CC79A7", "#999933", "#56B4E9", "#009E73", "#0072B2", "#000000"]
MARKERS = "osD^vPX*"
ZERO = 0.3  # end of the linear part of the axis of rates, so that 0 can be drawn on it


def rates(records: list[dict], axis: str, figure: str) -> dict[str, list[tuple[float, float]]]:
    """Returns a dictionary from policy to points (value on the axis, events per million rays), over all other
    parameters."""
    sums: dict[str, dict[float, list[int]]] = {}
    for record in records:
        both = sums.setdefault(record["policy"], {}).setdefault(record[axis], [0, 0])
        both[0] += record[figure]
        both[1] += record["rays"]
    return {policy: [(at, 1e6 * events / rays) for at, (events, rays) in sorted(places.items()) if rays]
            for policy, places in sums.items()}


def draw_panel(axes, records: list[dict], axis: str, figure: str, title: str, label: str) -> None:
    for i, (policy, points) in enumerate(rates(records, axis, figure).items()):
        best = policy == "bounded"
        axes.plot(*zip(*points), label=policy, color=COLOURS[i % len(COLOURS)], marker=MARKERS[i % len(MARKERS)],
                  linewidth=2.4 if best else 1.2, markersize=8 if best else 5, zorder=3 if best else 2, clip_on=False)
    axes.set_yscale("symlog", linthresh=ZERO, linscale=0.3)
    axes.set_ylim(0, 1e6)
    axes.set_yticks([0, 1, 10, 100, 1e3, 1e4, 1e5, 1e6],
                    ["0", "1", "10", "100", "1 000", "10 000", "100 000", "all"])
    axes.set_yticks([], minor=True)
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(label)
    axes.grid(True, color="#dddddd", linewidth=0.6)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def draw_study(document: dict, name: str, folder: Path, written: list[str]) -> None:
    figure, ((left, right),) = panels(1, 2, 5.25, 3.8)
    records = document["records"]
    draw_panel(left, records, "distance", "self_hits", "Self hits, all sizes together",
               "distance from the origin, multiples of the scene's size")
    positive = [r["distance"] for r in records if r["distance"] > 0]
    left.set_xscale("symlog", linthresh=min(positive, default=1), linscale=0.5)
    left.set_xlim(0, max(positive, default=1))
    draw_panel(right, records, "scene_size", "lost_contacts", "Lost contacts, all distances together",
               "size of the scene, scene units")
    right.set_xscale("log")
    left.set_ylabel("per million rays")
    save(figure, name, "Origins of secondary rays: the ray hits its own triangle, or misses a near surface", folder,
         left.get_legend_handles_labels(), written)


def draw(files: list[Path], folder: Path, written: list[str]) -> None:
    for i, file in enumerate(files, 1):
        try:
            draw_study(json.loads(file.read_text(encoding="utf-8")), f"origins-{i}", folder, written)
        except (ValueError, KeyError, TypeError) as error:
            raise Failed(f"{file}: expected JSON of 'ballot verify --origins'; {error!r}") from None


if __name__ == "__main__":
    sys.exit(run(__doc__, "ORIGINS.json", draw))
