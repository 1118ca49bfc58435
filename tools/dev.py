#!/usr/bin/env python3
"""The developer's commands for Ballot: set-up, build, tests, formatting, scenes, bundles. CI runs the same commands."""

import argparse
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # no __pycache__ in the source tree
sys.path.insert(0, str(Path(__file__).resolve().parent))

import dev_build  # noqa: E402
import dev_bundle  # noqa: E402
import dev_fuzz  # noqa: E402
import dev_gallery  # noqa: E402
import dev_lint  # noqa: E402
import dev_mesa  # noqa: E402
import dev_mutations  # noqa: E402
import dev_packages  # noqa: E402
import dev_scaling  # noqa: E402
import dev_scenes  # noqa: E402
from dev_build import ROOT  # noqa: E402
from dev_packages import Failed  # noqa: E402

SETUP = """\
The command first sets up the machine and builds. It lists missing packages of Debian 12 with their reasons and installs
them with apt-get, through sudo if you are not root; with --no-install it stops and prints what to type instead. Then it
configures and builds the preset in build/PRESET, the program alone unless tests are to run; a second call builds only
what changed. The logs, build/PRESET/*.log, grow meanwhile.
"""


def set_up(options: argparse.Namespace, command: str) -> None:
    """Installs what a command needs and builds: everything for the tests, else the program alone."""
    dev_packages.ensure(command, install=not options.no_install)
    tests = command == "test"
    dev_build.build(options.preset, options.jobs, None if tests else ["ballot"], tests)


def has_option(arguments: list[str], name: str) -> bool:
    return any(argument == name or argument.startswith(name + "=") for argument in arguments)


def value_of(arguments: list[str], name: str) -> str | None:
    for i, argument in enumerate(arguments):
        if argument.startswith(name + "="):
            return argument.split("=", 1)[1]
        if argument == name and i + 1 < len(arguments):
            return arguments[i + 1]
    return None


def number_text(value) -> str:
    return f"{value:.3g}" if isinstance(value, (int, float)) else "-"


def print_records(files: list[Path]) -> None:
    rows = [("scene", "view", "seconds", "Mrays/s", "file")]
    device = ""
    for file in files:
        try:
            document = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise Failed(f"cannot read {file}, which ballot wrote: {error}") from None
        device = f"{document.get('device', '?')}, {document.get('driver', '?')}, subgroups of " \
                 f"{document.get('subgroup_size', '?')}"
        for record in document.get("records", []):
            rows.append((str(record.get("scene", "")), str(record.get("view", "")), number_text(record.get("seconds")),
                         number_text(record.get("mrays_per_s")), str(record.get("png") or record.get("exr") or "")))
    widths = [max(len(row[i]) for row in rows) for i in range(4)]
    print(device)
    for row in rows:
        cells = [f"{row[0]:{widths[0]}}", f"{row[1]:{widths[1]}}", f"{row[2]:>{widths[2]}}", f"{row[3]:>{widths[3]}}"]
        print("  ".join([*cells, row[4]]))


def render(options: argparse.Namespace, rest: list[str]) -> int:
    scene = Path(rest.pop(0)) if rest and not rest[0].startswith("-") else None
    if scene and not scene.is_file():
        raise Failed(f"there is no scene file {scene}; check the path")
    set_up(options, "render")
    binary = dev_build.ballot_binary(options.preset)
    if scene is None:
        status, reports = dev_gallery.make(binary, rest, lambda name: has_option(rest, name))
        if reports:
            print_records(reports)
        return status
    out = ROOT / "out" / scene.stem
    out.mkdir(parents=True, exist_ok=True)
    report = Path(value_of(rest, "--json") or out / "render.json")
    arguments = [str(binary), "render", str(scene), *rest]
    for name, value in (("--view", "all"), ("--size", "512x512"), ("--out", f"{out}{os.sep}"), ("--json", str(report))):
        if not has_option(rest, name):
            arguments += [name, value]
    if not has_option(rest, "--png"):
        arguments.append("--png")
    result = subprocess.run(arguments, stdout=subprocess.PIPE, text=True, check=False)
    if result.returncode != 0:  # ballot has printed the reason to standard error
        print(result.stdout, end="")
        return result.returncode if result.returncode > 0 else 1
    print_records([report])
    return 0


