#!/usr/bin/env python3
"""Runs ballot with a Vulkan layer that makes calls fail, and checks how it ends.

Every command is run once without a fault, which tells how many calls it makes, and then with a fault at the n-th call,
for every n or every K-th. It must not crash, leave an object of the device, or a temporary file; it prints one message
of one line and no text of a library; a run that succeeds in spite of the fault has the right output."""

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

RAW = ("std::", "vector::", "basic_string", "json.exception", "bad_alloc", "_M_", "fault inside Ballot", "terminate")
COMMANDS = {
    "info": ["info", "--json", "out.json"],
    "scene": ["info", "SCENE", "--json", "out.json"],
    "render": ["render", "SCENE", "--view", "view0", "--size", "16x16", "--spp", "2", "--out", "out.exr"],
    "path": ["render", "SCENE", "--view", "view0", "--size", "8x8", "--spp", "64", "--shading", "path", "--out",
             "out.exr"],
    "trace": ["trace", "SCENE", "--rays", "rays.npy", "--out", "out.npy", "--method", "while-while"],
    "view": ["view", "SCENE", "--size", "64x64", "--view", "view0", "--frames", "6"],  # needs a display
}


class Runner:
    """Runs the program in a folder of its own, with the layer."""

    def __init__(self, options, folder: Path):
        self.options, self.folder = options, folder
        self.log = folder / "fault.log"
        self.environment = {**os.environ, "VK_LAYER_PATH": str(options.layer), "BALLOT_FAULT_LOG": str(self.log),
                            "VK_INSTANCE_LAYERS": "VK_LAYER_BALLOT_fault",
                            "XDG_CACHE_HOME": str(options.cache or folder / "cache")}
        self.bad = []

    def run(self, words: list[str], fault: str, **more: str) -> subprocess.CompletedProcess:
        for name in ("out.json", "out.exr", "out.npy"):
            (self.folder / name).unlink(missing_ok=True)
        self.log.unlink(missing_ok=True)
        words = [str(self.options.scene) if word == "SCENE" else word for word in words]
        return subprocess.run([self.options.ballot, *words], cwd=self.folder, capture_output=True, text=True,
                              errors="replace", timeout=120, check=False,
                              env={**self.environment, "BALLOT_FAULT": fault, **more})

    def counts(self) -> dict[str, int]:
        text = self.log.read_text(encoding="utf-8") if self.log.exists() else ""
        return {name: int(number) for name, number in re.findall(r"(\w+) (\d+) ", text)}

    def left(self) -> str:
        """Objects that were left when the device was destroyed; the last device's, of several."""
        text = self.log.read_text(encoding="utf-8") if self.log.exists() else ""
        return " ".join(re.findall(r"left: (.+)", text))

    def output(self) -> str:
        """A digest of what was written; pictures and documents hold times, so only their presence counts."""
        for name in ("out.npy", "out.exr", "out.json"):
            path = self.folder / name
            if path.exists():
                return hashlib.sha256(path.read_bytes()).hexdigest() if name == "out.npy" else name
        return ""

    def wrong(self, what: str, done: subprocess.CompletedProcess) -> None:
        self.bad.append(f"{what}: exit code {done.returncode}\n{done.stderr}")
        print(self.bad[-1], file=sys.stderr, flush=True)

    def check(self, what: str, done: subprocess.CompletedProcess, good: str, codes: tuple[int, ...]) -> None:
        """Checks how a run with a fault ended."""
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        said = [line for line in lines if line.startswith("ballot: ")]
        litter = [path.name for path in self.folder.iterdir() if path.name.startswith(".ballot-")]
        if done.returncode not in codes:
            self.wrong(f"{what}: expected one of {codes}", done)
        elif any(raw in done.stderr for raw in RAW):
            self.wrong(f"{what}: a text of a library", done)
        elif self.left():
            self.wrong(f"{what}: left {self.left()}", done)
        elif litter:
            self.wrong(f"{what}: litter {litter}", done)
        elif done.returncode == 0 and self.output() != good:
            self.wrong(f"{what}: another output", done)
        elif done.returncode != 0 and (len(said) != 1 or self.output()):
            self.wrong(f"{what}: {len(said)} messages, output '{self.output()}'", done)


def steps(count: int, every: int) -> list[int]:
    """The first and the last call, and every K-th between them."""
    return sorted({*range(1, count + 1, every), count}) if count else []


