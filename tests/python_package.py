#!/usr/bin/env python3
"""Installs the package of Python in a virtual environment, against a library that is built, and runs its tests and the
example on a cluster of two workers there.

The folder keeps the environment and the compiled extension for the next time. Needs PyPI the first time, for nanobind,
scikit-build-core, NumPy and dask.

BALLOT_PRELOAD names what Python has to load before a library with address sanitizer: the sanitizer's runtime. With it,
leaks are not reported, because Python itself leaks, and the wheel may have any size.
"""

import argparse
import math
import os
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE, EXAMPLES = ROOT / "engine/api/python", ROOT / "tools/examples"
MOST_WHEEL_BYTES = 8 << 20


def run(*command: object, **arguments: object) -> None:
    done = subprocess.run([str(word) for word in command], check=False, **arguments)
    if done.returncode:
        sys.exit(f"python_package: failed: {' '.join(map(str, command))}")


def environment(folder: Path) -> Path:
    """Returns the Python of the virtual environment, which is made if it is not there."""
    python = folder / "venv/bin/python"
    if not python.exists():
        venv.create(folder / "venv", with_pip=True)
    wanted = ["nanobind>=3.1,<4", "scikit-build-core>=0.10", "numpy>=1.24", "dask[array]", "distributed"]
    check = "import nanobind, scikit_build_core, numpy, dask.array, distributed"
    if subprocess.run([python, "-c", check], capture_output=True, check=False).returncode:
        run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *wanted)
    return python


def wheel(python: Path, folder: Path, library: Path) -> Path:
    """Returns the wheel, which is built if something changed."""
    for old in folder.glob("*.whl"):
        old.unlink()
    run(python, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-build-isolation", "--no-deps",
        "--wheel-dir", folder, f"--config-settings=build-dir={folder / 'build'}",
        f"--config-settings=cmake.define.BALLOT_LIBRARY={library}", PACKAGE)  # fmt: skip
    (made,) = folder.glob("*.whl")
    size = made.stat().st_size
    most = math.inf if "BALLOT_PRELOAD" in os.environ else MOST_WHEEL_BYTES
    print(f"{made.name}: {size / 2**20:.1f} MiB", flush=True)
    if size > most:
        sys.exit(f"python_package: the wheel has {size} bytes; at most {most} are allowed")
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--library", type=Path, required=True, help="libballot.so of the build folder")
    parser.add_argument("--folder", type=Path, required=True, help="where the environment is kept")
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
    run(python, "-X", "dev", "-m", "unittest", "discover", "-s", PACKAGE / "tests", cwd=options.folder,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})  # fmt: skip
    run(python, EXAMPLES / "dask_rays.py", cwd=options.folder)


if __name__ == "__main__":
    main()
