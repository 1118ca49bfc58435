"""Chroots of Debian's releases, in which wheels and the source package are installed and tested as others have them."""

import os
import shutil
import time
from pathlib import Path

from dev import ROOT, Failed, packages, run
from dev.wheel import FOLDER as WHEELS

FOLDER = ROOT / "build" / "dist"
RELEASES = ("bookworm", "trixie", "sid")
PYTHON = ("python3", "python3-venv")
DRIVER = ("libvulkan1", "mesa-vulkan-drivers")
OF_PROGRAM = ("libcli11-dev", "libglfw3-dev", "libglfw3", "libimgui-dev")  # packages that the library does without
NEEDED = ("numpy>=1.24", "trimesh", "meshio", "scikit-build-core>=0.12", "nanobind>=3.1,<4")
# Runs $2 in the chroot $1, where /dist has the packages, /tree the checkout and /pypi what pip needs; all of it and
# /proc go with the process.
ENTER = """
set -e
for name in dist tree pypi proc dev; do mkdir -p "$1/$name"; done
mount -t proc proc "$1/proc"
mount --rbind /dev "$1/dev"
mount --bind "$3" "$1/dist"
mount --bind -o ro "$4" "$1/tree"
mount --bind "$5" "$1/pypi"
exec chroot "$1" env -i PATH=/v/bin:/usr/bin:/bin HOME=/root PYTHONDONTWRITEBYTECODE=1 GALLIVM_PERF=nopt \\
  PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INDEX=1 PIP_FIND_LINKS="/dist /pypi" sh -ec "$2"
"""
INSTALL = "rm -rf /v; python3 -m venv /v; pip install -q ballot numpy trimesh meshio; cd /tmp; "
WITHOUT_DRIVER = INSTALL + """
if python -m ballot > out 2> err; then echo "a driver is here"; exit 1; fi
grep -q 'pip install "ballot\\[cpu\\]"' err
pip install -q 'ballot[cpu]'
python -m ballot
"""
WITH_DRIVER = INSTALL + """
python -m ballot
python -m unittest discover -s /tree/engine/api/python/tests
mkdir -p copy/tests && cp -r /tree/tests/api copy/tests/ && cp -r /tree/scenes copy/
for manual in README.md engine/api/README.md; do python copy/tests/api/guide.py /tree/$manual python; done
"""
FROM_SOURCE = "rm -rf /v; python3 -m venv /v; pip install -q numpy /dist/ballot-*.tar.gz; cd /tmp; python -m ballot"


def chroot(release: str, name: str, *more: str) -> Path:
    """Returns a chroot of the release with Python and these packages, which is made if it is not there."""
    root = FOLDER / f"{release}-{name}"
    if not root.is_dir():
        archive = FOLDER / f"{release}-{name}.tar"
        run("mmdebstrap", "--variant=minbase", f"--include={','.join((*PYTHON, *more))}", release, archive,
            "http://deb.debian.org/debian", capture_output=True)  # fmt: skip
        new = root.with_suffix(".new")
        shutil.rmtree(new, ignore_errors=True)
        new.mkdir()
        run("tar", "-xf", archive, "-C", new, "--exclude=./dev")
        archive.unlink()
        new.rename(root)
    return root


def inside(root: Path, command: str) -> None:
    """Runs a command in a chroot, with what it prints. Throws Failed."""
    run("unshare", "--mount", "sh", "-c", ENTER, "sh", root, command, WHEELS / "dist", ROOT, FOLDER / "pypi")


def download(root: Path) -> None:
    """Downloads what pip needs in the chroot, for its Python."""
    words = ("chroot", root, "python3", "-c", "import sys; print('%d.%d' % sys.version_info[:2])")
    version = run(*words, capture_output=True).stdout.strip()
    run(WHEELS / "venv" / "bin" / "python", "-m", "pip", "download", "--quiet", "--only-binary=:all:",
        f"--python-version={version}", "--dest", FOLDER / "pypi", *NEEDED)  # fmt: skip


def test(releases: list[str]) -> None:
    """Installs and tests the packages of build/wheel/dist in chroots of these releases, or of all. Throws Failed."""
    if os.geteuid() != 0:
        raise Failed("chroots need root; type: sudo tools/dev.py dist")
    if unknown := {*releases} - {*RELEASES}:
        raise Failed(f"there is no release {unknown.pop()}; the releases are: {', '.join(RELEASES)}")
    (FOLDER / "pypi").mkdir(parents=True, exist_ok=True)
    needed = [name for name in packages.needed("build") if name not in OF_PROGRAM]
    for release in releases or RELEASES:
        download(chroot(release, "bare"))
        for name, more, command in (("bare", (), WITHOUT_DRIVER), ("driver", DRIVER, WITH_DRIVER),
                                    ("source", needed, FROM_SOURCE)):  # fmt: skip
            root, start = chroot(release, name, *more), time.monotonic()
            print(f"{release}, {name}:", flush=True)
            inside(root, command)
            print(f"{release}, {name}: {time.monotonic() - start:.0f} s", flush=True)