def test(options: argparse.Namespace, rest: list[str]) -> int:
    if options.asan:
        options.preset = "asan"
    set_up(options, "test")
    environment = dict(os.environ)
    notes = []
    if icd := dev_mesa.system_icd():
        environment["BALLOT_SYSTEM_MESA_ICD"] = str(icd)
        print(f"system Mesa:  {dev_mesa.driver_name(icd) or icd}")
    else:
        notes.append("no lavapipe in /usr/share/vulkan/icd.d: tests that need the system's Mesa did not run")
    try:
        icd = dev_mesa.current_mesa()
        environment["BALLOT_CURRENT_MESA_ICD"] = str(icd)
        print(f"current Mesa: {dev_mesa.driver_name(icd) or icd}", flush=True)
    except Failed as error:
        notes.append(f"no current Mesa, so tests that need it did not run: {error}")
    if options.preset == "asan":
        environment.setdefault("ASAN_OPTIONS", "detect_stack_use_after_return=1:strict_string_checks=1")
        environment.setdefault("UBSAN_OPTIONS", "print_stacktrace=1:halt_on_error=1")
        environment.setdefault("LSAN_OPTIONS", f"suppressions={ROOT}/tests/lsan.supp:print_suppressions=0")
    if options.preset == "tsan":
        environment.setdefault("TSAN_OPTIONS", f"suppressions={ROOT}/tests/tsan.supp:exitcode=66")
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    command = ["ctest", "--preset", options.preset, "--output-on-failure", "--parallel", "2", "--timeout", "300",
               "--no-tests=error", *rest]
    status = subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode
    for note in notes:  # again, below the summary of the tests
        print(f"note: {note}", file=sys.stderr)
    return 0 if status == 0 else 1


def build(options: argparse.Namespace, rest: list[str]) -> int:
    dev_packages.ensure("render" if options.no_tests else "build", install=not options.no_install)
    print(dev_build.build(options.preset, options.jobs, rest, not options.no_tests))
    return 0


def mutations(options: argparse.Namespace, rest: list[str]) -> int:
    if rest:
        options.parser.error(f"unknown argument {rest[0]}")
    dev_packages.ensure("test", install=not options.no_install)
    dev_build.build(options.preset, options.jobs, ["ballot_device_tests"])
    return dev_mutations.check(options.preset, options.filter)


def fmt(options: argparse.Namespace, rest: list[str]) -> int:
    if rest:
        options.parser.error(f"unknown argument {rest[0]}")
    if shutil.which("clang-format") is None:
        dev_packages.ensure("fmt", install=not options.no_install)
    files = sorted(str(path) for folder in ("engine", "tools", "tests") for suffix in ("*.h", "*.cpp")
                   for path in (ROOT / folder).rglob(suffix))
    if not files:
        return 0
    mode = ["--dry-run", "--Werror"] if options.check else ["-i"]
    status = subprocess.run(["clang-format", "--style=file", *mode, *files], cwd=ROOT, check=False).returncode
    print(f"{len(files)} files {'checked' if options.check else 'formatted'}")
    return 0 if status == 0 else 1


def lint(options: argparse.Namespace, rest: list[str]) -> int:
    if rest:
        options.parser.error(f"unknown argument {rest[0]}")
    if shutil.which("clang-tidy") is None:
        dev_packages.ensure("lint", install=not options.no_install)
    return dev_lint.lint(options)


def scenes(options: argparse.Namespace, rest: list[str]) -> int:
    if rest:
        options.parser.error(f"unknown argument {rest[0]}")
    folder = options.dir or os.environ.get("BALLOT_SCENES")
    return dev_scenes.print_scenes(Path(folder) if folder else None)


def bundle(options: argparse.Namespace, rest: list[str]) -> int:
    if len(rest) > 1 or (rest and rest[0].startswith("-")):
        options.parser.error(f"unknown argument {rest[-1]}")
    if options.preset in ("asan", "tsan"):
        options.parser.error("a sanitizer's libraries cannot be bundled: choose release or debug")
    set_up(options, "bundle")
    folder = Path(rest[0] if rest else ROOT / "out" / "ballot").absolute()
    dev_bundle.bundle(folder, dev_build.ballot_binary(options.preset), dev_scenes.shipped_scenes(), options.archive)
    return 0


def scaling(options: argparse.Namespace, rest: list[str]) -> int:
    if rest:
        options.parser.error(f"unknown argument {rest[0]}")
    if not options.binary:
        set_up(options, "scaling")
    elif not options.binary.is_file():
        options.parser.error(f"there is no program {options.binary}")
    return dev_scaling.scaling(options.binary or dev_build.ballot_binary(options.preset), options)


def fuzz(options: argparse.Namespace, rest: list[str]) -> int:
    dev_packages.ensure("fuzz", install=not options.no_install)
    return dev_fuzz.fuzz(options, rest)


