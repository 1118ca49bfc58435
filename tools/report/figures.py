"""What all plots share: matplotlib, colours, panels, saving."""

import fcntl
import math
import os
import secrets
from pathlib import Path

import matplotlib
from matplotlib import pyplot, ticker

matplotlib.use("Agg")
matplotlib.rcParams.update({"svg.hashsalt": "ballot", "font.size": 9, "hatch.linewidth": 0.5})

# Okabe and Ito's colours, which most colour-blind readers can distinguish, and others; hatches and markers differ too.
COLOURS = ["#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#999933", "#332288", "#888888", "#000000"]
HATCHES = ["", "///", "...", "xxx", "\\\\\\", "+++", "ooo", "---"]
MARKERS = "osD^vP*X<>"
ABOVE = 0.55  # height of the title in inches
NUMBER = ticker.FuncFormatter(lambda value, _: f"{value:g}")


def style(i: int) -> dict:
    """Returns the colour and marker of the i-th line."""
    return {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)], "markersize": 4, "linewidth": 1.2}


def plain(text: str) -> str:
    """Escapes '$', because names come from files and must not start mathematics."""
    return text.replace("$", r"\$")


def write(figure, file: Path, **options) -> None:
    """Writes a figure whole or not at all. A link of that name is replaced: its maker may be another user."""
    temporary = file.with_name(f".ballot-{os.getpid()}-{secrets.token_hex(8)}.tmp")
    try:
        with open(temporary, "xb") as opened:
            fcntl.flock(opened, fcntl.LOCK_EX)  # a temporary file without a lock is litter
            figure.savefig(opened, format=file.suffix[1:], **options)
        temporary.replace(file)
    finally:
        temporary.unlink(missing_ok=True)


def save(figure, name: str, title: str, out: Path, legend: tuple = ((), ())) -> str:
    """Adds title and legend with room for them, and writes an SVG and a PNG file. Returns the name of the SVG."""
    handles, labels = legend
    columns = max(1, min(6, len(labels), int(figure.get_figwidth() / 1.9)))
    below = 0.2 + 0.2 * math.ceil(len(labels) / columns)
    height = figure.get_figheight() + ABOVE + below
    figure.set_figheight(height)
    heading = figure.suptitle(plain(title), y=1 - 0.1 / height, va="top", fontsize=11)
    names = figure.legend(handles, [plain(label) for label in labels], loc="lower center", ncol=columns, fontsize=8,
                          frameon=False)
    for artist in (heading, names):
        artist.set_in_layout(False)
    figure.tight_layout(rect=(0, below / height, 1, 1 - ABOVE / height))
    write(figure, out / f"{name}.svg", metadata={"Date": None})
    write(figure, out / f"{name}.png", dpi=110)
    pyplot.close(figure)
    return f"{name}.svg"


def panels(rows: int, columns: int, width: float, height: float):
    """Returns a figure and its subplots, each of this size in inches; the figure is wide enough for a title."""
    return pyplot.subplots(rows, columns, figsize=(max(8.0, width * columns), height * rows), squeeze=False)


def logarithmic(axis, lines: dict[str, list[tuple[float, float]]], title: str, label: str) -> None:
    """Draws a log-log panel with a line for each name, and its own legend below."""
    for i, (name, points) in enumerate(lines.items()):
        points = sorted((x, y) for x, y in points if y)
        if points:
            axis.plot(*zip(*points), label=plain(name), **style(i))
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_title(title, fontsize=10, loc="left")
    axis.set_xlabel(label)
    axis.grid(True, color="#dddddd", linewidth=0.6)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    axis.legend(fontsize=8, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncol=2)
