#!/usr/bin/env python3
"""The developer's commands for Ballot: set-up, build, tests, formatting, pictures, bundles. CI runs the same."""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # no __pycache__ in the source tree
sys.path.insert(0, str(Path(__file__).resolve().parent))

from dev import PRESETS, ROOT, Failed, build, run  # noqa: E402
from dev import bundle as bundles, docs as reference, fuzz as fuzzing, gallery, mesa, mutations as faults  # noqa: E402
from dev import deb as debs, dist as chroots, lavapipe, packages, wheel as wheels  # noqa: E402

SETUP = """
First it sets up the machine and builds: it lists missing packages of Debian 12 with their reasons and installs them
with apt-get, through sudo if you are not root. With --no-install it stops and prints what to type instead.
"""


def set_up(options: argparse.Namespace, *users: str, targets=("ballot",)) -> Path:
    """Installs what is needed and builds. Returns the build folder."""
    packages.ensure(not options.no_install, "build", *users)
    return build(options.preset, targets, tests="tests" in users, jobs=options.jobs)


def render(options: argparse.Namespace, rest: list[str]) -> int:
    scene = Path(rest.pop(0)) if rest and not rest[0].startswith("-") else None
    if scene and not scene.is_file():
        raise Failed(f"there is no scene file {scene}; check the path")
    ballot = set_up(options) / "ballot"
    return gallery.render_scene(ballot, scene, rest) if scene else gallery.render_gallery(ballot, rest)


def test(options: argparse.Namespace, rest: list[str]) -> int:
    options.preset = "asan" if options.asan else options.preset
    set_up(options, "tests", "test", targets=())
    environment, notes = dict(os.environ), []
    for name, find in (("SYSTEM", mesa.system_icd), ("CURRENT", mesa.current_icd)):
        try:
            environment[f"BALLOT_{name}_MESA_ICD"] = str(find())
        except Failed as error:
            notes.append(f"note: tests that need the {name.lower()} Mesa did not run: {error}")
    chosen = {word.split("=")[0] for word in rest} & {"-L", "-LE", "--label-regex", "--label-exclude"}
    words = rest if options.all or chosen else ["-LE", "extended", *rest]
    status = subprocess.run(["ctest", "--preset", options.preset, *words], cwd=ROOT, env=environment, check=False)
    print("\n".join(notes), file=sys.stderr, end="\n" if notes else "")
    return 1 if status.returncode else 0


def build_targets(options: argparse.Namespace, rest: list[str]) -> int:
    print(set_up(options, *([] if options.no_tests else ["tests"]), targets=rest))
    return 0


def mutations(options: argparse.Namespace, rest: list[str]) -> int:
    folder = set_up(options, "tests", targets=["ballot_device_tests"])
    return faults.check(folder, rest[0] if rest else faults.TESTS)


def fmt(options: argparse.Namespace, rest: list[str]) -> int:
    if shutil.which("clang-format") is None:
        packages.ensure(not options.no_install, "fmt")
    files = [path for folder in ("engine", "tools", "tests") for path in (ROOT / folder).rglob("*.[hc]*")
             if path.suffix in (".h", ".cpp")]
    run("clang-format", "--style=file", *(["--dry-run", "--Werror"] if options.check else ["-i"]), *files)
    return 0


