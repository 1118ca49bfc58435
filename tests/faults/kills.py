#!/usr/bin/env python3
"""Kills ballot at random moments (SIGKILL) and checks that nothing is lost, half-written or left behind.

Each round has the outputs of an earlier run, starts the command again, kills it, and looks: every output must be there
and whole, the old one or the new one. The command is then run to its end, after which no temporary file may be left."""

import argparse
import json
import os
import random
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# command: its arguments, and what it writes
COMMANDS = {
    "render": (["render", "SCENE", "--view", "view0", "--size", "64x64", "--spp", "4", "--shading", "path",
                "--checkpoint", "0.01", "--tiles", "0/2", "--out", "p0.exr", "--png"], ["p0.exr", "p0.png"]),
    "trace": (["trace", "SCENE", "--rays", "rays.npy", "--out", "hits.npy", "--json", "trace.json", "--method",
               "while-while"], ["hits.npy", "trace.json"]),
    "bench": (["bench", "SCENE", "--methods", "while-while,bvh4", "--rays", "primary,ao", "--views", "view0", "--size",
               "32x32", "--repeat", "3", "--json", "bench.json"], ["bench.json"]),
    "merge": (["merge", "q0.exr", "q1.exr", "--out", "merged.exr"], ["merged.exr"]),
    "verify": (["verify", "SCENE", "--methods", "while-while", "--rays", "primary", "--views", "view0", "--size",
                "32x32", "--json", "verify.json"], ["verify.json"]),
}
RAYS = 20000


class Round:
    def __init__(self, options, folder: Path):
        self.options, self.folder = options, folder
        self.environment = {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}
        self.bad = []

    def words(self, words: list[str]) -> list[str]:
        return [str(self.options.ballot), *[str(self.options.scene) if w == "SCENE" else w for w in words]]

    def finish(self, words: list[str]) -> float:
        """Runs a command to its end. Returns its seconds."""
        start = time.monotonic()
        done = subprocess.run(self.words(words), cwd=self.folder, env=self.environment, capture_output=True, text=True,
                              errors="replace", timeout=300, check=False)
        if done.returncode != 0:
            self.wrong(f"{words[0]} to its end: exit code {done.returncode}\n{done.stderr}")
        return time.monotonic() - start

    def kill(self, words: list[str], after: float) -> bool:
        """Kills a command after so many seconds. Returns false if it had ended by then."""
        with subprocess.Popen(self.words(words), cwd=self.folder, env=self.environment, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL) as process:
            time.sleep(after)
            process.kill()
            return process.wait() == -signal.SIGKILL

    def wrong(self, what: str) -> None:
        self.bad.append(what)
        print(what, file=sys.stderr, flush=True)

    def is_whole(self, path: Path) -> bool:
        if path.suffix == ".json":
            try:
                return isinstance(json.loads(path.read_text(encoding="utf-8")), dict)
            except ValueError:
                return False
        data = path.read_bytes()
        if path.suffix == ".npy":
            return len(data) == 10 + struct.unpack("<H", data[8:10])[0] + 16 * RAYS
        if path.suffix == ".png":
            return data.startswith(b"\x89PNG\r\n\x1a\n") and data.endswith(b"IEND\xaeB\x60\x82")
        return is_whole_exr(data)

    def litter(self) -> list[str]:
        return [str(path.relative_to(self.folder)) for path in self.folder.rglob(".ballot-*.tmp")]

    def play(self, name: str, seconds: float, random_number: random.Random) -> bool:
        words, outputs = COMMANDS[name]
        killed = self.kill(words, random_number.uniform(0, seconds))
        for output in outputs:
            path = self.folder / output
            if not path.exists():
                self.wrong(f"{name}: {output} is lost")
            elif not self.is_whole(path):
                self.wrong(f"{name}: {output} is half-written")
        return killed


def is_whole_exr(data: bytes) -> bool:
    """True if the offset table of a scanline EXR is filled and its last chunk ends where the file ends."""
    at = 8
    window, lines = None, 1
    while data[at] != 0:
        name_end = data.index(b"\0", at)
        type_end = data.index(b"\0", name_end + 1)
        size = struct.unpack("<i", data[type_end + 1:type_end + 5])[0]
        value = data[type_end + 5:type_end + 5 + size]
        if data[at:name_end] == b"dataWindow":
            window = struct.unpack("<4i", value)
        if data[at:name_end] == b"compression":
            lines = {0: 1, 1: 1, 2: 1, 3: 16}[value[0]]
        at = type_end + 5 + size
    chunks = -(-(window[3] - window[1] + 1) // lines)
    offsets = struct.unpack(f"<{chunks}Q", data[at + 1:at + 1 + 8 * chunks])
    last = max(offsets)
    if min(offsets) == 0 or last + 8 > len(data):
        return False
    return last + 8 + struct.unpack("<i", data[last + 4:last + 8])[0] == len(data)


def write_rays(path: Path) -> None:
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({RAYS}, 8), }}"
    header = header.ljust(117) + "\n"
    numbers = random.Random(1)
    rays = b"".join(struct.pack("<8f", 0, 1, 4, 0, numbers.uniform(-1, 1), numbers.uniform(-1, 1), -1, 100)
                    for _ in range(RAYS))
    path.write_bytes(b"\x93NUMPY\1\0" + struct.pack("<H", len(header)) + header.encode() + rays)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ballot", type=Path, required=True, help="the program")
    parser.add_argument("--scene", type=Path, required=True)
    parser.add_argument("--kills", type=int, default=200, help="in all [200]")
    parser.add_argument("--commands", default=",".join(COMMANDS), help="of: " + ", ".join(COMMANDS))
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    options.ballot, options.scene = options.ballot.resolve(), options.scene.resolve()
    names = options.commands.split(",")
    folder = Path(tempfile.mkdtemp(prefix="ballot-kills-"))
    killed, numbers = dict.fromkeys(names, 0), random.Random(options.seed)
    try:
        rounds = Round(options, folder)
        write_rays(folder / "rays.npy")
        if "merge" in names:
            for part in "01":
                rounds.finish(["render", "SCENE", "--view", "view0", "--size", "64x64", "--tiles", f"{part}/2", "--out",
                               f"q{part}.exr"])
        for name in names:
            rounds.finish(COMMANDS[name][0])
            seconds = rounds.finish(COMMANDS[name][0])
            wanted = -(-options.kills // len(names))
            for _ in range(4 * wanted):  # a run that has ended before it is killed does not count
                killed[name] += rounds.play(name, seconds, numbers)
                if killed[name] == wanted:
                    break
            rounds.finish(COMMANDS[name][0])
            if rounds.litter():
                rounds.wrong(f"{name}: the next run left {rounds.litter()}")
    finally:
        shutil.rmtree(folder)
    print(f"killed: {', '.join(f'{name} {count}' for name, count in killed.items())}; {len(rounds.bad)} wrong")
    return 1 if rounds.bad else 0


if __name__ == "__main__":
    sys.exit(main())
