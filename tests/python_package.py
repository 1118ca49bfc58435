#!/usr/bin/env python3
"""Installs the package of Python in a virtual environment, against a library that is built, and runs its tests, the
samples of the manuals and the checkers of types mypy and pyright there.

The package is built from a copy of its folder, as others may have it without the tree. The folder keeps the environment
and the compiled extension for the next time. Needs PyPI the first time, for what REQUIREMENTS names.

BALLOT_PRELOAD names what Python has to load before a library with address sanitizer: the sanitizer's runtime. With it,
leaks are not reported, because Python itself leaks, and the wheel may have any size.
"""

import argparse
import math
import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "engine/api/python"
MOST_WHEEL_BYTES = 8 << 20
REQUIREMENTS = {  # how pip and how Python names it
    "nanobind>=3.1,<4": "nanobind",
    "scikit-build-core>=0.12": "scikit_build_core",
    "numpy>=1.24": "numpy",
    "mypy": "mypy",
    "pyright[nodejs]": "pyright",
    "trimesh": "trimesh",
    "meshio": "meshio",
}


def run(*command: object, **arguments: object) -> None:
    done = subprocess.run([str(word) for word in command], check=False, **arguments)
    if done.returncode:
        sys.exit(f"python_package: failed: {' '.join(map(str, command))}")


def environment(folder: Path) -> Path:
    """Returns the Python of the virtual environment, which is made if it is not there."""
    python = folder / "venv/bin/python"
    if not python.exists():
        venv.create(folder / "venv", with_pip=True)
    check = f"import {', '.join(REQUIREMENTS.values())}"
    if subprocess.run([python, "-c", check], capture_output=True, check=False).returncode:
        run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *REQUIREMENTS)
    return python


def copied(python: Path, folder: Path) -> Path:
    """Returns a copy of the package's folder, far from the tree. Without a library it says what is missing."""
    if (PACKAGE / "LICENSE").read_bytes() != (ROOT / "LICENSE").read_bytes():
        sys.exit(f"python_package: {PACKAGE / 'LICENSE'} differs from that of the tree; copy it anew")
    copy = folder / "copied/package"
    shutil.rmtree(copy.parent, ignore_errors=True)
    shutil.copytree(PACKAGE, copy)
    nanobind = subprocess.run([python, "-m", "nanobind", "--cmake_dir"], capture_output=True, text=True, check=True)
    words = ["-G", "Ninja", f"-Dnanobind_DIR={nanobind.stdout.strip()}", "-DCMAKE_DISABLE_FIND_PACKAGE_Ballot=ON"]
    bare = subprocess.run(["cmake", "-S", copy, "-B", copy.parent / "bare", f"-DPython_EXECUTABLE={python}", *words],
                          capture_output=True, text=True, check=False)  # fmt: skip
    said = " ".join(bare.stderr.split())
    if bare.returncode == 0 or "Found neither Ballot's library nor its source tree" not in said:
        sys.exit(f"python_package: without a library CMake said: {bare.stderr}")
    return copy


def wheel(python: Path, folder: Path, library: Path) -> Path:
    """Returns the wheel, which is built if something changed."""
    package = copied(python, folder)
    for old in folder.glob("*.whl"):
        old.unlink()
    run(python, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-build-isolation", "--no-deps",
        "--wheel-dir", folder, f"--config-settings=build-dir={folder / 'build'}",
        f"--config-settings=cmake.define.BALLOT_LIBRARY={library}", package)  # fmt: skip
    (made,) = folder.glob("*.whl")
    held = {Path(name).name for name in zipfile.ZipFile(made).namelist() if ".dist-info/licenses/" in name}
    if not held >= {"LICENSE", "NOTICE", "LICENSE.nanobind"}:
        sys.exit(f"python_package: the wheel's licenses are {sorted(held)}; expected LICENSE, NOTICE, LICENSE.nanobind")
    size = made.stat().st_size
    most = math.inf if "BALLOT_PRELOAD" in os.environ else MOST_WHEEL_BYTES
    print(f"{made.name}: {size / 2**20:.1f} MiB", flush=True)
    if size > most:
        sys.exit(f"python_package: the wheel has {size} bytes; at most {most} are allowed")
    return made


def check_types(python: Path, folder: Path) -> None:
    """Checks the types of the installed package, with its stub and examples."""
    run(python, "-m", "mypy", "--strict", "--no-error-summary", "-p", "ballot", cwd=folder)
    (installed,) = folder.glob("venv/lib/python*/site-packages/ballot")
    run(python, "-m", "pyright", "--warnings", "--pythonpath", python, installed, cwd=folder)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--library", type=Path, required=True, help="libballot.so of the build folder")
    parser.add_argument("--folder", type=Path, required=True, help="where the environment is kept")
    parser.add_argument("--no-tests", action="store_true", help="install the package and stop")
    options = parser.parse_args()
    options.folder, options.library = options.folder.resolve(), options.library.resolve()
    options.folder.mkdir(parents=True, exist_ok=True)
    python = environment(options.folder)
    if preload := os.environ.get("BALLOT_PRELOAD"):
        sanitizer = os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=0"
        os.environ.update(LD_PRELOAD=preload, ASAN_OPTIONS=sanitizer)
    made = wheel(python, options.folder, options.library)
    run(
        python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps", "--force-reinstall", made
    )
    if options.no_tests:
        return
    run(python, "-X", "dev", "-m", "unittest", "discover", "-s", PACKAGE / "tests", cwd=options.folder,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})  # fmt: skip
    for manual in ("engine/api/README.md", "README.md"):
        run(python, ROOT / "tests/api/guide.py", ROOT / manual, "python")
    if not preload:  # the checkers do not load the library
        check_types(python, options.folder)


if __name__ == "__main__":
    main()
