"""The Debian packages that Ballot needs: lists them with reasons, finds the missing ones and installs them."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

# package: (reason, the commands of tools/dev.py that need it; "all" is every command that builds)
PACKAGES = {
    "cmake": ("configures the build", {"all"}),
    "ninja-build": ("runs the build", {"all"}),
    "g++": ("compiles C++20", {"all"}),
    "libvulkan-dev": ("Vulkan headers and loader", {"all"}),
    "mesa-vulkan-drivers": ("lavapipe, the Vulkan device of a machine without a GPU", {"all"}),
    "glslang-dev": ("compiles GLSL to SPIR-V, at build and at run time", {"all"}),
    "glslang-tools": ("the CMake files of glslang-dev ask for it", {"all"}),
    "spirv-tools": ("inlines the functions of SPIR-V, and checks it; glslang links to it", {"all"}),
    "libspirv-cross-c-shared-dev": ("reads a shader's bindings from its SPIR-V", {"all"}),
    "libembree-dev": ("builds the bounding volume hierarchy", {"all"}),
    "libglm-dev": ("vectors and matrices", {"all"}),
    "libtinygltf-dev": ("reads glTF scenes", {"all"}),
    "libdraco-dev": ("decompresses glTF scenes (KHR_draco_mesh_compression)", {"all"}),
    "libmeshoptimizer-dev": ("decompresses glTF scenes (EXT_meshopt_compression)", {"all"}),
    "libwebp-dev": ("decodes WebP textures of glTF scenes", {"all"}),
    "zlib1g-dev": ("reads .npz scenes, which are zip files", {"all"}),
    "libopenexr-dev": ("writes and reads EXR images", {"all"}),
    "libpng-dev": ("writes PNG images", {"all"}),
    "libcli11-dev": ("parses the command line", {"all"}),
    "nlohmann-json3-dev": ("writes and reads JSON", {"all"}),
    "libfmt-dev": ("formats text", {"all"}),
    "libboost-dev": ("integers of any size for the exact oracle", {"all"}),
    "libxxhash-dev": ("keys of the caches", {"all"}),
    "libgtest-dev": ("the tests' framework", {"test", "build", "fuzz"}),
    "libglfw3-dev": ("headers of GLFW, which opens the window of `ballot view`", {"all"}),
    "libglfw3": ("GLFW itself, loaded when `ballot view` starts", {"all"}),
    "libimgui-dev": ("the overlay of `ballot view`", {"all"}),
    "libstb-dev": ("decodes textures; the overlay's fonts: libimgui links to it", {"all"}),
    "libxtst-dev": ("types and moves the mouse in the tests of the viewer", {"test", "build"}),
    "xvfb": ("a display for the tests of the viewer", {"test"}),
    "vulkan-validationlayers": ("a validation message fails a test", {"test"}),
    "openexr": ("exrheader, with which the tests check EXR files", {"test"}),
    "python3-matplotlib": ("draws the plots of tools/report", {"test"}),
    "libjemalloc2": ("a malloc with which the tests' kernels compile faster", {"test"}),
    "patchelf": ("lets private libraries find each other", {"test", "bundle"}),
    "pkg-config": ("finds the installed library, as programs of others do", {"test"}),
    "python3-dev": ("headers of Python, for the package of Python", {"test"}),
    "python3-venv": ("the virtual environment that the package of Python is tested in", {"test"}),
    "clang-16": ("compiles the fuzz targets", {"fuzz"}),
    "libclang-rt-16-dev": ("libFuzzer, which runs the fuzz targets", {"fuzz"}),
    "llvm-16": ("counts the lines that fuzzing covers", {"fuzz"}),
    "clang-format": ("formats the C++ code", {"fmt", "test"}),
    "clang-tidy": ("checks names in the C++ code", {"lint", "test"}),
}
OPTIONAL = {
    "vulkan-tools": "vulkaninfo, which lists the Vulkan drivers",
    "python3-matplotlib": "draws the plots of tools/report",
}


class Failed(Exception):
    """The exception of failed work. Its text says what failed and what to do."""


def needed(command: str) -> dict[str, str]:
    """Returns the packages that a command needs, with the reason for each."""
    scope = {command} if command == "fmt" else {"all", command}
    return {name: reason for name, (reason, who) in PACKAGES.items() if who & scope}


def os_release() -> dict[str, str]:
    try:
        lines = Path("/etc/os-release").read_text(encoding="utf-8").splitlines()
    except OSError:
        return {}
    pairs = (line.split("=", 1) for line in lines if "=" in line)
    return {key: value.strip("\"'") for key, value in pairs}


def is_debian() -> bool:
    return os_release().get("ID") == "debian" and shutil.which("dpkg-query") is not None


def installed_version(package: str) -> str | None:
    """Returns the version of an installed package, None if it is absent or only its configuration is left."""
    query = ["dpkg-query", "-W", "-f", "${db:Status-Status} ${Version}\n", package]
    result = subprocess.run(query, capture_output=True, text=True, check=False)
    for line in result.stdout.splitlines():
        status, _, version = line.partition(" ")
        if status == "installed":
            return version
    return None


def print_table(packages: dict[str, str]) -> None:
    width = max(map(len, packages))
    for name, reason in packages.items():
        print(f"  {name:{width}}  {reason}", flush=True)


def _run_apt(prefix: list[str], arguments: list[str]) -> subprocess.CompletedProcess:
    command = prefix + ["apt-get"] + arguments
    print("$ " + " ".join(command), flush=True)
    return subprocess.run(command, capture_output=True, text=True, check=False)


def _root_prefix() -> list[str] | None:
    """Returns the words before a command that run it as root: `env ...`, after `sudo` if needed; None if there is no
    way to become root."""
    environment = ["env", "DEBIAN_FRONTEND=noninteractive"]
    if os.geteuid() == 0:
        return environment
    if shutil.which("sudo") is None:
        return None
    return ["sudo"] + ([] if sys.stdin.isatty() else ["-n"]) + environment


def ensure(command: str, install: bool = True) -> None:
    """Installs the missing packages of `command`. Throws Failed if that is not allowed or does not work."""
    packages = needed(command)
    if not is_debian():
        name = os_release().get("PRETTY_NAME", "this system")
        print(f"note: {name} is not Debian, so nothing is installed. Needed packages, by their names in Debian 12:",
              file=sys.stderr)
        for package, reason in packages.items():
            print(f"  {package}: {reason}", file=sys.stderr)
        return
    missing = {name: reason for name, reason in packages.items() if installed_version(name) is None}
    if not missing:
        return
    print(f"{len(missing)} of {len(packages)} packages are missing:")
    print_table(missing)
    arguments = ["install", "-y", "--no-install-recommends", *missing]
    by_hand = "apt-get update && apt-get install --no-install-recommends " + " ".join(missing)
    prefix = _root_prefix()
    if not install:
        raise Failed(f"packages are missing and --no-install was given; as root, type:\n  {by_hand}")
    if prefix is None:
        raise Failed(f"installing packages needs root, and there is no sudo; as root, type:\n  {by_hand}")
    # A fresh machine has no package lists, and the lists of an old one name versions that are gone: update if needed.
    lists = Path("/var/lib/apt/lists")
    fresh = any(lists.glob("*_Packages*")) if lists.is_dir() else False
    result = _run_apt(prefix, arguments) if fresh else None
    if result is None or result.returncode != 0:
        update = _run_apt(prefix, ["update"])
        result = _run_apt(prefix, arguments)
        if result.returncode != 0:
            text = "\n".join((update.stderr + result.stdout + result.stderr).strip().splitlines()[-15:])
            raise Failed(f"apt-get failed:\n{text}\nto install by hand, type as root:\n  {by_hand}")
    still = [name for name in missing if installed_version(name) is None]
    if still:
        raise Failed(f"apt-get succeeded, but these are not installed: {' '.join(still)}")
