"""The parts that all plotting scripts share: matplotlib, colours, panels, saving, the command line."""

import argparse
import fcntl
import math
import os
import secrets
import sys
from pathlib import Path

NO_MATPLOTLIB = 4  # exit code, known to the program that starts the script
try:
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot, ticker  # noqa: F401, the scripts import them from here
except ImportError as missing:
    print(f"error: {missing}; install python3-matplotlib (Debian) or matplotlib (pip)", file=sys.stderr)
    sys.exit(NO_MATPLOTLIB)

# Okabe and Ito's colours, which most colour-blind readers can distinguish, and others; hatches and markers differ too.
COLOURS = ["#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#999933", "#332288", "#888888", "#000000"]
HATCHES = ["", "///", "...", "xxx", "\\\\\\", "+++", "ooo", "---"]
MARKERS = "osD^vP*X<>"
ABOVE = 0.55  # height of the title in inches


class Failed(Exception):
    """The exception of failed work; its text says what failed."""


def rays_of(record: dict) -> str:
    return record["rays"] + (":any" if record["any"] and record["rays"].endswith(".npy") else "")


def unique(items) -> list:
    return list(dict.fromkeys(items))


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


def save(figure, name: str, title: str, out: Path, legend: tuple, written: list[str]) -> None:
    """Adds title and legend with room for them, and writes an SVG and a PNG file."""
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
    written.append(f"{name}.svg")


def panels(rows: int, columns: int, width: float, height: float):
    """Returns a figure and its subplots, each of this size in inches; the figure is wide enough for a title."""
    return pyplot.subplots(rows, columns, figsize=(max(8.0, width * columns), height * rows), squeeze=False)


def run(what: str, metavar: str, draw) -> int:
    """Runs a script's command line: calls `draw(files, folder, written)`, which appends the names of the plots to
    `written`. Returns the exit code."""
    parser = argparse.ArgumentParser(description=what,
                                     epilog="Prints 'plot NAME' for each SVG file; a PNG file is beside it.")
    parser.add_argument("files", nargs="+", type=Path, metavar=metavar, help="JSON file with the results")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the plots")
    options = parser.parse_args()
    matplotlib.rcParams.update({"svg.hashsalt": "ballot", "font.size": 9, "hatch.linewidth": 0.5})
    written: list[str] = []
    try:
        options.out.mkdir(parents=True, exist_ok=True)
        draw(options.files, options.out, written)
    except (Failed, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    for name in written:
        print(f"plot {name}")
    return 0
