#!/usr/bin/env python3
"""Draws the middle slice of each distance field: files of `ballot distance --grid N --signed`, .npy or .raw."""

import sys
from pathlib import Path

import numpy as np
from plot_common import Failed, panels, run, save


def field_of(file: Path) -> np.ndarray:
    if file.suffix == ".npy":
        field = np.load(file, mmap_mode="r")
    else:
        numbers = np.memmap(file, "<f4", "r")
        side = round(len(numbers) ** (1 / 3))
        if side**3 != len(numbers):
            raise Failed(f"{file}: {len(numbers)} numbers are no cube; expected a volume of --grid")
        field = numbers.reshape(side, side, side)
    if field.ndim != 3:
        raise Failed(f"{file}: shape is {field.shape}; expected a volume of --grid")
    return field


def draw(files: list[Path], folder: Path, written: list[str]) -> None:
    for file in files:
        field = field_of(file)
        middle = np.asarray(field[len(field) // 2])
        size = float(np.abs(middle[np.isfinite(middle)]).max())
        figure, ((axes,),) = panels(1, 1, 5, 5)
        axes.imshow(middle, origin="lower", cmap="RdBu", vmin=-size, vmax=size, interpolation="nearest")
        axes.contour(middle, levels=[0], colors="black", linewidths=1)
        axes.contour(middle, levels=12, colors="black", linewidths=0.3, linestyles="solid")
        axes.set_axis_off()
        save(figure, file.stem, f"Slice z = {len(field) // 2} of {file.name}", folder, ([], []), written)


if __name__ == "__main__":
    sys.exit(run(__doc__, "FIELD", draw))
