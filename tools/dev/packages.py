"""The packages of Debian and Ubuntu that Ballot needs (packages.txt): finds the missing ones and installs them."""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

from dev import Failed, run


SYSTEMS = ("debian-12", "debian-13", "ubuntu-24.04")  # where packages are installed, by the names of packages.txt
TOO_OLD = {"ubuntu-22.04": "its CMake 3.22 and OpenEXR 2.5 are too old; take the wheel of Python, which runs here"}


def needed(*users: str) -> dict[str, str]:
    """Returns the packages that any of these needs, with the reasons."""
    lines = Path(__file__).with_suffix(".txt").read_text(encoding="utf-8").splitlines()
    rows = [line.split(None, 2) for line in lines if not line.startswith(("#", "-"))]
    return {name: reason for name, who, reason in rows if {*users} & {*who.split(",")}}


def absent(here: str) -> set[str]:
    """Returns the packages that a system of SYSTEMS does not have."""
    lines = Path(__file__).with_suffix(".txt").read_text(encoding="utf-8").splitlines()
    return {name for line in lines if line.startswith(f"- {here}:") for name in line.split()[2:]}


def system() -> dict[str, str]:
    try:
        return platform.freedesktop_os_release()
    except OSError:
        return {}


def system_name() -> str:
    """Returns what this is, such as debian-12."""
    return "{ID}-{VERSION_ID}".format_map({"ID": "unknown", "VERSION_ID": "unknown", **system()})


def print_table(packages: dict[str, str], to=sys.stdout) -> None:
    for name, reason in packages.items():
        print(f"  {name:28} {reason}", file=to, flush=True)


def missing_of(packages: dict[str, str]) -> dict[str, str]:
    query = ["dpkg-query", "-W", "-f", "${db:Status-Status} ${Package}\n", *packages]
    states = subprocess.run(query, capture_output=True, text=True, check=False).stdout.split("\n")
    return {name: reason for name, reason in packages.items() if f"installed {name}" not in states}


def private_apt(folder: Path, sources: str) -> list[str]:
    """Returns the words of an apt-get whose sources, lists and downloads are its own, in `folder`, after an update."""
    for name in ("lists/partial", "cache/archives/partial"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    (folder / "sources.list").write_text(sources, encoding="ascii")
    apt = ["apt-get", "-q", "-oAPT::Sandbox::User=", "-oDebug::NoLocking=1", "-oAcquire::Retries=2",
           "-oAcquire::http::Timeout=30", f"-oDir::State::Lists={folder}/lists", f"-oDir::Cache={folder}/cache",
           f"-oDir::Etc::SourceList={folder}/sources.list", "-oDir::Etc::SourceParts=/dev/null"]
    run(*apt, "update", "--error-on=any", capture_output=True)
    return apt


def owners_of(files) -> set[str]:
    """Returns the packages that own these files, as far as dpkg knows them."""
    # dpkg knows only one of the names of a library in a merged /usr
    names = [name for path in map(Path.resolve, files) for name in (path, str(path).removeprefix("/usr"))]
    text = run("sh", "-c", 'dpkg-query -S "$@" 2> /dev/null || true', "sh", *names, capture_output=True).stdout
    return {line.split(":")[0] for line in text.splitlines()}


def ensure(install: bool, *users: str) -> None:
    """Installs the missing packages of these users. Throws Failed if that is not allowed or does not work."""
    packages, here, title = needed(*users), system_name(), system().get("PRETTY_NAME", "this system")
    if here in TOO_OLD:
        raise Failed(f"Ballot cannot be built on {title}: {TOO_OLD[here]}")
    if here not in SYSTEMS:
        print(f"note: {title} is none of {', '.join(SYSTEMS)}, so nothing is installed. Needed packages, by their "
              "names in Debian 12:", file=sys.stderr)
        return print_table(packages, sys.stderr)
    if lacking := sorted({*packages} & absent(here)):
        raise Failed(f"{title} has no {', '.join(lacking)}; do this on Debian 12")
    if not (missing := missing_of(packages)):
        return None
    print(f"{len(missing)} of {len(packages)} packages are missing:")
    print_table(missing)
    words = ["install", "-y", "--no-install-recommends", *missing]
    by_hand = f"as root, type:\n  apt-get update && apt-get {' '.join(words)}"
    if not install:
        raise Failed(f"packages are missing and --no-install was given; {by_hand}")
    root = [] if os.geteuid() == 0 else ["sudo"] if sys.stdin.isatty() else ["sudo", "-n"]
    if root and not shutil.which("sudo"):
        raise Failed(f"installing packages needs root, and there is no sudo; {by_hand}")
    try:
        for command in (["update"], words):
            run(*root, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-q", *command)
    except Failed as error:
        raise Failed(f"{error}\nto install by hand, {by_hand}") from None
    return None
