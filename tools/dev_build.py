"""Configures and builds a preset; prints little unless it fails."""

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

from dev_packages import Failed

ROOT = Path(__file__).resolve().parent.parent
PRESETS = ("release", "debug", "asan", "tsan")
BYTES_PER_COMPILER = 5 << 28  # the largest unit takes 1.2 GB


def build_folder(preset: str) -> Path:
    return ROOT / "build" / preset


def default_jobs() -> int:
    """Returns the number of compilers to run at once: one for each core, but no more than fit in memory."""
    cores = len(os.sched_getaffinity(0))
    try:
        text = Path("/proc/meminfo").read_text(encoding="ascii")
        free = int(re.search(r"MemAvailable:\s+(\d+)", text).group(1)) * 1024
    except (OSError, AttributeError):
        return cores
    return max(1, min(cores, free // BYTES_PER_COMPILER))


def run_logged(what: str, command: list[str], log: Path) -> None:
    """Runs a command with its output in `log`. Shows a line of progress, and the end of the log if the command fails.

    Throws Failed."""
    terminal = sys.stdout.isatty()
    log.parent.mkdir(parents=True, exist_ok=True)
    print(f"{what} ...", end="" if terminal else "\n", flush=True)
    start = time.monotonic()
    tenth = 0  # of the steps, as printed without a terminal
    with log.open("w", encoding="utf-8", errors="replace", buffering=1) as out:  # it grows line by line
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              errors="replace") as process:
            for line in process.stdout:
                out.write(line)
                step = re.match(r"\[(\d+)/(\d+)\]", line)
                if not step:
                    continue
                percent = 100 * int(step.group(1)) // max(1, int(step.group(2)))
                if terminal:
                    print(f"\r{what} ... {percent} % ({step.group(1)} of {step.group(2)})\x1b[K", end="", flush=True)
                elif percent // 10 > tenth:
                    tenth = percent // 10
                    print(f"{what}: {percent} %, {time.monotonic() - start:.0f} s", flush=True)
    if terminal:
        print("\r\x1b[K", end="")
    if process.returncode == 0:
        print(f"{what}: done in {time.monotonic() - start:.0f} s", flush=True)
        return
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    print("\n".join(lines[-60:]), file=sys.stderr)
    raise Failed(f"{what} failed; the whole log is {log}")


def build(preset: str, jobs: int | None = None, targets: list[str] | None = None, tests: bool = True) -> Path:
    """Configures and builds a preset; returns the build folder. Without `tests` it needs no package of theirs. Throws
    Failed."""
    if shutil.which("cmake") is None:
        raise Failed("cmake was not found; install it (Debian: package cmake)")
    folder = build_folder(preset)
    configure = ["cmake", "--preset", preset]
    if preset in PRESETS:
        configure.append(f"-DBALLOT_TESTS={'ON' if tests else 'OFF'}")
    run_logged(f"configuring {preset}", configure, folder / "configure.log")
    command = ["cmake", "--build", "--preset", preset, "--parallel", str(jobs or default_jobs())]
    if targets:
        command += ["--target", *targets]
    run_logged(f"building {preset}", command, folder / "build.log")
    return folder


def ballot_binary(preset: str) -> Path:
    binary = build_folder(preset) / "ballot"
    if not binary.is_file():
        raise Failed(f"the build succeeded but did not make {binary}")
    return binary
