"""Debian packages for the release that this runs on: libballot1, libballot-dev, python3-ballot, ballot.

CPack makes them of the components that CMake installs (tools/debian.cmake). Here is what they hold beside: the package
of Python, which takes the library of the system, copyrights and change logs.
"""

import gzip
import shutil
from email.utils import formatdate
from pathlib import Path

from dev import ROOT, Failed, default_jobs, run
from dev.bundle import COMPILED_IN, DOC
from dev.packages import system
from dev.wheel import PACKAGE

FOLDER = ROOT / "build" / "deb"
FILES = FOLDER / "files"
PYTHON = "/usr/bin/python3"  # that of the release
NAMES = {"runtime": "libballot1", "development": "libballot-dev", "python": "python3-ballot", "tools": "ballot"}
CONTACT = "the authors of Ballot <maintainers@ballot.invalid>"
COPYRIGHT = """Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: ballot
Comment: Parts of other projects are compiled in. Their notices follow.

Files: *
Copyright: the authors of Ballot
License: Apache-2.0
 On Debian systems, the text of the Apache License 2.0 is in /usr/share/common-licenses/Apache-2.0.
"""
LOG = """ballot ({version}) unstable; urgency=medium

  * Packages of this release, as tools/dev.py makes them.

 -- {contact}  {date}
"""
SCRIPTS = {"postinst": "py3compile -p python3-ballot", "prerm": "py3clean -p python3-ballot"}
SCRIPT = """#!/bin/sh
set -e
if command -v {program} > /dev/null; then
  {command}
fi
"""


def release() -> str:
    """Returns the part of the version that is this release's. Throws Failed unless it is one of Debian."""
    found = system()
    if found.get("ID") != "debian" or not found.get("VERSION_ID"):
        raise Failed(f"packages are made on a release of Debian, and this is {found.get('PRETTY_NAME', 'unknown')}")
    return f"1~deb{found['VERSION_ID']}"


def documents(component: str, version: str) -> None:
    """Writes the copyright file and the change log of a component's package."""
    folder = FILES / component / "share" / "doc" / NAMES[component]
    folder.mkdir(parents=True)
    parts = [COPYRIGHT, (PACKAGE / "NOTICE").read_text(encoding="utf-8")]
    if component in ("runtime", "tools"):
        files = [DOC / name / "copyright" for name in COMPILED_IN]
        parts += [f"{file.parent.name}\n\n{file.read_text(encoding='utf-8')}" for file in files if file.is_file()]
    (folder / "copyright").write_text(f"\n{'-' * 80}\n".join(parts), encoding="utf-8")
    log = LOG.format(version=version, contact=CONTACT, date=formatdate())
    with gzip.GzipFile(folder / "changelog.Debian.gz", "wb", 9, mtime=0) as file:
        file.write(log.encode())


def python(library: Path) -> None:
    """Lays the package of Python where Debian has such ones, and what compiles it there."""
    into = FILES / "python" / "lib" / "python3" / "dist-packages"
    environment = FOLDER / "venv"
    run(PYTHON, "-m", "venv", environment)
    run(environment / "bin" / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps",
        "--no-compile", "--upgrade", "--target", into, f"--config-settings=cmake.define.BALLOT_LIBRARY={library}",
        "--config-settings=cmake.define.BALLOT_HOLD_LIBRARY=OFF", PACKAGE)  # fmt: skip
    for name in ("direct_url.json", "REQUESTED"):  # of this machine
        for file in into.glob(f"*.dist-info/{name}"):
            file.unlink()
    for name, command in SCRIPTS.items():
        (FILES / name).write_text(SCRIPT.format(program=command.split()[0], command=command), encoding="ascii")
        (FILES / name).chmod(0o755)


def python_depends() -> str:
    """Returns what the package of Python depends on: the wheel's ABI is that of one version before 3.12."""
    minor = int(run(PYTHON, "-c", "import sys; print(sys.version_info.minor)", capture_output=True).stdout)
    newer = "" if minor >= 12 else f"python3 (<< 3.{minor + 1}), "
    return f"python3 (>= 3.{minor if newer else 12}~), {newer}python3-numpy"


def make(jobs: int | None) -> list[Path]:
    """Makes the packages in build/deb/dist, and has lintian look at them. Returns them. Throws Failed."""
    package_release = release()
    shutil.rmtree(FILES, ignore_errors=True)
    FILES.mkdir(parents=True)
    (FILES / "triggers").write_text("activate-noawait ldconfig\n", encoding="ascii")
    run("cmake", "--preset", "release", "-B", FOLDER, "--log-level=WARNING", "-DBALLOT_TESTS=OFF",
        "-DBALLOT_SOURCE_SHADERS=", "-DCMAKE_INSTALL_PREFIX=/usr", f"-DBALLOT_DEB={FILES}",
        f"-DCPACK_PACKAGE_CONTACT={CONTACT}", f"-DCPACK_DEBIAN_PACKAGE_RELEASE={package_release}",
        f"-DCPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS={python_depends()}")  # fmt: skip
    run("cmake", "--build", FOLDER, "--parallel", jobs or default_jobs(), "--target", "ballot", "ballot_api")
    python(FOLDER / "libballot.so")
    version = run(FOLDER / "ballot", "--version", capture_output=True).stdout.split()[1].rstrip(",")
    for component in NAMES:
        documents(component, f"{version}-{package_release}")
    shutil.rmtree(FOLDER / "dist", ignore_errors=True)
    run("cpack", "--config", FOLDER / "CPackConfig.cmake", "-B", FOLDER / "dist", cwd=FOLDER, capture_output=True)
    made = sorted((FOLDER / "dist").glob("*.deb"))
    if len(made) != len(NAMES):
        raise Failed(f"CPack made {[file.name for file in made]}, expected {len(NAMES)} packages")
    print(run("lintian", "--fail-on", "error", *made, capture_output=True).stdout, end="")
    for file in made:
        print(f"{file}: {file.stat().st_size / 2**20:.1f} MiB", flush=True)
    return made
