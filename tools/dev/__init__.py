"""What the commands of tools/dev.py share: running programs, building a preset, finding scenes."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PRESETS = ("release", "debug", "asan", "tsan")
BYTES_PER_COMPILER = 5 << 28  # the largest unit takes 1.2 GB


class Failed(Exception):
    """The exception of failed work. Its text says what failed and what to do."""


def run(*command, **options) -> subprocess.CompletedProcess:
    """Runs a program in ROOT. Throws Failed if it fails, with what it said if its output is captured."""
    words = list(map(str, command))
    done = subprocess.run(words, **{"cwd": ROOT, "text": True, "errors": "replace", "check": False, **options})
    if done.returncode:
        said = "\n".join(((done.stdout or "") + (done.stderr or "")).strip().splitlines()[-40:])
        raise Failed(f"exit code {done.returncode} of `{' '.join(words)}`{':' if said else ''} {said}".rstrip())
    return done


def default_jobs() -> int:
    """Returns the number of compilers to run at once: one for each core, but no more than fit in memory."""
    free = re.search(r"MemAvailable:\s+(\d+)", Path("/proc/meminfo").read_text(encoding="ascii"))
    return max(1, min(len(os.sched_getaffinity(0)), int(free.group(1)) * 1024 // BYTES_PER_COMPILER))


def build(preset: str, targets=(), tests: bool = True, jobs: int | None = None) -> Path:
    """Configures and builds a preset; returns the build folder. Without `tests` it needs no package of theirs."""
    run("cmake", "--preset", preset, "--log-level=WARNING", f"-DBALLOT_TESTS={'ON' if tests else 'OFF'}")
    words = ["--target", *targets] if targets else []
    run("cmake", "--build", "--preset", preset, "--parallel", jobs or default_jobs(), *words)
    return ROOT / "build" / preset


def scene_file(name: str) -> Path:
    """Returns the file of one of our scenes. One that is not in the checkout is made, unless it is newer than all of
    scenes/*.py."""
    file, sources = ROOT / "scenes" / f"{name}.gltf", (ROOT / "scenes").glob("*.py")
    if file.is_file():
        return file
    file = ROOT / "build" / "scenes" / f"{name}.glb"
    if not file.exists() or file.stat().st_mtime < max(source.stat().st_mtime for source in sources):
        print(f"generating {file.relative_to(ROOT)} ...", flush=True)
        file.parent.mkdir(parents=True, exist_ok=True)
        new = file.with_name(f"new-{file.name}")
        run(sys.executable, "-B", ROOT / "scenes" / f"make_{name}.py", new)
        new.replace(file)
    return file