def campaign(runner: Runner, name: str, kinds: list[str], every: int) -> int:
    """Runs one command with each fault. Returns the number of runs."""
    words = COMMANDS[name]
    runner.run(words, "none")  # fills the caches, so that all other runs make the same calls
    done = runner.run(words, "none")
    counts, good = runner.counts(), runner.output()
    runner.check(f"{name} without a fault", done, good, (0,))
    calls = {**counts, "timeout": counts.get("wait", 0)}
    runs = 0
    for kind in kinds:
        codes = {"allocate": (0, 1, 3), "submit": (1,), "wait": (1,), "timeout": (0,), "outdated": (0,)}[kind]
        for number in steps(calls.get(kind, 0), every):
            done = runner.run(words, f"{kind}:{number}")
            runner.check(f"{name} {kind}:{number}", done, good, codes)
            if kind in ("submit", "wait") and done.stderr.count("VK_ERROR_DEVICE_LOST") != 1:
                runner.wrong(f"{name} {kind}:{number}: the loss is not named once", done)
            runs += 1
    print(f"{name}: {', '.join(f'{kind} {calls.get(kind, 0)}' for kind in kinds)} calls, {runs} runs", flush=True)
    return runs


def check_checkpoint(runner: Runner) -> None:
    """A render that loses its device late keeps what was rendered, and a second run goes on from there."""
    words = COMMANDS["path"]
    (runner.folder / "out.checkpoint.exr").unlink(missing_ok=True)
    runner.run(words, "none")
    last = runner.counts()["wait"]  # a slower run makes more, as steps take a time
    whole = channels_of(runner.folder / "out.exr")
    done = runner.run(words, f"wait:{last * 2 // 3}", BALLOT_FAULT_DESCRIBE="1")
    runner.check("a late loss", done, "", (1,))
    for part in ("a fault of the tests", "out.checkpoint.exr keeps ", "go on with: "):
        if part not in done.stderr:
            runner.wrong(f"a late loss: no '{part}'", done)
    done = runner.run([*words, "--resume"], "none")
    if done.returncode != 0 or "resumed from" not in done.stdout + done.stderr:
        runner.wrong("going on after a loss", done)
    elif channels_of(runner.folder / "out.exr") != whole:
        runner.wrong("going on after a loss: another picture", done)


def check_pipeline_cache(runner: Runner) -> None:
    """The driver is given what it wrote, and nothing of a file that is damaged, cut short or of an older program."""
    words = COMMANDS["scene"]
    runner.run(COMMANDS["trace"], "none")
    files = list(Path(runner.environment["XDG_CACHE_HOME"]).glob("ballot/pipelines/*.bin"))
    whole = [file.read_bytes() for file in files]
    damaged = [lambda data: data[:-1], lambda data: data[:-1] + bytes([data[-1] ^ 1]), lambda data: data[24:],
               lambda data: b""]
    for change in [lambda data: data, *damaged]:
        for file, data in zip(files, whole):
            file.write_bytes(change(data))
        done = runner.run(words, "none")
        given = runner.counts().get("cache", 0)
        if done.returncode != 0 or not files or (given > 0) != (change not in damaged):
            runner.wrong(f"a pipeline cache: the driver was given {given} bytes", done)
    for file, data in zip(files, whole):
        file.write_bytes(data)


def channels_of(path: Path) -> bytes:
    """The bytes of an EXR behind its header, which holds times: offsets and pixels."""
    data = path.read_bytes()
    return data[data.index(b"\0\0", data.index(b"worldToNDC")):][-4096:]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ballot", type=Path, required=True, help="the program")
    parser.add_argument("--layer", type=Path, required=True, help="folder of the layer's manifest")
    parser.add_argument("--scene", type=Path, required=True)
    parser.add_argument("--cache", type=Path, help="cache folder, which may be warm; else an own one")
    parser.add_argument("--commands", default="info,render,trace", help="of: " + ", ".join(COMMANDS))
    parser.add_argument("--kinds", default="allocate,submit,wait,timeout", help="kinds of faults; also outdated")
    parser.add_argument("--every", type=int, default=1, metavar="K", help="only every K-th call [1]")
    options = parser.parse_args()
    for name in ("ballot", "layer", "scene", "cache"):  # the runs have a folder of their own
        if getattr(options, name):
            setattr(options, name, getattr(options, name).resolve())
    folder = Path(tempfile.mkdtemp(prefix="ballot-faults-"))
    try:
        runner = Runner(options, folder)
        write_rays(folder / "rays.npy")
        runs = sum(campaign(runner, name, options.kinds.split(","), options.every)
                   for name in options.commands.split(","))
        check_checkpoint(runner)
        check_pipeline_cache(runner)
    finally:
        shutil.rmtree(folder)
    print(f"{runs} runs with a fault, {len(runner.bad)} wrong")
    return 1 if runner.bad else 0


def write_rays(path: Path) -> None:
    """64 rays of shape (64, 8): origin, t_min, direction, t_max."""
    import struct
    header = "{'descr': '<f4', 'fortran_order': False, 'shape': (64, 8), }"
    header = header.ljust(117) + "\n"
    rays = b"".join(struct.pack("<8f", 0, 1, 4, 0, i / 64 - 0.5, 0.1, -1, 100) for i in range(64))
    path.write_bytes(b"\x93NUMPY\1\0" + struct.pack("<H", len(header)) + header.encode() + rays)


if __name__ == "__main__":
    sys.exit(main())
