#!/usr/bin/env python3
"""Measures speed and memory of Ballot against the number of triangles and of rays, and shows what fails first.

Makes wavy grids of 10^3, 10^4, ... triangles and traces the same 10^6 camera rays and 10^6 random rays through each;
then 10^4, 10^5, ... rays of both kinds through 10^5 triangles. Each run is a process of its own. A step that fails, for
memory or a limit of the device, is part of the result, and the next one follows. Prints both tables; writes
scaling.json after every step and, where matplotlib is installed, scaling.svg. Needs NumPy. 10^7 triangles need 4 GiB of
memory; 10^8 rays need 5 GiB of memory and 5 GiB of disk.

  load_s, build_s   of the scene and its BVH; bvh_mib: the size of the BVH, as `ballot info` has it
  peak_mib          largest resident memory of the process; on a CPU device it includes the device's
  Mrays/s           the dispatches alone: medians of `ballot bench` by triangles, one `ballot trace` by rays
  wall_s            the whole process; BVH and kernels of `ballot trace` come from caches
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
from multiprocessing import Process
from pathlib import Path

import numpy as np

KINDS, BATCH, MIDDLE = ("camera", "random"), 10**6, 10**5  # the rays of each scene; the triangles of each batch
WAVES = ((0.8, 1.3, 0.0), (-0.4, 1.1, 1.0), (0.2, -2.3, 2.0), (2.1, 1.7, 3.0))  # frequencies along x and z, phase
HALF, EYE, EXTENT = 10.0, np.array([0, 8.0, 16.0]), 0.466  # half the grid's side; tan(half the field of view)
TILE, CHUNK = 4, 10**6  # camera rays are stored in tiles of 4 x 4; rays that are made at a time


def near_square(cells: int) -> tuple[int, int]:
    """Returns two factors of `cells`, the larger first, as near to each other as possible."""
    rows = next(r for r in range(int(cells**0.5), 0, -1) if cells % r == 0)
    return cells // rows, rows


def write_scene(path: Path, triangles: int) -> None:
    columns, rows = near_square(triangles // 2)
    x, z = np.meshgrid(np.linspace(-HALF, HALF, columns + 1), np.linspace(-HALF, HALF, rows + 1))
    y = sum(0.5 * np.sin(a * x + b * z + phase) for a, b, phase in WAVES)
    corner, below = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1, 1), columns + 1
    np.savez(path, vertices=np.stack([x, y, z], -1).reshape(-1, 3).astype(np.float32),
             triangles=np.concatenate([corner + [0, below, 1], corner + [1, below, below + 1]], 1).reshape(-1, 3))


def write_rays(path: Path, kind: str, count: int) -> None:
    """Writes rays of a square picture, or from random points around the waves in random directions."""
    rays = np.lib.format.open_memmap(path, "w+", np.float32, (count, 6))
    (across, down), forward = near_square(count // TILE**2), -EYE / np.linalg.norm(EYE)
    for first in range(0, count, CHUNK):
        part = rays[first:first + CHUNK]
        tile, inside = np.divmod(np.arange(first, first + len(part)), TILE**2)
        if kind == "camera":
            x = EXTENT * ((2 * (tile % across * TILE + inside % TILE) + 1) / (across * TILE) - 1)
            y = EXTENT * (1 - (2 * (tile // across * TILE + inside // TILE) + 1) / (down * TILE))
            part[:, :3], part[:, 3:] = EYE, forward + np.outer(x, [1, 0, 0]) + np.outer(y, [0, -forward[2], forward[1]])
        else:
            rng = np.random.default_rng(first)
            part[:, :3] = rng.uniform([-HALF, -2, -HALF], [HALF, 4, HALF], (len(part), 3))
            part[:, 3:] = rng.normal(size=(len(part), 3))


def make(write, path: Path, *arguments) -> Path:
    """Makes an input in another process: the peak memory of a process counts from that of its parent."""
    if not path.exists():
        process = Process(target=write, args=(path, *arguments))
        process.start()
        process.join()
        if process.exitcode:
            raise SystemExit(f"error: cannot make {path}")
    return path


class Study:
    def __init__(self, options: argparse.Namespace, files: Path):
        self.options, self.files = options, files
        self.rows: dict = {"triangles": [], "rays": []}
        self.document: dict = {"date": time.strftime("%Y-%m-%d"), **self.rows, "failures": []}

    def ballot(self, row: dict, what: str, *words) -> dict:
        """Runs ballot. Notes wall time and peak memory in the row, and why it failed. Returns its JSON, or {}."""
        print(what, "...", flush=True)
        report = self.files / "report.json"
        words = (self.options.ballot, *words, *(word for knob in self.options.knob for word in ("--knob", knob)),
                 "--device", self.options.device, "--json", report)
        with tempfile.TemporaryFile("w+", errors="replace") as errors:
            start = time.monotonic()
            process = subprocess.Popen(list(map(str, words)), stdout=subprocess.DEVNULL, stderr=errors,
                                       env={**os.environ, "XDG_CACHE_HOME": str(self.options.out / "cache")})
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            row |= {"wall_s": time.monotonic() - start, "peak_mib": used.ru_maxrss / 1024}
            errors.seek(0)
            said = errors.read().strip().splitlines() or ["no message"]
        document = {} if process.returncode else json.loads(report.read_text(encoding="utf-8"))
        if process.returncode:
            self.document["failures"].append(f"{what}: exit code {process.returncode}: {said[-1]}")
        if process.returncode in (2, 3):  # wrong arguments, no device: every step would fail
            raise SystemExit(f"error: {said[-1]}")
        self.document |= {key: document[key] for key in ("device", "driver", "commit") if key in document}
        return document

    def save(self) -> None:
        (self.options.out / "scaling.json").write_text(json.dumps(self.document, indent=1) + "\n", encoding="utf-8")

    def scene(self, triangles: int) -> Path:
        return make(write_scene, self.files / f"waves-{triangles}.npz", triangles)

    def rays(self, kind: str, count: int) -> Path:
        return make(write_rays, self.files / f"{kind}-{count}.npy", kind, count)

    def measure_scene(self, triangles: int) -> None:
        row: dict = {"triangles": triangles}
        self.rows["triangles"].append(row)
        rays = ",".join(f"{kind}={self.rays(kind, BATCH)}" for kind in KINDS)
        bench = self.ballot(row, f"{triangles:,} triangles", "bench", self.scene(triangles), "--no-cache",
                            "--methods", self.options.methods, "--rays", rays, "--repeat", 5)
        for scene in bench.get("scenes", []):
            del row["wall_s"]  # of many runs
            row |= {"load_s": scene["load_s"], "build_s": scene["build_s"], "bvh_mib": scene["bytes"] / 2**20}
        for record in bench.get("records", []):
            row[f"Mrays/s, {record['rays']}, {record['method']}"] = record["mrays_per_s"]
        self.save()

    def measure_batch(self, count: int, kind: str, method: str) -> None:
        row: dict = {"rays": count, "kind": kind, "method": method}
        self.rows["rays"].append(row)
        for again in ("to fill the caches", "measured"):
            trace = self.ballot(row, f"{count:,} {kind} rays, {method}, {again}", "trace", self.scene(MIDDLE), "--rays",
                                self.rays(kind, count), "--out", self.files / "hits.npy", "--method", method)
        for record in trace.get("records", []):
            row |= {"hits": record["hits"], "trace_ms": record["trace_ms"], "Mrays/s": record["mrays_per_s"]}
        self.save()

    def print_table(self, along: str) -> None:
        heads = list(max(self.rows[along], key=len, default={}))
        rows = [[row.get(head, "failed") for head in heads] for row in self.rows[along]]
        for line in (heads, ["---:"] * len(heads), *rows):
            print("| " + " | ".join(f"{cell:.3g}" if isinstance(cell, float) else str(cell) for cell in line) + " |")
        print()

    def draw(self, file: Path) -> None:
        """Draws both tables, log-log: a row of panels for each."""
        import matplotlib
        matplotlib.use("svg")
        from matplotlib import pyplot
        figure, axes = pyplot.subplots(2, 3, figsize=(15, 9), layout="constrained")
        lines: dict = {}  # (axis, label): points
        for panels, (along, rows) in zip(axes, self.rows.items()):
            for row in rows:
                for name in row:
                    panel = [i for i, word in enumerate(("Mrays/s", "_s", "_mib")) if word in name]
                    label = ", ".join(filter(None, (name, row.get("kind"), row.get("method"))))
                    for axis in panels[panel]:
                        lines.setdefault((axis, label), []).append((row[along], row[name]))
                        axis.set(xlabel=along, xscale="log", yscale="log")
        for (axis, label), points in lines.items():
            axis.plot(*zip(*points), marker="o", markersize=4, label=label)
            axis.legend(fontsize=8)
        figure.suptitle(f"{self.document.get('device')}, {self.document.get('driver')}")
        figure.savefig(file)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    root = Path(__file__).resolve().parents[1]
    for name, default, text in (
            ("--ballot", root / "build/release/ballot", "the program"), ("--out", root / "build/scaling", "folder"),
            ("--device", "", "as ballot takes it"), ("--methods", "auto,while-while", "traversal methods"),
            ("--most-triangles", 1e7, "of the largest scene"), ("--most-rays", 1e8, "of the largest batch")):
        parser.add_argument(name, type=type(default), default=default, metavar="", help=f"{text} [%(default)s]")
    parser.add_argument("--knob", action="append", default=[], metavar="NAME=VALUE", help="of every trace; repeatable")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="inputs-", dir=options.out) as folder:
        study = Study(options, Path(folder))
        for triangles in (10**e for e in range(3, 10) if 10**e <= options.most_triangles):
            study.measure_scene(triangles)
        for count in (10**e for e in range(4, 10) if 10**e <= options.most_rays):
            for kind in KINDS:
                for method in options.methods.split(","):
                    study.measure_batch(count, kind, method)
    study.print_table("triangles")
    study.print_table("rays")
    print("\n".join(study.document["failures"] or ["nothing failed"]))
    try:
        study.draw(options.out / "scaling.svg")
    except ImportError:
        print("no plot: install python3-matplotlib (Debian) or matplotlib (pip)")


if __name__ == "__main__":
    main()
