"""The wheel ballot-lavapipe of `pip install "ballot[cpu]"`: lavapipe and the Vulkan loader with their libraries.

They are Debian's. glibc, the C++ run time and zlib are the system's, as for every wheel.
"""

import json
import re
import shutil
from pathlib import Path

from dev import Failed, run
from dev.bundle import RUN_TIME, copy_notices, libraries_of
from dev.mesa import FOLDER as BACKPORTS, current_icd
from dev.packages import owners_of
from dev.wheel import FOLDER, newest_glibc, tools

LIBZ = re.compile(r"libz\.so.*")
LOADER = "libvulkan.so.1"
MODULE = '''"""lavapipe, Mesa's Vulkan driver for CPUs, and the Vulkan loader, for Ballot where there is no other."""

import os

_FOLDER = os.path.dirname(os.path.abspath(__file__))
ICD = os.path.join(_FOLDER, "lvp_icd.json")  # for VK_DRIVER_FILES
LOADER = os.path.join(_FOLDER, "lib", "libvulkan.so.1")  # for BALLOT_VULKAN_LOADER
'''
METADATA = """Metadata-Version: 2.1
Name: ballot-lavapipe
Version: {version}
Summary: lavapipe, Mesa's Vulkan driver for CPUs, with its libraries, for the ray queries of Ballot
License: MIT AND Apache-2.0 WITH LLVM-exception AND others; see licenses
Requires-Python: >=3.10
Classifier: Operating System :: POSIX :: Linux

Ballot uses this driver where it finds no other one. Debian's notice of each library is in licenses.
"""
WHEEL = """Wheel-Version: 1.0
Generator: ballot
Root-Is-Purelib: false
Tag: py3-none-manylinux_2_{glibc}_x86_64
"""


def copied(driver: Path, lib: Path) -> set[str]:
    """Copies the driver and the loader with what they need. Returns the packages that they come from."""
    loader = next(Path("/usr/lib").rglob(LOADER))
    needed = {driver.name: driver, LOADER: loader, **libraries_of(driver), **libraries_of(loader)}
    kept = {name: path for name, path in needed.items() if not RUN_TIME.fullmatch(name) and not LIBZ.fullmatch(name)}
    lib.mkdir(parents=True)
    for name, path in kept.items():
        shutil.copy(path, lib / name)
        (lib / name).chmod(0o755)
    run("patchelf", "--force-rpath", "--set-rpath", "$ORIGIN", *lib.iterdir())
    run("strip", "--strip-unneeded", *lib.iterdir())
    return owners_of(kept.values())


def check(lib: Path) -> None:
    """Throws Failed if a library needs another one that is neither here nor the system's."""
    for file in lib.iterdir():
        for name, path in libraries_of(file).items():
            if not RUN_TIME.fullmatch(name) and not LIBZ.fullmatch(name) and path.resolve().parent != lib.resolve():
                raise Failed(f"{file.name} loads {name} from {path}, expected it from {lib}")


def make() -> Path:
    """Makes the wheel in build/wheel/dist. Returns it."""
    icd = json.loads(current_icd().read_text(encoding="utf-8"))
    driver = (BACKPORTS / icd["ICD"]["library_path"]).resolve()
    version = re.search(r"mesa-vulkan-drivers_([\d.]+)", " ".join(
        file.name for file in (BACKPORTS / "cache" / "archives").glob("*.deb"))).group(1)  # fmt: skip
    tree = FOLDER / "lavapipe"
    shutil.rmtree(tree, ignore_errors=True)
    package, information = tree / "ballot_lavapipe", tree / f"ballot_lavapipe-{version}.dist-info"
    packages = copied(driver, package / "lib")
    check(package / "lib")
    icd["ICD"]["library_path"] = f"./lib/{driver.name}"
    (package / "lvp_icd.json").write_text(json.dumps(icd, indent=2) + "\n", encoding="ascii")
    (package / "__init__.py").write_text(MODULE, encoding="ascii")
    notices = information / "licenses"
    copy_notices(notices, packages)
    unpacked = BACKPORTS / "root" / "usr" / "share" / "doc"
    copy_notices(notices, [folder.name for folder in unpacked.iterdir()], unpacked)
    shutil.rmtree(notices / "ballot")
    if not (notices / "mesa-vulkan-drivers").is_dir() or not list(notices.glob("libllvm*")):
        raise Failed(f"{notices} lacks the notices of Mesa or LLVM")
    (information / "METADATA").write_text(METADATA.format(version=version), encoding="ascii")
    glibc = max(newest_glibc(file.read_bytes()) for file in (package / "lib").iterdir())
    (information / "WHEEL").write_text(WHEEL.format(glibc=glibc), encoding="ascii")
    (FOLDER / "dist").mkdir(exist_ok=True)
    run(tools() / "python", "-m", "wheel", "pack", tree, "--dest-dir", FOLDER / "dist", capture_output=True)
    (made,) = (FOLDER / "dist").glob(f"ballot_lavapipe-{version}-*.whl")
    print(f"{made}: {len(list((package / 'lib').iterdir()))} libraries, {made.stat().st_size / 2**20:.1f} MiB")
    return made
