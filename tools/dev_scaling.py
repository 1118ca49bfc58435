"""Measures speed and memory against the number of triangles and of rays, and shows what fails first."""

import argparse
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import dev_scaling_inputs as inputs
from dev_build import ROOT
from dev_packages import Failed
from dev_scaling_report import BATCH, METHODS, draw, markdown, spaced

FEWEST_TRIANGLES, FEWEST_RAYS = 10 ** 3, 10 ** 4
RUNS = 3  # number of runs of `info` up to 10^6 triangles, and of `trace` up to 10^6 rays
MIDDLE = 10 ** 5  # triangles of the scene through which every batch of rays is traced
# Bytes of a texel; texels of a pair of nodes, of a leaf's header and of a triangle, as in shaders/shared/layout.h.
TEXEL, PAIR_TEXELS, LEAF_TEXELS, TRIANGLE_TEXELS = 16, 4, 2, 3
WRONG_ARGUMENTS, NO_DEVICE = 2, 3  # exit codes of ballot
HELP = """\
Generates wavy grids of 10^3, 10^4, ... triangles and traces the same 10^6 camera rays and 10^6 random rays through
each; then traces 10^4, 10^5, ... rays of both kinds through the scene of 10^5 triangles. The methods are auto (the
default) and while-while. Every run is a separate process. Writes to --out (default build/scaling):

  scaling.md      both tables, and each failed step with ballot's message
  scaling.json    every figure; rewritten after each step
  *.svg, *.png    log-log plots, if matplotlib is installed

A step that fails (memory, a limit of the device) is part of the result: its message is quoted, and the next step
follows. The columns:

  load s, build s       seconds to load the scene and to build the BVH, as `ballot info SCENE --no-cache` (three runs;
                        one beyond 10^6 triangles) and `bench` report them; medians
  build's share         share of the build in the wall time of `info` and of tracing both batches once by auto
  MiB on device         nodes and leaf blocks as uploaded for while-while; the eight-wide tree of packet-wide, the rays
                        and the hits come on top
  peak MiB              largest resident memory of the process; on a CPU device it includes the device's memory
  load average          of the machine, this program's own share included; if it is well above the number of processors,
                        other work took time away
  Mrays/s by triangles  trace alone, by `ballot bench --no-cache`; median of --repeat measurements, interleaved
  trace ms, Mrays/s     by rays: the dispatches of one `ballot trace`, which takes its BVH from a cache
  wall s                by rays: the whole process: start, load, read rays, trace, write hits. A batch of up to 10^6
                        rays is traced once to cache kernels and auto's choice, then three times; medians

Without --binary the command first sets up the machine and builds, as the other commands do. With --binary it installs
and builds nothing and needs only Python 3, so it runs on a machine that has only this folder and a bundle
(`tools/dev.py bundle`):

  tools/dev.py scaling --most-triangles 1e6 --most-rays 1e7
  tools/dev.py scaling --binary ballot/bin/ballot --out scaling --device gpu
  tools/dev.py scaling --most-rays 1e4 --knob fetch=storage         # meets the limit of storage buffers
  tools/plot_scaling.py build/scaling/scaling.json --out plots      # the plots again, elsewhere

10^7 triangles need 4 GiB of memory; 10^8 rays need 5 GiB of memory and 5 GiB of disk. Inputs are deleted unless --keep
is given. Exit codes: 0 done, even if steps failed; 1 nothing could be measured; 2 wrong arguments; 3 no usable device.
"""


def count_of(text: str) -> int:
    try:
        value = 10 ** int(text[3:]) if text.startswith("10^") else int(float(text))
    except (ValueError, OverflowError):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number such as 1e6 or 10^6") from None
    if not 0 <= value <= 10 ** 9:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and 1e9")
    return value


def positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number above 0")
    return int(text)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for tables and plots; default: build/scaling")
    parser.add_argument("--binary", type=Path, metavar="PATH", help="the ballot program to run; builds nothing")
    parser.add_argument("--device", metavar="TEXT", help="the Vulkan device, as ballot's option --device takes it")
    parser.add_argument("--most-triangles", type=count_of, default=10 ** 7, metavar="N",
                        help="triangles of the largest scene, such as 1e6; default: 1e7")
    parser.add_argument("--most-rays", type=count_of, default=10 ** 8, metavar="N",
                        help="rays of the largest batch, such as 1e7; default: 1e8; below 1e4 no batch is measured")
    parser.add_argument("--knob", action="append", default=[], metavar="NAME=VALUE",
                        help="a knob for every trace, as ballot's option --knob takes it; may be repeated")
    parser.add_argument("--repeat", type=positive, default=5, metavar="N",
                        help="measurements by `ballot bench`; default: 5")
    parser.add_argument("--timeout", type=positive, default=1800, metavar="S",
                        help="seconds after which a process is killed and counts as failed; default: 1800")
    parser.add_argument("--keep", action="store_true", help="keep the generated scenes and rays, and the hits")


def powers(first: int, last: int) -> list[int]:
    return [10 ** e for e in range(10) if first <= 10 ** e <= last]


def write_text(path: Path, text: str) -> None:
    with inputs.replacing(path) as file:
        file.write(text.encode())


class Outcome:
    """The result of one process: wall seconds, peak MiB, exit code, and a line on why it failed ("" if it did not)."""

    def __init__(self, seconds: float, peak: float, code: int, error: str):
        self.seconds, self.peak, self.code, self.error = seconds, peak, code, error


def reason(code: int, late: bool, timeout: int, said: str) -> str:
    lines = [line.strip() for line in said.replace("\r", "\n").splitlines() if line.strip()]
    ours = [line for line in lines if line.startswith("ballot:")]
    last = (ours or lines or [""])[-1]
    if late:
        return f"ended after {timeout} s (--timeout)"
    if code < 0:
        hint = ", as by the kernel when memory runs out" if -code == signal.SIGKILL else ""
        return f"killed by {signal.Signals(-code).name}{hint}" + (f"; its last message: {last}" if last else "")
    return last or f"exit code {code}, without a message"


def measure(command: list[str], environment: dict[str, str], timeout: int) -> Outcome:
    """Runs a process and measures it. wait4 gives the peak memory of this one process. That peak starts at the script's
    own, which is smaller (dev_scaling_inputs.py)."""
    with tempfile.TemporaryFile() as errors:
        start = time.monotonic()
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=errors, env=environment)
        late = threading.Event()
        timer = threading.Timer(timeout, lambda: (late.set(), os.kill(process.pid, signal.SIGKILL)))
        timer.start()
        try:
            _, status, usage = os.wait4(process.pid, 0)
        except BaseException:
            process.kill()
            process.wait()
            raise
        finally:
            timer.cancel()
        process.returncode = code = os.waitstatus_to_exitcode(status)
        seconds = time.monotonic() - start
        errors.seek(0)
        said = errors.read().decode(errors="replace")
    error = reason(code, late.is_set(), timeout, said) if code != 0 else ""
    return Outcome(seconds, usage.ru_maxrss / 1024, code, error)


