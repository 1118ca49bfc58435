"""Makes a bundle: a folder that runs from any place on x86-64 Linux with a Vulkan loader and glibc 2.36 or newer."""

import json
import os
import re
import shutil
import subprocess
import tarfile
from pathlib import Path

from dev_build import ROOT
from dev_packages import Failed

# Libraries that are not bundled: glibc's parts must match the system's loader, and the Vulkan loader its drivers.
SYSTEM_LIBRARIES = re.compile(
    r"(linux-vdso|ld-linux.*|lib(c|m|pthread|dl|rt|resolv|util|anl|nsl|mvec|BrokenLocale)|libvulkan)\.so.*")
# The C++ run time is taken from the system: a driver that was built with a newer run time than the bundled one would
# not load with it. For systems without one, the bundle has a copy in lib/fallback, which is used only on request.
FALLBACK_LIBRARIES = re.compile(r"lib(stdc\+\+|gcc_s)\.so.*")
# Packages whose headers or static libraries are in the program.
COMPILED_IN = ("libdraco-dev", "libstb-dev", "libimgui-dev", "glslang-dev", "libcli11-dev", "nlohmann-json3-dev",
               "libglm-dev", "libboost-dev", "libxxhash-dev", "libvulkan-dev")
MARK = "Ballot, a relocatable folder"
README = MARK + """

  bin/ballot --help                                        lists the commands
  bin/ballot info                                          lists the Vulkan devices
  bin/ballot render share/ballot/scenes/cornell.gltf --view all --png --out out/

Needs: x86-64 Linux, glibc 2.36 or newer, the Vulkan loader libvulkan.so.1 and a driver (Debian: libvulkan1 and
mesa-vulkan-drivers, or the GPU vendor's). All other libraries are in lib/. The folder may be moved and renamed.
The C++ run time (libstdc++ of GCC 12 or newer) is the system's, because drivers need it too. If there is none:

  LD_LIBRARY_PATH=lib/fallback bin/ballot info

`view` also needs the system's GLFW 3.3 or newer (Debian: libglfw3; libglfw3-wayland for Wayland without X11). The other
commands do not.

`python3 share/ballot/report` makes tables, comparisons and plots of what `bench` and `verify` write with --json. Plots
need matplotlib (Debian: python3-matplotlib).

Compiled shaders are cached in $XDG_CACHE_HOME/ballot or ~/.cache/ballot. Licences, of what is
compiled in too, are in share/doc; share/doc/ballot/NOTICE lists them.
"""


def linked_libraries(binary: Path) -> dict[str, Path | None]:
    """Returns every shared library that `binary` needs, with its path; None if the loader does not find it."""
    environment = {key: value for key, value in os.environ.items() if key not in ("LD_LIBRARY_PATH", "LD_PRELOAD")}
    result = subprocess.run(["ldd", str(binary)], capture_output=True, text=True, check=False, env=environment)
    if result.returncode != 0:
        raise Failed(f"ldd {binary}: {(result.stderr or result.stdout).strip()}")
    libraries: dict[str, Path | None] = {}
    for line in result.stdout.splitlines():
        match = re.match(r"\s*(\S+) => (not found|/.*?)(?: \(0x[0-9a-f]+\))?$", line)
        if match:
            libraries[match.group(1)] = None if match.group(2) == "not found" else Path(match.group(2))
    return libraries


def set_rpath(file: Path, rpath: str) -> None:
    # DT_RPATH, not DT_RUNPATH: it takes precedence over LD_LIBRARY_PATH and also applies to libraries of libraries.
    result = subprocess.run(["patchelf", "--force-rpath", "--set-rpath", rpath, str(file)], capture_output=True,
                            text=True, check=False)
    if result.returncode != 0:
        raise Failed(f"patchelf {file}: {result.stderr.strip()}")


def copy_licence(library: Path, folder: Path) -> None:
    """Copies the copyright file of the library's Debian package, if dpkg knows the package."""
    if shutil.which("dpkg-query") is None:
        return
    real = str(library.resolve())
    for name in (real, real.removeprefix("/usr"), "/usr" + real):  # merged /usr: dpkg knows only one of these names
        result = subprocess.run(["dpkg-query", "-S", name], capture_output=True, text=True, check=False)
        if result.returncode == 0:
            package = result.stdout.split(":")[0]
            source = Path("/usr/share/doc") / package / "copyright"
            if source.is_file():
                target = folder / "share" / "doc" / package
                target.mkdir(parents=True, exist_ok=True)
                shutil.copy(source, target / "copyright")
            return


