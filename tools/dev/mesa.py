"""Provides the current Mesa beside the system's: unpacks it in the build folder and installs nothing.

Debian 12's lavapipe (Mesa 22.3.6) and that of bookworm-backports behave differently, and Ballot's tests must pass on
both.
"""

import json
import shutil
from pathlib import Path

from dev import ROOT, Failed, run
from dev.packages import private_apt, system

FOLDER = ROOT / "build" / "backports"
ICD = FOLDER / "lvp_icd.json"
SOURCES = "".join(f"deb http://deb.debian.org/debian bookworm{suite} main\n" for suite in ("", "-backports"))


def system_icd() -> Path:
    for icd in Path("/usr/share/vulkan/icd.d").glob("lvp_icd*.json"):
        return icd
    raise Failed("there is no lavapipe in /usr/share/vulkan/icd.d")


def unpack() -> None:
    """Unpacks the driver with what the system lacks of its dependencies, or has in too old a version. apt-get works
    with lists and caches of its own."""
    apt = private_apt(FOLDER, SOURCES)
    run(*apt, "install", "-y", "--reinstall", "--download-only", "--no-install-recommends", "-tbookworm-backports",
        "mesa-vulkan-drivers", capture_output=True)
    for package in (FOLDER / "cache" / "archives").glob("*.deb"):
        run("dpkg-deb", "-x", package, FOLDER / "root", capture_output=True)


def current_icd() -> Path:
    """Returns the ICD file of the current Mesa's lavapipe, which is fetched unless it is there. Throws Failed."""
    if ICD.is_file():
        return ICD
    if system().get("VERSION_CODENAME") != "bookworm":
        raise Failed("bookworm-backports is for Debian 12, and this is another system")
    shutil.rmtree(FOLDER, ignore_errors=True)
    unpack()
    library = next(FOLDER.rglob("libvulkan_lvp.so"))
    # The libraries find each other by their rpath; LD_LIBRARY_PATH would also affect the system's driver.
    run("patchelf", "--force-rpath", "--set-rpath", "$ORIGIN",
        *(file for file in library.parent.glob("*.so*") if not file.is_symlink()), capture_output=True)
    if "not found" in (linked := run("ldd", library, capture_output=True).stdout):
        raise Failed(f"{library.name} does not find all of its libraries:\n{linked}")
    icd = json.loads(next(FOLDER.rglob("lvp_icd*.json")).read_text(encoding="utf-8"))
    icd["ICD"]["library_path"] = f"./{library.relative_to(FOLDER)}"  # of this file, as the checkout may move
    ICD.write_text(json.dumps(icd, indent=2) + "\n", encoding="utf-8")
    return ICD
