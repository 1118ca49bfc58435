"""Builds the fuzz targets of tests/fuzz and runs campaigns of libFuzzer."""

import re
import subprocess
import time
from pathlib import Path

import dev_build
from dev_packages import Failed

HELP = """\
Reads mutated files under address and undefined-behaviour sanitizers. TARGET is one of those in tests/fuzz: gltf, obj,
mesh (PLY, STL, NPY), exr, results; without it all run, one after the other. The corpus of each is kept in
build/fuzz/corpus and starts from seeds that the target makes; inputs that fail are kept in build/fuzz/findings.

  tools/dev.py fuzz                       a minute of each target
  tools/dev.py fuzz gltf --minutes 30
"""


def targets() -> list[str]:
    return sorted(path.stem.removeprefix("fuzz_") for path in (dev_build.ROOT / "tests/fuzz").glob("fuzz_*.cpp"))


def add_options(parser) -> None:
    parser.add_argument("--minutes", type=float, default=1, metavar="N", help="time for each target [1]")
    parser.add_argument("--jobs", type=int, metavar="N", help="number of compilers to run at once")


def chosen(rest: list[str]) -> list[str]:
    unknown = [name for name in rest if name not in targets()]
    if unknown:
        raise Failed(f"there is no fuzz target '{unknown[0]}'; there are: {', '.join(targets())}")
    return rest or targets()


def campaign(folder: Path, name: str, minutes: float) -> str:
    """Runs one target. Returns a line on what it did. Throws Failed if an input failed."""
    program = folder / "tests/fuzz" / f"fuzz_{name}"
    seeds, corpus, findings = (folder / kind / name for kind in ("seeds", "corpus", "findings"))
    for path in (corpus, findings):
        path.mkdir(parents=True, exist_ok=True)
    subprocess.run([program, "--seeds", seeds], check=True)
    log = folder / f"fuzz_{name}.log"
    start = time.monotonic()
    with log.open("w", encoding="utf-8") as out:
        done = subprocess.run([program, f"-max_total_time={max(1, round(60 * minutes))}", f"-dict={seeds}.dict",
                               "-timeout=20", "-rss_limit_mb=4096", "-max_len=65536", "-print_final_stats=1",
                               f"-artifact_prefix={findings}/", corpus, seeds], stdout=out, stderr=subprocess.STDOUT)
    text = log.read_text(encoding="utf-8", errors="replace")
    if done.returncode != 0:
        kept = re.findall(r"Test unit written to (\S+)", text)
        raise Failed(f"fuzz target {name} failed: {', '.join(kept) or 'no input was kept'}; the log is {log}")
    runs = re.findall(r"number_of_executed_units:\s+(\d+)", text)
    cover = re.findall(r"cov: (\d+)", text)
    return (f"{name:8} {int(runs[-1]) if runs else 0:>10} inputs in {time.monotonic() - start:5.0f} s, "
            f"{cover[-1] if cover else '?':>6} edges covered, no finding")


def fuzz(options, rest: list[str]) -> int:
    names = chosen(rest)
    folder = dev_build.build("fuzz", options.jobs, [f"fuzz_{name}" for name in names])
    failures = []
    for name in names:
        try:
            print(campaign(folder, name, options.minutes), flush=True)
        except Failed as error:
            print(error, flush=True)
            failures.append(name)
    if failures:
        raise Failed(f"inputs of {', '.join(failures)} failed; each log names them")
    return 0