class Study:
    def __init__(self, binary: Path, options: argparse.Namespace):
        self.options = options
        self.out = (options.out or ROOT / "build" / "scaling").absolute()
        self.binary = str(binary.absolute())
        self.files = self.out / "inputs"
        self.files.mkdir(parents=True, exist_ok=True)
        self.used = {self.files / "report.json", self.files / "hits.npy"}
        self.environment = {**os.environ, "XDG_CACHE_HOME": str(self.out / "cache")}  # not the user's cache
        self.document: dict = {"knobs": options.knob, "repeat": options.repeat, "processors": os.cpu_count(),
                               "date": time.strftime("%Y-%m-%d"), "triangles": [], "rays": [], "failures": []}

    def save(self) -> None:
        write_text(self.out / "scaling.json", json.dumps(self.document, indent=1) + "\n")

    def fail(self, place: str, step: str, error: str) -> None:
        self.document["failures"].append({"place": place, "step": step, "error": error})
        print(f"failed: {error}", flush=True)

    def make(self, path: Path, place: str, write, *arguments) -> bool:
        self.used.add(path)
        if path.exists():
            return True
        print(f"{place}: writing {path.name} ... ", end="", flush=True)
        try:
            write(path, *arguments)
        except OSError as error:
            self.fail(place, f"writing {path.name}", error.strerror or str(error))
            return False
        print(f"{path.stat().st_size / 2 ** 20:.1f} MiB", flush=True)
        return True

    def remove(self, path: Path) -> None:
        if not self.options.keep:
            path.unlink(missing_ok=True)

    def ballot(self, place: str, step: str, arguments: list) -> tuple[Outcome, dict]:
        """Runs ballot with --json; returns the outcome and the document, which is empty if it failed."""
        print(f"{place}: {step} ... ", end="", flush=True)
        report = self.files / "report.json"
        report.unlink(missing_ok=True)
        device = ["--device", self.options.device] if self.options.device else []
        outcome = measure([self.binary, *map(str, arguments), *device, "--json", str(report)], self.environment,
                          self.options.timeout)
        document = {}
        if not outcome.error:
            try:
                document = json.loads(report.read_text(encoding="utf-8"))
            except (OSError, ValueError) as error:
                outcome.error = f"cannot read the results: {error}"
        if outcome.code in (WRONG_ARGUMENTS, NO_DEVICE):  # every other step would fail in the same way
            print("failed", flush=True)
            print(f"error: {outcome.error}", file=sys.stderr)
            raise SystemExit(outcome.code)
        if outcome.error:
            self.fail(place, step, outcome.error)
        else:
            print(f"{outcome.seconds:.2f} s, {outcome.peak:.0f} MiB", flush=True)
        for name in ("device", "driver", "subgroup_size", "commit"):
            if name in document:
                self.document[name] = document[name]
        self.save()
        return outcome, document

    def knobs(self) -> list[str]:
        return [word for knob in self.options.knob for word in ("--knob", knob)]

    def scene(self, triangles: int) -> Path:
        return self.files / f"waves-{triangles}.glb"

    def rays(self, kind: str, count: int) -> Path:
        return self.files / f"{kind}-{count}.npy"

    def measure_scene(self, triangles: int) -> None:
        place, path = f"{spaced(triangles)} triangles", self.scene(triangles)
        row: dict = {"triangles": triangles, "load_average": os.getloadavg()[0], "mrays_per_s": {}, "variants": {}}
        self.document["triangles"].append(row)
        if not self.make(path, place, inputs.write_scene, triangles):
            return
        row["file_mib"] = path.stat().st_size / 2 ** 20
        builds, walls = [], []
        for i in range(RUNS if triangles <= BATCH else 1):
            outcome, info = self.ballot(place, f"info {i + 1}", ["info", path, "--no-cache"])
            if outcome.error:
                break
            builds.append(info["scenes"][0])
            walls.append(outcome.seconds)
            row["build_peak_mib"] = max(outcome.peak, row.get("build_peak_mib", 0))
        files = [f"{kind}={self.rays(kind, BATCH)}" for kind in inputs.KINDS]
        outcome, bench = self.ballot(place, "bench", [
            "bench", path, "--no-cache", "--methods", ",".join(METHODS), "--rays", ",".join(files), "--repeat",
            self.options.repeat, *self.knobs()])
        if bench:
            row["trace_peak_mib"] = outcome.peak
            for record in bench["records"]:
                row["mrays_per_s"].setdefault(record["rays"], {})[record["method"]] = record["mrays_per_s"]
                row["variants"].setdefault(record["rays"], {})[record["method"]] = record["variant"]
            row["trace_s"] = sum(r["trace_ms"]["median"] * 1e-3 for r in bench["records"] if r["method"] == "auto")
            builds.append(bench["scenes"][0])
        if builds:
            row.update(info_of(builds))
        if walls and bench:
            row["info_wall_s"] = statistics.median(walls)
            row["build_share"] = statistics.median(b["build_s"] / (w + row["trace_s"]) for b, w in zip(builds, walls))
        self.save()

    def measure_batch(self, place: str, kind: str, count: int, method: str, command: list) -> dict:
        row = {"rays": count, "kind": kind, "method": method, "load_average": os.getloadavg()[0]}
        times, walls, peaks = [], [], []
        for step in [f"{method}, to fill the caches", *[method] * RUNS] if count <= BATCH else [method]:
            outcome, trace = self.ballot(place, step, command)
            if outcome.error:
                return {**row, "error": outcome.error}
            times.append(trace["records"][0]["trace_ms"])
            walls.append(outcome.seconds)
            peaks.append(outcome.peak)
        kept = slice(-RUNS, None)  # leaves out the run that filled the caches, if there was one
        trace_ms = statistics.median(times[kept])
        record = {name: trace["records"][0][name] for name in ("hits", "variant", "retraced")}
        return {**row, **record, "trace_ms": trace_ms, "mrays_per_s": count / trace_ms * 1e-3,
                "wall_s": statistics.median(walls[kept]), "peak_mib": max(peaks[kept])}

    def measure_rays(self, kind: str, count: int, scene: Path) -> None:
        place, path, hits = f"{spaced(count)} {kind} rays", self.rays(kind, count), self.files / "hits.npy"
        if self.make(path, place, inputs.write_rays, kind, count):
            for method in METHODS:
                self.document["rays"].append(self.measure_batch(place, kind, count, method, [
                    "trace", scene, "--rays", path, "--out", hits, "--method", method, *self.knobs()]))
            self.save()
        self.remove(hits)
        if count != BATCH:
            self.remove(path)

    def run(self) -> int:
        outcome, info = self.ballot("devices", "info", ["info"])
        if outcome.error:
            return 1
        if len(info["devices"]) == 1:  # so that the device is known even if every scene fails
            device = info["devices"][0]
            self.document.update(device=device["name"], driver=device["driver"], subgroup_size=device["subgroup_size"])
        scenes = powers(FEWEST_TRIANGLES, self.options.most_triangles)
        batches = powers(FEWEST_RAYS, self.options.most_rays)
        middle = min(MIDDLE, max(scenes, default=MIDDLE))
        for kind in inputs.KINDS if scenes else ():
            if not self.make(self.rays(kind, BATCH), f"{spaced(BATCH)} {kind} rays", inputs.write_rays, kind, BATCH):
                return 1
        for triangles in scenes:
            self.measure_scene(triangles)
            if triangles != middle or not batches:
                self.remove(self.scene(triangles))
        if batches and self.make(self.scene(middle), f"{spaced(middle)} triangles", inputs.write_scene, middle):
            self.document["ray_scene_triangles"] = middle
            for count in batches:
                for kind in inputs.KINDS:
                    self.measure_rays(kind, count, self.scene(middle))
        return 0 if any("build_s" in row or "hits" in row
                        for row in self.document["triangles"] + self.document["rays"]) else 1


