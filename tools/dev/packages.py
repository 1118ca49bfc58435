"""The Debian packages that Ballot needs (packages.txt): finds the missing ones and installs them."""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

from dev import Failed, run


def needed(*users: str) -> dict[str, str]:
    """Returns the packages that any of these needs, with the reasons."""
    lines = Path(__file__).with_suffix(".txt").read_text(encoding="utf-8").splitlines()
    rows = [line.split(None, 2) for line in lines if not line.startswith("#")]
    return {name: reason for name, who, reason in rows if {*users} & {*who.split(",")}}


def system() -> dict[str, str]:
    try:
        return platform.freedesktop_os_release()
    except OSError:
        return {}


def print_table(packages: dict[str, str], to=sys.stdout) -> None:
    for name, reason in packages.items():
        print(f"  {name:28} {reason}", file=to, flush=True)


def missing_of(packages: dict[str, str]) -> dict[str, str]:
    query = ["dpkg-query", "-W", "-f", "${db:Status-Status} ${Package}\n", *packages]
    states = subprocess.run(query, capture_output=True, text=True, check=False).stdout.split("\n")
    return {name: reason for name, reason in packages.items() if f"installed {name}" not in states}


def ensure(install: bool, *users: str) -> None:
    """Installs the missing packages of these users. Throws Failed if that is not allowed or does not work."""
    packages = needed(*users)
    if system().get("ID") != "debian":
        print(f"note: {system().get('PRETTY_NAME', 'this system')} is not Debian, so nothing is installed. Needed "
              "packages, by their names in Debian 12:", file=sys.stderr)
        return print_table(packages, sys.stderr)
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
