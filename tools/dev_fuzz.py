"""Builds the fuzz targets of tests/fuzz and runs campaigns of libFuzzer."""

import os
import re
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

import dev_build
from dev_packages import Failed

HELP = """\
Reads mutated files under address and undefined-behaviour sanitizers. TARGET is one of those in tests/fuzz: bvh (the
cache of trees), cache (folders), checkpoint, command (lines), exr, gltf, mesh (PLY, STL),
npy, obj, results, views; without it all run, as many at once as there are cores. What a target learns is kept in
build/fuzz/corpus, inputs that fail in build/fuzz/findings. The last table has the inputs, CPU seconds and covered lines
of each reader.

  tools/dev.py fuzz                       a minute of each target
  tools/dev.py fuzz gltf --minutes 30
"""

# target: the files of its reader, for the lines covered
READERS = {
    "bvh": ["engine/bvh/cache.cpp"],
    "cache": ["engine/core/cache_file.cpp", "engine/core/temporary.cpp"],
    "checkpoint": ["engine/render/film/film_file.cpp", "engine/core/image_exr.cpp"],
    "command": ["tools/program.cpp", "tools/cli.cpp", "tools/command_files.cpp", "tools/run_args.cpp",
                "tools/cmd_*.cpp", "tools/bench/plan.cpp"],
    "exr": ["engine/core/exr_header.cpp", "engine/core/image_exr.cpp", "engine/core/image_merge.cpp",
            "engine/scene/sky.cpp"],
    "gltf": ["engine/scene/gltf_*.cpp", "engine/scene/load_gltf.cpp", "engine/scene/checked_bytes.cpp",
             "engine/scene/named_file.cpp", "engine/scene/texture.cpp", "engine/scene/animation.cpp"],
    "mesh": ["engine/scene/load_ply.cpp", "engine/scene/ply_file.cpp", "engine/scene/load_stl.cpp"],
    "npy": ["engine/core/npy*.cpp", "engine/scene/load_npy.cpp"],
    "obj": ["engine/scene/load_obj.cpp", "engine/scene/obj_*.cpp", "engine/scene/polygon.cpp"],
    "views": ["tools/views_file.cpp"],
}
SANITIZERS = {"ASAN_OPTIONS": "quarantine_size_mb=16:detect_leaks=1:allocator_may_return_null=1",
              "UBSAN_OPTIONS": "print_stacktrace=1"}


def add_options(parser) -> None:
    parser.add_argument("--minutes", type=float, default=1, metavar="N", help="time for each target [1]")
    parser.add_argument("--jobs", type=int, metavar="N", help="number of compilers, then of targets, to run at once")


def chosen(rest: list[str]) -> list[str]:
    unknown = [name for name in rest if name not in READERS]
    if unknown:
        raise Failed(f"there is no fuzz target '{unknown[0]}'; there are: {', '.join(READERS)}")
    return rest or list(READERS)


def make_seeds(program: Path, seeds: Path, environment: dict) -> None:
    """Lets a target write its seeds and dictionary. Throws Failed with what the target said."""
    done = subprocess.run([program, "--seeds", seeds], env=environment, capture_output=True, text=True,
                          errors="replace", check=False)
    if done.returncode != 0:
        said = "\n".join(done.stderr.splitlines()[-40:])
        raise Failed(f"fuzz target {seeds.name} cannot make its seeds, exit code {done.returncode}:\n{said}")


def covered_lines(program: Path, name: str, raw: Path) -> str:
    """Returns the share of the reader's lines that the campaign ran."""
    profile = raw.with_suffix(".profdata")
    sources = [path for pattern in READERS[name] for path in sorted(dev_build.ROOT.glob(pattern))]
    try:
        subprocess.run(["llvm-profdata-16", "merge", "-sparse", raw, "-o", profile], check=True, capture_output=True)
        report = subprocess.run(["llvm-cov-16", "report", program, f"-instr-profile={profile}", *sources], check=True,
                                capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return "? (llvm-profdata-16 and llvm-cov-16 are of the package llvm-16)"
    (raw.with_suffix(".coverage")).write_text(report, encoding="utf-8")
    total = next((line.split() for line in report.splitlines() if line.startswith("TOTAL")), [])
    return f"{total[9]} of {total[7]} lines" if len(total) > 9 else "?"


def run_timed(command: list, out, environment: dict) -> tuple[int, float]:
    """Runs a program. Returns its exit status and its CPU seconds, which are its own although others run beside it."""
    with subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT, env=environment) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, used.ru_utime + used.ru_stime


def campaign(folder: Path, name: str, minutes: float) -> str:
    """Runs one target. Returns a line on what it did. Throws Failed if an input failed."""
    program = folder / "tests/fuzz/ballot_fuzz"
    seeds, corpus, findings = (folder / kind / name for kind in ("seeds", "corpus", "findings"))
    for path in (corpus, findings):
        path.mkdir(parents=True, exist_ok=True)
    raw = folder / f"fuzz_{name}.profraw"
    environment = {**os.environ, **SANITIZERS, "BALLOT_FUZZ_TARGET": name, "LLVM_PROFILE_FILE": str(raw)}
    make_seeds(program, seeds, environment)
    log = folder / f"fuzz_{name}.log"
    words = Path(f"{seeds}.dict")
    dictionary = [f"-dict={words}"] if words.stat().st_size else []  # libFuzzer refuses an empty one
    command = [program, f"-max_total_time={max(1, round(60 * minutes))}", *dictionary, "-timeout=20",
               "-rss_limit_mb=4096", "-max_len=16384", "-print_final_stats=1",
               "-close_fd_mask=3" if name == "command" else "-close_fd_mask=1", f"-artifact_prefix={findings}/", corpus,
               seeds]
    start = time.monotonic()
    with log.open("w", encoding="utf-8") as out:
        status, spent = run_timed(command, out, environment)
    text = log.read_text(encoding="utf-8", errors="replace")
    if status != 0:
        kept = re.findall(r"Test unit written to (\S+)", text)
        raise Failed(f"fuzz target {name} failed: {', '.join(kept) or 'no input was kept'}; the log is {log}")
    runs = re.findall(r"number_of_executed_units:\s+(\d+)", text)
    return (f"{name:10} {int(runs[-1]) if runs else 0:>9} inputs in {time.monotonic() - start:5.0f} s, {spent:5.0f} "
            f"CPU-s, reader covered {covered_lines(program, name, raw)}, no finding")


def fuzz(options, rest: list[str]) -> int:
    names = chosen(rest)
    folder = dev_build.build("fuzz", options.jobs, ["ballot_fuzz"])
    failures = []
    with ThreadPoolExecutor(options.jobs or dev_build.default_jobs()) as pool:
        runs = {pool.submit(campaign, folder, name, options.minutes): name for name in names}
        for run in as_completed(runs):
            try:
                print(run.result(), flush=True)
            except Failed as error:
                print(error, flush=True)
                failures.append(runs[run])
    if failures:
        raise Failed(f"inputs of {', '.join(failures)} failed; each log names them")
    return 0
