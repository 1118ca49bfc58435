"""Tests the hard-case suite itself by mutation: puts deliberate faults into the shaders; the suite must find each."""

import json
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from dev_build import ROOT, build_folder
from dev_packages import Failed

SHOWN = 6  # cases that a row of the table names
SHADERS = ROOT / "shaders"
TESTS = "*HardCases.Hold/*"
TIME_LIMIT_S = 600


@dataclass(frozen=True)
class Fault:
    name: str
    file: str  # under shaders/
    text: str  # the original text, which must be there exactly once
    instead: str  # the faulty text


FAULTS = (
    Fault("box pad removed", "lib/numeric/box_padded.glsl",
          "precise vec3 e = vec3(pad) + 1.25e-7 * o;",
          "precise vec3 e = vec3(0.0);"),
    Fault("relative boxes have no room at the origin", "lib/numeric/box_relative.glsl",
          "vec3 room = 1.25e-7 * abs(origin) + (3.47e-18 * m + 1.9e-37);", "vec3 room = vec3(0.0);"),
    Fault("relative boxes are not stretched", "lib/numeric/box_relative.glsl",
          "return fma(abs(end), END_SLACK, end);", "return end;"),
    Fault("interval of one point is empty", "lib/tree/leaf.glsl", "return i.x <= i.y;\n}\n\n// The same",
          "return i.x < i.y;\n}\n\n// The same"),
    Fault("edges do not belong to triangles", "lib/numeric/triangle_watertight.glsl",
          "smaller(smaller(a, b), c) >= 0.0 || larger(larger(a, b), c) <= 0.0",
          "smaller(smaller(a, b), c) > 0.0 || larger(larger(a, b), c) < 0.0"),
    Fault("interval of one point is empty in packets", "lib/packet/packet_rays.glsl", "met |= uint(i.x <= i.y) << r;",
          "met |= uint(i.x < i.y) << r;"),
    Fault("mirrored pad points inwards", "lib/numeric/padded_slabs.glsl",
          "return Slabs(mix(s.lo_origin, -s.hi_origin, down), mix(s.hi_origin, -s.lo_origin, down), abs(s.inv));",
          "return Slabs(mix(s.lo_origin, -s.lo_origin, down), mix(s.hi_origin, -s.hi_origin, down), abs(s.inv));"),
    Fault("ties go to the first met", "lib/numeric/hit_order.glsl",
          "t < best.t || (t == best.t && prim_at(place) < prim_at(best.prim))", "t < best.t"),
    Fault("t_min and t_max do not belong to the ray", "lib/numeric/hit_order.glsl", "t >= ray.t_min && t <= best.t",
          "t > ray.t_min && t < best.t"),
    Fault("zero directions unguarded", "lib/numeric/box.glsl", "precise vec3 inv = 1.0 / d;",
          "precise vec3 inv = 1.0 / dir;"),
    Fault("NaN and infinity unguarded", "lib/tree/leaf.glsl", "return !finite || IS_EMPTY_RANGE(ray.t_min, ray.t_max)",
          "return !(ray.t_max > ray.t_min)"),
)


def mutated(fault: Fault, source: Path, folder: Path) -> None:
    """Copies the shaders to a folder and puts in the fault. Throws Failed if its text is not there exactly once."""
    shutil.copytree(source, folder)
    path = folder / fault.file
    if not path.is_file():
        raise Failed(f"mutation '{fault.name}': there is no shaders/{fault.file}; correct tools/dev_mutations.py")
    text = path.read_text(encoding="utf-8")
    if (found := text.count(fault.text)) != 1:
        raise Failed(f"mutation '{fault.name}': shaders/{fault.file} has its text {found} times, expected once; "
                     f"correct tools/dev_mutations.py. The text: {fault.text}")
    path.write_text(text.replace(fault.text, fault.instead), encoding="utf-8")


