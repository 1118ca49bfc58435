"""Provides the current Mesa beside the system's: unpacks it in the build folder and installs nothing.

Debian 12's lavapipe (Mesa 22.3.6) and that of bookworm-backports behave differently, and Ballot's tests must pass on
both.
"""

import json
import os
import re
import shutil
import subprocess
import time
from pathlib import Path

from dev_build import ROOT
from dev_packages import Failed, installed_version, is_debian, os_release

FOLDER = ROOT / "build" / "backports"
ICD = FOLDER / "lvp_icd.json"
SOURCE = "deb http://deb.debian.org/debian bookworm-backports main"
PACKAGE = "mesa-vulkan-drivers"
KEEP_DAYS = 7


def system_icd() -> Path | None:
    found = sorted(Path("/usr/share/vulkan/icd.d").glob("lvp_icd*.json"))
    return found[0] if found else None


def _run(command: list[str], **options) -> str:
    result = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if result.returncode != 0:
        text = (result.stderr or result.stdout).strip().splitlines()
        raise Failed(f"`{' '.join(command[:1] + command[-2:])}` failed: {' | '.join(text[-3:]) or 'no message'}")
    return result.stdout


def _apt(arguments: list[str], private: bool = True) -> str:
    """Runs apt-get. If `private`, it has its own lists and caches, so that the system's stay unchanged."""
    options = ["-oAPT::Sandbox::User=", "-oAcquire::Retries=2", "-oAcquire::http::Timeout=30"]
    if private:
        options += [f"-oDir::State::Lists={FOLDER}/lists", "-oDir::Etc::SourceParts=/dev/null",
                    f"-oDir::Etc::SourceList={FOLDER}/backports.list", f"-oDir::Cache={FOLDER}/cache"]
    return _run(["apt-get", *options, *arguments], cwd=FOLDER / "debs")


def _satisfied(relation: str) -> bool:
    """Returns True if the system satisfies a dependency: "name", "name (>= version)", or one of "a | b"."""
    for choice in relation.split("|"):
        match = re.fullmatch(r"\s*([^\s(:]+)(?::\w+)?\s*(?:\(\s*([<>=]+)\s*(\S+)\s*\))?\s*", choice)
        if not match:
            continue
        name, compare, wanted = match.groups()
        version = installed_version(name)
        if version is None:
            continue
        if compare is None:
            return True
        if subprocess.run(["dpkg", "--compare-versions", version, compare, wanted], check=False).returncode == 0:
            return True
    return False


def _fetch(package: str) -> Path:
    """Downloads a package from backports, or if it is not there from the system's sources."""
    before = set((FOLDER / "debs").glob("*.deb"))
    try:
        _apt(["download", package])
    except Failed:
        _apt(["download", package], private=False)
    new = set((FOLDER / "debs").glob("*.deb")) - before
    if len(new) != 1:
        raise Failed(f"apt-get download {package} left {len(new)} new files, expected one")
    return new.pop()


def _unpack_with_dependencies() -> None:
    """Unpacks the driver and, recursively, every dependency that the system lacks or has in too old a version."""
    queue, seen = [PACKAGE], set()
    while queue:
        package = queue.pop()
        if package in seen:
            continue
        seen.add(package)
        deb = _fetch(package)
        _run(["dpkg-deb", "-x", str(deb), str(FOLDER / "root")])
        depends = _run(["dpkg-deb", "-f", str(deb), "Depends"])
        for relation in filter(None, map(str.strip, depends.split(","))):
            if not _satisfied(relation):
                queue.append(re.match(r"[^\s(:|]+", relation).group(0))


def _library() -> Path:
    found = sorted((FOLDER / "root").rglob("libvulkan_lvp.so"))
    if not found:
        raise Failed(f"the package {PACKAGE} has no libvulkan_lvp.so")
    return found[0]


def _link_privately(library: Path) -> None:
    """Sets the rpath of the private libraries so that they find each other. LD_LIBRARY_PATH would also affect the
    system's driver."""
    for shared in library.parent.glob("*.so*"):
        if shared.is_file() and not shared.is_symlink():
            _run(["patchelf", "--force-rpath", "--set-rpath", "$ORIGIN", str(shared)])
    lost = [line.strip() for line in _run(["ldd", str(library)]).splitlines() if "not found" in line]
    if lost:
        raise Failed(f"{library.name} does not find: {'; '.join(lost)}")


def _write_icd(library: Path) -> None:
    packaged = next((FOLDER / "root").rglob("lvp_icd*.json"), None)
    version = json.loads(packaged.read_text(encoding="utf-8"))["ICD"]["api_version"] if packaged else "1.3.0"
    icd = {"file_format_version": "1.0.0", "ICD": {"library_path": str(library), "api_version": version}}
    ICD.write_text(json.dumps(icd, indent=2) + "\n", encoding="utf-8")


def driver_name(icd: Path) -> str | None:
    """Returns the driver's description by vulkaninfo, None if there is no vulkaninfo. Throws Failed if the driver does
    not load."""
    if shutil.which("vulkaninfo") is None:
        return None
    environment = {**os.environ, "VK_DRIVER_FILES": str(icd), "VK_ICD_FILENAMES": str(icd)}
    text = _run(["vulkaninfo", "--summary"], env=environment)
    match = re.search(r"driverInfo\s*=\s*(.+)", text)
    if not match or "llvmpipe" not in text:
        raise Failed(f"vulkaninfo finds no lavapipe through {icd}")
    return match.group(1).strip()


def current_mesa() -> Path:
    """Returns the ICD file of the current Mesa's lavapipe. Fetches the package at most once a week. Throws Failed with
    the reason if that does not work."""
    if not is_debian() or os_release().get("VERSION_CODENAME") != "bookworm":
        raise Failed("bookworm-backports is for Debian 12, and this is another system")
    stamp = FOLDER / "complete"
    fresh = stamp.exists() and time.time() - stamp.stat().st_mtime < KEEP_DAYS * 86400
    if not fresh:
        shutil.rmtree(FOLDER, ignore_errors=True)
        for name in ("lists/partial", "cache/archives/partial", "debs", "root"):
            (FOLDER / name).mkdir(parents=True)
        (FOLDER / "backports.list").write_text(SOURCE + "\n", encoding="ascii")
        _apt(["update", "--error-on=any"])
        _unpack_with_dependencies()
        _link_privately(_library())
        shutil.rmtree(FOLDER / "debs")
        stamp.touch()
    _write_icd(_library())  # each time, because it holds an absolute path and the checkout may have moved
    driver_name(ICD)
    return ICD
