"""Tests the hard-case suite itself by mutation: puts deliberate faults into the shaders; the suite must find each."""

import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

from dev import ROOT, Failed

SHOWN = 6  # cases that a row of the table names
SHADERS = ROOT / "shaders"
TESTS = "*HardCases.Hold/*"


class Fault(NamedTuple):
    name: str
    file: str  # under shaders/
    text: str  # the original text, which must be there exactly once
    instead: str  # the faulty text


FAULTS = (
    Fault("box pad removed", "lib/numeric/box_padded.glsl",
          "precise vec3 e = vec3(pad) + 1.25e-7 * o;",
          "precise vec3 e = vec3(0.0);"),
    Fault("relative boxes have no room at the origin", "lib/numeric/box_relative.glsl",
          "vec3 room = 1.25e-7 * abs(origin) + (3.47e-18 * m + 1.9e-37) ROOM_IN_DOUBLE(ray, m);",
          "vec3 room = vec3(0.0);"),
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


def put_in(fault: Fault, folder: Path) -> Path:
    """Copies the shaders to a folder and puts in the fault. Throws Failed if its text is not there exactly once."""
    shutil.copytree(SHADERS, folder)
    path = folder / fault.file
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    if (found := text.count(fault.text)) != 1:
        raise Failed(f"mutation '{fault.name}': shaders/{fault.file} has its text {found} times, expected once; "
                     f"correct tools/dev/mutations.py. The text: {fault.text}")
    path.write_text(text.replace(fault.text, fault.instead), encoding="utf-8")
    return folder


def failed_cases(build: Path, shaders: Path, tests: str) -> list[str]:
    """Runs the suite on these shaders; returns the cases that fail. Throws Failed if it did not run to its end."""
    environment = {"XDG_CACHE_HOME": str(build / "cache"), **os.environ, "BALLOT_SHADERS": str(shaders)}
    with tempfile.NamedTemporaryFile(suffix=".json") as report:
        said = subprocess.run(
            [build / "tests" / "ballot_device_tests", f"--gtest_filter={tests}", f"--gtest_output=json:{report.name}"],
            env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", check=False,
            timeout=600).stdout
        document = json.loads(report.read() or "{}")
    if not document.get("tests") or "does not compile" in said or "does not preprocess" in said:
        raise Failed("the suite did not run to its end, or no test matches:\n" + "\n".join(said.splitlines()[-20:]))
    return [test["name"].split("/", 1)[-1].replace("_", "-")
            for suite in document["testsuites"] for test in suite["testsuite"] if test.get("failures")]


def check(build: Path, tests: str) -> int:
    """Checks that the suite passes without a fault and fails with every fault; returns 0. Throws Failed if not."""
    with tempfile.TemporaryDirectory(prefix="ballot-mutations-") as temporary:
        faulty = [put_in(fault, Path(temporary) / str(i)) for i, fault in enumerate(FAULTS)]
        if cases := failed_cases(build, SHADERS, tests):
            raise Failed(f"the suite fails without any fault, so it proves nothing; first repair: {', '.join(cases)}")
        alive = []
        print(f"{'fault':47} {'file':36} found by")
        for fault, shaders in zip(FAULTS, faulty):
            cases = failed_cases(build, shaders, tests)
            more = f" and {len(cases) - SHOWN} more" if len(cases) > SHOWN else ""
            print(f"{fault.name:47} {fault.file:36} {', '.join(cases[:SHOWN]) or 'NONE'}{more}", flush=True)
            alive += [] if cases else [fault.name]
    if alive:
        raise Failed(f"the suite does not find {len(alive)} of {len(FAULTS)} faults: {', '.join(alive)}")
    return 0