def failed_cases(document: dict) -> list[str]:
    """Returns the names of the cases that failed, from a JSON report of GoogleTest."""
    return [test["name"].split("/", 1)[-1].replace("_", "-")
            for suite in document.get("testsuites", []) for test in suite.get("testsuite", []) if test.get("failures")]


def run_suite(binary: Path, shaders: Path, tests: str, folder: Path) -> list[str]:
    """Runs the suite on these shaders; returns the cases that fail. Throws Failed if it did not run to its end."""
    report = folder / "report.json"
    report.unlink(missing_ok=True)
    environment = {**os.environ, "BALLOT_SHADERS": str(shaders)}
    environment.setdefault("XDG_CACHE_HOME", str(binary.parent.parent / "cache"))
    command = [str(binary), f"--gtest_filter={tests}", f"--gtest_output=json:{report}"]
    try:
        result = subprocess.run(command, env=environment, capture_output=True, text=True, errors="replace", check=False,
                                timeout=TIME_LIMIT_S)
    except subprocess.TimeoutExpired:
        raise Failed(f"the suite did not end within {TIME_LIMIT_S} s") from None
    lines = (result.stdout + result.stderr).strip().splitlines()
    if not report.is_file():
        raise Failed(f"the suite ended with exit code {result.returncode} and without a report:\n"
                     + "\n".join(lines[-20:]))
    if broken := [line for line in lines if "does not compile" in line or "does not preprocess" in line]:
        raise Failed(f"the faulty shaders must compile, but: {broken[0].strip()}")
    document = json.loads(report.read_text(encoding="utf-8"))
    if document.get("tests", 0) == 0:
        raise Failed(f"no test matches {tests}")
    return failed_cases(document)


def print_table(rows: list[tuple[Fault, list[str]]]) -> None:
    widths = (max(len(fault.name) for fault, _ in rows), max(len(fault.file) for fault, _ in rows))
    print(f"{'fault':{widths[0]}}  {'file':{widths[1]}}  found by")
    for fault, cases in rows:
        killers = ", ".join(cases[:SHOWN]) + (f" and {len(cases) - SHOWN} more" if len(cases) > SHOWN else "")
        print(f"{fault.name:{widths[0]}}  {fault.file:{widths[1]}}  {killers or 'NONE'}")


def check_texts() -> None:
    """Throws Failed if a fault's text is not in the shaders exactly once."""
    with tempfile.TemporaryDirectory(prefix="ballot-mutations-") as temporary:
        for i, fault in enumerate(FAULTS):
            mutated(fault, SHADERS, Path(temporary) / str(i))


def check(preset: str, tests: str = TESTS) -> int:
    """Checks that the suite passes without a fault and fails with every fault; returns 0. Throws Failed if not."""
    binary = build_folder(preset) / "tests" / "ballot_device_tests"
    with tempfile.TemporaryDirectory(prefix="ballot-mutations-") as temporary:
        folder = Path(temporary)
        for i, fault in enumerate(FAULTS):  # all before the first long run, to report outdated texts at once
            mutated(fault, SHADERS, folder / str(i))
        print("no fault ...", flush=True)
        if cases := run_suite(binary, SHADERS, tests, folder):
            raise Failed(f"the suite fails without any fault, so it proves nothing; first repair: {', '.join(cases)}")
        rows = []
        for i, fault in enumerate(FAULTS):
            print(f"{fault.name} ...", flush=True)
            rows.append((fault, run_suite(binary, folder / str(i), tests, folder)))
    print_table(rows)
    alive = [fault.name for fault, cases in rows if not cases]
    if alive:
        raise Failed(f"the suite does not find {len(alive)} of {len(rows)} faults: {', '.join(alive)}")
    return 0


if __name__ == "__main__":  # run by ctest each time: checks only the texts, because running the faults takes minutes
    try:
        check_texts()
    except Failed as error:
        raise SystemExit(str(error)) from None