def info_of(builds: list[dict]) -> dict:
    """Returns medians of the times, the size of the tree, and the MiB that are uploaded: node pairs, leaf headers and
    the triangles of leaves."""
    scene = builds[0]
    texels = max(0, scene["nodes"] - 1) // 2 * PAIR_TEXELS + scene["leaves"] * LEAF_TEXELS
    mib = (texels + scene["references"] * TRIANGLE_TEXELS) * TEXEL / 2 ** 20
    return {**{name: statistics.median(build[name] for build in builds) for name in ("load_s", "build_s")},
            **{name: scene[name] for name in ("nodes", "leaves", "references", "depth")},
            "build_samples_s": [build["build_s"] for build in builds], "device_mib": mib}


def scaling(binary: Path, options: argparse.Namespace) -> int:
    if not binary.is_file():
        raise Failed(f"there is no program {binary}; name one with --binary")
    study = Study(binary, options)
    try:
        code = study.run()
    finally:
        for path in study.used:
            study.remove(path)
    text = markdown(study.document)
    write_text(study.out / "scaling.md", text)
    print("\n" + text)
    if code == 0:
        draw(study.out / "scaling.json")
        print(f"tables and figures: {study.out}")
    else:
        print("error: nothing could be measured", file=sys.stderr)
    return code