def copy_notices(folder: Path) -> None:
    """Copies Ballot's licence and notice, and the copyright files of what is compiled in."""
    own = folder / "share" / "doc" / "ballot"
    own.mkdir(parents=True, exist_ok=True)
    for file in (ROOT / "LICENSE", ROOT / "engine" / "api" / "python" / "NOTICE"):
        shutil.copy(file, own / file.name)
    for package in COMPILED_IN:
        source = Path("/usr/share/doc") / package / "copyright"
        if source.is_file():
            target = folder / "share" / "doc" / package
            target.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target / "copyright")


def files_of_scene(scene: Path) -> list[Path]:
    """Returns the scene file and, for a .gltf, the buffer files that it names."""
    if scene.suffix != ".gltf":
        return [scene]
    uris = [buffer.get("uri", "") for buffer in json.loads(scene.read_text(encoding="utf-8")).get("buffers", [])]
    return [scene] + [scene.parent / uri for uri in uris if uri and not uri.startswith("data:")]


def check(folder: Path, binary: Path) -> None:
    """Throws Failed if a library that is not the system's own resolves to a file outside of the folder."""
    lib = folder.resolve() / "lib"
    for file in [binary, *lib.glob("*.so*")]:
        for name, path in linked_libraries(file).items():
            if SYSTEM_LIBRARIES.fullmatch(name) or FALLBACK_LIBRARIES.fullmatch(name):
                continue
            if path is None or path.resolve().parent != lib:
                raise Failed(f"{file.name} loads {name} from {path or 'nowhere'}, expected it from {lib}")


def fill(folder: Path, binary: Path, scenes: list[Path]) -> None:
    (folder / "bin").mkdir(parents=True)
    (folder / "lib" / "fallback").mkdir(parents=True)
    share = folder / "share" / "ballot"
    program = folder / "bin" / binary.name
    shutil.copy(binary, program)
    for name, path in linked_libraries(binary).items():
        if SYSTEM_LIBRARIES.fullmatch(name):
            continue
        if path is None:
            raise Failed(f"{binary} needs {name}, which the loader does not find")
        target = folder / "lib" / ("fallback" if FALLBACK_LIBRARIES.fullmatch(name) else "") / name
        shutil.copy(path, target)  # follows links: copies the file under the name that the loader looks for
        set_rpath(target, "$ORIGIN")
        copy_licence(path, folder)
    set_rpath(program, "$ORIGIN/../lib")
    copy_notices(folder)
    share.mkdir(parents=True, exist_ok=True)
    shutil.copytree(ROOT / "tools" / "report", share / "report", ignore=shutil.ignore_patterns("__pycache__"))
    (share / "scenes").mkdir()
    for scene in scenes:
        for file in files_of_scene(scene):
            shutil.copy(file, share / "scenes" / file.name)
    (folder / "README.txt").write_text(README, encoding="utf-8")
    check(folder, program)


def is_bundle(folder: Path) -> bool:
    readme = folder / "README.txt"
    return readme.is_file() and readme.read_text(encoding="utf-8", errors="replace").startswith(MARK)


def bundle(folder: Path, binary: Path, scenes: list[Path], archive: bool) -> None:
    """Makes or replaces the bundle `folder` and, if asked for, `folder`.tar.gz. Throws Failed and then leaves the old
    bundle in place."""
    if folder.exists() and not is_bundle(folder) and (not folder.is_dir() or any(folder.iterdir())):
        raise Failed(f"{folder} exists and is not a bundle; name another folder")
    folder.parent.mkdir(parents=True, exist_ok=True)
    temporary = folder.with_name(f".{folder.name}-{os.getpid()}")
    try:
        fill(temporary, binary, scenes)
        if folder.exists():
            shutil.rmtree(folder)
        temporary.rename(folder)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    files = [path for path in folder.rglob("*") if path.is_file()]
    print(f"{folder}: {len(files)} files, {sum(path.stat().st_size for path in files) / 2**20:.0f} MiB, "
          f"{len(list((folder / 'lib').rglob('*.so*')))} libraries")
    if archive:
        target = folder.with_name(folder.name + ".tar.gz")
        partial = target.with_name(f".{target.name}-{os.getpid()}")
        try:
            with tarfile.open(partial, "w:gz", compresslevel=6) as tar:
                tar.add(folder, arcname=folder.name)
            partial.replace(target)
        finally:
            partial.unlink(missing_ok=True)
        print(f"{target}: {target.stat().st_size / 2**20:.0f} MiB")