def lint(options: argparse.Namespace, rest: list[str]) -> int:
    if shutil.which("run-clang-tidy") is None:
        packages.ensure(not options.no_install, "build", "tests", "lint")
    run("cmake", "--preset", "debug", "--log-level=WARNING")  # it has neither unity files nor precompiled headers
    run("cmake", "--build", "--preset", "debug", "--target", "ballot_commit", capture_output=True)
    database = json.loads((ROOT / "build/debug/compile_commands.json").read_text(encoding="utf-8"))
    names = [str(Path(entry["file"]).relative_to(ROOT)) for entry in database]
    if not options.all:  # those of the work tree, then of the last commits; a header stands for the .cpp of its name
        status = run("git", "status", "--porcelain", capture_output=True).stdout.splitlines()
        changed = [line[3:].split(" -> ")[-1] for line in status]
        changed += run("git", "log", "-10", "--name-only", "--format=", capture_output=True).stdout.split()
        changed = dict.fromkeys(name[:-1] + "cpp" if name.endswith(".h") else name for name in changed)
        names = [name for name in changed if name in names][:options.files]
    words = ["run-clang-tidy", "-quiet", "-p", "build/debug", f"^{ROOT}/({'|'.join(names) or '-'})$"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    text = re.sub(r"\x1b\[[0-9;]*m", "", done.stdout)  # it is always coloured
    findings = sorted({line for line in text.splitlines() if ": error: " in line or ": warning: " in line})
    print("\n".join([*findings, f"{len(names)} files checked, {len(findings)} findings"]))
    return 1 if findings or done.returncode else 0


def bundle(options: argparse.Namespace, rest: list[str]) -> int:
    folder = Path(rest[0] if rest else ROOT / "out" / "ballot").absolute()
    folder.parent.mkdir(parents=True, exist_ok=True)
    bundles.bundle(folder, set_up(options, "bundle"), options.archive)
    return 0


def wheel(options: argparse.Namespace, rest: list[str]) -> int:
    packages.ensure(not options.no_install, *([] if options.source else ["build"]), "wheel")
    wheels.make(rest, options.jobs, options.source)
    if options.lavapipe:
        lavapipe.make()
    return 0


def deb(options: argparse.Namespace, rest: list[str]) -> int:
    packages.ensure(not options.no_install, "build", "deb")
    debs.make(options.jobs)
    return 0


def dist(options: argparse.Namespace, rest: list[str]) -> int:
    packages.ensure(not options.no_install, "build", "wheel", "dist")
    if not options.made:
        wheels.make([], options.jobs, False)
        lavapipe.make()
    chroots.test(rest)
    return 0


def fuzz(options: argparse.Namespace, rest: list[str]) -> int:
    packages.ensure(not options.no_install, "build", "fuzz")
    return fuzzing.fuzz(rest, options.minutes, options.jobs)


def docs(options: argparse.Namespace, rest: list[str]) -> int:
    folder = ROOT / "build" / options.preset
    if not options.check:
        set_up(options, "docs", targets=["ballot", "ballot_api"])
        run(sys.executable, ROOT / "tests/python_package.py", "--library", folder / "libballot.so", "--folder",
            folder / "python", "--no-tests")
    return reference.make(folder, options.check)


COMMANDS = {  # name: (function, the words it takes beside its options, summary, the rest of its help)
    "render": (render, "[SCENE] [ballot's options ...]", "set up, make the five pictures of the gallery, or of a scene",
               SETUP + """
Without SCENE, it makes the gallery in out/gallery/. With SCENE, it renders all views at 512x512 to out/<scene>/. Other
options go to `ballot render`; `build/release/ballot render --help` lists them.

  tools/dev.py render scenes/cornell.gltf --view view0 --size 1024x1024 --shading normals --spp 16
"""),
    "test": (test, "[ctest's options ...]", "set up, run the tests on lavapipe", SETUP + """
The tests run on the system's Mesa and on the current one, which is mesa-vulkan-drivers of bookworm-backports. It is
unpacked in build/backports and not installed; delete the folder to fetch it again. Tests of large scenes look for them
in the folder BALLOT_SCENES. Without --all, or -L or -LE of ctest, tests with the label `extended` are left out: those
that do not differ by driver run on one. Other options go to ctest:

  tools/dev.py test -R Npy                tests whose name contains Npy
  tools/dev.py test --asan -R '^cpu'      the CPU tests with address and undefined-behaviour sanitizers
  tools/dev.py test --preset tsan -R 'Concurrency|BvhCache'     with ThreadSanitizer, what uses several threads
"""),
    "build": (build_targets, "[TARGET ...]", "set up and build", SETUP),
    "mutations": (mutations, "[TESTS]", "show that the hard-case suite finds deliberate faults", SETUP + """
Runs the hard cases, or the tests that match TESTS as --gtest_filter takes it, on the shaders, where they must pass, and
then on copies with one fault each (tools/dev/mutations.py), where one must fail. Prints which cases found which fault.
The Vulkan loader chooses the driver; VK_DRIVER_FILES and LP_NATIVE_VECTOR_WIDTH choose others, as in the tests.
"""),
    "fmt": (fmt, "", "format the C++ code of engine/, tools/ and tests/ with clang-format", ""),
    "lint": (lint, "", "check the names in C++ files with clang-tidy", """
Takes the files of the work tree and of the last ten commits, the newest first; a header is checked through the .cpp of
its name. A file takes about three seconds.
"""),
    "docs": (docs, "", "make the reference in HTML, build/docs/index.html", SETUP + """
The reference holds the manuals, the docstrings of the Python package, the comments of the C and C++ headers, and the
gallery. The exit code is 1, after a list of the faults, if a link between pages or to a file is broken, or if a public
name of Python, C or C++ has no text. --check takes the package as it is installed in build/PRESET/python. Needs PyPI
once, for Sphinx, MyST and Breathe in build/reference/venv.
"""),
    "bundle": (bundle, "[DIR]", "make a relocatable folder", SETUP + """
DIR (out/ballot) gets bin/ballot, the libraries that it needs except glibc and the Vulkan loader, and two scenes; the
shaders are inside the program. It runs from any folder on x86-64 Linux with glibc 2.36 or newer and a Vulkan loader.
"""),
    "wheel": (wheel, "[PYTHON ...]", "make wheels that hold what they need, and the source package", SETUP + """
build/wheel/dist gets the source package and a wheel for each PYTHON, or for those of python3.10 and python3.11 that are
in PATH and a newer one, whose wheel serves all from 3.12 on: where PATH has none, Python 3.13 is compiled once. A wheel
runs on x86-64 Linux with glibc 2.35 or newer, the C++ run time of GCC 12 or newer, a Vulkan loader and a driver, such
as those of the wheel ballot-lavapipe (Mesa of bookworm-backports), which serves where there is no other. Needs PyPI,
and the sources of Embree and Python from Debian once.
"""),
    "deb": (deb, "", "make Debian packages: library, development, Python, program", SETUP + """
build/deb/dist gets libballot1, libballot-dev, python3-ballot and ballot for the release of Debian that this runs on,
which lintian has looked at: its errors fail. Needs PyPI, for what builds the extension of Python.
"""),
    "dist": (dist, "[RELEASE ...]", "make the packages of Python, and test them in chroots of Debian", SETUP + """
Makes what `wheel --lavapipe` makes, and installs and tests it in chroots of each RELEASE (bookworm, trixie, sid), or in
single ones (trixie-bare): bare has no driver, driver that of the release, source what the source package needs; deb
makes and uses the Debian packages (not on sid). Needs root, Debian's mirror and PyPI; takes hours. Chroots are kept in
build/dist; delete one to make it anew.
"""),
    "fuzz": (fuzz, "[TARGET ...]", "read mutated files under sanitizers, with libFuzzer", SETUP + """
Runs each target of tests/fuzz, or those named, as many at once as there are cores. What a target learns is kept in
build/fuzz/corpus, inputs that fail in build/fuzz/findings.

  tools/dev.py fuzz gltf --minutes 30
"""),
}
OPTIONS = (  # (commands, name, settings)
    ((*COMMANDS,), "--no-install", {"action": "store_true", "help": "list missing packages and stop"}),
    (("render", "test", "build", "mutations", "docs", "bundle"), "--preset",
     {"choices": PRESETS, "default": "release", "help": "the preset to build in build/PRESET [release]"}),
    (("render", "test", "build", "mutations", "docs", "bundle", "wheel", "deb", "dist", "fuzz"), "--jobs",
     {"type": int, "metavar": "N", "help": "compilers to run at once [as many as cores and memory allow]"}),
    (("test",), "--all", {"action": "store_true", "help": "also run tests with the label `extended`"}),
    (("test",), "--asan", {"action": "store_true", "help": "the same as --preset asan"}),
    (("build",), "--no-tests", {"action": "store_true", "help": "leave the tests out, and the packages they need"}),
    (("fmt",), "--check", {"action": "store_true", "help": "change no file; fail if one is not formatted"}),
    (("docs",), "--check", {"action": "store_true", "help": "make nothing; fail if it has faults"}),
    (("lint",), "--all", {"action": "store_true", "help": "check every file"}),
    (("lint",), "--files", {"type": int, "default": 40, "metavar": "N", "help": "check N files at most [40]"}),
    (("bundle",), "--archive", {"action": "store_true", "help": "also write DIR.tar.gz"}),
    (("dist",), "--made", {"action": "store_true", "help": "test what lies in build/wheel/dist"}),
    (("wheel",), "--source", {"action": "store_true", "help": "make the source package alone"}),
    (("wheel",), "--lavapipe", {"action": "store_true", "help": "also make ballot-lavapipe, for ballot[cpu]"}),
    (("fuzz",), "--minutes", {"type": float, "default": 1, "metavar": "N", "help": "time for each target [1]"}),
)
PASSING = ("render", "test")  # commands that pass on what they do not know


def main() -> int:
    parser = argparse.ArgumentParser(prog="tools/dev.py", description=__doc__, allow_abbrev=False,
                                     epilog="`tools/dev.py COMMAND --help` explains a command. Exit codes: 0 done, 1 "
                                            "the work failed, 2 the arguments are wrong, 3 no usable Vulkan device.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (function, words, summary, text) in COMMANDS.items():
        sub = commands.add_parser(name, help=summary, description=f"{summary}\n{text}", allow_abbrev=False,
                                  usage=f"tools/dev.py {name} [options] {words}".rstrip(),
                                  formatter_class=argparse.RawDescriptionHelpFormatter)
        sub.set_defaults(function=function, words=words, parser=sub)
        for users, option, settings in OPTIONS:
            if name in users:
                sub.add_argument(option, **settings)
    options, rest = parser.parse_known_args()
    rest = [word for word in rest if word != "--"]
    most = 99 if "..." in options.words else 1 if options.words else 0
    unknown = [word for word in rest if word.startswith("-") and options.command not in PASSING] or rest[most:]
    if unknown:
        options.parser.error(f"unknown argument {unknown[0]}")
    try:
        return options.function(options, rest)
    except (Failed, OSError, subprocess.SubprocessError) as error:  # OSError: a missing program, a full disk
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