COMMANDS = {
    "render": (render, "[SCENE] [ballot's options ...]", "set up, make the five pictures of the gallery, or of a scene",
               SETUP + """
Without SCENE, it makes the gallery: five pictures in out/gallery/. With SCENE, all its views are rendered at 512x512 to
out/<scene>/. Options that this command does not know are passed to `ballot render`; `build/release/ballot render
--help` lists them.

  tools/dev.py render
  tools/dev.py render scenes/cornell.gltf --view view0 --size 1024x1024 --shading normals --spp 16
"""),
    "test": (test, "[ctest's options ...]", "set up, run every test on lavapipe", SETUP + """
The tests run on the system's Mesa and on the current one, which is mesa-vulkan-drivers of bookworm-backports. It is
unpacked in build/backports and not installed; delete the folder to fetch it again. The tests find the two drivers' ICD
files through BALLOT_SYSTEM_MESA_ICD and BALLOT_CURRENT_MESA_ICD, and large scenes in the folder BALLOT_SCENES.
Options that this command does not know are passed to ctest:

  tools/dev.py test                       everything
  tools/dev.py test -R Npy                tests whose name contains Npy
  tools/dev.py test --asan -R '^cpu'      the CPU tests with address and undefined-behaviour sanitizers
  tools/dev.py test --preset tsan -R 'Concurrency|BvhCache'     with ThreadSanitizer, what uses several threads
"""),
    "build": (build, "[TARGET ...]", "set up and build", SETUP),
    "mutations": (mutations, "", "show that the hard-case suite finds deliberate faults", SETUP + """
Runs the hard-case tests first on the unchanged shaders, where they must pass, and then on copies with one deliberate
fault each, where they must fail. Prints which cases found which fault. Takes some minutes. The Vulkan loader chooses
the driver; to choose another, set BALLOT_TEST_DRIVER and LP_NATIVE_VECTOR_WIDTH as the tests do.
tools/dev_mutations.py lists the faults.
"""),
    "fmt": (fmt, "", "format the C++ code with clang-format", """\
Formats the C++ files of engine/, tools/ and tests/ in place by .clang-format. --check changes nothing and fails if a
file is not formatted. GLSL is formatted by hand.
"""),
    "lint": (lint, "", "check names in the C++ files that changed last, with clang-tidy", dev_lint.HELP),
    "scenes": (scenes, "", "generate the shipped scenes, list and verify the others", """\
Prints scenes/manifest.json with the state of each file: verified (its SHA-256 matches), absent, or DIFFERS. Searches
the checkout, build/scenes, and the folder of --dir or BALLOT_SCENES. Says where to get absent files; downloads nothing.
"""),
    "bundle": (bundle, "[DIR]", "make a relocatable folder", SETUP + """
DIR (default out/ballot) gets bin/ballot, the libraries that it needs except glibc and the Vulkan loader, and the
shipped scenes; the shaders are inside the program. It runs from any folder on x86-64 Linux with glibc 2.36 or newer and
a Vulkan loader.

  tools/dev.py bundle out/ballot --archive
"""),
    "fuzz": (fuzz, "[TARGET ...]", "read mutated files under sanitizers, with libFuzzer", SETUP + dev_fuzz.HELP),
    "scaling": (scaling, "", "measure speed and memory against triangles and rays", dev_scaling.HELP),
}


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="tools/dev.py", description=__doc__, allow_abbrev=False,
                                     epilog="`tools/dev.py COMMAND --help` explains a command. Exit codes: 0 done, 1 "
                                            "the work failed, 2 the arguments are wrong, 3 no usable Vulkan device.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (function, usage, summary, text) in COMMANDS.items():
        sub = commands.add_parser(name, help=summary, description=f"{summary}\n\n{text}", allow_abbrev=False,
                                  usage=f"tools/dev.py {name} [options] {usage}".rstrip(),
                                  formatter_class=argparse.RawDescriptionHelpFormatter)
        sub.set_defaults(function=function, parser=sub)
        if name != "scenes":
            sub.add_argument("--no-install", action="store_true", help="list missing packages and stop")
        if name in ("render", "test", "build", "mutations", "bundle", "scaling"):
            sub.add_argument("--preset", choices=dev_build.PRESETS, default="release",
                             help="the CMake preset to build; default: release")
            sub.add_argument("--jobs", type=int, metavar="N",
                             help="number of compilers to run at once; default: as many as cores and memory allow")
        if name == "build":
            sub.add_argument("--no-tests", action="store_true", help="leave the tests out, and the packages they need")
        if name == "test":
            sub.add_argument("--asan", action="store_true", help="the same as --preset asan")
        if name == "mutations":
            sub.add_argument("--filter", default=dev_mutations.TESTS, metavar="TESTS",
                             help="the tests to run, as --gtest_filter takes them; default: %(default)s")
        if name == "fmt":
            sub.add_argument("--check", action="store_true", help="change no file; fail if one is not formatted")
        if name == "lint":
            sub.add_argument("--all", action="store_true", help="check every file")
            sub.add_argument("--commits", type=int, default=10, metavar="N", help="take files of N commits [10]")
            sub.add_argument("--files", type=int, default=40, metavar="N", help="check N files at most [40]")
        if name == "scenes":
            sub.add_argument("--dir", help="folder with scene files; default: the environment variable BALLOT_SCENES")
        if name == "scaling":
            dev_scaling.add_options(sub)
        if name == "fuzz":
            dev_fuzz.add_options(sub)
        if name == "bundle":
            sub.add_argument("--archive", action="store_true", help="also write DIR.tar.gz")
    return parser


def main() -> int:
    options, rest = make_parser().parse_known_args()
    if rest and rest[0] == "--":
        rest.pop(0)
    try:
        return options.function(options, rest)
    except Failed as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except OSError as error:  # a missing program, a full disk
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
