"""Makes a bundle: a folder that runs from any place on x86-64 Linux with a Vulkan loader and glibc 2.36 or newer."""

import os
import re
import shutil
import tarfile
from pathlib import Path

from dev import ROOT, Failed, run, scene_file
from dev.packages import owners_of

# Libraries that are not bundled: glibc's parts must match the system's loader, and the Vulkan loader its drivers.
SYSTEM = re.compile(
    r"(linux-vdso|ld-linux.*|lib(c|m|pthread|dl|rt|resolv|util|anl|nsl|mvec|BrokenLocale)|libvulkan)\.so.*")
# The C++ run time is taken from the system: a driver that was built with a newer run time than the bundled one would
# not load with it. For systems without one, the bundle has a copy in lib/fallback, which is used only on request.
RUN_TIME = re.compile(r"lib(stdc\+\+|gcc_s)\.so.*")
# Packages whose headers or static libraries are in the program.
COMPILED_IN = ("libdraco-dev", "libstb-dev", "libimgui-dev", "glslang-dev", "libcli11-dev", "nlohmann-json3-dev",
               "libglm-dev", "libboost-dev", "libxxhash-dev", "libvulkan-dev")
DOC = Path("/usr/share/doc")
MARK = "Ballot, a relocatable folder"
README = MARK + """

  bin/ballot --help                                        lists the commands
  bin/ballot info                                          lists the Vulkan devices
  bin/ballot render share/ballot/scenes/cornell.gltf --view all --png --out out/

Needs: x86-64 Linux, glibc 2.36 or newer, the Vulkan loader libvulkan.so.1 and a driver (Debian: libvulkan1 and
mesa-vulkan-drivers, or the GPU vendor's). All other libraries are in lib/. The folder may be moved and renamed.
The C++ run time (libstdc++ of GCC 12 or newer) is the system's, because drivers need it too. If there is none:

  LD_LIBRARY_PATH=lib/fallback bin/ballot info

`view` also needs the system's GLFW 3.3 or newer (Debian: libglfw3; libglfw3-wayland for Wayland without X11). Plots of
measured runs are drawn by Python 3 with matplotlib (Debian: python3-matplotlib), by what is in share/ballot.

Compiled shaders are cached in $XDG_CACHE_HOME/ballot or ~/.cache/ballot. Licences, of what is compiled in too, are in
share/doc; share/doc/ballot/NOTICE lists them.
"""


def libraries_of(file: Path) -> dict[str, Path]:
    """Returns the shared libraries that a program or library needs, but for the system's own, with their paths."""
    clean = {key: value for key, value in os.environ.items() if key not in ("LD_LIBRARY_PATH", "LD_PRELOAD")}
    text = run("ldd", file, capture_output=True, env=clean).stdout
    if "not found" in text:
        raise Failed(f"{file} needs libraries that the loader does not find:\n{text}")
    found = re.findall(r"^\s*(\S+) => (/.*) \(0x", text, re.MULTILINE)
    return {name: Path(path) for name, path in found if not SYSTEM.fullmatch(name)}


def copy_notices(folder: Path, packages, doc: Path = DOC) -> None:
    """Copies Ballot's licence and notice, and the copyright files of Debian packages as far as they are there, each to
    a folder of its package's name."""
    files = {"ballot": [ROOT / "LICENSE", ROOT / "engine" / "api" / "python" / "NOTICE"],
             **{package: list((doc / package).glob("copyright")) for package in packages}}
    for name, sources in files.items():
        for source in sources:
            (folder / name).mkdir(parents=True, exist_ok=True)
            shutil.copy(source, folder / name)


def fill(folder: Path, build: Path) -> None:
    run("cmake", "--install", build, "--component", "tools", "--prefix", folder, capture_output=True)
    program, lib = folder / "bin" / "ballot", folder / "lib"
    linked = libraries_of(program)
    (lib / "fallback").mkdir(parents=True)
    for name, path in linked.items():  # each under the name that the loader looks for
        shutil.copy(path, lib / "fallback" if RUN_TIME.fullmatch(name) else lib)
    # DT_RPATH, not DT_RUNPATH: it takes precedence over LD_LIBRARY_PATH and also applies to libraries of libraries.
    run("patchelf", "--force-rpath", "--set-rpath", "$ORIGIN/../lib", program)
    run("patchelf", "--force-rpath", "--set-rpath", "$ORIGIN", *lib.rglob("*.so*"))
    for file in [program, *lib.glob("*.so*")]:
        for name, path in libraries_of(file).items():
            if not RUN_TIME.fullmatch(name) and path.resolve().parent != lib.resolve():
                raise Failed(f"{file.name} loads {name} from {path}, expected it from {lib}")
    copy_notices(folder / "share" / "doc", {*COMPILED_IN, *owners_of(linked.values())})
    scenes = folder / "share" / "ballot" / "scenes"
    scenes.mkdir()
    for scene in (scene_file("cornell"), scene_file("atrium")):
        shutil.copy(scene, scenes)
    (folder / "README.txt").write_text(README, encoding="utf-8")


def bundle(folder: Path, build: Path, archive: bool) -> None:
    """Makes or replaces the bundle `folder` and, if asked for, `folder`.tar.gz. Throws Failed and then leaves the old
    bundle in place."""
    mark = folder / "README.txt"
    if any(folder.glob("*")) and not (mark.is_file() and mark.read_text(errors="replace").startswith(MARK)):
        raise Failed(f"{folder} exists and is not a bundle; name another folder")
    new = folder.with_name(f".{folder.name}-{os.getpid()}")
    try:
        fill(new, build)
        shutil.rmtree(folder, ignore_errors=True)
        new.rename(folder)
    finally:
        shutil.rmtree(new, ignore_errors=True)
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    print(f"{folder}: {len(sizes)} files, {sum(sizes) / 2**20:.0f} MiB")
    if archive:
        with tarfile.open(f"{folder}.tar.gz", "w:gz", compresslevel=6) as tar:
            tar.add(folder, arcname=folder.name)
        print(f"{folder}.tar.gz: {Path(f'{folder}.tar.gz').stat().st_size / 2**20:.0f} MiB")
