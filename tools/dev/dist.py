"""Chroots of Debian's releases, in which packages are installed and tested as others have them."""

import os
import shutil
import time
from pathlib import Path

from dev import ROOT, Failed, packages, run
from dev.wheel import FOLDER as WHEELS, tools

FOLDER = ROOT / "build" / "dist"
RELEASES = {"bookworm": (), "trixie": (), "sid": ('--aptopt=Acquire::Check-Valid-Until "false"',)}  # sid may be old
PYTHON = ("python3", "python3-venv")
MIRROR = "http://deb.debian.org/debian"
DRIVER = ("libvulkan1", "mesa-vulkan-drivers")
OF_PROGRAM = ("libcli11-dev", "libglfw3-dev", "libglfw3", "libimgui-dev")  # packages that the library does without
NEEDED = ("numpy>=1.24", "trimesh", "meshio", "nbclient", "ipykernel", "scikit-build-core>=0.12", "nanobind>=3.1,<4")
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
exec chroot "$1" env -i PATH=/v/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root \\
  PYTHONDONTWRITEBYTECODE=1 GALLIVM_PERF=nopt DEBIAN_FRONTEND=noninteractive \\
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
pip install -q nbclient ipykernel
python -m unittest discover -s /tree/engine/api/python/tests
mkdir -p copy/tests && cp -r /tree/tests/api copy/tests/ && cp -r /tree/scenes copy/
for manual in README.md engine/api/README.md; do python copy/tests/api/guide.py /tree/$manual python; done
"""
OTHER_MACHINE = """
rm -rf /tmp/other; mkdir /tmp/other; cd /tmp/other
for wheel in /dist/ballot-*x86_64.whl; do cp $wheel $(basename $wheel x86_64.whl)riscv64.whl; done
if pip install -q --no-deps ./*riscv64.whl 2> err; then echo "another machine's wheel was taken"; exit 1; fi
grep 'is not a supported wheel on this platform' err
"""
FROM_SOURCE = """
rm -rf /v; python3 -m venv /v
pip install -q numpy /dist/ballot-*.tar.gz
cd /tmp; python -m ballot
"""
DEBS = """
rm -rf /tmp/tree; mkdir /tmp/tree; cd /tmp/tree; tar -xf /pypi/tree.tar
python3 tools/dev.py deb
apt-get -qq -y --no-install-recommends install ./build/deb/dist/*.deb
cd /tmp; /usr/bin/python3 -m ballot; ballot selftest
/usr/bin/python3 /tmp/tree/tests/api/guide.py /tmp/tree/engine/api/README.md python
cmake -S /tmp/tree/tests/api/consumer -B consumer -DCMAKE_BUILD_TYPE=Release
cmake --build consumer
consumer/consumer_c; consumer/consumer_cpp
apt-get -qq -y remove libballot1 ballot
"""


def base(release: str) -> Path:
    """Returns a chroot of the release with Python alone, to copy, which is made if it is not there."""
    root = FOLDER / f"{release}-base"
    if not root.is_dir():
        archive = root.with_suffix(".tar")
        run("mmdebstrap", "--variant=minbase", *RELEASES[release], f"--include={','.join(PYTHON)}", release, archive,
            MIRROR, capture_output=True)  # fmt: skip
        new = root.with_suffix(".new")
        shutil.rmtree(new, ignore_errors=True)
        new.mkdir()
        run("tar", "-xf", archive, "-C", new, "--exclude=./dev")
        archive.unlink()
        new.rename(root)
    return root


def chroot(release: str, name: str, *more: str) -> Path:
    """Returns a chroot of the release with Python and these packages, which is made if it is not there."""
    root = FOLDER / f"{release}-{name}"
    if not root.is_dir():
        new = root.with_suffix(".new")
        shutil.rmtree(new, ignore_errors=True)
        run("cp", "--archive", base(release), new)
        if more:
            install = f"apt-get -qq -y --no-install-recommends install {' '.join(more)}"
            inside(new, f"apt-get -qq update; {install} > /dev/null")
        new.rename(root)
    return root


def inside(root: Path, command: str) -> None:
    """Runs a command in a chroot, with what it prints. Throws Failed."""
    run("unshare", "--mount", "sh", "-c", ENTER, "sh", root, command, WHEELS / "dist", ROOT, FOLDER / "pypi")


def download(root: Path) -> None:
    """Downloads what pip needs in the chroot, for its Python."""
    words = ("chroot", root, "python3", "-c", "import sys; print('%d.%d' % sys.version_info[:2])")
    version = run(*words, capture_output=True).stdout.strip()
    run(tools() / "python", "-m", "pip", "download", "--quiet", "--only-binary=:all:", f"--python-version={version}",
        "--dest", FOLDER / "pypi", *NEEDED)  # fmt: skip


def steps() -> dict[str, tuple[tuple[str, ...], str]]:
    """Returns what is tested: a name, such as trixie-bare, with the packages of its chroot and the command there."""
    needed = tuple(name for name in packages.needed("build") if name not in OF_PROGRAM)
    of_each = {"bare": ((), WITHOUT_DRIVER + OTHER_MACHINE), "driver": (DRIVER, WITH_DRIVER),
               "source": (needed, FROM_SOURCE)}  # fmt: skip
    found = {f"{release}-{name}": step for release in RELEASES for name, step in of_each.items()}
    return found | {f"{release}-deb": (("ca-certificates",), DEBS) for release in ("bookworm", "trixie")}


def test(words: list[str]) -> None:
    """Installs and tests the packages of build/wheel/dist in chroots: all of them, those of the named releases, or
    single ones. Goes on behind a failure. Throws Failed at the end."""
    if os.geteuid() != 0:
        raise Failed("chroots need root; type: sudo tools/dev.py dist")
    known = steps()
    if unknown := {*words} - {*RELEASES, *known}:
        raise Failed(f"there is no {unknown.pop()}; there are: {', '.join([*RELEASES, *known])}")
    (FOLDER / "pypi").mkdir(parents=True, exist_ok=True)
    commit = run("git", "describe", "--always", "--abbrev=12", capture_output=True).stdout.strip()
    run("git", "archive", f"--output={FOLDER / 'pypi' / 'tree.tar'}", f"--add-virtual-file=COMMIT:{commit}", "HEAD")
    failed = []
    for name in [name for name in known if not words or {name, name.split("-")[0]} & {*words}]:
        (more, command), start = known[name], time.monotonic()
        print(f"{name}:", flush=True)
        try:
            root = chroot(*name.split("-"), *more)
            download(root)
            inside(root, command)
            print(f"{name}: passed in {time.monotonic() - start:.0f} s", flush=True)
        except Failed as error:
            failed.append(name)
            print(f"{name}: failed after {time.monotonic() - start:.0f} s: {str(error).splitlines()[0]}", flush=True)
    if failed:
        raise Failed(f"{len(failed)} failed: {', '.join(failed)}")
