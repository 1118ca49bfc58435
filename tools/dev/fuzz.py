"""Runs campaigns of libFuzzer over the targets of tests/fuzz."""

import os
import re
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from dev import Failed, build, default_jobs, run

SANITIZERS = {"ASAN_OPTIONS": "quarantine_size_mb=16:detect_leaks=1:allocator_may_return_null=1",
              "UBSAN_OPTIONS": "print_stacktrace=1"}


def campaign(folder: Path, name: str, minutes: float) -> bool:
    """Runs one target and prints a line on it. Returns true if no input failed."""
    program, log = folder / "tests/fuzz/ballot_fuzz", folder / f"fuzz_{name}.log"
    seeds, corpus, findings = (folder / kind / name for kind in ("seeds", "corpus", "findings"))
    for path in (corpus, findings):
        path.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, **SANITIZERS, "BALLOT_FUZZ_TARGET": name}
    run(program, "--seeds", seeds, env=environment, capture_output=True)
    words = Path(f"{seeds}.dict")
    dictionary = [f"-dict={words}"] if words.stat().st_size else []  # libFuzzer refuses an empty one
    quiet = 3 if name == "command" else 1  # what the target prints
    with log.open("w", encoding="utf-8") as out:
        code = subprocess.run(
            [program, f"-max_total_time={max(1, round(60 * minutes))}", *dictionary, "-timeout=20",
             "-rss_limit_mb=4096", "-max_len=16384", f"-close_fd_mask={quiet}", f"-artifact_prefix={findings}/",
             corpus, seeds], stdout=out, stderr=subprocess.STDOUT, env=environment, check=False).returncode
    text = log.read_text(encoding="utf-8", errors="replace")
    kept = ", ".join(re.findall(r"Test unit written to (\S+)", text)) or "no input was kept"
    done = re.search(r"#(\d+)\s+DONE\s+cov: (\d+)", text)
    print(f"{name:10} failed: {kept}; the log is {log}" if code else
          f"{name:10} {done and done[1]:>9} inputs, {done and done[2]:>6} edges covered, no finding", flush=True)
    return code == 0


def fuzz(names: list[str], minutes: float, jobs: int | None) -> int:
    folder = build("fuzz", ["ballot_fuzz"], tests=False, jobs=jobs)
    names = names or run(folder / "tests/fuzz/ballot_fuzz", "--targets", capture_output=True).stdout.split()
    with ThreadPoolExecutor(jobs or default_jobs()) as pool:
        good = list(pool.map(lambda name: campaign(folder, name, minutes), names))
    if not all(good):
        raise Failed(f"inputs of {', '.join(name for name, fine in zip(names, good) if not fine)} failed")
    return 0
